"""The command line as a script, ``blender -b shot.blend -P addon/batch.py -- [options]``: see `result.command_line`."""

import importlib
import importlib.util
import sys
from pathlib import Path

import bpy


def _run_as_script() -> int:
    """Run the enabled add-on, else the one that holds this script."""
    words = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    if hasattr(bpy.types, "SMOKELIFT_PT_view"):
        package = bpy.types.SMOKELIFT_PT_view.__module__.removesuffix(".panel.tab")
        return importlib.import_module(f"{package}.result.command_line").main(words)
    init = Path(__file__).resolve().parent / "__init__.py"
    name = "smokelift_addon"  # not the folder's name, which an extension shares with the engine
    spec = importlib.util.spec_from_file_location(name, init, submodule_search_locations=[str(init.parent)])
    package = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(package)
    package.register()
    try:
        return importlib.import_module(f"{name}.result.command_line").main(words)
    finally:
        package.unregister()


if __name__ == "__main__":
    sys.exit(_run_as_script())
