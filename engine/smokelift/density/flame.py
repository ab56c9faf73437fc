"""Flame from one picture: where in the smoke its light comes from.

The picture shows the integral of the emission along each ray, less what the smoke before it takes away. It says nothing
of the depth. As for smoke, a flame is assumed to be as deep as it is wide (`smokelift.density.profile`), about the
middle of the smoke at its height. From there maximum likelihood expectation maximization (Shepp and Vardi 1982) scales
the emission until it shows the picture. The emission stays at least 0, and its distribution along a ray stays about
what it was. Figures: docs/experiments/fire.md.
"""

import numpy as np
from scipy import ndimage, sparse

from smokelift.checks import Array, Doubles
from smokelift.density.hull import project_voxels, visual_hull
from smokelift.density.profile import DepthProfile
from smokelift.density.upright_plane import SmokeAxis, view_frame
from smokelift.render import Optics, Volume
from smokelift.render.emission import emission_matrix
from smokelift.scene import Camera, Domain

ITERATIONS = 30
"""Largest number of iterations of the scaling."""

EXACT = 0.01
"""Difference from the picture, as a fraction of its sum, at which the scaling stops."""

MIN_PROFILE = 1e-3
"""Fraction of a profile's peak below which nothing burns."""

SMOOTHING = 2.0
"""Standard deviation (voxels) of the average of the smoke's middle along its height."""


def flame_emission(light: Array, camera: Camera, density: Volume, optics: Optics) -> Volume:
    """Reconstruct the emission (nx, ny, nz) of a flame, radiance per meter.

    ``light`` (rows, columns) is the radiance that the flame adds to the picture of the smoke, not negative. The camera
    stands still. The density (nx, ny, nz) of the smoke takes light away.
    """
    flame = np.zeros(optics.domain.resolution, np.float32)
    projection = project_voxels(camera, optics.domain)
    hull = visual_hull(light > 0, projection)
    if not hull.any():
        return flame
    profile = DepthProfile(light, camera, optics.domain, _middle(density, camera, optics.domain))
    places = projection.places(hull)
    flame[hull] = places.read(light) * profile.at(places, hull)
    burning = flame > 0
    burning[hull] &= profile.shape(places, hull) > MIN_PROFILE
    pixels = ndimage.binary_dilation(light > 0, iterations=2)
    matrix = emission_matrix(density, camera, optics, pixels, burning)
    flame = np.where(burning, flame, np.float32(0))
    flame[burning] = _scaled(flame[burning].astype(np.float64), light[pixels].astype(np.float64), matrix)
    return flame


def _scaled(emission: Doubles, light: Doubles, matrix: sparse.csr_array) -> Doubles:
    """The emission (voxels,) that shows the light (pixels,) through the matrix (pixels, voxels)."""
    seen = matrix.sum(0)
    emission = np.where(seen > 0, emission, 0)
    for _ in range(ITERATIONS):
        shown = matrix @ emission
        if np.abs(shown - light).sum() < EXACT * light.sum():
            break
        ratio = np.divide(light, shown, out=np.zeros_like(light), where=shown > 0)
        emission *= np.divide(matrix.T @ ratio, seen, out=np.zeros_like(seen), where=seen > 0)
    return emission


def _middle(density: Volume, camera: Camera, domain: Domain) -> SmokeAxis:
    """How far behind the domain's center the smoke's middle is, by height; below the smoke as at its base."""
    where = np.nonzero(density)
    if not where[0].size:
        return SmokeAxis.upright()
    _, along, up = view_frame(camera)
    h = domain.voxel_size
    offset = (np.stack(where, -1) + 0.5) * h + np.array(domain.min) - np.array(domain.centre)
    level = np.rint(offset @ up / h).astype(int)
    lowest = level.min()
    amount = density[where].astype(np.float64)
    total, moment = (
        ndimage.gaussian_filter1d(np.bincount(level - lowest, weights), SMOOTHING)
        for weights in (amount, amount * (offset @ along))
    )
    known = total > MIN_PROFILE * total.max()
    depths = moment[known] / total[known]
    heights = (np.flatnonzero(known) + lowest) * h
    return SmokeAxis.by_height(heights, depths)
