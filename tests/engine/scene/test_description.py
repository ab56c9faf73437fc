"""What a description refuses as a whole, and what it says of itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from scene_examples import GOOD, load, moving_camera

from smokelift.scene import Camera, Domain, Scene, SceneError


def test_further_views_keep_step_with_another_range(tmp_path: Path) -> None:
    """Frames that were said to belong to the clip's move with them; those that were not have the same numbers."""
    scene = load(tmp_path, GOOD)
    (view,) = scene.views
    said = replace(view, clip=replace(view.clip, frames=(5, 15)))
    later = replace(scene, views=(view, said)).with_frames(3, 7)
    assert later.clip == replace(scene.clip, frames=(3, 7))
    assert [each.clip.frames for each in later.views] == [None, (8, 12)]
    began = replace(scene, clip=replace(scene.clip, frames=(6, 10)), views=(said,))
    with pytest.raises(SceneError, match="has no picture before frame 1 of the input"):
        began.with_frames(0, 4)


def test_a_camera_that_does_not_see_the_domain_is_refused() -> None:
    domain = Domain((-1, -1, 0), (1, 1, 3), (2, 2, 3))
    size = (64, 64)
    for target in ((0, -20, 1.5), (20, -7, 1.5), (0, -7.1, 20)):
        camera = Camera.look_at((0, -7, 1.5), target, fov_y_degrees=30, size=size)
        with pytest.raises(SceneError, match="does not see the domain"):
            Scene(camera=camera, domain=domain)
    inside = Camera.look_at((0, 0, 1.5), (0, 5, 1.5), fov_y_degrees=30, size=size)
    assert Scene(camera=inside, domain=domain).camera == inside


def test_a_moving_camera_must_see_the_domain_once() -> None:
    """One frame with the box in its picture is enough."""
    domain = Domain((-1, -1, 0), (1, 1, 3), (20, 20, 30))
    camera = moving_camera((50, -7, 1.5), (0, -7, 1.5))
    assert Scene(camera=camera, domain=domain).camera == camera
    with pytest.raises(SceneError, match="does not see the domain"):
        Scene(camera=moving_camera((50, -7, 1.5), (40, -7, 1.5)), domain=domain)
