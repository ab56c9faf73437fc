# mypy: ignore-errors
# The framework need not be installed where types are checked.
"""Dr.Jit with the adjoint by hand, the fastest exact way in it.

A symbolic loop runs per light column, per ray and back along the ray, one lane each, without records. (kappa, J) lie
side by side and are gathered and scattered as packets. ``ReduceMode.Expand`` gives every thread a gradient of its own,
so there are no atomics. Nothing skips empty space.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import drjit as dr
import numpy as np
from drjit.llvm import Array2f, Float, Int32, UInt32

from benchmarks.renderer.peers import Iteration
from benchmarks.renderer.reference import phase_volume
from benchmarks.renderer.sampling import LightTable, RayTable, light_table, ray_table
from benchmarks.renderer.scene import BenchScene
from smokelift.scene.domain import LATERAL


def without_atomics() -> Any:
    """Return how to add up derivatives: in a copy a thread, unless the copies cost more than atomics."""
    return dr.ReduceMode.Expand if dr.thread_count() <= 4 else dr.ReduceMode.Local


def prepare(scene: BenchScene) -> Iteration:
    """Upload the tables."""
    n = scene.domain.resolution[0]
    padded = n + 2
    extinction = scene.medium.extinction
    rays, columns = ray_table(scene), _Columns(light_table(scene), n)
    count, length = Int32(rays.count), Float(rays.step)
    b, db, c, dc = (Float(a) for a in (rays.b, rays.db, rays.c, rays.dc))
    first, following, across, down = (Int32(a) for a in (rays.first, rays.next, rays.across, rays.down))
    phase = Float(phase_volume(scene).astype(np.float32).ravel())
    target = [Float(np.ascontiguousarray(scene.target.reshape(-1, 3)[rays.pixel, channel])) for channel in range(3)]
    colors = list(zip(scene.light.irradiance, scene.background, target, strict=True))
    mode = without_atomics()
    cells = np.arange(padded**3, dtype=np.int32).reshape((padded,) * 3)
    nearest = np.pad(cells[1:-1, 1:-1, 1:-1], 1, mode="edge")
    border, beside = (Int32(a[nearest != cells]) for a in (cells, nearest))

    def in_padded() -> tuple[list[Any], Any]:
        """The nearest voxel of every padded cell, and which cells are voxels."""
        cell = _unravel(padded)
        voxel = [dr.clip(a - 1, 0, n - 1) for a in cell]
        return voxel, (cell[0] == voxel[0] + 1) & (cell[1] == voxel[1] + 1) & (cell[2] == voxel[2] + 1)

    def position(s: Any) -> tuple[Any, Any, Any]:
        at_b, at_c = dr.fma(s, db, b), dr.fma(s, dc, c)
        i, j = Int32(at_b), Int32(at_c)
        return first + s * following + i * across + j * down, at_b - i, at_c - j

    def interpolate(medium: Any, cell: Any, f: Any, g: Any) -> Any:
        def corner(offset: Any) -> Any:
            return dr.gather(Array2f, medium, cell + offset)

        return (1 - f) * ((1 - g) * corner(0) + g * corner(down)) + f * (
            (1 - g) * corner(across) + g * corner(across + down)
        )

    def light(density: Any) -> Any:
        voxel, inside = in_padded()
        kappa = extinction * dr.gather(Float, density, _flat(voxel, n), inside)
        dr.eval(kappa)
        slots = columns.accumulate(kappa, reverse=False)
        voxel, _ = in_padded()
        inscatter = dr.gather(Float, phase, _flat(voxel, n)) * dr.exp(-columns.at_voxels(slots, voxel))
        medium = dr.empty(Float, 2 * padded**3)
        dr.scatter(medium, Array2f(kappa, inscatter), dr.arange(UInt32, padded**3))
        dr.eval(medium)
        return medium

    def march(medium: Any) -> tuple[Any, Any]:
        def step(s: Any, depth: Any, radiance: Any) -> tuple[Any, Any, Any]:
            kappa, inscatter = interpolate(medium, *position(s))
            behind = depth + kappa * length
            return s + 1, behind, radiance + (dr.exp(-depth) - dr.exp(-behind)) * inscatter

        start = dr.zeros(Int32, len(count)), dr.zeros(Float, len(count)), dr.zeros(Float, len(count))
        _, depth, radiance = dr.while_loop(start, lambda s, *_: s < count, step)
        return depth, radiance

    def march_back(medium: Any, depth: Any, of_scattered: Any, of_transmittance: Any) -> Any:
        gradient = dr.zeros(Float, 2 * padded**3)

        def step(s: Any, depth: Any, behind: Any) -> tuple[Any, Any, Any]:
            cell, f, g = position(s)
            kappa, inscatter = interpolate(medium, cell, f, g)
            x = kappa * length
            depth = dr.maximum(depth - x, 0)
            tau, passed = dr.exp(-depth), dr.exp(-x)
            glow = of_scattered * inscatter
            of_sample = Array2f(length * tau * passed * (glow - behind), tau * (1 - passed) * of_scattered)
            for weight, offset in (
                ((1 - f) * (1 - g), 0),
                ((1 - f) * g, down),
                (f * (1 - g), across),
                (f * g, across + down),
            ):
                dr.scatter_add(gradient, of_sample * weight, cell + offset, mode=mode)
            return s - 1, depth, (1 - passed) * glow + passed * behind

        dr.while_loop((count - 1, depth, of_transmittance), lambda s, *_: s >= 0, step)
        dr.eval(gradient)
        dr.scatter_add(gradient, dr.gather(Float, gradient, 2 * border + 1), 2 * beside + 1)
        return gradient

    def shadow(medium: Any, gradient: Any) -> Any:
        cell = 2 * dr.arange(UInt32, padded**3) + 1
        _, inside = in_padded()
        of_depth = dr.select(inside, -dr.gather(Float, medium, cell) * dr.gather(Float, gradient, cell), 0)
        dr.eval(of_depth)
        slots = columns.accumulate(of_depth, reverse=True)
        voxel = _unravel(n)
        direct = dr.gather(Float, gradient, 2 * _flat([a + 1 for a in voxel], padded))
        return extinction * (direct + columns.at_voxels(slots, voxel))

    def run(density: Any) -> tuple[Any, Any]:
        medium = light(density)
        depth, scattered = march(medium)
        tau = dr.exp(-depth)
        image = [irradiance * scattered + behind * tau for irradiance, behind, _ in colors]
        of_image = [2 * (value - wanted) for value, (_, _, wanted) in zip(image, colors, strict=True)]
        of_scattered = sum(of * irradiance for of, (irradiance, _, _) in zip(of_image, colors, strict=True))
        of_transmittance = sum(of * behind for of, (_, behind, _) in zip(of_image, colors, strict=True))
        dr.eval(image, depth, of_scattered, of_transmittance)
        gradient = shadow(medium, march_back(medium, depth, of_scattered, of_transmittance))
        dr.eval(gradient)
        dr.sync_thread()
        return image, gradient

    return Iteration(lambda density: Float(density.ravel()), run, partial(to_arrays, scene, rays))


def to_arrays(scene: BenchScene, rays: RayTable, image: Any, gradient: Any) -> tuple[Any, Any]:
    """Return the image (n, n, 3) of the rays' channels, and the gradient (n, n, n)."""
    n = scene.domain.resolution[0]
    picture = np.full((n * n, 3), scene.background, np.float32)
    picture[rays.pixel] = np.stack([np.array(channel) for channel in image], -1)
    return picture.reshape(n, n, 3), np.array(gradient).reshape((n,) * 3)


