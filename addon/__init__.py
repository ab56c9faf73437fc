"""Smokelift's Blender add-on: a clip of smoke becomes a volume in the shot.

It knows nothing of the engine but its command line and its files. Its folders import in one direction,
``panel`` -> ``result`` -> ``scene`` -> ``core``:

- `core`, without Blender: `take` (the files of a run), `job` (the engine's process), `sentences` (its messages in the
  panel's words), `contract` (what the add-on repeats of it), `retiming` (a speed ramp), `image_sequence` (with gaps).
- `scene`, Blender's data: `smoke` (the objects that hold the settings); `scene_file` (Blender scene to scene file) with
  `clip`, `plate`, `strokes`, `mask`, `camera`, `box` and `lights`; `volume` (sequence to Volume object) with `look`
  (its material) and `modifiers` (its proxy, and frames between two of a take); `shot_setup` (what matches the clip)
  with `compositing` and `projection`; `nodes` (the node groups of these), `pictures` (frames of the clip as files),
  `floor` (where smoke stands) and `blender` (what all of them ask of Blender).
- `result`: `smoke_takes` (the takes of a smoke), `run_queue` (runs of the engine), `side_job` (work that changes no
  result), `shot_check` (the forecast of a run), `directing` (what acts on the smoke after its clip), `export`, `follow`
  (paths of a .blend that is saved elsewhere), `command_line`.
- `panel`: `tab`, whose parts are `clip_panel`, `camera_panel`, `quality_panel` and `run_panel`; the sub-panels in files
  of their names; `properties` (the settings) with `settings` (how they are declared), `common` (what operators and
  panels need) and `layout` (rows that are drawn alike), `editors` (what is shown elsewhere in Blender), `preferences`.

``batch.py`` is the command line as a script.
"""

from types import ModuleType


def register() -> None:
    """Register all classes, properties and handlers.

    ShotError if the zip is for another Blender, which its preferences show when they enable the add-on.
    """
    from .core.job import require_fitting_zip

    require_fitting_zip()
    from .scene.blender import register_modules

    register_modules(_modules())


def unregister() -> None:
    """Unregister them."""
    from .scene.blender import unregister_modules

    unregister_modules(_modules())


def _modules() -> tuple[ModuleType, ...]:
    """Modules with classes or more to register, each after those it needs; panels in the order of the tab."""
    from .panel import (
        advanced_panel,
        camera_panel,
        clip_panel,
        direct_panel,
        editors,
        element_panel,
        export_panel,
        look_panel,
        preferences,
        properties,
        quality_panel,
        results_panel,
        run_panel,
        setup_panel,
        tab,
    )
    from .result import command_line, export, follow, run_queue, shot_check, side_job
    from .scene import volume

    data = (preferences, properties, volume, follow, shot_check, run_queue, side_job, export)
    buttons = (clip_panel, camera_panel, quality_panel, run_panel, editors)
    panels = (tab, element_panel, results_panel, advanced_panel, look_panel, setup_panel, direct_panel, export_panel)
    return (*data, *buttons, *panels, command_line)
