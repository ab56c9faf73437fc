"""The words of the add-on can be translated: what is filled in comes after that, as in Blender's own scripts."""

import ast
from pathlib import Path

import pytest

ADDON = Path(__file__).parents[2] / "addon"
SAYING = {"label", "draw_text", "report", "operator", "progress", "poll_message_set", "draw_hint"}
TRANSLATING = {"iface_", "rpt_"}


def calls(module: str) -> list[tuple[str, ast.Call]]:
    """Every call in a module, by the name of what is called."""
    tree = ast.parse((ADDON / module).read_text(encoding="utf-8"))
    found = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    return [(getattr(node.func, "attr", getattr(node.func, "id", "")), node) for node in found]


@pytest.mark.parametrize("module", sorted(path.relative_to(ADDON).as_posix() for path in ADDON.rglob("*.py")))
def test_nothing_is_filled_in_before_it_is_translated(module) -> None:
    for name, call in calls(module):
        said = [*call.args, *(keyword.value for keyword in call.keywords if keyword.arg == "text")]
        if name in SAYING:
            assert not any(isinstance(word, ast.JoinedStr) for word in said), f"{module}:{call.lineno}"
        if name in TRANSLATING and not isinstance(call.args[0], ast.Name):  # a name: what a caller looked up
            assert isinstance(call.args[0], ast.Constant), f"{module}:{call.lineno}"
