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

from benchmarks.mitsuba_scene import emitter, integral, march, pixel_rays, surroundings, volume

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
        """Render one light in every medium; each sample on a camera ray marches to it. Radiance and transmittance."""
        step = self.voxel / steps
        width, height = self.camera["size"]

        def picture(extinction: float, function: Any) -> tuple[np.ndarray, np.ndarray]:
            def scattered(where: Any) -> Any:
                towards, irradiance = light(where)
                shadow = integral(self.texture, self.box, where.p, towards, step)
                return irradiance * phase_value(function, -self.rays.d, towards) * dr.exp(-extinction * shadow)

            radiance, transmittance = march(self.texture, scattered, self.box, self.rays, step, extinction)
            return np.array(radiance).T.reshape(height, width, 3), transmittance.numpy().reshape(height, width)

        views = [[picture(extinction, function) for function in self.phases] for extinction in self.extinctions]
        pictures = np.array([[radiance for radiance, _ in row] for row in views])
        return self.albedo * pictures, np.array([row[0][1] for row in views])

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
