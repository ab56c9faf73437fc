"""How well the renderer's pictures agree with Mitsuba 3's, as the grid is refined: the tables of docs/renderer.md.

    python -m benchmarks.renderer.agreement --mitsuba /path/to/python [--folder KEPT]

One field of density, trilinear between the centers of 32^3 voxels, structured down to two, is the truth. Mitsuba
renders it as it is (`mitsuba_pictures`, in a process of its own, since Mitsuba need not live in the same environment);
we sample it onto finer grids, and a step shrinks with the voxel. All figures are relative L2 differences in percent.
Optical depth is that of the thickest column along an axis. Half an hour on two cores.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from benchmarks.tables import markdown
from smokelift.evaluation.metrics import volume_error
from smokelift.output.images import write_image
from smokelift.render import Optics, Renderer
from smokelift.render.environment import EnvironmentCells, environment_count
from smokelift.scene import Camera, DirectionalLight, Domain, EnvironmentLight, FiniteLight, Medium, PointLight

Array = npt.NDArray[np.floating[Any]]

SOURCE = Path(__file__).resolve().parents[2]
"""The folder that holds the package benchmarks."""

VOXELS = 32
GRIDS = (32, 64, 128, 192)
LOW, HIGH = (-0.5, -0.5, 0.0), (0.5, 0.5, 1.0)
FOV, SIZE = 32.0, (96, 96)
CAMERA = Camera.look_at((1.6, -2.1, 1.7), (0.0, 0.0, 0.5), fov_y_degrees=FOV, size=SIZE)
ALBEDO = 0.9
DEPTHS = (1.0, 15.0)
ANISOTROPIES = (0.0, 0.6)
BACKGROUND = np.array([0.05, 0.08, 0.12], np.float32)
SUN = DirectionalLight((0.57, 0.456, -0.684), (6.0, 5.0, 4.0))
LIGHTS: dict[str, FiniteLight] = {
    "directional": SUN,
    "point": PointLight((-0.9, -0.6, 1.5), (6.0, 5.0, 4.0)),
    "point, close": PointLight((-0.1, -0.7, 0.7), (0.6, 0.5, 0.4)),
}
ROTATION = 40.0
COUNTS = (4, 8, 16, 32, 64, 128, 256)


def truth() -> Array:
    """Lumps and hollows in a ball that stays clear of the box's sides, (32, 32, 32), at most 1."""
    rng = np.random.default_rng(7)
    x, y, z = np.meshgrid(*[(np.arange(VOXELS) + 0.5) / VOXELS * 2 - 1] * 3, indexing="ij")
    noise = sum(
        weight * ndimage.gaussian_filter(rng.standard_normal(x.shape), size, mode="wrap")
        for size, weight in ((1.2, 1.3), (2.4, 5.6))
    )
    ball = np.maximum(1 - (x / 0.75) ** 2 - (y / 0.75) ** 2 - (z / 0.85) ** 2, 0)
    field = np.sqrt(ball) * np.maximum(1 + 1.2 * noise / noise.std(), 0)
    return np.asarray(field / field.max(), np.float32)


def sampled(field: Array, count: int) -> Array:
    """The trilinear field at the centers of count^3 voxels."""
    at = (np.arange(count) + 0.5) * VOXELS / count - 0.5
    corners = np.meshgrid(at, at, at, indexing="ij")
    return np.asarray(ndimage.map_coordinates(field, corners, order=1, mode="nearest"), np.float32)


def surroundings(rows: int = 512) -> Array:
    """A sky with a broad cold and a narrower warm light in it, (rows, 2 rows, 3)."""
    elevation = np.pi * (0.5 - (np.arange(rows)[:, None] + 0.5) / rows)
    azimuth = 2 * np.pi * (0.5 - (np.arange(2 * rows) + 0.5) / (2 * rows))
    level = np.cos(elevation)
    axes = np.broadcast_arrays(level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation))
    towards = np.stack(axes, -1)
    z = towards[..., 2:]
    radiance = 0.3 * (1 + z) * np.array([0.5, 0.7, 1.0]) + 0.4 * (1 - z) * np.array([0.3, 0.2, 0.1])
    for center, sharpness, color in (((0.6, -0.5, 0.62), 20, (4, 3, 2)), ((-0.8, 0.1, 0.2), 8, (0.5, 1, 2))):
        cosine = towards @ center / np.linalg.norm(center)
        radiance = radiance + np.exp(sharpness * (cosine - 1))[..., None] * np.array(color)
    return np.asarray(radiance, np.float32)


