"""Light that is scattered more than once, on blocks of voxels (``cpp/diffuse_light.h``).

It comes from all sides and changes slowly, so a coarse grid holds it: light goes from block to block along 14
directions, and conjugate gradients solve for all orders of scattering. What the lights themselves scatter, with its
sharp shadows, stays on the voxels. Figures: docs/experiments/scattering.md.
"""

import numpy as np

import smokelift._core as _core
from smokelift.checks import Array
from smokelift.render.plan import RenderPlan

BLOCKS = 24
"""Blocks along the longest side of a domain, about: coarse grids show what fine ones show."""

MIN_BLOCK, MAX_BLOCK = 2, 4
"""Voxels along the edge of a block: one voxel says nothing of how its emission changes across it, and larger blocks are
too dark (docs/experiments/scattering.md)."""

FIELDS = 4
"""Fields of what is linear across a block: the mean, and the slopes along x, y and z (by definition)."""


class DiffuseLight:
    """The diffuse light of one `RenderPlan`, in voxels with a border of one, (x + 2, y + 2, z + 2, channels + 1)."""

    def __init__(self, plan: RenderPlan, support: _core.Support) -> None:
        self._support = support
        albedos = plan.medium.albedos
        self._albedo = max(albedos)
        if plan.medium.is_gray:  # it scatters all channels alike, whatever colors they are
            self._alike, relative = [(self._albedo, slice(0, FIELDS * plan.channels))], np.ones(plan.channels)
        else:
            self._alike = [(albedo, slice(FIELDS * n, FIELDS * (n + 1))) for n, albedo in enumerate(albedos)]
            relative = np.array(albedos) / self._albedo
        self._relative_albedos = relative.astype(np.float32).repeat(FIELDS)[:, None, None, None]
        size = min(max(round(max(plan.domain.resolution) / BLOCKS), MIN_BLOCK), MAX_BLOCK)
        self._edge = size * plan.domain.voxel_size
        # blocks lie alike in the domain whatever the box; their centers reach around all voxels of the box
        corner, count = np.array(plan.corner), np.array(plan.shape)
        first = np.floor((corner + 0.5) / size - 0.5).astype(int)
        last = np.floor((corner + count - 0.5) / size - 0.5).astype(int) + 1
        shape, offset = (last - first + 1).tolist(), (corner - size * first).tolist()
        self._blocks = _core.Blocks(shape=shape, size=size, offset=offset)
        self._means: Array
        self._radiance: Array

    def add(self, medium: Array) -> None:
        """Add to the radiance that the voxels scatter what they scatter of scattered light."""
        self._means = _core.average(medium, self._support, self._blocks)
        parts = [_core.diffuse(_of(self._means, part), albedo, self._edge) for albedo, part in self._alike]
        self._radiance = np.concatenate(parts)
        self._interpolate(self._radiance, self._albedo, medium)

    def pull_back(self, medium: Array, gradient: Array) -> None:
        """Add to a derivative by extinction and scattered radiance what it says of them through the light added.

        The medium is left as it was before `add`.
        """
        self._interpolate(self._radiance, -self._albedo, medium)
        radiance_gradient = self._relative_albedos * _core.interpolate_adjoint(
            gradient, self._support, self._albedo, self._blocks
        )
        means_gradient = np.zeros_like(self._means)
        for albedo, part in self._alike:
            means = _of(self._means, part)
            part_gradient = _core.diffuse_adjoint(
                means, self._radiance[part], radiance_gradient[part], albedo, self._edge
            )
            means_gradient[0] += part_gradient[0]
            means_gradient[1:][part] = part_gradient[1:]
        _core.average_adjoint(medium, self._support, self._blocks, means_gradient, gradient)

    def _interpolate(self, radiance: Array, factor: float, medium: Array) -> None:
        """Add a multiple of what the voxels scatter of the blocks' radiance, each channel by its relative albedo."""
        _core.add_interpolated(self._relative_albedos * radiance, factor, self._blocks, medium, self._support)


def _of(means: Array, channels: slice) -> Array:
    """The mean extinction, and fields of what some channels emit."""
    return np.concatenate([means[:1], means[1:][channels]])
