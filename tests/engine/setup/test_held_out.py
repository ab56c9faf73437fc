"""The judge of lights: the other half of the pixels, in whatever light the smoke is shown."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.footage.clip import Clip
from smokelift.footage.plate import known_plate
from smokelift.footage.working_picture import working_picture
from smokelift.scene import completed
from smokelift.setup.coarse import CoarseFrame, coarse_frame
from smokelift.setup.held_out import held_out
from smokelift.setup.shot import ShotView


@pytest.fixture
def frame(plume) -> CoarseFrame:
    """A coarse frame of the blob in its own light."""
    scene, clip = completed(plume.scene), Clip.open(plume.scene.clip)
    behind = np.zeros((*clip.size[::-1], 3), np.float32)
    view = ShotView(clip, scene.camera, known_plate(behind, clip), working_picture(scene.camera, scene.domain))
    found = coarse_frame([view], 2, scene)
    assert found is not None
    return found


def test_the_right_light_and_model_leave_the_least(frame, draft) -> None:
    right = held_out([frame], "single", "single", draft.density)
    wrong = held_out([frame], "unshadowed", "single", draft.density)
    assert right.error < 0.05 < wrong.error
    assert right.light == pytest.approx(1, abs=0.03)
    np.testing.assert_allclose(right.colours, 1, atol=0.05)


def test_a_light_of_another_colour_is_asked_to_change(frame, draft) -> None:
    (sun,) = frame.scene.lights
    red, green, blue = sun.irradiance
    tinted = frame.lit_by((replace(sun, irradiance=(red, green, 2 * blue)),))
    (colour,) = held_out([tinted], "single", "single", draft.density).colours
    assert colour[2] / colour[0] == pytest.approx(0.5, rel=0.05)


def test_absorption_asks_for_no_light(frame, draft) -> None:
    assert held_out([frame], "absorption", "absorption", draft.density).light == 1
