"""Mitsuba 3's pictures of the scenes of `agreement`, which starts this module with the Python that has Mitsuba.

    python -m benchmarks.renderer.mitsuba_pictures FOLDER     (with scene.json and fields.npz; writes reference.npz)

Single scattering, integrated by the midpoint rule over Mitsuba's own sensor, emitters, phase function and trilinear
grid, so the pictures carry no noise; the step is halved until nothing changes. `benchmarks.truth.picture --check`
compares such pictures with `volpath`, which shares no integrator with them.
"""

import json
import sys
import time
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from benchmarks.mitsuba_scene import emitter, integral, pixel_rays, surroundings, volume

STEPS = (4, 8, 16)  # a voxel; the last is the reference
ENVIRONMENT_STEPS = 4
DIRECTIONS = ((8, 16), (12, 24), (16, 32))  # Gauss points in z, equal ones in azimuth; the last is the reference


def phase_value(function: Any, towards_eye: Any, towards_light: Any) -> Any:
    """Evaluate Mitsuba's phase function."""
    medium = dr.zeros(mi.MediumInteraction3f, dr.width(towards_eye))
    medium.wi = towards_eye
    medium.sh_frame = mi.Frame3f(towards_eye)
    value, _ = function.eval_pdf(mi.PhaseFunctionContext(None), medium, towards_light)
    return value


@dr.syntax
def march(
    texture: Any, box: Any, ray: Any, step: float, extinctions: list, phases: list, light: Any, shade: Any
) -> Any:
    """March through the smoke, in several media at once.

    Parameters
    ----------
    texture
        The density.
    box
        Where it is.
    ray
        The camera's rays.
    step
        Largest step (m).
    extinctions, phases
        Of the media.
    light
        Of points: direction towards the light, irradiance.
    shade
        Of points and that direction: the integral of density towards the light.

    Returns
    -------
    list
        Radiance for each extinction and phase function, extinctions first, for an albedo of 1.
    list
        Transmittance of the ray for each extinction.
    """
    hit, near, far = box.ray_intersect(ray)
    length = dr.select(hit, far - near, 0.0)
    count = mi.UInt32(dr.ceil(length / step))
    width = length / mi.Float(dr.maximum(count, 1))
    where = dr.zeros(mi.Interaction3f, dr.width(ray))
    radiance = [mi.Color3f(0.0) for _ in extinctions for _ in phases]
    transmittance = [mi.Float(1.0) for _ in extinctions]

    def add_sample(where: Any, radiance: list, transmittance: list) -> tuple[list, list]:
        density = texture.eval_1(where)
        towards, irradiance = light(where)
        shadow = shade(where, towards)
        scattered = [irradiance * phase_value(function, -ray.d, towards) for function in phases]
        passed = [dr.exp(-e * density * width) for e in extinctions]
        lit = [t * (1 - p) * dr.exp(-e * shadow) for t, p, e in zip(transmittance, passed, extinctions, strict=True)]
        arriving = [weight * color for weight in lit for color in scattered]
        brighter = [r + a for r, a in zip(radiance, arriving, strict=True)]
        return brighter, [t * p for t, p in zip(transmittance, passed, strict=True)]

    i = mi.UInt32(0)
    while i < count:
        where.p = ray(near + (mi.Float(i) + 0.5) * width)
        radiance, transmittance = add_sample(where, radiance, transmittance)
        i += 1
    return radiance, transmittance


class Reference:
    """One field of density in the lights and media of a scene.json."""

    def __init__(self, scene: dict[str, Any], field: np.ndarray) -> None:
        self.field = field
        self.camera, self.lights, self.albedo = scene["camera"], scene["lights"], scene["albedo"]
        self.extinctions, self.anisotropies = scene["extinctions"], scene["anisotropies"]
        self.low, self.high = (np.array(scene["domain"][key], float) for key in ("min", "max"))
        self.voxel = float(self.high[0] - self.low[0]) / len(self.field)
        self.texture = mi.load_dict(volume(self.field, self.low, self.high))
        self.box = mi.BoundingBox3f(mi.ScalarPoint3f(self.low), mi.ScalarPoint3f(self.high))
        self.phases = [mi.load_dict({"type": "hg", "g": g}) for g in self.anisotropies]
        self.rays = pixel_rays(self.camera)
        place = mi.ScalarTransform4f().translate((self.low + self.high) / 2).scale((self.high - self.low) / 2)
        self.cube = {"type": "cube", "to_world": place}

    def single(self, light: Any, steps: int) -> tuple[np.ndarray, np.ndarray]:
        """Render one light; every sample on a camera ray marches to it. Radiance and transmittance."""
        step = self.voxel / steps

        def shade(where: Any, towards: Any) -> Any:
            return integral(self.texture, self.box, where.p, towards, step)

        radiance, transmittance = march(
            self.texture, self.box, self.rays, step, self.extinctions, self.phases, light, shade
        )
        width, height = self.camera["size"]
        pictures = np.stack([np.array(picture).T.reshape(height, width, 3) for picture in radiance])
        pictures = pictures.reshape(len(self.extinctions), len(self.anisotropies), height, width, 3)
        return self.albedo * pictures, np.stack([t.numpy().reshape(height, width) for t in transmittance])

    def lit(self, name: str, steps: int) -> tuple[np.ndarray, np.ndarray]:
        """Render a directional or a point light."""
        scene = mi.load_dict({"type": "scene", "domain": self.cube, "light": emitter(self.lights[name])})
        source = scene.emitters()[0]

        def light(where: Any) -> tuple[Any, Any]:
            sample, irradiance = source.sample_direction(where, mi.Point2f(0.5))
            return sample.d, irradiance

        return self.single(light, steps)

    def surrounded(self, directions: tuple[int, int], steps: int) -> np.ndarray:
        """Render the environment by a product rule over the sphere."""
        total: Any = 0.0
        for pair in surroundings(self.lights["environment"], directions):
            total = total + self.single(lambda _, pair=pair: pair, steps)[0]
        return total


def main() -> None:
    """Render every light, and what says how converged that is."""
    folder = Path(sys.argv[1])
    scene = json.loads((folder / "scene.json").read_text())
    fields = np.load(folder / "fields.npz")
    voxels = min(int(name) for name in fields)
    reference = Reference(scene, fields[str(voxels)])
    kept: dict[str, np.ndarray] = {}

    def keep(began: float, **pictures: np.ndarray) -> None:
        kept.update(pictures)
        np.savez_compressed(folder / "reference.npz", **kept)
        print(f"{', '.join(pictures)}: {time.perf_counter() - began:.0f} s", flush=True)

    for name in reference.lights:
        if name != "environment":
            for steps in STEPS:
                began = time.perf_counter()
                picture, transmittance = reference.lit(name, steps)
                keep(began, **{f"{name}/{steps}": picture}, transmittance=transmittance)
    for count in fields:
        began = time.perf_counter()
        steps = max(STEPS) * voxels // int(count)
        keep(began, **{f"grid/{count}": Reference(scene, fields[count]).lit("directional", steps)[0]})
    for directions in DIRECTIONS:
        began = time.perf_counter()
        picture = reference.surrounded(directions, ENVIRONMENT_STEPS)
        keep(began, **{f"environment/{directions[0] * directions[1]}": picture})


if __name__ == "__main__":
    main()
