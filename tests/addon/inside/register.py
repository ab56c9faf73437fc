"""Registering and unregistering leave nothing behind."""

from typing import get_args

import bpy
import pytest

import addon
from smokelift.direct.continuation import ROOM
from smokelift.footage.image_files import Transfer
from smokelift.render.device import DeviceName
from smokelift.scene import Medium
from smokelift.setup.settings import QUALITIES, Settings
from tests.example_shot import EXAMPLE, smoke

MEDIUM = ("extinction", "albedo", "anisotropy")


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
    assert {"Object.smokelift", "ops.run", "SMOKELIFT_PT_view"} <= ours()
    during = handlers()
    addon.unregister()
    assert ours() == set()
    before = handlers()
    addon.register()
    assert handlers() == during >= before


def test_names_follow_blenders_rules() -> None:
    for name in dir(bpy.ops.smokelift):
        kind = getattr(bpy.ops.smokelift, name).get_rna_type()
        assert kind.description, name
    for setting in bpy.types.Object.bl_rna.properties["smokelift"].fixed_type.properties:
        if setting.identifier not in ("rna_type", "name"):
            assert setting.name and setting.description, setting.identifier
            assert not setting.description.endswith("."), setting.identifier  # Blender adds it


def test_choices_and_defaults_are_the_engines(scene) -> None:
    properties = smoke(scene).smokelift.bl_rna.properties
    choices = {"quality": QUALITIES, "device": get_args(DeviceName), "transfer": ("AUTO", *get_args(Transfer))}
    assert {name: tuple(properties[name].enum_items.keys()) for name in choices} == choices
    for owner, kind, names in ((Settings.preset(), Settings, ("detail", "seed")), (Medium(), Medium, MEDIUM)):
        for name in names:
            setting = properties[name]
            assert setting.default == pytest.approx(getattr(owner, name))
            for limit in (setting.hard_min, setting.hard_max):
                kind(**{name: limit})
    room = smoke(scene).smokelift.directing.bl_rna.properties["room"]
    assert (room.default, room.hard_min) == (ROOM, 1.0)


def test_what_cannot_be_used_says_so_without_an_error(scene) -> None:
    """Blender prints an error in such a question, and goes on."""
    kinds = [getattr(bpy.types, name) for name in dir(bpy.types) if name.startswith(("SMOKELIFT_OT", "SMOKELIFT_PT"))]
    asked = [kind for kind in kinds if hasattr(kind, "poll") and kind.__name__ != "SMOKELIFT_PT_strokes"]
    assert len(asked) > 30
    may = {kind.__name__ for kind in asked if kind.poll(bpy.context)}
    always = {f"SMOKELIFT_{name}" for name in ("OT_add", "OT_open_manual", "OT_stroke", "PT_view", "PT_clip")}
    assert may - {"SMOKELIFT_PT_presets"} == always


def test_smoke_is_in_the_menu_for_volumes(scene, tmp_path) -> None:
    """Where Blender's search looks; choosing a clip adds the smoke, and what is no clip is one sentence."""
    menu = bpy.types.VIEW3D_MT_volume_add
    assert any(draw.__module__.startswith("addon") for draw in menu.draw._draw_funcs)
    assert bpy.ops.smokelift.add.get_rna_type().name == "Smoke from Video"
    assert bpy.ops.smokelift.add(filepath=str(EXAMPLE / "clip.mp4")) == {"FINISHED"}
    assert smoke(scene).smokelift.clip.name == "clip.mp4"
    assert bpy.context.view_layer.objects.active == smoke(scene)
    with pytest.raises(RuntimeError, match=r"nothing\.mp4"):
        bpy.ops.smokelift.add(filepath=str(tmp_path / "nothing.mp4"))
    (tmp_path / "notes.txt").write_text("no clip")
    with pytest.raises(RuntimeError, match=r"notes\.txt"):
        bpy.ops.smokelift.add(filepath=str(tmp_path / "notes.txt"))
    assert len(bpy.data.movieclips) == 1


SAVED = {
    "smokelift": "albedo anisotropy assumed_camera before between box camera_mode clip closed detail device directing "
    "distance drawn_mask extinction first folder fps inlet is_smoke last light_mode longest_side mask output plate "
    "plate_frames plate_mode plate_place quality results saved_as seed set_up_camera set_up_colors set_up_light "
    "set_up_plate set_up_range speed start_number strokes transfer use_medium",
    "smokelift_export": "folder host precision proxy use_velocity",
}
"""Settings by the names under which .blend files and scripts have them."""


def test_settings_have_the_names_that_files_know(scene) -> None:
    for owner, names in SAVED.items():
        assert set(names.split()) <= set(getattr(smoke(scene), owner).bl_rna.properties.keys())
    directing = smoke(scene).smokelift.directing.bl_rna.properties
    names = "buoyancy closed direction dissipation effectors fade fan_speed frames live overlap part_first part_last "
    names += "room speed speed_end speed_middle start use_buoyancy use_dissipation use_part use_ramp use_start"
    assert set(names.split()) <= set(directing.keys())