def _unravel(n: int) -> list[Any]:
    """Return x, y, z of every cell of a cube."""
    cell = dr.arange(UInt32, n**3)
    row = cell // n
    x = row // n
    return [Int32(x), Int32(row - x * n), Int32(cell - row * n)]


def _flat(voxel: list[Any], n: int) -> Any:
    return (voxel[0] * n + voxel[1]) * n + voxel[2]


class _Columns:
    """The light's columns; slots lie as the voxels do, so that a lane of a column reads along the grid's lines."""

    def __init__(self, table: LightTable, n: int) -> None:
        self._axes = (table.axis, *LATERAL[table.axis])
        self._upwards = table.planes.step > 0
        self._step = table.step
        self._window = [Int32(np.ascontiguousarray(a)) for a in table.window.T]
        self._weight = [Float(np.ascontiguousarray(a)) for a in table.weight.T]
        i, j = np.meshgrid(*map(np.arange, table.columns), indexing="ij")
        low, high = np.full(i.shape, n), np.full(i.shape, -1)
        for k, (p, q) in enumerate(table.window.tolist()):
            passed = (slice(p, p + n + 1), slice(q, q + n + 1))
            low[passed] = np.minimum(low[passed], k)
            high[passed] = k
        used = low <= high
        self._i, self._j, self._low, self._high = (Int32(a[used].astype(np.int32)) for a in (i, j, low, high))
        shape = [n + 1] * 3
        shape[table.axis] = n
        self._size = int(np.prod(shape))
        self._stride = _strides(shape)
        self._padded_stride = _strides([n + 2] * 3)

    def accumulate(self, field: Any, reverse: bool) -> Any:
        """K S of a padded field, per unit of length, at the slots."""
        along, across, down = (self._padded_stride[a] for a in self._axes)
        slots = dr.empty(Float, self._size)
        count = self._high - self._low

        def step(s: Any, before: Any) -> tuple[Any, Any]:
            k = self._low + s if self._upwards != reverse else self._high - s
            f, g = (dr.gather(Float, weight, k) for weight in self._weight)
            i, j = (a - dr.gather(Int32, window, k) for a, window in zip((self._i, self._j), self._window, strict=True))
            cell = (k + 1) * along + i * across + j * down

            def corner(offset: int) -> Any:
                return dr.gather(Float, field, cell + offset)

            value = (1 - f) * ((1 - g) * corner(0) + g * corner(down)) + f * (
                (1 - g) * corner(across) + g * corner(across + down)
            )
            dr.scatter(
                slots,
                before + 0.5 * value,
                sum(x * self._stride[a] for x, a in zip((k, i, j), self._axes, strict=True)),
            )
            return s + 1, before + value

        dr.while_loop((dr.zeros(Int32, len(count)), dr.zeros(Float, len(count))), lambda s, _: s <= count, step)
        dr.eval(slots)
        return slots

    def at_voxels(self, slots: Any, voxel: list[Any]) -> Any:
        """S^T of slots, times the length of the light's step."""
        k, i, j = (voxel[a] for a in self._axes)
        f, g = (dr.gather(Float, weight, k) for weight in self._weight)
        along, across, down = (self._stride[a] for a in self._axes)
        cell = k * along + i * across + j * down

        def corner(offset: int) -> Any:
            return dr.gather(Float, slots, cell + offset)

        return self._step * (
            f * (g * corner(0) + (1 - g) * corner(down))
            + (1 - f) * (g * corner(across) + (1 - g) * corner(across + down))
        )


def _strides(shape: list[int]) -> tuple[int, int, int]:
    return shape[1] * shape[2], shape[2], 1
