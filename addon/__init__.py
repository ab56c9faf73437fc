"""Smokelift's Blender add-on: a clip of smoke becomes a volume in the shot.

The library knows nothing of Blender: `take` is the files of a run, `job` the engine's process, `toml` the text of a
scene file, `contract` what the add-on repeats of the engine. `smoke` finds the objects that hold the settings.
`scene_file` (Blender scene to scene file), `volume` (sequence to Volume object) and `shot_setup` (camera, world and
light that match the clip) translate to Blender's data and back. The interface is thin: `properties`, `panel` and
`operators`; `run` keeps the queue; `batch` is the command line.
"""


def register() -> None:
    """Register all classes, properties and handlers."""
    from . import batch, operators, panel, properties, run, smoke, volume

    for module in (properties, smoke, volume, run, operators, panel, batch):
        module.register()


def unregister() -> None:
    """Unregister them."""
    from . import batch, operators, panel, properties, run, smoke, volume

    for module in (batch, panel, operators, run, volume, smoke, properties):
        module.unregister()
