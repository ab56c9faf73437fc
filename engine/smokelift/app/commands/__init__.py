"""The commands of the command line, a module each.

A module has the command's help, ``add_options`` for its parser, and ``run``, which is given the options and says what
happens.
"""

from smokelift.app.commands import (
    batch,
    check,
    continue_,
    doctor,
    evaluate,
    export,
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
"""The modules by the names of their commands."""
