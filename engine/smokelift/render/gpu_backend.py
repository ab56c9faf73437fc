"""The renderer on a GPU: Taichi runs ``gpu_kernels`` over the box around the smoke.

It is imported only after a GPU is found: importing Taichi takes longer than a picture.
"""

from typing import Any

import numpy as np
from scipy import ndimage

import smokelift._core as _core
from smokelift.checks import Array
from smokelift.render import gpu_kernels as kernels
from smokelift.render import taichi_runtime as taichi
from smokelift.render.cpu_backend import DiffuseLight
from smokelift.render.plan import Face, ParallelSweep, PointSweep, RenderPlan, Sweep


class GpuBackend:
    """Picture and derivative of one `RenderPlan` in channels; `Renderer` makes colors of them."""

    def __init__(self, plan: RenderPlan) -> None:
        self._plan = plan
        self._channels = plan.channels
        x, y, z = plan.shape
        near = ndimage.binary_dilation(plan.marked, np.ones((3, 3, 3)))
        self._marked = taichi.upload(plan.marked)
        self._near = taichi.upload(near.astype(np.int32))
        self._padded = (x + 2, y + 2, z + 2)
        self._medium = taichi.zeros((*self._padded, self._channels + 1))
        pixels = plan.rays.length.shape
        self._lines = taichi.upload(plan.rays.lines)
        self._length = taichi.upload(plan.rays.length)
        self._planes = taichi.upload(plan.rays.planes)
        self._scattered = taichi.zeros((*pixels, max(self._channels, 1)))
        self._depth = taichi.zeros(pixels)
        self._record: Any = None
        self._gradient: Any = None
        self._scratch: Any = None
        self._sweeps = LightSweeps(plan, self._near)
        self._diffuse = DiffuseLight(plan, _core.Support(plan.marked)) if plan.diffuse else None
        if self._channels and not plan.shadows:
            self._shade()

    def image(self, density: Array, keep_record: bool) -> tuple[Array, Array]:
        """Scattered radiance (rows, columns, channels) and optical depth (rows, columns)."""
        plan = self._plan
        kernels.pack(taichi.upload(density[plan.box]), self._marked, self._medium, plan.medium.extinction)
        if plan.shadows:
            self._shade()
        if self._diffuse:  # blocks are few, so the processor follows the light among them
            medium = taichi.download(self._medium)
            self._diffuse.add(medium)
            self._medium = taichi.upload(medium)
        if keep_record and self._record is None:
            self._record = taichi.zeros((max(plan.shape), *plan.rays.length.shape, self._channels + 1))
        record = self._record if keep_record else self._medium
        for axis in plan.rays.axes:
            kernels.march(
                self._medium, self._lines, self._length, self._planes,
                self._scattered, self._depth, record, axis, self._channels, keep_record,
            )  # fmt: skip
        return taichi.download(self._scattered)[..., : self._channels], taichi.download(self._depth)

    def gradient(self, scattered_gradient: Array, transmittance_gradient: Array, out: Array | None = None) -> Array:
        """Pull derivatives by the last recorded picture back to the density (nx, ny, nz); uses the record up."""
        plan = self._plan
        if self._gradient is None:
            self._gradient = taichi.zeros((*self._padded, self._channels + 1))
        if not self._channels:
            scattered_gradient = np.zeros((*transmittance_gradient.shape, 1), np.float32)
        kernels.march_adjoint(
            self._record, self._length, self._planes, self._depth,
            taichi.upload(scattered_gradient), taichi.upload(transmittance_gradient), self._channels,
        )  # fmt: skip
        to_pixel = taichi.matrix(plan.rays.to_pixel)
        for number, axis in enumerate(plan.rays.axes or (0,)):
            kernels.gather_gradient(
                self._record, self._lines, self._planes, to_pixel, self._near, self._gradient,
                axis, self._channels, number,
            )  # fmt: skip
        if self._diffuse:
            gradient = taichi.download(self._gradient)
            self._diffuse.pull_back(taichi.download(self._medium), gradient)
            self._gradient = taichi.upload(gradient)
        if plan.shadows:
            self._shade_adjoint()
        in_box = taichi.zeros(plan.shape)
        kernels.unpack(self._gradient, self._marked, in_box, plan.medium.extinction)
        result = np.zeros(plan.domain.resolution, np.float32) if out is None else out
        result[plan.box] = taichi.download(in_box)
        return result

    def _shade(self) -> None:
        for number, sweep in enumerate(self._plan.lights):
            self._sweeps.scatter(sweep, self._medium, self._medium, number)
        kernels.extend_into_border(self._medium)

    def _shade_adjoint(self) -> None:
        if self._scratch is None:
            self._scratch = taichi.zeros((*self._padded, 1))
        for sweep in self._plan.lights:
            if isinstance(sweep, ParallelSweep):
                self._sweeps.scatter_parallel(sweep, self._medium, self._gradient, self._scratch, adjoint=True)
                # the adjoint of the sweep is that of the light that travels the other way
                columns = self._sweeps.columns(sweep, self._scratch, -sweep.travel)
                kernels.add_parallel_shadow(
                    columns, self._near, self._gradient, sweep.axis, self._sweeps.slopes[sweep], sweep.step
                )
                continue
            for face in sweep.faces:
                columns = self._sweeps.scatter_face(
                    sweep, face, self._medium, self._gradient, self._scratch, adjoint=True
                )
                rays = self._sweeps.rays[sweep, face]
                kernels.accumulate_rays(self._scratch, columns, face.axis, rays, sweep.voxel_size, True)
                kernels.add_point_shadow(columns, self._near, self._gradient, face.axis, rays)


