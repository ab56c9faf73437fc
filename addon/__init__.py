"""Smokelift's Blender add-on: a clip of smoke becomes a volume in the shot.

The library knows nothing of Blender: `take` is the files of a run, `job` the engine's process, `toml` the text of a
scene file, `pace` a speed ramp, `contract` what the add-on repeats of the engine. `smoke` finds the objects that hold
the settings. `scene_file` (Blender scene to scene file), `volume` (sequence to Volume object), `look` (its material),
`directing` (what acts on the smoke after its clip), `shot_setup` (camera, world and light that match the clip),
`compositing` (smoke over the clip) and `projection` (the clip's background on a card), all with the clean `plate`, and
`undistort` (the clip without its lens's distortion) translate to Blender's data and back. The interface is
thin: `properties`, `panel` with its sub-panels `look_panel`, `setup_panel` and `direct_panel` (`subpanel` is what they
share), and `operators`; `run`
keeps the queue; `export` hands a smoke on; `drop`, `presets` and `preferences` are what Blender calls so; `batch` is
the command line.
"""

from types import ModuleType


def register() -> None:
    """Register all classes, properties and handlers."""
    for module in _modules():
        module.register()


def unregister() -> None:
    """Unregister them."""
    for module in reversed(_modules()):
        module.unregister()


def _modules() -> tuple[ModuleType, ...]:
    """Those with something to register, each after those it needs; panels in the order of the tab."""
    from . import (
        batch,
        direct_panel,
        drop,
        export,
        look,
        look_panel,
        operators,
        panel,
        preferences,
        presets,
        properties,
        run,
        setup_panel,
        smoke,
        undistort,
        volume,
    )

    panels = (panel, look_panel, setup_panel, direct_panel, export)
    return (preferences, properties, smoke, look, volume, run, operators, undistort, drop, presets, *panels, batch)
