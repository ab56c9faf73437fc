"""How many parallel lights stand for an environment: their number doubles until a picture hardly changes."""

from __future__ import annotations

import numpy as np

from smokelift.render.environment import EnvironmentCells
from smokelift.render.renderer import Image, Renderer, Volume
from smokelift.scene import Camera, Domain, EnvironmentLight, Medium
from smokelift.scene.projection import voxel_width

MIN_LIGHTS, MAX_LIGHTS = 4, 256
"""Numbers of lights that `environment_count` chooses between (docs/experiments/renderer-agreement.md)."""

TOLERANCE = 0.01
"""Relative L2 change of the picture. Single scattering at a voxel a step is itself good to a few tenths of a percent,
and one code value of an 8-bit picture is half a percent of middle gray (docs/experiments/renderer-agreement.md)."""

REFERENCE_VOXELS = 28
"""Voxels along the longest edge of the smoke that the number is chosen with: enough for its lumps, and quick."""

REFERENCE_PIXELS = 96
"""Pixels along the longer side of its picture, at most."""

REFERENCE_DEPTH = 3.0
"""Optical depth through its thickest part: dense enough for shadows, thin enough to be lit on all sides."""


def environment_count(light: EnvironmentLight, camera: Camera, domain: Domain, medium: Medium) -> int:
    """Choose the number of lights for an environment by convergence.

    A ball of lumps and hollows that fills the domain is rendered in the medium before black with 4, 8, 16, ... lights,
    until doubling their number changes the picture by at most `TOLERANCE`, or the number is 256. Under six kinds of
    surroundings, a plume then came within 0.2 to 1.3 % of its picture with 512 lights
    (docs/experiments/renderer-agreement.md).
    """
    small = _coarse(domain)
    view = _coarse_camera(camera, small)
    ball = _reference_density(small, medium)
    cells = EnvironmentCells(light)

    def picture(lights: int) -> Image:
        return Renderer(view, small, medium, cells.lights(lights), np.zeros(3, np.float32)).image(ball)

    count, image = MIN_LIGHTS, picture(MIN_LIGHTS)
    while count < MAX_LIGHTS:
        finer = picture(2 * count)
        if np.linalg.norm(finer - image) <= TOLERANCE * np.linalg.norm(finer):
            break
        count, image = 2 * count, finer
    return count


def _coarse(domain: Domain) -> Domain:
    """The domain in few cubic voxels; where they do not fit its edges, to the nearest."""
    voxel = max(domain.size) / REFERENCE_VOXELS
    x, y, z = (max(round(edge / voxel), 1) for edge in domain.size)
    return domain.about_centre((x, y, z), voxel)


def _coarse_camera(camera: Camera, domain: Domain) -> Camera:
    """The camera with pixels about as wide as voxels at the domain's center."""
    width, height = camera.size
    shrink = max(1.0, voxel_width(camera, domain), max(width, height) / REFERENCE_PIXELS)
    return camera.resized(max(1, round(width / shrink)), max(1, round(height / shrink)))


def _reference_density(domain: Domain, medium: Medium) -> Volume:
    """A ball of lumps and hollows that fills the domain, of optical depth 3 through its thickest part."""
    x, y, z = np.meshgrid(*((2 * np.arange(n) + 1) / n - 1 for n in domain.resolution), indexing="ij")
    lumps = np.maximum(1 + 4 * np.sin(9 * x) * np.sin(8 * y + 1) * np.sin(7 * z + 2), 0)
    ball = np.maximum(1 - (x * x + y * y + z * z), 0) * lumps
    thickest = domain.voxel_size * min(ball.sum(axis).max() for axis in range(3))
    return np.asarray(ball * REFERENCE_DEPTH / (medium.extinction * thickest), np.float32)
