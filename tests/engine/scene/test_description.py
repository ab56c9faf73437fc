"""A scene as a whole: its box and inlets, what is missing, what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scene_examples import GOOD, load, moving_camera

from smokelift import Background, Camera, Domain, Medium, Scene
from smokelift.scene import Box, Inlet, SceneError, completed, scene_from_dict, scene_to_dict
from smokelift.scene.domain import box_around


def test_an_inlet_is_the_voxels_in_its_ball() -> None:
    domain = Domain((-1, -1, 0), (1, 1, 3), (64, 64, 96))
    inlet = Inlet((0.1, -0.2, 0), 0.4)
    found = inlet.voxels(domain)
    centers = np.stack(np.meshgrid(*(np.arange(n) + 0.5 for n in found.shape), indexing="ij"), -1) / 32 + domain.min
    np.testing.assert_array_equal(found, np.linalg.norm(centers - inlet.centre, axis=-1) <= 0.4)
    assert found.sum() / 32**3 == pytest.approx(2 / 3 * math.pi * 0.4**3, rel=0.02)


@pytest.mark.parametrize(
    ("center", "voxel"), [((0.01, 0.02, 0.05), (32, 32, 1)), ((-1.005, 0.99, 3), (0, 63, 95))], ids=["in", "beside"]
)
def test_a_small_inlet_is_the_nearest_voxel(center, voxel) -> None:
    domain = Domain((-1, -1, 0), (1, 1, 3), (64, 64, 96))
    np.testing.assert_array_equal(np.argwhere(Inlet(center, 0.006).voxels(domain)), [voxel])


def test_the_box_around_marked_voxels_ends_at_the_grid() -> None:
    marked = np.zeros((9, 8, 7), np.bool_)
    assert all(marked[box_around(marked, 2)].shape[axis] == 0 for axis in range(3))
    marked[4, 1, 6] = marked[5, 3, 5] = True
    assert box_around(marked, 0) == (slice(4, 6), slice(1, 4), slice(5, 7))
    assert box_around(marked, 2) == (slice(2, 8), slice(0, 6), slice(3, 7))


def test_inlets_add_up(tmp_path) -> None:
    scene = completed(load(tmp_path, GOOD))
    inlets = Inlet((0, 0, 0), 0.2), Inlet((0.5, 0.5, 1), 0.1)
    expected = inlets[0].voxels(scene.domain) | inlets[1].voxels(scene.domain)
    np.testing.assert_array_equal(replace(scene, inlets=inlets).inflow(), expected)
    assert scene.inflow() is None


def test_what_is_missing_takes_a_default_but_camera_and_domain(tmp_path) -> None:
    described = load(tmp_path, GOOD)
    bare = Scene(camera=described.camera, domain=described.domain)
    scene = completed(bare)
    assert (scene.medium, scene.lights, scene.scattering) == (Medium(), (), "single")
    assert scene.background == Background(color=(0.0, 0.0, 0.0))
    assert completed(scene) == completed(scene_from_dict(scene_to_dict(scene))) == scene
    other = described.views[0].camera
    assert completed(replace(bare, camera=None), other) == completed(scene, other) == replace(scene, camera=other)
    with pytest.raises(ValueError, match="camera"):
        completed(replace(bare, camera=None))
    with pytest.raises(ValueError, match="domain"):
        completed(replace(bare, domain=None))
    with pytest.raises(ValueError, match="resolution"):
        completed(replace(bare, domain=Box((-1, -1, 0), (1, 1, 3))))
    with pytest.raises(ValueError, match="background"):
        replace(scene, background=None)


def test_further_views_keep_step_with_another_range(tmp_path) -> None:
    """Frames that were said to belong to the clip's move with them; those that were not have the same numbers."""
    scene = load(tmp_path, GOOD)
    (view,) = scene.views
    said = replace(view, clip=replace(view.clip, frames=(5, 15)))
    later = replace(scene, views=(view, said)).with_frames(3, 7)
    assert later.clip == replace(scene.clip, frames=(3, 7))
    assert [each.clip.frames for each in later.views] == [None, (8, 12)]
    began = replace(scene, clip=replace(scene.clip, frames=(6, 10)), views=(said,))
    with pytest.raises(SceneError, match="frame 1 "):
        began.with_frames(0, 4)


def test_a_camera_that_does_not_see_the_domain_is_refused() -> None:
    domain = Domain((-1, -1, 0), (1, 1, 3), (2, 2, 3))
    size = (64, 64)
    for target in ((0, -20, 1.5), (20, -7, 1.5), (0, -7.1, 20)):
        camera = Camera.look_at((0, -7, 1.5), target, fov_y_degrees=30, size=size)
        with pytest.raises(SceneError, match="domain"):
            Scene(camera=camera, domain=domain)
    inside = Camera.look_at((0, 0, 1.5), (0, 5, 1.5), fov_y_degrees=30, size=size)
    assert Scene(camera=inside, domain=domain).camera == inside
    assert Scene(camera=moving_camera((50, -7, 1.5), (0, -7, 1.5)), domain=domain).domain == domain
    beside = Camera.look_at((5, -7, 1.5), (5, 0, 1.5), fov_y_degrees=30, size=size)
    parallel = replace(beside, type="orthographic", fx=20, fy=20)  # sees 1.6 m to each side
    for camera in (moving_camera((50, -7, 1.5), (40, -7, 1.5)), parallel):
        with pytest.raises(SceneError, match="domain"):
            Scene(camera=camera, domain=domain)
