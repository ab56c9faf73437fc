"""What holds of the add-on's source: imports lead one way, and its words can be translated.

Imports lead from the panel to results, from these to Blender's data, and to the core. What is filled into words comes
after their translation, as in Blender's own scripts.
"""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ADDON = Path(__file__).parents[2] / "addon"
FILES = {path.relative_to(ADDON).with_suffix("").as_posix(): path for path in ADDON.rglob("*.py")}
TREES = {module: ast.parse(path.read_text(encoding="utf-8")) for module, path in FILES.items()}
FOLDERS = ("core", "scene", "result", "panel")
"""From the lowest, which knows no Blender, to the highest."""

SAYING = {"label", "draw_text", "report", "operator", "progress", "poll_message_set", "draw_hint"}
TRANSLATING = {"iface_", "rpt_"}


def imports(module: str) -> set[str]:
    """What a module imports: of the add-on ``folder/module``, of others the first part of the name."""
    found = set()
    for node in ast.walk(TREES[module]):
        if isinstance(node, ast.Import):
            found |= {name.name.partition(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level:
            place = "/".join([*module.split("/")[: -node.level], *filter(None, (node.module or "").split("."))])
            found |= {place} if "/" in place else {f"{place}/{name.name}" for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(str(node.module).partition(".")[0])
    return found


MODULES = {module: imports(module) for module in TREES if "/" in module and not module.endswith("__init__")}
"""All modules of the folders, with what they import."""


def test_imports_lead_down() -> None:
    assert {module.partition("/")[0] for module in MODULES} == set(FOLDERS)
    level = {module: FOLDERS.index(module.partition("/")[0]) for module in MODULES}
    upward = {(a, b) for a in MODULES for b in MODULES[a] & MODULES.keys() if level[b] > level[a]}
    assert upward == set()
    order = list(TopologicalSorter({a: MODULES[a] & MODULES.keys() for a in MODULES}).static_order())  # no circle
    assert len(order) == len(MODULES)


def test_the_core_knows_no_blender_and_nobody_the_engine() -> None:
    blender = {"bpy", "bpy_extras", "mathutils", "bl_ui", "bl_operators"}
    assert {module for module in MODULES if module.startswith("core/") and MODULES[module] & blender} == set()
    assert {module for module in MODULES if MODULES[module] & {"smokelift", "smokelift_command"}} == set()


@pytest.mark.parametrize("module", sorted(TREES))
def test_nothing_is_filled_in_before_it_is_translated(module) -> None:
    for call in (node for node in ast.walk(TREES[module]) if isinstance(node, ast.Call)):
        name = getattr(call.func, "attr", getattr(call.func, "id", ""))
        said = [*call.args, *(keyword.value for keyword in call.keywords if keyword.arg == "text")]
        if name in SAYING:
            assert not any(isinstance(word, ast.JoinedStr) for word in said), f"{module}:{call.lineno}"
        if name in TRANSLATING and not isinstance(call.args[0], ast.Name):  # a name: what a caller looked up
            assert isinstance(call.args[0], ast.Constant), f"{module}:{call.lineno}"
