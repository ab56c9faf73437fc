"""One scene, one camera, one grid: a density in, an image out, and the derivative back.

The smoke is grey, so a picture is two numbers a pixel, scattered radiance for unit irradiance S and transmittance
T = exp(-optical depth), and colours are a matter of the last line:

    L_rgb = irradiance_rgb S + T background_rgb.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.render import device, light, view
from smokelift.render.rays import camera_rays
from smokelift.scene import Camera, DirectionalLight, Domain, Medium

Image = NDArray[np.float32]
Volume = NDArray[np.float32]
Scattering = Literal["single", "unshadowed", "absorption"]


class Renderer:
    """A differentiable renderer for one camera and one grid.

    Parameters
    ----------
    camera, domain, medium
        What is seen, from where.
    sun
        The light; None leaves absorption only.
    background : (rows, columns, 3) or (3,)
        Linear radiance behind the smoke.
    scattering
        ``"single"``: single scattering with self-shadowing; ``"unshadowed"``: light reaches every voxel
        unattenuated; ``"absorption"``: the background attenuated, nothing else.
    support : (nx, ny, nz) bool, optional
        Voxels that may hold smoke: only the box around them is rendered, and the gradient is zero elsewhere.
    """

    def __init__(
        self,
        camera: Camera,
        domain: Domain,
        medium: Medium,
        sun: DirectionalLight | None,
        background: Image,
        scattering: Scattering = "single",
        support: NDArray[np.bool_] | None = None,
    ) -> None:
        device.start()
        self.camera, self.domain, self.medium = camera, domain, medium
        self._scatters = scattering != "absorption" and sun is not None
        self._shadows = self._scatters and scattering == "single"
        self._irradiance = np.array(sun.irradiance if sun else (0, 0, 0), np.float64)
        self._background = np.asarray(background, np.float64)
        inside = np.ones(domain.resolution, np.bool_) if support is None else support
        near = ndimage.binary_dilation(inside, np.ones((3, 3, 3)))
        corner, self._crop = _bounding_box(near)
        box = _part(domain, self._crop)
        self._inside = inside[self._crop]
        self._rays = camera_rays(camera, box)
        self._lines = device.upload(self._rays.lines)
        self._length = device.upload(self._rays.length)
        self._planes = device.upload(self._rays.planes)
        self._shape = shape = box.resolution
        rows, columns = camera.size[1], camera.size[0]
        self._support = device.upload(self._inside.astype(np.int32))
        self._near = device.upload(near[self._crop].astype(np.int32))
        self._medium = device.zeros((shape[0] + 2, shape[1] + 2, shape[2] + 2, 2))
        self._scattered = device.zeros((rows, columns))
        self._depth = device.zeros((rows, columns))
        self._record: Any = None
        # one voxel where nothing is scattered: kernels want an array
        self._inscatter = device.zeros(shape if self._scatters else (1, 1, 1))
        if self._scatters and sun is not None:
            direction = np.array(sun.direction, np.float64)
            direction /= np.linalg.norm(direction)
            light.fill_phase(
                self._inscatter, device.matrix(_to_eye(camera, box)), device.vector(direction),
                medium.anisotropy, medium.albedo,
            )  # fmt: skip
        if self._shadows and sun is not None:
            self._phase = self._inscatter
            self._inscatter = device.zeros(shape)
            self._sweep = light.light_sweep(np.array(sun.direction, np.float64), corner)
            self._columns = device.zeros(light.column_shape(shape, self._sweep.axis))
            self._optical_length = medium.extinction * domain.voxel_size * self._sweep.length

    def image(self, density: Volume, *, keep_record: bool = False) -> Image:
        """Render a density (nx, ny, nz); linear radiance (rows, columns, 3)."""
        self._density = device.upload(density[self._crop])
        if self._shadows:
            self._light_pass()
        view.pack(self._density, self._inscatter, self._near, self._medium, self.medium.extinction, int(self._scatters))
        if keep_record and self._record is None:
            self._record = device.zeros((max(self._shape), *self._rays.length.shape, 2))
        record = self._record if keep_record else self._medium
        for axis in self._rays.axes:
            view.march(
                self._medium, self._lines, self._length, self._planes,
                self._scattered, self._depth, record, axis, keep_record,
            )  # fmt: skip
        scattered = device.download(self._scattered)[..., None]
        return np.asarray(self._irradiance * scattered + self.transmittance[..., None] * self._background, np.float32)

    @property
    def transmittance(self) -> Image:
        """Transmittance (rows, columns) of the last image's rays."""
        return np.asarray(np.exp(-device.download(self._depth)))

    def gradient(self, image_gradient: Image) -> Volume:
        """Pull dloss / dimage (rows, columns, 3) back to dloss / ddensity (nx, ny, nz).

        Belongs to the last `image` made with ``keep_record``, and uses its record up.
        """
        of_image = np.asarray(image_gradient, np.float64)
        view.march_adjoint(
            self._record, self._length, self._planes, self._depth,
            device.upload(of_image @ self._irradiance),
            device.upload((of_image * self._background).sum(-1)),
        )  # fmt: skip
        gradient = device.zeros(self._shape)
        depth_gradient = device.zeros(self._shape if self._shadows else (1, 1, 1))
        to_pixel = device.matrix(self._rays.to_pixel)
        for axis in self._rays.axes:
            view.gather_gradient(
                self._record, self._lines, self._planes, to_pixel, self._near, self._inscatter,
                gradient, depth_gradient, self.medium.extinction, axis, int(self._shadows),
            )  # fmt: skip
        if self._shadows:
            back = self._sweep.reversed
            light.accumulate_columns(depth_gradient, self._columns, back.axis, back.travel, *back.slope, back.first)
            light.add_shadow_gradient(
                self._columns, self._support, gradient, back.axis, *back.slope, back.first, self._optical_length
            )
        result = np.zeros(self.domain.resolution, np.float32)
        result[self._crop] = np.where(self._inside, device.download(gradient), 0)
        return result

    def _light_pass(self) -> None:
        sweep = self._sweep
        light.accumulate_columns(self._density, self._columns, sweep.axis, sweep.travel, *sweep.slope, sweep.first)
        light.shade(
            self._columns, self._phase, self._near, self._inscatter,
            sweep.axis, *sweep.slope, sweep.first, self._optical_length,
        )  # fmt: skip


