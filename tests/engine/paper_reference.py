"""The Riemann sum of the paper's equations 1-5 in float64 and NumPy, from the text and not from the kernels.

Like ``renderer_reference`` it takes complex densities, for derivatives by a complex step.
"""

import numpy as np

from smokelift.scene.camera import ray_through_pixels
from tests.engine.renderer_reference import inscatter_of


def _trilinear(volume, position):
    """Values (..., channels) of a volume (x, y, z, channels) at positions (..., 3); outside as the nearest voxel."""
    at = np.clip(position, 0, np.array(volume.shape[:3]) - 1)
    low = np.minimum(np.floor(at).astype(int), np.maximum(np.array(volume.shape[:3]) - 2, 0))
    f = at - low
    value = 0
    for corner in np.ndindex(2, 2, 2):
        index = np.minimum(low + corner, np.array(volume.shape[:3]) - 1)
        weight = np.prod(np.where(corner, f, 1 - f), -1)
        value = value + weight[..., None] * volume[index[..., 0], index[..., 1], index[..., 2]]
    return value


def render(density, camera, domain, medium, lights, background, scattering="single"):
    """Image (rows, columns, 3), in the precision of the density: float64 or complex128."""
    h = domain.voxel_size
    kappa = medium.extinction * density
    inscatter = inscatter_of(kappa, camera, domain, medium, lights, scattering)
    volume = np.concatenate([kappa[..., None], inscatter], -1)
    origin, direction = ray_through_pixels(camera)
    with np.errstate(divide="ignore"):
        sides = (np.array([domain.min, domain.max])[:, None, None] - origin) / direction
    enter, leave = sides.min(0).max(-1), sides.max(0).min(-1)
    if camera.type == "perspective":
        enter = np.maximum(enter, 0)
    # samples in the middle of whole steps, counted from the back of the box
    count = np.floor((leave - enter) / h + 0.5 - 1e-6)
    scattered = np.zeros((*count.shape, 3), density.dtype)
    depth = np.zeros(count.shape, density.dtype)
    for s in range(int(count.max())):
        there = s < count
        distance = leave[there] - (count[there] - 0.5 - s) * h
        point = origin[there] + distance[:, None] * direction[there]
        values = _trilinear(volume, (point - np.array(domain.min)) / h - 0.5)
        x = values[:, 0] * h
        scattered[there] += (np.exp(-depth[there]) * x)[:, None] * values[:, 1:]
        depth[there] += x
    return scattered + np.exp(-depth)[..., None] * background