class LightSweeps:
    """Lights swept through the voxels of a plan that are marked in ``near``; columns of one shape share memory.

    What kernels take of a light is made once, as Taichi needs a fifth of a millisecond for it.
    """

    def __init__(self, plan: RenderPlan, near: Any) -> None:
        self._shape, self._near = plan.shape, near
        self._columns: dict[tuple[int, ...], Any] = {}
        phase = taichi.matrix(plan.to_eye), plan.medium.anisotropy, plan.medium.albedo
        self._shadings, self.slopes, self.rays = dict[Sweep, Any](), dict[Sweep, Any](), dict[tuple[Sweep, Face], Any]()
        for sweep in plan.lights:
            self._shadings[sweep] = kernels.Shading(taichi.vector(np.resize(sweep.energy, 3)), *phase)
            if isinstance(sweep, ParallelSweep):
                self.slopes[sweep] = kernels.Slopes(*sweep.slope, sweep.first)
                continue
            for face in sweep.faces:
                begin = taichi.vector(np.array([face.columns_b[0], face.columns_c[0]]))
                position = taichi.vector(sweep.position)
                self.rays[sweep, face] = kernels.Rays(face.travel, face.first, face.far, begin, position)

    def scatter(self, sweep: Sweep, medium: Any, result: Any, add: int) -> None:
        """Write, or ``add``, the radiance of a light that a medium scatters, in the channels after its first one."""
        if isinstance(sweep, ParallelSweep):
            self.scatter_parallel(sweep, medium, result, result, add)
            return
        for face in sweep.faces:
            self.scatter_face(sweep, face, medium, result, result, add)

    def scatter_parallel(
        self, sweep: ParallelSweep, medium: Any, source: Any, result: Any, add: int = 0, *, adjoint: bool = False
    ) -> None:
        """Do `kernels.scatter_parallel` with the columns of a parallel light."""
        kernels.scatter_parallel(
            self.columns(sweep, medium, sweep.travel), self._near, source, result, sweep.axis, self.slopes[sweep],
            sweep.step, taichi.vector(sweep.direction), self._shadings[sweep], add, adjoint,
        )  # fmt: skip

    def scatter_face(
        self, sweep: PointSweep, face: Face, medium: Any, source: Any, result: Any, add: int = 0, *,
        adjoint: bool = False,
    ) -> Any:  # fmt: skip
        """Do `kernels.scatter_point` through one face of a point light, and return its columns."""
        columns, rays = self._of_shape(face.planes, face.columns_b[1], face.columns_c[1]), self.rays[sweep, face]
        kernels.accumulate_rays(medium, columns, face.axis, rays, sweep.voxel_size, False)
        shading = self._shadings[sweep]
        kernels.scatter_point(columns, self._near, source, result, face.axis, rays, shading, add, adjoint)
        return columns

    def columns(self, sweep: ParallelSweep, voxels: Any, travel: int) -> Any:
        """Sums over voxels along the columns of a parallel light, one way or the other along its axis."""
        columns = self._of_shape(*(n + (axis != sweep.axis) for axis, n in enumerate(self._shape)))
        kernels.accumulate_columns(voxels, columns, sweep.axis, travel, self.slopes[sweep])
        return columns

    def _of_shape(self, *shape: int) -> Any:
        if shape not in self._columns:
            self._columns[shape] = taichi.zeros(shape)
        return self._columns[shape]