def _bounding_box(near: NDArray[np.bool_]) -> tuple[tuple[int, int, int], tuple[slice, slice, slice]]:
    """First voxel and slices of the box around the marked voxels; one voxel if there are none."""
    spans = []
    for axis in range(3):
        marked = np.nonzero(near.any(tuple(other for other in range(3) if other != axis)))[0]
        spans.append((int(marked[0]), int(marked[-1]) + 1) if marked.size else (0, 1))
    x, y, z = spans
    return (x[0], y[0], z[0]), (slice(*x), slice(*y), slice(*z))


def _part(domain: Domain, crop: tuple[slice, slice, slice]) -> Domain:
    h = domain.voxel_size
    low = [start + h * part.start for start, part in zip(domain.min, crop, strict=True)]
    high = [start + h * part.stop for start, part in zip(domain.min, crop, strict=True)]
    x, y, z = (part.stop - part.start for part in crop)
    return Domain((low[0], low[1], low[2]), (high[0], high[1], high[2]), (x, y, z))


def _to_eye(camera: Camera, domain: Domain) -> NDArray[np.float64]:
    """Affine map from a voxel's index to the direction from there to the eye, 3x4."""
    matrix = np.array(camera.matrix, np.float64)
    affine = np.zeros((3, 4))
    if camera.type == "orthographic":
        affine[:, 3] = matrix[:3, 2]
        return affine
    h = domain.voxel_size
    affine[:, :3] = -h * np.eye(3)
    affine[:, 3] = matrix[:3, 3] - (np.array(domain.min) + 0.5 * h)
    return affine
