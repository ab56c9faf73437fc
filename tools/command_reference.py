"""Every option of the command line, as tables in Markdown, from its own parser.

python tools/command_reference.py        # prints what the manual's page "Commands" ends with
"""

import argparse
import sys

from smokelift.app.cli import command_parser


def subcommands() -> dict[str, argparse.ArgumentParser]:
    """Return the parser of each command by its name."""
    for action in command_parser()._actions:
        if isinstance(action, argparse._SubParsersAction):
            return dict(action.choices)
    raise LookupError("the command line has no commands")


def markdown() -> str:
    """Return the arguments of all commands as Markdown."""
    parts = []
    for name, parser in subcommands().items():
        rows = [f"| {_written(action)} | {_meaning(action)} |" for action in parser._actions if _shown(action)]
        parts.append("\n".join([f"### smokelift {name}", "", "| argument | meaning |", "| --- | --- |", *rows]))
    return "\n\n".join(parts)


def _shown(action: argparse.Action) -> bool:
    """Return whether an argument is one that a user should know."""
    return not isinstance(action, argparse._HelpAction) and action.help != argparse.SUPPRESS


def _written(action: argparse.Action) -> str:
    """Return an argument as it is typed."""
    values = _values(action)
    if not action.option_strings:
        return f"`{values}`"
    return "`" + f"{action.option_strings[-1]} {values}".strip() + "`" + (" (required)" if action.required else "")


def _values(action: argparse.Action) -> str:
    """Return the values of an argument by their names."""
    if action.nargs == 0:
        return ""
    if isinstance(action.metavar, tuple):
        return " ".join(action.metavar)
    choices = "|".join(map(str, action.choices or ()))
    name = action.metavar or choices or action.dest.upper()
    if isinstance(action.nargs, int):
        return " ".join([name] * action.nargs)
    return f"{name} ..." if action.nargs in ("+", "*", argparse.REMAINDER) else name


def _meaning(action: argparse.Action) -> str:
    """Return what an argument is, and its default."""
    said = (action.help or "").replace("|", "\\|").replace("%%", "%")
    usual = isinstance(action.default, str | int | float) and not isinstance(action.default, bool)
    if usual and action.option_strings and "default" not in said:
        return f"{said}; default `{action.default}`".removeprefix("; ")
    return said


if __name__ == "__main__":
    sys.stdout.write(markdown() + "\n")
