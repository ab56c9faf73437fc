"""The paper's figure 3: a rabbit of smoke, optimised until its picture is that of a plume.

    python -m benchmarks.renderer.rabbit docs/figure3.png

The rabbit is made of ellipsoids, the plume of curled noise; nothing is downloaded. Each row of the figure is a moment
of the optimisation: the picture, its derivative with respect to a common scale of the density (red: more smoke makes
the pixel brighter, blue: darker), the sum of the exact gradient along each ray (red: less smoke lowers the error, blue:
more), and the density from the side. The last row is the target. The error that the paper's derivative reaches from
the same start is printed.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image as Pillow
from PIL import ImageDraw
from scipy import ndimage

from smokelift.baselines.density import FixedRateDescent
from smokelift.density import DepthEstimate, Observation, View, ViewSet
from smokelift.density.descent import descend
from smokelift.density.objective import Term
from smokelift.footage.images import linear_to_srgb
from smokelift.footage.noise import lasting_noise
from smokelift.footage.plate import Plate
from smokelift.render import Image, Optics, Renderer, Volume
from smokelift.scene import Camera, DirectionalLight, Domain, Medium, orbit

SIZE, PIXELS = 64, 160
DOMAIN = Domain((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0), (SIZE,) * 3)
MEDIUM = Medium(extinction=6.0, albedo=0.9, anisotropy=0.2)
SUN = DirectionalLight((0.6, 0.5, -0.8), (9.0, 8.6, 8.0))
OPTICS = Optics(DOMAIN, MEDIUM, (SUN,), "single")
CAMERA = Camera.look_at((0.0, -2.6, 0.6), (0.0, 0.0, 0.48), fov_y_degrees=27, size=(PIXELS, PIXELS))
WALL = np.array([0.02, 0.03, 0.05], np.float32)
MOMENTS = (0, 10, 40, 120, 320)  # steps of descent
RESTART = 10  # steps after which voxels are measured anew
PAPER_STEPS, PAPER_RATE = 320, 0.1

Tile = npt.NDArray[np.uint8]

# centre and half axes (m) of the rabbit's parts
RABBIT = (
    ((0.02, 0.0, 0.24), (0.21, 0.17, 0.2)),  # body
    ((-0.16, -0.02, 0.5), (0.12, 0.1, 0.11)),  # head
    ((-0.1, 0.06, 0.72), (0.04, 0.035, 0.17)),  # ears
    ((-0.15, -0.08, 0.72), (0.04, 0.035, 0.17)),
    ((0.24, 0.0, 0.17), (0.065, 0.065, 0.065)),  # tail
    ((-0.1, -0.08, 0.07), (0.11, 0.05, 0.05)),  # paws
    ((-0.1, 0.1, 0.07), (0.11, 0.05, 0.05)),
)


def main() -> None:
    """Optimise, and draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    out = parser.parse_args().out
    renderer = Renderer(CAMERA, DOMAIN, MEDIUM, (SUN,), WALL)
    side = Renderer(orbit(CAMERA, DOMAIN, 90), DOMAIN, MEDIUM, (SUN,), WALL)
    target_density = plume()
    target = renderer.image(target_density)
    density = rabbit()
    rows: list[list[Tile | None]] = []
    done = 0
    for moment in MOMENTS:
        if moment > done:
            density = step(renderer, target, density, moment - done)
            done = moment
        rows.append(draw_row(renderer, side, target, density))
        print(f"{moment:4d} steps: {error(renderer.image(density), target):.4f} of the target", flush=True)
    print(f"paper, {PAPER_STEPS} steps: {error(renderer.image(by_the_paper(target)), target):.4f}")
    rows.append([shown(target), None, None, shown(side.image(target_density))])
    labels = [f"{moment} steps" if moment else "start" for moment in MOMENTS] + ["target"]
    assemble(rows, labels, ("picture", "derivative", "gradient", "from the side")).save(out, optimize=True)


