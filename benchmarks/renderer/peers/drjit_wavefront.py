# mypy: ignore-errors
# The framework need not be installed where types are checked.
"""Dr.Jit as it is meant to be used: a wavefront of all samples, and ``dr.backward``.

Running sums along columns and rays are ``block_prefix_sum``s, one block each, so columns are as long as the grid and
partly outside of it.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import drjit as dr
import numpy as np
from drjit.llvm.ad import Array2f, Float, Int32, UInt32

from benchmarks.renderer.peers import Iteration
from benchmarks.renderer.peers.drjit_loops import to_arrays, without_atomics
from benchmarks.renderer.sampling import light_table, phase_volume, ray_table
from benchmarks.renderer.scene import BenchScene
from smokelift.render.camera_rays import LATERAL


def prepare(scene: BenchScene) -> Iteration:
    """Upload the tables."""
    n = scene.domain.resolution[0]
    padded = n + 2
    extinction = scene.medium.extinction
    rays, light = ray_table(scene), light_table(scene)
    names = ("count", "step", "b", "db", "c", "dc", "first", "next", "across", "down")
    tables = {name: (Int32 if getattr(rays, name).dtype == np.int32 else Float)(getattr(rays, name)) for name in names}
    phase = Float(phase_volume(scene).ravel())
    window = [Int32(np.ascontiguousarray(a)) for a in light.window.T]
    weight = [Float(np.ascontiguousarray(a)) for a in light.weight.T]
    target = [Float(np.ascontiguousarray(scene.target.reshape(-1, 3)[rays.pixel, channel])) for channel in range(3)]
    colours = list(zip(scene.light.irradiance, scene.background, target, strict=True))
    mode = without_atomics()
    axes = (light.axis, *LATERAL[light.axis])
    stride = (padded * padded, padded, 1)
    columns = light.columns[1]

    def blend(corners: list[Any], f: Any, g: Any) -> Any:
        """Corners 00, 01, 10, 11; f and g belong to the lower index."""
        return f * (g * corners[0] + (1 - g) * corners[1]) + (1 - f) * (g * corners[2] + (1 - g) * corners[3])

    def in_order(s: Any) -> Any:
        return s if light.planes.step > 0 else n - 1 - s

    def shadow(kappa: Any) -> Any:
        """Optical depth from the light to the voxels."""
        lane = dr.arange(Int32, light.columns[0] * columns * n)
        column = lane // n
        k = in_order(lane - column * n)
        row = column // columns
        i, j = row - dr.gather(Int32, window[0], k), column - row * columns - dr.gather(Int32, window[1], k)
        inside = (i >= 0) & (i <= n) & (j >= 0) & (j <= n)
        along, across, down = (stride[a] for a in axes)
        cell = (k + 1) * along + i * across + j * down
        corners = [
            dr.gather(Float, kappa, cell + offset, inside, mode=mode) for offset in (0, down, across, across + down)
        ]
        value = blend(corners, *(1 - dr.gather(Float, w, k) for w in weight))
        depth = dr.block_prefix_sum(value, n, exclusive=True) + 0.5 * value
        dr.eval(depth)
        k, i, j = (_unravel(n)[a] for a in axes)
        i, j = i + dr.gather(Int32, window[0], k), j + dr.gather(Int32, window[1], k)
        slot = (i * columns + j) * n + in_order(k)
        corners = [dr.gather(Float, depth, slot + offset * n, mode=mode) for offset in (0, 1, columns, columns + 1)]
        return light.step * blend(corners, *(dr.gather(Float, w, k) for w in weight))

    def render(density: Any) -> list[Any]:
        cell = _unravel(padded)
        nearest = [dr.clip(a - 1, 0, n - 1) for a in cell]
        inside = (cell[0] == nearest[0] + 1) & (cell[1] == nearest[1] + 1) & (cell[2] == nearest[2] + 1)
        voxel = (nearest[0] * n + nearest[1]) * n + nearest[2]
        kappa = extinction * dr.gather(Float, density, voxel, inside, mode=dr.ReduceMode.NoConflicts)
        dr.eval(kappa)
        inscatter = phase * dr.exp(-shadow(kappa))
        dr.eval(inscatter)
        medium, pair = dr.zeros(Float, 2 * padded**3), 2 * dr.arange(UInt32, padded**3)
        dr.scatter(medium, kappa, pair)
        dr.scatter(medium, dr.gather(Float, inscatter, voxel, mode=mode), pair + 1)
        dr.eval(medium)

        lane = dr.arange(Int32, len(rays.pixel) * n)
        ray = lane // n
        s = lane - ray * n
        at = {name: dr.gather(type(table), table, ray) for name, table in tables.items()}
        b, c = dr.fma(s, at["db"], at["b"]), dr.fma(s, at["dc"], at["c"])
        i, j = Int32(b), Int32(c)
        first = at["first"] + s * at["next"] + i * at["across"] + j * at["down"]
        offsets = (0, at["down"], at["across"], at["across"] + at["down"])
        corners = [dr.gather(Array2f, medium, first + offset, s < at["count"], mode=mode) for offset in offsets]
        sample, glow = blend(corners, 1 - (b - i), 1 - (c - j))
        x = sample * at["step"]
        dr.eval(x, glow)
        before = dr.block_prefix_sum(x, n, exclusive=True)
        scattered = dr.block_sum(dr.exp(-before) * (1 - dr.exp(-x)) * glow, n)
        transmittance = dr.exp(-dr.block_sum(x, n))
        return [irradiance * scattered + behind * transmittance for irradiance, behind, _ in colours]

    def run(density: Any) -> tuple[Any, Any]:
        density = Float(density)
        dr.enable_grad(density)
        image = render(density)
        dr.backward(sum(dr.sum(dr.square(i - wanted)) for i, (_, _, wanted) in zip(image, colours, strict=True)))
        gradient = dr.grad(density)
        dr.eval(image, gradient)
        dr.sync_thread()
        return dr.detach(image), gradient

    return Iteration(lambda density: Float(density.ravel()), run, partial(to_arrays, scene, rays))


def _unravel(n: int) -> list[Any]:
    """Return x, y, z of every cell of a cube, in the types of this module."""
    cell = dr.arange(UInt32, n**3)
    row = cell // n
    x = row // n
    return [Int32(x), Int32(row - x * n), Int32(cell - row * n)]
