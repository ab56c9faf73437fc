"""The commands of the command line: a module each, or one for some that are alike, with ``COMMANDS`` by their names."""

from smokelift.app.commands import (
    batch,
    directed,
    doctor,
    export,
    extract,
    inspect,
    reconstruct,
    render,
    sequences,
)

COMMANDS = {
    name: command
    for module in (reconstruct, extract, batch, inspect, render, sequences, directed, export, doctor)
    for name, command in module.COMMANDS.items()
}
