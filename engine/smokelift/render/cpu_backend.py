"""The renderer on the processor: compiled sweeps over the voxels that may hold smoke (``cpp/``).

Sweeps of light are fastest along rows of memory, and slow where the light travels along them. So where most of the
light comes from above or below, y and z change places: the voxels are copied into the sweeps' own grid anyway.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import smokelift._core as _core
from smokelift.checks import Array
from smokelift.render.diffuse_light import DiffuseLight
from smokelift.render.plan import ParallelSweep, RenderPlan


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
