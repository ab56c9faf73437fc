"""Smokelift's Blender add-on: a clip of smoke in, a volume that sits in the shot out.

The sidebar is `panel`, what its buttons do `operators`, what is saved with the .blend `properties`. `scene` turns
the Blender scene into a scene file, `job` runs the engine on it in a process of its own and `run` looks after that,
`take` knows the files of a run, `volume` shows them, `look` makes a render of them look like the clip. `batch` is the
same without a window.
"""


def register() -> None:
    """Make everything known to Blender."""
    from . import batch, operators, panel, properties, run, volume

    for module in (properties, volume, run, operators, panel, batch):
        module.register()


def unregister() -> None:
    """Take everything back."""
    from . import batch, operators, panel, properties, run, volume

    for module in (batch, panel, operators, run, volume, properties):
        module.unregister()
