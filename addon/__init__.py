"""Smokelift's Blender add-on: a clip of smoke in, a volume that sits in the shot out.

The sidebar is `panel`, what its buttons do `operators`, what is saved with the .blend `properties`. `scene` turns
the Blender scene into a scene file, `job` runs the engine on it in a process of its own, `take` knows the files of
a run, `volume` shows them. `batch` is the same without a window.
"""


def register() -> None:
    """Make everything known to Blender."""
    from . import batch, operators, panel, properties

    for module in (properties, operators, panel, batch):
        module.register()


def unregister() -> None:
    """Take everything back."""
    from . import batch, operators, panel, properties

    for module in (batch, panel, operators, properties):
        module.unregister()
