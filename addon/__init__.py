"""Smokelift's Blender add-on: a clip of smoke becomes a volume in the shot.

The library knows nothing of Blender: `take` is the files of a run, `job` the engine's process, `toml` the text of a
scene file, `pace` a speed ramp, `contract` what the add-on repeats of the engine. `smoke` finds the objects that hold
the settings. `scene_file` (Blender scene to scene file), `volume` (sequence to Volume object), `look` (its material),
`directing` (what acts on the smoke after its clip) and `shot_setup` (camera, world and light that match the clip)
translate to Blender's data and back. The interface is thin: `properties`, `panel` with its sub-panels `look_panel` and
`direct_panel`, and `operators`; `run` keeps the queue; `batch` is the command line.
"""


def register() -> None:
    """Register all classes, properties and handlers."""
    from . import batch, direct_panel, look, look_panel, operators, panel, properties, run, smoke, volume

    for module in (properties, smoke, look, volume, run, operators, panel, look_panel, direct_panel, batch):
        module.register()


def unregister() -> None:
    """Unregister them."""
    from . import batch, direct_panel, look, look_panel, operators, panel, properties, run, smoke, volume

    for module in (batch, direct_panel, look_panel, panel, operators, run, volume, look, smoke, properties):
        module.unregister()
