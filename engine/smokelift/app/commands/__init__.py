"""The commands of the command line, a module each.

A module's `add_parser` adds the command with its options to the parser; the option ``run`` is what runs it.
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

MODULES = (
    reconstruct,
    batch,
    inspect,
    render,
    preview,
    evaluate,
    check,
    continue_,
    retime,
    loop,
    export,
    proxy,
    doctor,
)

COMMANDS = tuple(module.add_parser for module in MODULES)
