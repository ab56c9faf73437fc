"""What is selected becomes what acts on the smoke."""

import bpy

from addon.scene import volume
from conftest import made
from tests.example_shot import smoke


def select(*objects: bpy.types.Object) -> None:
    """Select these alone."""
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
