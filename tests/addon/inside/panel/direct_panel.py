"""What is selected becomes what acts on the smoke, and another object plays its files at its own time."""

import bpy
import pytest

from addon.scene import volume
from conftest import FRAMES, made, played
from smokelift.scene import Medium
from tests.example_shot import smoke


def select(*objects: bpy.types.Object) -> None:
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)


def test_the_selected_act_on_the_smoke(shot, tmp_path) -> None:
    obj = smoke(shot)
    volume.show(obj, made(tmp_path))
    select(obj, obj.smokelift.box, shot.camera)
    assert not bpy.ops.smokelift.add_effectors.poll()
    bpy.ops.object.effector_add(type="WIND")
    wind = bpy.context.object
    select(obj, wind)
    assert bpy.ops.smokelift.add_effectors() == {"FINISHED"}
    effectors = obj.smokelift.directing.effectors
    assert list(effectors.objects) == [wind]
    assert effectors.name in shot.collection.children
    bpy.ops.mesh.primitive_uv_sphere_add()
    ball = bpy.context.object
    select(ball, wind)
    assert bpy.ops.smokelift.add_effectors() == {"FINISHED"}
    assert obj.smokelift.directing.effectors == effectors
    assert set(effectors.objects) == {wind, ball}
    assert len(wind.users_collection) == 2


@pytest.fixture
def shown(scene, tmp_path) -> bpy.types.Object:
    """A smoke of `made`, active."""
    obj = volume.show(smoke(scene), made(tmp_path, medium=Medium(4.0, 0.8)))
    bpy.context.view_layer.objects.active = obj
    return obj


def test_an_instance_plays_later_once_or_again(shown) -> None:
    start = shown.data.frame_start
    assert bpy.ops.smokelift.add_instance(offset=2) == {"FINISHED"}
    once = bpy.context.object
    assert once != shown and not once.smokelift.is_smoke
    assert once.data.materials[0] == shown.data.materials[0]
    assert (once.location, once.delta_location) == (shown.location, shown.delta_location)
    assert [played(once, start + n) for n in (0, 2, 4)] == ["", "smoke_0001.vdb", "smoke_0003.vdb"]
    assert played(shown, start + 4) == "smoke_0005.vdb"
    bpy.context.view_layer.objects.active = shown
    assert bpy.ops.smokelift.add_instance(offset=3, repeat=True) == {"FINISHED"}
    again = bpy.context.object
    expected = [f"smoke_{FRAMES - 1:04d}.vdb", "smoke_0004.vdb"]
    assert [played(again, start + n) for n in (1, FRAMES)] == expected
