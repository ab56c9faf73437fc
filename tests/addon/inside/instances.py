"""Instances with their own time: what each of them shows, and what Cycles renders of it."""

from pathlib import Path

import bpy
import numpy as np
import pytest

from addon import instances, volume
from conftest import FRAMES, made, rendered
from smokelift.scene import Medium
from tests.example_shot import add, add_camera, smoke


@pytest.fixture
def shown(scene, tmp_path) -> bpy.types.Object:
    """A smoke of `made`, active: its first frame is empty."""
    obj = volume.show(smoke(scene), made(tmp_path, medium=Medium(4.0, 0.8)))
    bpy.context.view_layer.objects.active = obj
    return obj


def scattered(**settings: object) -> bpy.types.Object:
    assert bpy.ops.smokelift.scatter(**settings) == {"FINISHED"}
    return bpy.context.object


def seen(points: bpy.types.Object, frame: int) -> list[tuple[float, str]]:
    """Place along X and file of every instance in a frame, from left to right; no file before and after its frames."""
    bpy.context.scene.frame_set(frame)
    found = []
    for instance in bpy.context.evaluated_depsgraph_get().object_instances:
        if instance.is_instance and instance.parent.original == points:
            data = instance.object.data
            data.grids.load()
            found.append((instance.matrix_world.translation.x, Path(data.grids.frame_filepath).name))
    return sorted(found)


def files(points: bpy.types.Object, frame: int) -> list[str]:
    return [file for _, file in seen(points, frame)]


def test_each_point_plays_later(shown) -> None:
    start = shown.data.frame_start
    points = scattered(count=3, step=2)
    assert not points.smokelift.is_smoke
    assert files(points, start + 4) == ["smoke_0005.vdb", "smoke_0003.vdb", "smoke_0001.vdb"]
    points.data.attributes[instances.OFFSET].data.foreach_set("value", [4, 4, 2])
    points.data.update_tag()
    assert files(points, start + 4) == ["smoke_0001.vdb", "smoke_0001.vdb", "smoke_0003.vdb"]
    assert shown.data.frame_start == start
    places = [x for x, _ in seen(points, start)]
    assert np.diff(places).min() > 0.1


def test_before_its_time_an_instance_shows_nothing_unless_it_repeats(shown) -> None:
    start = shown.data.frame_start
    once = scattered(count=2, step=3)
    assert files(once, start + 1) == ["smoke_0002.vdb", ""]
    bpy.context.view_layer.objects.active = shown
    again = scattered(count=2, step=3, repeat=True)
    assert files(again, start + 1) == ["smoke_0002.vdb", f"smoke_{FRAMES - 1:04d}.vdb"]
    assert files(again, start + FRAMES) == ["smoke_0001.vdb", "smoke_0004.vdb"]


def test_instances_keep_turn_scale_and_material(shown) -> None:
    shown.location, shown.scale, shown.rotation_euler = (1.0, 2.0, 3.0), (2.0, 2.0, 2.0), (0.0, 0.0, 1.0)
    points = scattered(count=2, step=1)
    bpy.context.view_layer.update()
    for instance in bpy.context.evaluated_depsgraph_get().object_instances:
        if instance.is_instance:
            assert instance.matrix_world.to_scale()[:] == pytest.approx((2.0, 2.0, 2.0))
            assert instance.matrix_world.to_euler().z == pytest.approx(1.0)
            assert instance.object.data.materials[0].original == shown.data.materials[0]
            assert instance.object.data.velocity_unit == "SECOND"
    assert points.location == shown.location


def test_cycles_renders_them_at_their_times(shown, tmp_path) -> None:
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = 48, 16
    scene.cycles.samples, scene.cycles.use_denoising = 32, False
    points = scattered(count=3, step=2)
    points.data.vertices.foreach_set("co", np.ravel([(-1.5, 0, 0), (0, 0, 0), (1.5, 0, 0)]))
    shown.hide_render = True
    camera = add_camera(scene, (0.44, -5.0, 1.62), (np.pi / 2, 0.0, 0.0))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 4.5
    sun = add(scene, "Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 5.0, (0.8, 0.0, 0.0)
    scene.frame_set(shown.data.frame_start + 3)
    found = rendered(scene, tmp_path / "found.exr").sum(-1)
    left, middle, right = (found[:, columns].sum() for columns in (slice(0, 16), slice(16, 32), slice(32, 48)))
    assert left > middle > 3.0
    assert right < 0.01 * middle
