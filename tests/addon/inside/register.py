"""Registering and unregistering leave nothing behind."""

from __future__ import annotations

from typing import get_args

import bpy
import pytest

import addon
from smokelift.direct import ROOM
from smokelift.footage.images import Transfer
from smokelift.render.device import DeviceName
from smokelift.scene import Medium
from smokelift.setup.settings import QUALITIES, Settings
from tests.example_shot import EXAMPLE, smoke


def ours() -> set[str]:
    """Names of everything of ours that Blender knows."""
    classes = {name for name in dir(bpy.types) if "smokelift" in name.lower()}
    operators = {f"ops.{name}" for name in dir(bpy.ops.smokelift)}
    places = (bpy.types.Scene, bpy.types.WindowManager, bpy.types.Object, bpy.types.MovieClip)
    properties = {f"{place.__name__}.smokelift" for place in places if hasattr(place, "smokelift")}
    return classes | operators | properties


def handlers() -> int:
    lists = [getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers)]
    return sum(len(entries) for entries in lists if isinstance(entries, list))


def test_unregistering_leaves_nothing_behind() -> None:
    """No class, operator, property or handler; and it can be done again."""
    assert {"Object.smokelift", "ops.run", "SMOKELIFT_PT_view"} <= ours()
    during = handlers()
    addon.unregister()
    assert ours() == set()
    before = handlers()
    addon.register()
    assert handlers() == during >= before


def test_names_follow_blenders_rules() -> None:
    """Every operator has a tooltip and every setting a name and a tooltip."""
    for name in dir(bpy.ops.smokelift):
        kind = getattr(bpy.ops.smokelift, name).get_rna_type()
        assert kind.description, name
    for setting in bpy.types.Object.bl_rna.properties["smokelift"].fixed_type.properties:
        if setting.identifier not in ("rna_type", "name"):
            assert setting.name and setting.description, setting.identifier
            assert not setting.description.endswith("."), setting.identifier  # Blender adds it


@pytest.mark.parametrize(
    ("name", "expected"),
    [("quality", QUALITIES), ("device", get_args(DeviceName)), ("transfer", ("AUTO", *get_args(Transfer)))],
)
def test_choices_are_the_engines(scene, name, expected) -> None:
    """In the engine's order."""
    assert tuple(smoke(scene).smokelift.bl_rna.properties[name].enum_items.keys()) == expected


def test_what_is_made_up_is_the_engines_by_default(scene) -> None:
    """And the panel's limits are within the engine's."""
    properties = smoke(scene).smokelift.bl_rna.properties
    for name in ("detail", "seed"):
        setting = properties[name]
        assert setting.default == getattr(Settings.preset(), name)
        for limit in (setting.hard_min, setting.hard_max):
            Settings(**{name: limit})
    assert properties["detail"].subtype == "FACTOR"


def test_room_is_the_engines_by_default(scene) -> None:
    """As large as the box of simulated smoke may become."""
    room = smoke(scene).smokelift.directing.bl_rna.properties["room"]
    assert (room.default, room.hard_min) == (ROOM, 1.0)


def test_default_medium_is_the_engines(scene) -> None:
    """And its limits are within the engine's."""
    names = ("extinction", "albedo", "anisotropy")
    properties = smoke(scene).smokelift.bl_rna.properties
    assert [properties[name].default for name in names] == pytest.approx([getattr(Medium(), name) for name in names])
    for name in names:
        Medium(**{name: properties[name].hard_min}), Medium(**{name: properties[name].hard_max})


def test_smoke_is_in_the_menu_for_volumes(scene, tmp_path) -> None:
    """Where Blender's search looks; choosing a clip adds the smoke, and what is no clip is one sentence."""
    menu = bpy.types.VIEW3D_MT_volume_add
    assert any(draw.__module__.startswith("addon") for draw in menu.draw._draw_funcs)
    assert bpy.ops.smokelift.add.get_rna_type().name == "Smoke from Video"
    assert bpy.ops.smokelift.add(filepath=str(EXAMPLE / "clip.mp4")) == {"FINISHED"}
    assert smoke(scene).smokelift.clip.name == "clip.mp4"
    assert bpy.context.view_layer.objects.active == smoke(scene)
    with pytest.raises(RuntimeError, match=r"nothing\.mp4 is no video"):
        bpy.ops.smokelift.add(filepath=str(tmp_path / "nothing.mp4"))