def step(renderer: Renderer, target: Image, density: Volume, count: int) -> Volume:
    """Descend some steps on the exact gradient; every voxel may hold smoke.

    The descent scales each voxel by its initial density. That is far from the answer here, so the descent is restarted.
    """
    everywhere = np.ones(density.shape, bool)
    term = Term(seen(target), renderer, np.ones(target.shape[:2], np.float32))
    for _ in range(count // RESTART):
        density = descend([term], density, everywhere, RESTART, 0.0, RESTART).density
    return density


def seen(target: Image) -> View:
    """Return the target as a view without noise, so that a fit goes on to the end."""
    clean = Plate(np.broadcast_to(WALL, target.shape), np.ones(target.shape[:2], np.float32), lasting_noise(0.0))
    return replace(View.of(Observation(CAMERA, target), OPTICS), plate=clean)


def by_the_paper(target: Image) -> Volume:
    """Descend with the paper's derivative at its fixed rate, from the rabbit."""
    views = ViewSet((seen(target),), np.ones(DOMAIN.resolution, bool), OPTICS)
    fog = np.full(DOMAIN.resolution, 0.1 / MEDIUM.extinction, np.float32)
    depth = DepthEstimate(fog, (np.ones(target.shape[:2], np.float32),), views)
    return FixedRateDescent(PAPER_RATE, PAPER_STEPS, 1e-6).fit(views, depth, rabbit()).density


def rabbit() -> Volume:
    """Return the density of the rabbit."""
    x, y, z = centres()
    shape = np.zeros(DOMAIN.resolution)
    for centre, axes in RABBIT:
        distance = np.sqrt(sum(((p - c) / a) ** 2 for p, c, a in zip((x, y, z), centre, axes, strict=True)))
        shape = np.maximum(shape, np.clip((1.08 - distance) * 6, 0, 1))
    return np.asarray(shape, np.float32)


def plume() -> Volume:
    """Return the density of a plume: a rising column of blobs, stirred by the curl of noise."""
    rng = np.random.default_rng(7)
    potential = [ndimage.gaussian_filter(rng.standard_normal((SIZE,) * 3), 5, mode="wrap") for _ in range(3)]
    gradient = [np.gradient(p / p.std()) for p in potential]
    curl = (gradient[2][1] - gradient[1][2], gradient[0][2] - gradient[2][0], gradient[1][0] - gradient[0][1])
    x, y, z = centres()
    radius = 0.07 + 0.24 * z
    column = np.exp(-(((x**2 + y**2) / radius**2) ** 1.5)) * np.clip(8 * z, 0, 1) * np.clip(5 * (0.92 - z), 0, 1)
    index = np.indices(column.shape).astype(float)
    for _ in range(6):  # stir, little by little
        strength = 5.0 * np.clip(1.6 * z, 0.1, 1)
        at = [i - strength * c for i, c in zip(index, curl, strict=True)]
        column = ndimage.map_coordinates(column, at, order=1, mode="constant")
    return np.asarray(np.maximum(0.9 * column - 0.03, 0), np.float32)


def centres() -> tuple[npt.NDArray[np.float64], ...]:
    """Return the positions of the voxels' centres (m)."""
    return tuple(
        np.meshgrid(
            *((low + (np.arange(SIZE) + 0.5) * DOMAIN.voxel_size) for low in DOMAIN.min), indexing="ij", sparse=True
        )
    )


def draw_row(renderer: Renderer, side: Renderer, target: Image, density: Volume) -> list[Tile | None]:
    """Return the tiles of one moment: picture, derivative, gradient along the rays, view from the side."""
    change = 0.02
    more, less = renderer.image(density * (1 + change)), renderer.image(density * (1 - change))
    derivative = (more - less).mean(-1) / (2 * change)
    picture = renderer.image(density, keep_record=True)
    gradient = renderer.gradient(2 * (picture - target))
    along = np.flipud(gradient.sum(1).T)  # the camera looks along y
    return [shown(picture), signed(derivative), signed(along), shown(side.image(density))]


def shown(picture: Image) -> Tile:
    """Return a linear picture as 8-bit sRGB."""
    return np.asarray(255 * linear_to_srgb(np.clip(picture, 0, 1)), np.uint8)


def signed(values: npt.NDArray[np.floating[Any]]) -> Tile:
    """Return positive values in red, negative ones in blue, on white, relative to the largest."""
    scaled = np.clip(values / (np.quantile(np.abs(values), 0.995) or 1), -1, 1)
    red, blue = np.clip(1 + scaled, 0, 1), np.clip(1 - scaled, 0, 1)
    picture = np.stack([red, np.minimum(red, blue), blue], -1)
    tile = Pillow.fromarray(np.asarray(255 * picture, np.uint8)).resize((PIXELS, PIXELS))
    return np.asarray(tile)


def error(picture: Image, target: Image) -> float:
    """Return the distance from the target, relative to the target's own difference from the wall."""
    return float(np.linalg.norm(picture - target) / np.linalg.norm(target - WALL))


def assemble(rows: list[list[Tile | None]], labels: list[str], titles: tuple[str, ...]) -> Pillow.Image:
    """Return the tiles as a table with headings."""
    margin, top, left = 6, 22, 64
    pitch = PIXELS + margin
    sheet = Pillow.new("RGB", (left + pitch * len(titles), top + pitch * len(rows)), "white")
    draw = ImageDraw.Draw(sheet)
    for column, title in enumerate(titles):
        draw.text((left + column * pitch + 4, 5), title, fill="black")
    for number, (row, label) in enumerate(zip(rows, labels, strict=True)):
        draw.text((4, top + number * pitch + PIXELS // 2), label, fill="black")
        for column, tile in enumerate(row):
            if tile is not None:
                sheet.paste(Pillow.fromarray(tile), (left + column * pitch, top + number * pitch))
    return sheet


if __name__ == "__main__":
    main()
