"""Imports of the add-on lead one way: from the panel to results, from these to Blender's data, and to the core."""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ADDON = Path(__file__).parents[2] / "addon"
FOLDERS = ("core", "scene", "result", "panel")
"""From the lowest, which knows no Blender, to the highest."""


def imports(path: Path) -> set[str]:
    """What a module imports: of the add-on ``folder/module``, of others the first part of the name."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {name.name.partition(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level:
            folder = path.parents[node.level - 1].relative_to(ADDON)
            parts = [*folder.parts, *(node.module or "").split(".")]
            place = "/".join(part for part in parts if part)
            found |= {place} if "/" in place else {f"{place}/{name.name}" for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(str(node.module).partition(".")[0])
    return found


@pytest.fixture(scope="module")
def modules() -> dict[str, set[str]]:
    """The imports of all modules."""
    return {
        f"{path.parent.name}/{path.stem}": imports(path) for path in ADDON.glob("*/*.py") if path.stem != "__init__"
    }


def test_imports_lead_down(modules) -> None:
    assert {module.partition("/")[0] for module in modules} == set(FOLDERS)
    level = {module: FOLDERS.index(module.partition("/")[0]) for module in modules}
    upward = {(a, b) for a in modules for b in modules[a] & modules.keys() if level[b] > level[a]}
    assert upward == set()
    order = list(TopologicalSorter({a: modules[a] & modules.keys() for a in modules}).static_order())  # no circle
    assert len(order) == len(modules)


def test_the_core_knows_no_blender_and_nobody_the_engine(modules) -> None:
    blender = {"bpy", "bpy_extras", "mathutils", "bl_ui", "bl_operators"}
    assert {module for module in modules if module.startswith("core/") and modules[module] & blender} == set()
    assert {module for module in modules if modules[module] & {"smokelift", "smokelift_command"}} == set()