def extinctions(field: Array) -> list[float]:
    """Extinction for each of DEPTHS through the thickest column along an axis."""
    thickest = max(field.sum(axis).max() for axis in range(3)) * (HIGH[0] - LOW[0]) / VOXELS
    return [depth / float(thickest) for depth in DEPTHS]


def described(light: FiniteLight | EnvironmentLight) -> dict[str, Any]:
    """Return a light as JSON takes it."""
    kind = {DirectionalLight: "directional", PointLight: "point", EnvironmentLight: "environment"}[type(light)]
    return {"type": kind} | {key: str(v) if isinstance(v, Path) else v for key, v in asdict(light).items()}


def prepare(folder: Path, field: Array) -> EnvironmentLight:
    """Write what Mitsuba's side reads, and remove its pictures of another scene; returns the environment."""
    environment = EnvironmentLight(folder / "surroundings.exr", rotation_degrees=ROTATION)
    write_image(environment.image, surroundings(), half=False)
    np.savez_compressed(folder / "fields.npz", **{str(n): sampled(field, n) for n in GRIDS})
    lights = {name: described(light) for name, light in LIGHTS.items()} | {"environment": described(environment)}
    scene = {
        "domain": {"min": LOW, "max": HIGH},
        "camera": {"matrix": CAMERA.matrix, "fov_y_degrees": FOV, "size": SIZE},
        "albedo": ALBEDO,
        "extinctions": extinctions(field),
        "anisotropies": ANISOTROPIES,
        "lights": lights,
    }
    written, text = folder / "scene.json", json.dumps(scene)
    if not written.exists() or written.read_text() != text:
        (folder / "reference.npz").unlink(missing_ok=True)
        written.write_text(text)
    return environment


def difference(picture: Array, reference: Array) -> float:
    """Return the relative L2 difference in percent."""
    return 100 * volume_error(picture, reference)


