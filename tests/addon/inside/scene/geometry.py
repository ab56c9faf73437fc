"""The click on where the smoke stands."""

import bpy
import numpy as np
import pytest
from mathutils import Vector

from addon.core import ShotError
from addon.scene.geometry import Floor
from addon.scene.scene_file import shot_tables
from smokelift.density.upright_plane import depth_at
from smokelift.scene import Scene, scene_from_dict
from tests.example_shot import smoke


def looking_down(scene: bpy.types.Scene, at: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> bpy.types.Object:
    """The scene's camera, from 3 m above the floor."""
    camera = scene.camera
    camera.location = (0.5, -7.0, 3.0)
    camera.rotation_euler = (Vector(at) - camera.location).to_track_quat("-Z", "Y").to_euler()
    bpy.context.view_layer.update()
    return camera


def clicked(scene: bpy.types.Scene, *points: tuple[float, float, float]) -> float:
    """The distance by a click on what stands at a point, with another beside it."""
    eye = scene.camera.matrix_world.translation
    return Floor.of(smoke(scene)).clicked([(eye, Vector(point) - eye) for point in points])


def engines(scene: bpy.types.Scene) -> Scene:
    bpy.context.view_layer.update()
    return scene_from_dict(shot_tables(smoke(scene)))


@pytest.mark.parametrize("turned", [0.0, 0.4])
def test_a_click_gives_the_distance_that_the_engine_takes(shot, turned) -> None:
    smoke(shot).smokelift.box.rotation_euler[2] = turned
    looking_down(shot)
    place = (0.2, 0.35, 0.0)
    distance = clicked(shot, place, (0.2, 0.34, 0.0))
    found = engines(shot)
    from_middle = np.array(place) - (0.0, 0.0, 1.5)
    away = Vector((-0.5, 7.0, 0.0)).normalized()
    assert depth_at(distance, found.camera, found.domain) == pytest.approx(from_middle @ away, abs=0.02)


def test_a_click_from_any_side_gives_the_cameras_distance(shot) -> None:
    looking_down(shot, (0.5, 0.0, 1.0))
    above, down = Vector((0.2, 0.35, 9.0)), Vector((0.0, 0.0, -1.0))
    rays = [(above, down), (above + Vector((0.0, -0.01, 0.0)), down)]
    assert Floor.of(smoke(shot)).clicked(rays) == pytest.approx(7.35)


def test_the_distance_is_that_of_the_first_frame(shot) -> None:
    camera = looking_down(shot, (0.5, 0.0, 1.0))
    camera.keyframe_insert("location", frame=1)
    camera.location.y = -5.0
    camera.keyframe_insert("location", frame=20)
    shot.frame_set(20)
    assert clicked(shot, (0.5, 0.35, 0.0), (0.5, 0.34, 0.0)) == pytest.approx(7.35)
    assert shot.frame_current == 20


@pytest.mark.parametrize(
    ("height", "points"),
    [
        (3.0, [(0.0, 0.0, 4.0), (0.0, 0.0, 3.9)]),
        (3.0, [(0.0, 3.0, 0.0), (0.0, 2.9, 0.0)]),
        (0.1, [(0.0, 0.5, 0.0), (0.0, 0.2, 0.0)]),
    ],
    ids=["above the floor", "outside the box", "near to the floor"],
)
def test_a_click_that_tells_nothing_is_refused(shot, height, points) -> None:
    looking_down(shot).location.z = height
    bpy.context.view_layer.update()
    with pytest.raises(ShotError):
        clicked(shot, *points)
