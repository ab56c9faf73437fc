"""The renderer on the processor: compiled sweeps over the voxels that may hold smoke (``cpp/``).

Sweeps of light are fastest along rows of memory, and slow where the light travels along them. So where most of the
light comes from above or below, y and z change places: the voxels are copied into the sweeps' own grid anyway.

Light that is scattered more than once (`DiffuseLight`, ``cpp/diffuse_light.h``) comes from all sides and changes
slowly, so blocks of voxels hold it: light goes from block to block along 14 directions, and conjugate gradients solve
for all orders of scattering. What the lights themselves scatter, with its sharp shadows, stays on the voxels. Blocks
are few, so that a GPU leaves them to the processor. Figures: docs/experiments/scattering.md.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import smokelift._core as _core
from smokelift.checks import Array
from smokelift.render.plan import ParallelSweep, RenderPlan

BLOCKS = 24
"""Blocks along the longest side of a domain, about: coarse grids show what fine ones show."""

MIN_BLOCK, MAX_BLOCK = 2, 4
"""Voxels along the edge of a block: one voxel says nothing of how its emission changes across it, and larger blocks are
too dark (docs/experiments/scattering.md)."""

FIELDS = 4
"""Fields of what is linear across a block: the mean, and the slopes along x, y and z (by definition)."""


class CpuBackend:
    """Picture and derivative of one `RenderPlan` in channels; `Renderer` makes colors of them."""

    def __init__(self, plan: RenderPlan) -> None:
        self._axes = (0, 1, 2)
        lights = plan.lights
        parallel = [light for light in lights if isinstance(light, ParallelSweep)]
        # a point light's voxels belong to the first of its faces, an order that a swap would change
        if len(parallel) == len(lights) and 2 * sum(light.axis == 2 for light in parallel) > len(lights):
            self._axes = (0, 2, 1)
            plan = _with_y_and_z_swapped(plan, parallel)
        self._plan = plan
        channels = plan.channels
        x, y, z = plan.shape
        self._support = _core.Support(plan.marked)
        self._rays = _core.Rays(plan.rays.lines, plan.rays.length, plan.rays.planes)
        # rays go as far as voxels that may hold smoke are around them
        mask = _core.zeros((x + 2, y + 2, z + 2, 1))
        mask[1:-1, 1:-1, 1:-1, 0] = plan.marked
        self._rays.clip(self._support, mask)
        # what no sweep touches is never given memory
        self._medium = _core.zeros((x + 2, y + 2, z + 2, channels + 1))
        self._gradient: Array | None = None
        self._scratch: Array | None = None
        self._record: Array | None = None
        self._depth = np.zeros(plan.rays.length.shape, np.float32)
        self._phase = _core.Phase(to_eye=plan.to_eye, albedo=plan.medium.albedo, anisotropy=plan.medium.anisotropy)
        self._diffuse = DiffuseLight(plan, self._support) if plan.diffuse else None
        if channels and not plan.shadows:
            self._shade()

    def image(self, density: Array, keep_record: bool) -> tuple[Array, Array]:
        """Scattered radiance (rows, columns, channels) and optical depth (rows, columns)."""
        plan = self._plan
        part = np.asarray(density, np.float32).transpose(self._axes)[plan.box]
        _core.pack(part, self._support, plan.medium.extinction, self._medium)
        if plan.shadows:
            self._shade()
        if self._diffuse:
            self._diffuse.add(self._medium)
        if keep_record and self._record is None:
            self._record = _core.zeros((plan.channels + 1, self._rays.recorded))
        record = self._record if keep_record else None
        scattered, self._depth = _core.march(self._medium, self._support, self._rays, record)
        return scattered, self._depth

    def gradient(self, scattered_gradient: Array, transmittance_gradient: Array, out: Array | None = None) -> Array:
        """Pull derivatives by the last recorded picture back to the density (nx, ny, nz); uses the record up."""
        plan = self._plan
        if self._gradient is None:
            self._gradient = _core.zeros(self._medium.shape)
        derivatives = scattered_gradient, transmittance_gradient
        _core.march_adjoint(self._rays, self._depth, *derivatives, self._record, self._gradient, self._support)
        if self._diffuse:
            self._diffuse.pull_back(self._medium, self._gradient)
        if plan.shadows:
            if self._scratch is None and len(plan.lights) > 1:
                self._scratch = _core.zeros((*self._medium.shape[:3], 1))
            _core.shade_adjoint(self._medium, self._gradient, self._scratch, self._support, self._phase, plan.lights)
        result = _core.zeros(plan.domain.resolution) if out is None else out
        part = result.transpose(self._axes)[plan.box]
        _core.unpack(self._gradient, self._support, plan.medium.extinction, part)
        return result

    def _shade(self) -> None:
        _core.shade(self._medium, self._support, self._phase, self._plan.lights)


def _with_y_and_z_swapped(plan: RenderPlan, lights: Sequence[ParallelSweep]) -> RenderPlan:
    """Return the plan for arrays of voxels [x, z, y]; only its domain stays as it is."""
    x, y, z = plan.corner
    rays = plan.rays
    lines, planes = rays.lines.copy(), rays.planes.copy()
    # across x the two other axes change places; the others keep x first
    across_x = planes[..., 0] == 0
    lines[across_x] = lines[across_x][:, [2, 3, 0, 1]]
    planes[..., 0] = np.array([0, 2, 1])[planes[..., 0]]
    swapped = tuple(
        replace(light, axis=(0, 2, 1)[light.axis], slope=light.slope if light.axis else light.slope[::-1])
        for light in lights
    )
    return replace(
        plan,
        corner=(x, z, y),
        marked=np.ascontiguousarray(plan.marked.transpose(0, 2, 1)),
        rays=replace(rays, lines=lines, planes=planes),
        to_eye=plan.to_eye[:, [0, 2, 1, 3]],
        lights=swapped,
    )


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
