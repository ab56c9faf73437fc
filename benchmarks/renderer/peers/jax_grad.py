# mypy: ignore-errors
# The framework need not be installed where types are checked.
"""JAX: ``jit`` of ``grad`` on the processor.

Samples are gathered all at once, with cells and weights tabulated; sums along rays and along the light's columns are
``scan``s. Rays are sorted by length and taken in groups, so that few samples of a group's rectangle lie outside. The
light's optical depth is linear in kappa and has its transpose by hand (the light that travels the other way), so that
nothing of its scan is stored. Tables are arguments: as constants they would be folded for half a minute.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from numpy.typing import NDArray

from benchmarks.renderer.peers import Iteration
from benchmarks.renderer.sampling import RayTable, light_table, phase_volume, ray_table
from benchmarks.renderer.scene import BenchScene

Array = jax.Array


GROUPS = 8


class _Group(NamedTuple):
    """Some rays: cell and weights of their samples (samples, rays); step, strides and pixel of the rays."""

    cell: Array
    f: Array
    g: Array
    step: Array
    across: Array
    down: Array
    pixel: Array


class _Tables(NamedTuple):
    """Rays; weight and window of every plane of the light; phase function; target."""

    groups: tuple[_Group, ...]
    weight: Array
    window: Array
    phase: Array
    target: Array


def prepare(scene: BenchScene) -> Iteration:
    """Tabulate cells and weights of the samples."""
    n = scene.domain.resolution[0]
    light = light_table(scene)
    tables = _tables(scene)
    irradiance, background = jnp.array(scene.light.irradiance), jnp.array(scene.background)

    def sweep(field: Array, weight: Array, window: Array, reverse: bool) -> Array:
        f, g = weight[:, 0, None, None], weight[:, 1, None, None]
        values = _blend(jnp.pad(jnp.moveaxis(field, light.axis, 0), ((0, 0), (1, 1), (1, 1))), 1 - f, 1 - g)

        def plane(before: Array, at: tuple[Array, Array]) -> tuple[Array, Array]:
            value, corner = at
            passing = lax.dynamic_slice(before, corner, value.shape)
            return lax.dynamic_update_slice(before, passing + value, corner), passing + 0.5 * value

        _, slots = lax.scan(plane, jnp.zeros(light.columns), (values, window), reverse=reverse)
        return light.step * jnp.moveaxis(_blend(slots, f, g), 0, light.axis)

    upwards = light.planes.step > 0
    optical_depth = jax.custom_vjp(partial(sweep, reverse=not upwards))
    optical_depth.defvjp(
        lambda kappa, *columns: (optical_depth(kappa, *columns), columns),
        lambda columns, gradient: (sweep(gradient, *columns, reverse=upwards), None, None),
    )

    def render(density: Array, t: _Tables) -> Array:
        kappa = scene.medium.extinction * density
        inscatter = t.phase * jnp.exp(-optical_depth(kappa, t.weight, t.window))

        kappa, inscatter = jnp.pad(kappa, 1).ravel(), jnp.pad(inscatter, 1, mode="edge").ravel()
        image = jnp.broadcast_to(background, (n * n, 3))
        for group in t.groups:
            scattered, tau = _march(kappa, inscatter, group)
            colours = scattered[:, None] * irradiance + tau[:, None] * background
            image = image.at[group.pixel].set(colours, unique_indices=True)
        return image.reshape(n, n, 3)

    @partial(jax.grad, has_aux=True)
    def derivative(density: Array, t: _Tables) -> tuple[Array, Array]:
        image = render(density, t)
        return jnp.square(image - t.target).sum(), image

    compiled = jax.jit(derivative)

    def run(density: Array) -> tuple[Array, Array]:
        gradient, image = jax.block_until_ready(compiled(density, tables))
        return image, gradient

    return Iteration(jnp.asarray, run, lambda image, gradient: (np.asarray(image), np.asarray(gradient)))


def _march(kappa: Array, inscatter: Array, t: _Group) -> tuple[Array, Array]:
    """Scattered radiance and transmittance of a group's rays through padded, flattened volumes."""

    def interpolate(volume: Array) -> Array:
        def corner(offset: Array | int) -> Array:
            return volume.at[t.cell + offset].get(mode="promise_in_bounds")

        return (1 - t.f) * ((1 - t.g) * corner(0) + t.g * corner(t.down)) + t.f * (
            (1 - t.g) * corner(t.across) + t.g * corner(t.across + t.down)
        )

    def step(state: tuple[Array, Array], sample: tuple[Array, Array]) -> tuple[tuple[Array, Array], None]:
        scattered, tau = state
        x, j = sample
        opacity = -jnp.expm1(-x)
        return (scattered + tau * opacity * j, tau * (1 - opacity)), None

    start = jnp.zeros(t.step.shape), jnp.ones(t.step.shape)
    return lax.scan(step, start, (t.step * interpolate(kappa), interpolate(inscatter)))[0]


def _tables(scene: BenchScene) -> _Tables:
    rays, light = ray_table(scene), light_table(scene)
    groups = np.array_split(np.argsort(rays.count, kind="stable"), GROUPS)
    columns = (light.weight, light.window, phase_volume(scene), scene.target)
    return _Tables(tuple(_group(rays, some) for some in groups), *map(jnp.array, columns))


def _group(rays: RayTable, some: NDArray[np.intp]) -> _Group:
    step, across, down, pixel = (a[some] for a in (rays.step, rays.across, rays.down, rays.pixel))
    s = np.arange(rays.count[some].max())[:, None]
    inside = s < rays.count[some]
    b, c = rays.b[some] + s * rays.db[some], rays.c[some] + s * rays.dc[some]
    i, j = b.astype(np.int32), c.astype(np.int32)
    cell = rays.first[some] + s * rays.next[some] + i * across + j * down
    # samples that do not exist lie in the border's first cell, where kappa is zero
    samples = np.where(inside, cell, 0).astype(np.int32), np.where(inside, b - i, 0), np.where(inside, c - j, 0)
    return _Group(*map(jnp.array, (*samples, step, across, down, pixel)))


def _blend(planes: Array, f: Array, g: Array) -> Array:
    """Weigh every 2 x 2 cell of every plane; f and g belong to the lower index."""
    across = f * planes[:, :-1] + (1 - f) * planes[:, 1:]
    return g * across[..., :-1] + (1 - g) * across[..., 1:]
