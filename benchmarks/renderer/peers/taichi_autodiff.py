# mypy: ignore-errors
# Taichi compiles what stands here; its annotations are no Python types.
"""Taichi's own autodiff, on the processor.

Every sample of every ray has its place in a field: Taichi's derivative of a recurrence inside one kernel is silently
wrong, and right where each value is written once. The light's optical depth is linear in kappa and has its transpose
by hand (``grad_replaced``: the light that travels the other way), without atomics.
"""

import numpy as np
import taichi as ti

from benchmarks.renderer.peers import Iteration
from benchmarks.renderer.sampling import light_table, phase_volume, ray_table
from benchmarks.renderer.scene import BenchScene


def prepare(scene: BenchScene) -> Iteration:
    """Start Taichi and lay out the fields."""
    ti.init(arch=ti.cpu, log_level=ti.ERROR)
    n = scene.domain.resolution[0]
    rays, light = ray_table(scene), light_table(scene)
    ray = {name: _table(getattr(rays, name)) for name in ("pixel", "count", "step", "b", "db", "c", "dc", "plane")}
    axis, travel = _table(rays.axis), _table(rays.travel)
    planes, rows, columns = n, *light.columns
    window, weight = _table(light.window), _table(light.weight)
    phase, target = _table(phase_volume(scene)), _table(scene.target.reshape(-1, 3))
    extinction, light_axis, light_step = scene.medium.extinction, light.axis, light.step
    irradiance, background = ti.Vector(scene.light.irradiance), ti.Vector(scene.background)
    upwards = light.planes.step > 0

    volume = {"shape": (n, n, n), "needs_grad": True}
    density, optical_depth, inscatter = (ti.field(ti.f32, **volume) for _ in range(3))
    slots = ti.field(ti.f32, (n, n + 1, n + 1))
    samples = {"shape": (rays.pixel.size, n + 1), "needs_grad": True}
    x, j, before = (ti.field(ti.f32, **samples) for _ in range(3))
    image = ti.field(ti.f32, (n * n, 3), needs_grad=True)
    loss = ti.field(ti.f32, (), needs_grad=True)

    @ti.func
    def voxel(a: ti.template(), k, p, q):
        index = ti.Vector([k, p, q])
        if ti.static(a == 1):
            index = ti.Vector([p, k, q])
        if ti.static(a == 2):
            index = ti.Vector([p, q, k])
        return index

    @ti.func
    def inside(field: ti.template(), a: ti.template(), k, p, q):
        value = 0.0
        if 0 <= p < n and 0 <= q < n:
            value = field[voxel(a, k, p, q)]
        return value

    @ti.kernel
    def accumulate(field: ti.template(), ascending: ti.i32):
        for row, column in ti.ndrange(rows, columns):
            depth = 0.0
            for s in range(planes):
                k = s if ascending else planes - 1 - s
                p, q = row - window[k, 0], column - window[k, 1]
                if 0 <= p <= n and 0 <= q <= n:
                    f, g = weight[k, 0], weight[k, 1]
                    value = (1 - f) * (
                        (1 - g) * inside(field, light_axis, k, p - 1, q - 1)
                        + g * inside(field, light_axis, k, p - 1, q)
                    ) + f * ((1 - g) * inside(field, light_axis, k, p, q - 1) + g * inside(field, light_axis, k, p, q))
                    slots[k, p, q] = depth + 0.5 * value
                    depth += value

    @ti.kernel
    def spread(result: ti.template(), scale: ti.f32):
        for k, p, q in ti.ndrange(n, n, n):
            f, g = weight[k, 0], weight[k, 1]
            result[voxel(light_axis, k, p, q)] += scale * (
                f * (g * slots[k, p, q] + (1 - g) * slots[k, p, q + 1])
                + (1 - f) * (g * slots[k, p + 1, q] + (1 - g) * slots[k, p + 1, q + 1])
            )

    @ti.ad.grad_replaced
    def shadow():
        optical_depth.fill(0)
        accumulate(density, upwards)
        spread(optical_depth, extinction * light_step)

    @ti.ad.grad_for(shadow)
    def _shadow_adjoint():
        accumulate(optical_depth.grad, not upwards)
        spread(density.grad, extinction * light_step)

    @ti.kernel
    def shade():
        for index in ti.grouped(inscatter):
            inscatter[index] = phase[index] * ti.exp(-optical_depth[index])

    @ti.func
    def cell_value(field: ti.template(), a, k, p, q):
        value = 0.0
        if a == 0:
            value = field[k, p, q]
        elif a == 1:
            value = field[p, k, q]
        else:
            value = field[p, q, k]
        return value

    @ti.kernel
    def sample():
        for r, s in ti.ndrange(rays.pixel.size, n):
            if s < ray["count"][r]:
                a, k = axis[r], ray["plane"][r] + s * travel[r]
                b, c = ray["b"][r] + s * ray["db"][r] - 1, ray["c"][r] + s * ray["dc"][r] - 1
                p, q = ti.floor(b, ti.i32), ti.floor(c, ti.i32)
                f, g = b - p, c - q
                for u, v in ti.static(ti.ndrange(2, 2)):
                    w = (f if u else 1 - f) * (g if v else 1 - g)
                    m, o = ti.min(ti.max(p + u, 0), n - 1), ti.min(ti.max(q + v, 0), n - 1)
                    if m == p + u and o == q + v:
                        x[r, s] += w * extinction * ray["step"][r] * cell_value(density, a, k, m, o)
                    j[r, s] += w * cell_value(inscatter, a, k, m, o)

    @ti.kernel
    def attenuate():
        for r in range(rays.pixel.size):
            for s in range(ray["count"][r]):
                before[r, s + 1] = before[r, s] + x[r, s]

    @ti.kernel
    def gather_light():
        for r in range(rays.pixel.size):
            for s in range(ray["count"][r]):
                radiance = (ti.exp(-before[r, s]) - ti.exp(-before[r, s + 1])) * j[r, s]
                for channel in ti.static(range(3)):
                    image[ray["pixel"][r], channel] += irradiance[channel] * radiance

    @ti.kernel
    def add_background():
        for r in range(rays.pixel.size):
            tau = ti.exp(-before[r, ray["count"][r]])
            for channel in ti.static(range(3)):
                image[ray["pixel"][r], channel] += (tau - 1) * background[channel]

    @ti.kernel
    def compare():
        for pixel, channel in image:
            loss[None] += (image[pixel, channel] + background[channel] - target[pixel, channel]) ** 2

    def run(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        for field in (x, j, image):
            field.fill(0)
        with ti.ad.Tape(loss):
            shadow()
            shade()
            sample()
            attenuate()
            gather_light()
            add_background()
            compare()
        ti.sync()
        return image, density.grad

    def download(image, gradient):
        return image.to_numpy().reshape(n, n, 3) + np.array(scene.background, np.float32), gradient.to_numpy()

    return Iteration(density.from_numpy, run, download)


def _table(values: np.ndarray):
    field = ti.field(ti.i32 if values.dtype == np.int32 else ti.f32, values.shape)
    field.from_numpy(values)
    return field
