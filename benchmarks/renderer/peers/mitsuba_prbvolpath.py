# mypy: ignore-errors
# The framework need not be installed where types are checked.
"""Mitsuba 3's path replay backpropagation: an estimate of the integral that the others sum up deterministically.

It answers another question with random numbers: its image and gradient come with noise, and the gradient by extinction
is slightly biased (its issue 678); that is what the table's errors are. A background would light the smoke too, so the
smoke stands before black here and is compared with the reference that stands there as well.
"""

from __future__ import annotations

import itertools
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from benchmarks.mitsuba_scene import emitter, sensor, smoke
from benchmarks.renderer.peers import Iteration
from benchmarks.renderer.scene import BenchScene
from smokelift.scene import Camera

mi.set_variant("llvm_ad_mono")


class _Middles:
    """A sampler that puts every sample in the middle of its pixel."""

    def __init__(self, sampler: Any) -> None:
        self.sample_count = sampler.sample_count

    def next_2d(self) -> Any:
        return mi.Point2f(0.5)


class _ThroughMiddles(mi.ad.integrators.prbvolpath.PRBVolpathIntegrator):
    """An integrator of everybody's rays: averaged over the pixels' areas, voxels would have quite other gradients."""

    def sample_rays(self, scene: Any, sensor: Any, sampler: Any) -> Any:
        return super().sample_rays(scene, sensor, _Middles(sampler))


mi.register_integrator("through_middles", _ThroughMiddles)

_GRID = "smoke.interior_medium.sigma_t.data"


def prepare(scene: BenchScene, samples: int) -> Iteration:
    """Build the scene, with a light of irradiance one; colors come in the last line."""
    n = scene.domain.resolution[0]
    mitsuba_scene = mi.load_dict(_description(scene))
    params = mi.traverse(mitsuba_scene)
    target = [mi.Float(np.ascontiguousarray(scene.target[..., c]).ravel()) for c in range(3)]
    seeds = itertools.count()

    def run(density: Any) -> tuple[Any, Any]:
        params[_GRID] = mi.TensorXf(density)
        dr.enable_grad(params[_GRID])
        params.update()
        seed = next(seeds)
        scattered = mi.render(mitsuba_scene, params, spp=samples, seed=2 * seed, seed_grad=2 * seed + 1).array
        differences = [irradiance * scattered - t for irradiance, t in zip(scene.light.irradiance, target, strict=True)]
        dr.backward(sum(dr.sum(dr.square(d)) for d in differences))
        gradient = dr.grad(params[_GRID])
        dr.eval(scattered, gradient)
        dr.sync_thread()
        return dr.detach(scattered), gradient

    def download(scattered: Any, gradient: Any) -> tuple[Any, Any]:
        image = np.array(scattered).reshape(n, n, 1) * np.array(scene.light.irradiance, np.float32)
        return image, _turned(np.array(gradient)[..., 0])

    return Iteration(lambda density: mi.TensorXf(_turned(density)[..., None]), run, download)


def _turned(volume: Any) -> Any:
    """Mitsuba's grids are [z, y, x]."""
    return np.ascontiguousarray(volume.transpose())


def _description(scene: BenchScene) -> dict[str, Any]:
    camera, (low, high) = scene.camera, (np.array(side, float) for side in (scene.domain.min, scene.domain.max))
    seen = sensor({"size": camera.size, "matrix": camera.matrix, "fov_y_degrees": _degrees(camera)})
    seen["film"]["pixel_format"] = "luminance"
    medium = {"extinction": scene.medium.extinction, "albedo": scene.medium.albedo}
    return {
        "type": "scene",
        "integrator": {"type": "through_middles", "max_depth": 2, "rr_depth": 100},
        "sensor": seen | {"sampler": {"type": "independent"}},
        "light": emitter({"type": "directional", "direction": list(scene.light.direction), "irradiance": 1.0}),
        "smoke": smoke(scene.density, low, high, medium, {"type": "hg", "g": scene.medium.anisotropy}),
    }


def _degrees(camera: Camera) -> float:
    return float(2 * np.degrees(np.arctan(0.5 * camera.size[1] / camera.fy)))
