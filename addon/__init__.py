"""Smokelift's Blender add-on: a clip of smoke becomes a volume in the shot.

The library knows nothing of Blender: `take` is the files of a run, `job` the engine's process, `toml` the text of a
scene file, `pace` a speed ramp, `contract` what the add-on repeats of the engine. `smoke` finds the objects that hold
the settings. `scene_file` (Blender scene to scene file), `volume` (sequence to Volume object), `look` (its material),
`directing` (what acts on the smoke after its clip), `shot_setup` (camera, world and light that match the clip),
`compositing` (smoke over the clip) and `projection` (the clip's background on a card), all with the clean `plate`, and
`undistort` (the clip without its lens's distortion) translate to Blender's data and back. The interface is
thin: `properties`; `panel` with the sub-panels `results_panel`, `advanced_panel`, `look_panel`, `setup_panel` and
`direct_panel`, each with its buttons (`subpanel` is what they share); the other buttons in `operators`, `box` and
`editors`, and what all of them need in `needs`. `run` keeps the queue; `export` hands a smoke on, and `instances` shows
it at other times; `drop`, `presets` and `preferences` are what Blender calls so; `batch` is the command line.
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
        advanced_panel,
        batch,
        box,
        direct_panel,
        drop,
        editors,
        export,
        instances,
        look,
        look_panel,
        operators,
        panel,
        preferences,
        presets,
        properties,
        results_panel,
        run,
        setup_panel,
        smoke,
        undistort,
        volume,
    )

    data = (preferences, properties, smoke, look, volume, run)
    buttons = (operators, box, editors, instances, undistort, drop, presets)
    panels = (panel, results_panel, advanced_panel, look_panel, setup_panel, direct_panel, export)
    return (*data, *buttons, *panels, batch)
