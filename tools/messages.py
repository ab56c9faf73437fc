"""Every sentence that the engine and the add-on can end with or warn of, read from their code.

python tools/messages.py        # prints what the manual's page "All messages" shows
"""

import ast
import html
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

GAP = "…"
"""Stands for what a message fills in: a path, a number, a name."""

_FIELD = re.compile(r"\{\w*(?::[^{}]*)?\}")
"""What `str.format` fills in, in sentences of a table or that are translated first."""

SPEAKERS = {"fail", "note", "report", "error", "unexpected", "warn"}
"""Functions that say their first argument to the user; classes of exceptions do so as well."""

MIN_WORDS = 4
"""Fewest words of a message: less is a part of one."""

TOPICS = {
    "Command line": ("engine/smokelift/app", "engine/smokelift_command"),
    "Clip and background": ("engine/smokelift/footage", "engine/smokelift/extraction"),
    "Scene file": ("engine/smokelift/checks", "engine/smokelift/scene"),
    "Shot and result": ("engine/smokelift/report",),
    "Set-up of the shot": ("engine/smokelift/setup",),
    "Density and rendering": ("engine/smokelift/density", "engine/smokelift/render"),
    "Velocity and transport": ("engine/smokelift/velocity", "engine/smokelift/transport", "engine/smokelift/pipeline"),
    "Sequence and files": ("engine/smokelift/output",),
    "Directed smoke": ("engine/smokelift/direct",),
    "Many shots": ("engine/smokelift/batch",),
    "Measuring": ("engine/smokelift/evaluation", "engine/smokelift/baselines"),
    "Blender": ("addon",),
}
"""What the messages are about, and the folders whose code says them."""


def messages(path: Path) -> list[str]:
    """Return the messages of one module, in the order of its lines, with `GAP` for what is filled in."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    skipped = set(_documentation(tree))
    found: dict[str, None] = {}
    for said, text in _strings(tree, False, skipped):
        text = " ".join(text.split())
        sentence = text.endswith(".") and (text[:1].isupper() or text.startswith(GAP))
        if (said or sentence) and len(text.replace(GAP, " ").split()) >= MIN_WORDS:
            found[text] = None
    return list(found)


@cache
def all_messages() -> dict[str, list[str]]:
    """Return the messages of the engine and the add-on by topic, each once."""
    return {
        topic: list(
            dict.fromkeys(
                message
                for folder in folders
                for path in sorted((ROOT / folder).rglob("*.py"))
                for message in messages(path)
            )
        )
        for topic, folders in TOPICS.items()
    }


def markdown() -> str:
    """Return all messages as Markdown."""
    return "\n\n".join(
        "\n".join([f"## {topic}", "", *(f"- {html.escape(message, quote=False)}" for message in listed)])
        for topic, listed in all_messages().items()
    )


def _documentation(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield strings that are no messages: docstrings, and helps of options."""
    for node in ast.walk(tree):
        if (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)) or (
            isinstance(node, ast.keyword) and node.arg in ("help", "description", "metavar", "prog")
        ):
            yield node.value


def _strings(node: ast.AST, said: bool, skipped: set[ast.AST]) -> Iterator[tuple[bool, str]]:
    """Yield every string of a tree whole, and whether it is handed to a function that says it."""
    if node in skipped:
        return
    text = _text(node)
    if text is not None:
        yield said, text
        return
    if isinstance(node, ast.Call):
        called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        said = called in SPEAKERS or called.endswith(("Error", "Warning", "Unavailable"))
    for child in ast.iter_child_nodes(node):
        yield from _strings(child, said, skipped)


def _text(node: ast.AST) -> str | None:
    """Return the text of a string, `GAP` in place of what it fills in; None for anything else."""
    if isinstance(node, ast.Constant):
        return _FIELD.sub(GAP, node.value) if isinstance(node.value, str) else None
    if isinstance(node, ast.JoinedStr):
        return "".join(_text(value) or GAP for value in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        parts = _text(node.left), _text(node.right)
        return None if parts == (None, None) else "".join(GAP if part is None else part for part in parts)
    return None


if __name__ == "__main__":
    sys.stdout.write(markdown() + "\n")
