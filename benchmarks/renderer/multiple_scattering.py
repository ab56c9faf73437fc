"""How far single and multiple scattering are from a path tracer, for given densities.

    python -m benchmarks.renderer.multiple_scattering REFERENCE.npz

REFERENCE is made by `benchmarks.renderer.multiple_reference`. The table has the relative root mean square error where
the smoke covers more than 1 %, in %, and the difference of the mean in brackets. The product of the differences from
the reference's two pictures keeps noise out of the error; it is negative where no more than noise is left.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from smokelift.render import Renderer
from smokelift.scene import Camera, DirectionalLight, Domain, Medium, Scattering

DIRECTIONS = {
    "front": (0.0, 0.819152, -0.573576),
    "side": (-0.819152, 0.0, -0.573576),
    "back": (0.0, -0.819152, -0.573576),
}
"""Directions of travel, as the reference has them."""

DISTANCE, FOV = 7.0, 30.0
IRRADIANCE = 2 * math.pi
MODELS: tuple[Scattering, ...] = ("single", "multiple")


def errors(pictures: npt.NDArray[np.float32], setting: str, density: npt.NDArray[np.float32], voxel: float) -> str:
    """Return the cells of a setting's row, one for each of `MODELS`; pictures are (2, rows, columns)."""
    albedo, depth, light = setting.split()
    x, y, z = density.shape
    width, length, height = (float(n * voxel) for n in density.shape)
    domain = Domain((-width / 2, -length / 2, 0.0), (width / 2, length / 2, height), (x, y, z))
    middle = height / 2
    camera = Camera.look_at(
        (0.0, -DISTANCE, middle), (0.0, 0.0, middle), up=(0.0, 0.0, 1.0), fov_y_degrees=FOV, size=(x, z)
    )
    medium = Medium(float(depth) / (float(density.sum(1).max()) * voxel), float(albedo))
    sun = DirectionalLight(DIRECTIONS[light], (IRRADIANCE, IRRADIANCE, IRRADIANCE))
    cells = []
    for model in MODELS:
        renderer = Renderer(camera, domain, medium, (sun,), np.zeros(3, np.float32), model)
        image = renderer.image(density)[..., 0]
        smoky = renderer.transmittance < 0.99
        one, other, ours = pictures[0][smoky], pictures[1][smoky], image[smoky]
        square = float(np.mean((ours - one) * (ours - other)) / np.mean(one * other))
        bias = float(ours.mean() / pictures[:, smoky].mean()) - 1
        cells.append(f"{100 * math.copysign(math.sqrt(abs(square)), square):.1f} ({100 * bias:+.1f})")
    return " | ".join(cells)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("reference", type=Path)
    options = parser.parse_args()
    print("| albedo | depth | light |", " | ".join(MODELS), "|\n|---|---|---|---|---|")
    with np.load(options.reference) as file:
        density, voxel = file["density"], float(file["voxel_size"])
        for setting in (name for name in file.files if " " in name):
            print(f"| {' | '.join(setting.split())} | {errors(file[setting], setting, density, voxel)} |", flush=True)


if __name__ == "__main__":
    main()
