"""The renderer on the processor: compiled sweeps over the voxels that may hold smoke (``cpp/``)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from smokelift import _core
from smokelift.render.lights import Parallel, Point
from smokelift.render.setup import Setup

Floats = NDArray[np.float32]


class CpuPipeline:
    """Picture and derivative of one `Setup` in channels; `Renderer` makes colours of them."""

    def __init__(self, setup: Setup) -> None:
        self._setup = setup
        channels = setup.lighting.channels
        x, y, z = setup.shape
        self._support = _core.Support(setup.marked)
        # what no sweep touches is never given memory
        self._medium = _core.zeros((x + 2, y + 2, z + 2, channels + 1))
        self._gradient: Floats | None = None
        self._scratch: Floats | None = None
        self._record: Floats | None = None
        self._rays = _core.Rays(setup.rays.lines, setup.rays.length, setup.rays.planes)
        pixels = setup.rays.length.shape
        self._scattered = np.zeros((*pixels, channels), np.float32)
        self._depth = np.zeros(pixels, np.float32)
        self._phase = _core.Phase(to_eye=setup.to_eye, albedo=setup.medium.albedo, anisotropy=setup.medium.anisotropy)
        self._lights = [self._light(light) for light in setup.lighting.lights]
        if not setup.everywhere:
            mask = np.zeros((x + 2, y + 2, z + 2, 1), np.float32)
            mask[1:-1, 1:-1, 1:-1, 0] = setup.marked
            self._rays.clip(self._support, mask)
        if channels and not setup.shadows:
            _core.shade(self._medium, self._support, self._phase, self._lights)

    def image(self, density: Floats, keep_record: bool) -> tuple[Floats, Floats]:
        """Scattered radiance (rows, columns, channels) and optical depth (rows, columns)."""
        setup = self._setup
        density = np.ascontiguousarray(density, np.float32)
        _core.pack(density, setup.corner, self._support, setup.medium.extinction, self._medium)
        if setup.shadows:
            _core.shade(self._medium, self._support, self._phase, self._lights)
        if keep_record and self._record is None:
            planes = max(setup.shape)
            self._record = _core.zeros((setup.lighting.channels + 1, planes, *self._depth.shape))
        record = self._record if keep_record else None
        _core.march(self._medium, self._support, self._rays, self._scattered, self._depth, record)
        return self._scattered, self._depth

    def gradient(self, of_scattered: Floats, of_transmittance: Floats) -> Floats:
        """Pull derivatives by the last recorded picture back to the density (nx, ny, nz); uses the record up."""
        setup = self._setup
        if self._gradient is None:
            self._gradient = _core.zeros(self._medium.shape)
        _core.march_adjoint(
            self._rays, self._depth, of_scattered, of_transmittance, self._record, self._gradient, self._support
        )
        if setup.shadows:
            if self._scratch is None:
                self._scratch = _core.zeros((*self._medium.shape[:3], 1))
            _core.shade_adjoint(self._medium, self._gradient, self._scratch, self._support, self._phase, self._lights)
        result = _core.zeros(setup.domain.resolution)
        _core.unpack(self._gradient, self._support, setup.medium.extinction, result, setup.corner)
        return result

    def _light(self, light: Parallel | Point) -> _core.ParallelLight | _core.PointLight:
        energy = np.zeros(3)
        energy[: light.energy.size] = light.energy
        if isinstance(light, Point):
            faces = [_core.Face(**vars(face)) for face in light.faces]
            return _core.PointLight(position=light.position, energy=energy, voxel_size=light.voxel_size, faces=faces)
        return _core.ParallelLight(**{**vars(light), "energy": energy})
