"""Smokelift's Blender add-on: a clip of smoke becomes a volume in the shot.

It knows nothing of the engine but its command line and its files. ARCHITECTURE.md says what is in its folders, which
import in one direction: ``panel`` -> ``result`` -> ``scene`` -> ``core``. ``batch.py`` is the command line as a script.
"""

from importlib import import_module
from types import ModuleType

MODULES = (
    ("panel", "properties"),
    ("scene", "volume"),
    ("result", "follow shot_check run_queue side_job export command_line"),
    ("panel", "clip_panel camera_panel quality_panel editors tab"),
    ("panel", "element_panel results_panel look_panel direct_panel"),
)
"""Folders and modules with classes or more to register, each after those it needs; panels in the order of the tab."""


def register() -> None:
    """Register all of it; ShotError, which Blender's preferences show, if the zip is for another Blender."""
    from .core.job import require_fitting_zip

    require_fitting_zip()
    from .scene.blender import register_modules

    register_modules(_modules())


def unregister() -> None:
    from .scene.blender import unregister_modules

    unregister_modules(_modules())


def _modules() -> list[ModuleType]:
    return [import_module(f".{folder}.{name}", __name__) for folder, names in MODULES for name in names.split()]
