"""Smokelift's Blender add-on: a clip of smoke becomes a volume in the shot.

It knows nothing of the engine but its command line and its files. From what knows no Blender to the interface:

- Without Blender: `take` (the files of a run), `job` (the engine's process), `toml` (the text of a scene file), `pace`
  (a speed ramp), `pictures` (a sequence with gaps), `sentences` (the engine's messages in the panel's words),
  `contract` (what the add-on repeats of the engine).
- Blender's data to the engine's and back: `smoke` (the objects that hold the settings), `smoke_takes` (its takes),
  `scene_file` (Blender scene to scene file: `clip_table`, `background`, `strokes`, `mask`, `camera_table`, `box_table`
  and `light_tables`, of a `blender_scene`), `volume` (sequence to Volume object), `look` (its material), `proxy` (what
  viewports show of a large one), `directing` (what acts on the smoke after its clip), `shot_setup` (camera, world and
  light that match the clip), `compositing` (smoke over the clip), `projection` (the clip's background on a card),
  `plate` (the clean plate for these three), `instances` (the smoke at other times), `nodes` (the node groups of these),
  `clip_pictures` (frames of the clip as files), `undistort` (the clip without its lens's distortion), `usd` (an export
  that is imported), `follow` (paths of a .blend that is saved elsewhere).
- Work beside Blender: `run` (the queue of takes), `side_job` (what changes no result), `shot_check` (the forecast of a
  run), `batch` (the command line).
- Interface: `properties` (the settings); `panel` (`automatic` for its numbers)
  with the sub-panels `element`, `results_panel`, `advanced_panel`, `look_panel`,
  `setup_panel`, `direct_panel` and `export`, each with its buttons (`subpanel` is what they share); other buttons in
  `operators`, `strokes_panel`, `box`, `place` and `editors` (`needs` says when they can be pressed); `drop`, `presets`
  and `preferences`, which Blender calls so.
"""

from types import ModuleType


def register() -> None:
    """Register all classes, properties and handlers.

    Raises
    ------
    EngineMissingError
        If the zip is for another Blender, which its preferences show when they enable the add-on.
    """
    from .job import require_fitting_zip

    require_fitting_zip()
    for module in _modules():
        module.register()


def unregister() -> None:
    """Unregister them."""
    for module in reversed(_modules()):
        module.unregister()


def _modules() -> tuple[ModuleType, ...]:
    """Modules with something to register, each after those it needs; panels in the order of the tab."""
    from . import (
        advanced_panel,
        background,
        batch,
        box,
        direct_panel,
        drop,
        editors,
        element,
        export,
        follow,
        instances,
        look_panel,
        mask,
        operators,
        panel,
        place,
        preferences,
        presets,
        properties,
        results_panel,
        run,
        setup_panel,
        shot_check,
        side_job,
        strokes_panel,
        undistort,
        usd,
        volume,
    )

    data = (preferences, properties, volume, follow, shot_check, run, side_job)
    buttons = (operators, background, mask, strokes_panel, box, place)
    further = (editors, instances, undistort, drop, presets, usd)
    panels = (panel, element, results_panel, advanced_panel, look_panel, setup_panel, direct_panel, export)
    return (*data, *buttons, *further, *panels, batch)