class Comparison:
    """Our pictures against Mitsuba's.

    Parameters
    ----------
    field : (32, 32, 32)
        The truth.
    reference
        What `mitsuba_pictures` wrote.
    environment
        The light whose picture Mitsuba saw too.
    """

    def __init__(self, field: Array, reference: dict[str, Array], environment: EnvironmentLight) -> None:
        self.reference, self.environment = reference, environment
        self.extinctions = extinctions(field)
        self.densities = {count: sampled(field, count) for count in GRIDS}
        self.cases = [(d, a) for d in range(len(DEPTHS)) for a in range(len(ANISOTROPIES))]

    def pictures(self, kind: str) -> dict[int, Array]:
        """A light's pictures, ever finer."""
        names = [name for name in self.reference if name.rpartition("/")[0] == kind]
        return {int(name.rpartition("/")[2]): self.reference[name] for name in names}

    def finest(self, kind: str) -> Array:
        """A light's most exact pictures."""
        return list(self.pictures(kind).values())[-1]

    def medium(self, case: tuple[int, int]) -> Medium:
        return Medium(self.extinctions[case[0]], ALBEDO, ANISOTROPIES[case[1]])

    def renderer(self, case: tuple[int, int], lights: tuple[FiniteLight, ...], grid: int) -> Renderer:
        black = np.zeros(3, np.float32)
        return Optics(Domain(LOW, HIGH, (grid,) * 3), self.medium(case), lights).renderer(CAMERA, black)

    def errors(
        self, kind: str, case: tuple[int, int], lights: tuple[FiniteLight, ...], grid: int
    ) -> tuple[float, float]:
        """Difference of the scattered light alone, and of the picture before the background where smoke is."""
        renderer = self.renderer(case, lights, grid)
        scattered = renderer.image(self.densities[grid])
        ours = scattered + renderer.transmittance[..., None] * BACKGROUND
        true = self.finest(kind)[case]
        transmittance = self.reference["transmittance"][case[0]]
        smoke = transmittance < 1
        whole = true + transmittance[..., None] * BACKGROUND
        return difference(scattered, true), difference(ours[smoke], whole[smoke])

    def named(self, case: tuple[int, int]) -> list[str]:
        return [f"{DEPTHS[case[0]]:g}", f"{ANISOTROPIES[case[1]]:g}"]

    def grids(self) -> str:
        """Every light at every grid."""
        sets: dict[str, tuple[FiniteLight, ...]] = {name: (light,) for name, light in LIGHTS.items()}
        sets["environment"] = EnvironmentCells(self.environment).lights(COUNTS[-1])
        rows, worst = [], dict.fromkeys(GRIDS, 0.0)
        for name, lights in sets.items():
            for case in self.cases:
                errors = {grid: self.errors(name, case, lights, grid) for grid in GRIDS}
                rows.append([name, *self.named(case), *(f"{a:.2f} / {b:.2f}" for a, b in errors.values())])
                worst = {grid: max(worst[grid], *errors[grid]) for grid in GRIDS}
        rows.append(["largest", "", "", *(f"{value:.2f}" for value in worst.values())])
        return markdown(["light", "depth", "g", *(f"{grid}³" for grid in GRIDS)], rows)

    def counts(self, grid: int = 128) -> str:
        """The environment by the number of lights."""
        rows = []
        domain = Domain(LOW, HIGH, (grid,) * 3)
        for case in self.cases:
            sets = map(EnvironmentCells(self.environment).lights, COUNTS)
            cells = [f"{self.errors('environment', case, lights, grid)[0]:.2f}" for lights in sets]
            chosen = environment_count(self.environment, CAMERA, domain, self.medium(case))
            rows.append([*self.named(case), *cells, str(chosen)])
        return markdown(["depth", "g", *map(str, COUNTS), "chosen"], rows)

    def parts(self) -> str:
        """What of the difference is the sampling of the field, and what the rendering of the samples."""
        rows = []
        true = self.finest("directional")
        for case in self.cases:
            cells = []
            for grid in GRIDS:
                same_voxels = self.reference[f"grid/{grid}"][case]
                ours = self.renderer(case, (SUN,), grid).image(self.densities[grid])
                cells.append(f"{difference(same_voxels, true[case]):.2f} + {difference(ours, same_voxels):.2f}")
            rows.append([*self.named(case), *cells])
        return markdown(["depth", "g", *(f"{grid}³" for grid in GRIDS)], rows)

    def convergence(self) -> str:
        """How far the references are from being exact."""
        rows = []
        for kind in (*LIGHTS, "environment"):
            pictures = self.pictures(kind)
            *coarser, best = pictures
            for number in coarser:
                cells = [f"{difference(pictures[number][c], pictures[best][c]):.3f}" for c in self.cases]
                rows.append([kind, str(number), str(best), *cells])
        columns = [", ".join(self.named(case)) for case in self.cases]
        return markdown(["light", "steps per voxel or directions", "against", *columns], rows)

    def tables(self) -> Iterator[tuple[str, str]]:
        """Yield what each table shows, and the table."""
        yield "Scattered light alone / the picture before a constant background, where there is smoke", self.grids()
        yield "Environment: scattered light by the number of parallel lights, 128^3 voxels", self.counts()
        yield "Directional: what the sampling of the field adds + what the rendering of the samples adds", self.parts()
        yield "How exact the references are; columns are depth, anisotropy", self.convergence()


def main() -> None:
    """Run Mitsuba's side, then ours, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--mitsuba", default=sys.executable, help="Python of an environment that has Mitsuba")
    parser.add_argument("--folder", type=Path, help="where Mitsuba's pictures are kept; they are used again")
    options = parser.parse_args()
    field = truth()
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.folder or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        environment = prepare(folder, field)
        if not (folder / "reference.npz").exists():
            module = (options.mitsuba, "-m", "benchmarks.renderer.mitsuba_pictures")
            subprocess.run([*module, str(folder)], env={**os.environ, "PYTHONPATH": str(SOURCE)}, check=True)
        with np.load(folder / "reference.npz") as reference:
            for about, table in Comparison(field, dict(reference), environment).tables():
                print(f"{about}\n\n{table}\n", flush=True)


if __name__ == "__main__":
    main()
