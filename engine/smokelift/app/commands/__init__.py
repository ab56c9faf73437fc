"""The commands of the command line, a module each.

A module has ``HELP``, ``add_options`` for the command's parser, and ``run``, which gets the options and says what
happens.
"""

from smokelift.app.commands import (
    batch,
    check,
    continue_,
    doctor,
    evaluate,
    export,
    extract,
    inspect,
    loop,
    preview,
    proxy,
    reconstruct,
    render,
    retime,
)

COMMANDS = {
    "reconstruct": reconstruct,
    "extract": extract,
    "batch": batch,
    "inspect": inspect,
    "render": render,
    "preview": preview,
    "evaluate": evaluate,
    "check": check,
    "continue": continue_,
    "retime": retime,
    "loop": loop,
    "export": export,
    "proxy": proxy,
    "doctor": doctor,
}
"""Modules by their commands' names."""
