"""What a user sets once: preferences, presets, and what is dropped into a window."""

from collections.abc import Iterator
from pathlib import Path

import bpy
import pytest

from addon.panel import properties
from addon.result import smoke_takes
from addon.scene.blender import PACKAGE, thread_options
from addon.scene.smoke import new_smoke, smokes
from tests.example_shot import EXAMPLE


@pytest.fixture
def user(blender) -> Iterator[bpy.types.AddonPreferences]:
    entry = bpy.context.preferences.addons.new()
    entry.module = PACKAGE
    yield entry.preferences
    bpy.context.preferences.addons.remove(entry)


def test_without_preferences_everything_is_as_usual(scene, clip) -> None:
    obj = new_smoke(scene, clip)
    assert obj.smokelift.quality == "balanced"
    assert smoke_takes.output_folder(obj) == EXAMPLE / "clip_smokelift"
    assert thread_options() == []


def test_new_smokes_follow_the_preferences(scene, clip, user, tmp_path) -> None:
    first = new_smoke(scene, clip)
    user.quality, user.output, user.threads = "draft", str(tmp_path), 1
    second = new_smoke(scene, clip)
    assert [obj.smokelift.quality for obj in (first, second)] == ["balanced", "draft"]
    assert [smoke_takes.output_folder(obj) for obj in (first, second)] == [tmp_path / "clip", tmp_path / "clip_2"]
    second.smokelift.output = str(tmp_path / "own")
    assert smoke_takes.output_folder(second) == tmp_path / "own"
    assert thread_options() == ["--threads", "1"]


def test_settings_are_kept_as_a_preset(scene, clip, monkeypatch, tmp_path) -> None:
    def folder(_kind: str, *, path: str = "", create: bool = False) -> str:
        (tmp_path / path).mkdir(parents=True, exist_ok=create)
        return str(tmp_path / path)

    monkeypatch.setattr(bpy.utils, "user_resource", folder)
    first = new_smoke(scene, clip)
    first.smokelift.detail, first.smokelift.closed, first.smokelift.first = 0.25, {"x-", "z-"}, 7
    assert bpy.ops.smokelift.add_preset(name="My Smoke") == {"FINISHED"}
    (file,) = (tmp_path / "presets" / properties.FOLDER).iterdir()
    second = new_smoke(scene, clip)
    bpy.ops.script.execute_preset(filepath=str(file), menu_idname="SMOKELIFT_PT_presets")
    assert second.smokelift.detail == 0.25 and second.smokelift.closed == {"x-", "z-"}
    assert second.smokelift.first == 1


@pytest.mark.parametrize("suffix", [".mp4", ".mov", ".mkv"])
def test_a_dropped_video_becomes_a_smoke(scene, suffix, tmp_path) -> None:
    handler = bpy.types.SMOKELIFT_FH_video
    assert suffix in handler.bl_file_extensions.split(";")
    dropped = tmp_path / f"my clip{suffix}"
    dropped.write_bytes((EXAMPLE / "clip.mp4").read_bytes())
    family, name = handler.bl_import_operator.split(".")
    operator = getattr(getattr(bpy.ops, family), name)
    assert operator("INVOKE_DEFAULT", filepath=str(dropped)) == {"FINISHED"}
    (obj,) = smokes(scene)
    assert Path(bpy.path.abspath(obj.smokelift.clip.filepath)) == dropped
