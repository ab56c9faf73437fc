# mypy: ignore-errors
# The framework need not be installed where types are checked.
"""PyTorch autograd on the processor.

All samples of one dominant axis are one two-dimensional ``grid_sample`` with the planes as its batch: that is
vectorised, and its derivative runs over the batch in parallel without atomics, several times as fast as indexing. The
light's optical depth is linear in kappa, so it is one function with a derivative by hand (the light that travels the
other way), plane after plane in the cache. ``torch.compile`` is not used: it wants a C++ compiler where it runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch.nn.functional import grid_sample, pad

from benchmarks.renderer.peers import Iteration
from benchmarks.renderer.sampling import LightTable, RayTable, light_table, phase_volume, ray_table
from benchmarks.renderer.scene import BenchScene

Tensor = torch.Tensor


class _OpticalDepth(torch.autograd.Function):
    """S^T K S kappa."""

    @staticmethod
    def forward(ctx: Any, kappa: Tensor, table: LightTable) -> Tensor:
        ctx.table = table
        return _sweep(kappa, table, table.planes)

    @staticmethod
    def backward(ctx: Any, *gradient: Tensor) -> tuple[Tensor, None]:
        return _sweep(gradient[0], ctx.table, ctx.table.planes[::-1]), None


def _sweep(field: Tensor, table: LightTable, planes: range) -> Tensor:
    values = pad(field.movedim(table.axis, 0), (1, 1, 1, 1))
    rows, columns = (n - 1 for n in values.shape[1:])
    result = torch.empty((values.shape[0], rows - 1, columns - 1))
    before = torch.zeros(table.columns)
    for k in planes:
        (f, g), (i, j) = table.weight[k].tolist(), table.window[k]
        passing = before[i : i + rows, j : j + columns]
        value = _blend(values[k], 1 - f, 1 - g)
        torch.mul(_blend(passing.add_(value, alpha=0.5), f, g), table.step, out=result[k])
        passing.add_(value, alpha=0.5)
    return result.movedim(0, table.axis)


def _blend(plane: Tensor, f: float, g: float) -> Tensor:
    """Weigh every 2 x 2 cell; f and g belong to the lower index."""
    across = torch.lerp(plane[1:], plane[:-1], f)
    return torch.lerp(across[:, 1:], across[:, :-1], g)


@dataclass(frozen=True, eq=False)
class _Bundle:
    """Rays of one dominant axis and direction of travel.

    ``grid`` (planes, 1, rays, 2) are positions of ``grid_sample``, far outside where a ray has no sample.
    """

    axis: int
    travel: int
    pixel: Tensor
    length: Tensor
    grid: Tensor


def _bundle(rays: RayTable, axis: int, travel: int, n: int) -> _Bundle:
    mine = (rays.axis == axis) & (rays.travel == travel)
    s = (np.arange(n)[:, None] - rays.plane[mine]) * travel
    inside = (s >= 0) & (s < rays.count[mine])
    at = np.stack([rays.c[mine] + s * rays.dc[mine], rays.b[mine] + s * rays.db[mine]], -1) - 1
    grid = np.where(inside[..., None], at * (2 / (n - 1)) - 1, -3)
    return _Bundle(
        axis,
        travel,
        torch.from_numpy(rays.pixel[mine].astype(np.int64)),
        torch.from_numpy(rays.step[mine]),
        torch.from_numpy(grid[:, None].astype(np.float32)),
    )


def prepare(scene: BenchScene) -> Iteration:
    """Tabulate positions for ``grid_sample``, of 0.6 n^3 samples."""
    n = scene.domain.resolution[0]
    rays, light = ray_table(scene), light_table(scene)
    directions = np.unique(np.stack([rays.axis, rays.travel]), axis=1).T.tolist()
    bundles = [_bundle(rays, axis, travel, n) for axis, travel in directions]
    phase = torch.from_numpy(phase_volume(scene))
    irradiance, background = torch.tensor(scene.light.irradiance), torch.tensor(scene.background)
    target = torch.from_numpy(scene.target)

    def render(density: Tensor) -> Tensor:
        kappa = scene.medium.extinction * density
        inscatter = phase * torch.exp(-_OpticalDepth.apply(kappa, light))
        scattered, transmittance = torch.zeros(n * n), torch.ones(n * n)
        for bundle in bundles:
            k_planes, j_planes = (field.movedim(bundle.axis, 0)[:, None] for field in (kappa, inscatter))
            x = grid_sample(k_planes, bundle.grid, align_corners=True)[:, 0, 0] * bundle.length
            j = grid_sample(j_planes, bundle.grid, padding_mode="border", align_corners=True)[:, 0, 0]
            after = torch.cumsum(x, 0)
            total = after[-1]
            if bundle.travel < 0:
                after = total - after + x
            tau = torch.exp(-after)
            # opacity times the transmittance before a sample, which is exp(x) times that after it
            scattered = scattered.index_put((bundle.pixel,), (torch.expm1(x) * tau * j).sum(0))
            transmittance = transmittance.index_put((bundle.pixel,), torch.exp(-total))
        return scattered.view(n, n, 1) * irradiance + transmittance.view(n, n, 1) * background

    def run(density: Tensor) -> tuple[Tensor, Tensor]:
        density.grad = None
        image = render(density)
        (image - target).square().sum().backward()
        assert density.grad is not None
        return image.detach(), density.grad

    return Iteration(
        upload=lambda density: torch.from_numpy(density.copy()).requires_grad_(),
        run=run,
        download=lambda image, gradient: (image.numpy(), gradient.numpy()),
    )
