"""What noise leaves of the objective."""

import numpy as np
import pytest

from smokelift.density import Observation
from smokelift.density.objective import camera_terms, noise_floor
from smokelift.density.observation import ViewSet
from smokelift.extraction.plate import Plate
from smokelift.footage.images import linear_to_srgb
from smokelift.footage.noise import Noise, linear_per_srgb
from smokelift.render import scene_optics
from smokelift.scene import Camera, Domain, Scene, completed

NOISE = 0.03
"""Standard deviation of a pixel, sRGB values."""


def test_noise_that_has_faded_with_the_picture_is_not_expected() -> None:
    """What shows no smoke is the background itself, without noise: a fit that expects it stops too early."""
    camera = Camera.look_at((0, -4, 0), (0, 0, 0), fov_y_degrees=30, size=(64, 64))
    scene = completed(Scene(camera=camera, domain=Domain((-1, -1, -1), (1, 1, 1), (12, 12, 12))))
    rows, columns = np.mgrid[:64, :64]
    opacity = 0.8 * np.clip(1.5 - np.hypot(rows - 32, columns - 32) / 8, 0, 1)[..., None]
    truth = (0.2 * (1 - opacity) + 0.6 * opacity).astype(np.float32).repeat(3, -1)
    noise = np.random.default_rng(0).normal(0, NOISE, truth.shape) * linear_per_srgb(linear_to_srgb(truth))
    one = np.ones((64, 64), np.float32)
    plate = Plate(
        0.2 * one[..., None].repeat(3, -1), one, Noise(np.full(3, NOISE, np.float32), np.full(3, 1e-3, np.float32))
    )
    views = ViewSet.of([Observation(camera, (truth + noise).astype(np.float32), plate)], scene_optics(scene))
    (term,) = camera_terms(views, [one])
    assert noise_floor([term]) == pytest.approx(term.loss(truth - views.views[0].image), rel=0.2)
