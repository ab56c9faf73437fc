"""What the choice of a model saves and costs: each clip once as chosen and once with the richest model, side by side.

    python -m benchmarks.accuracy.selection OUT CLIP[=SCENE:FIRST:STEP] ... [--frames 10] [--quality balanced]

A CLIP is a scene file. SCENE is a folder of `benchmarks.truth.picture` with the same smoke in sunlight: its frame FIRST
+ STEP n is the clip's frame n. It gives the true density, and pictures from 20, 45 and 90 degrees in that light. The
two sides take turns, frame by frame, so that both have the same machine; time is the processor's, over all cores. The
richest model has the scene's own voxels (or the most of the quality, if the box is found), 64 directions of light,
three grids of velocity, and shadows where the light is known. Both sides are smooth answers: detail that is made up
differs from grid to grid and would say nothing about the model.

OUT gets selection.md, selection.json and selection.png.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.accuracy.scenes import VIEWS, BakedViews
from benchmarks.errors import relative_error
from benchmarks.tables import markdown
from benchmarks.timing import UNTIMED
from smokelift import Clip, Frame, Scene, Settings, prepare_shot, reconstruct
from smokelift.evaluation.metrics import psnr
from smokelift.evaluation.resampling import resampled
from smokelift.evaluation.truth import Truth
from smokelift.footage.images import area_average
from smokelift.output.images import eight_bit
from smokelift.output.sheet import write_sheet
from smokelift.render import Image, Volume, scene_renderer
from smokelift.scene import EnvironmentLight, Scattering, completed
from smokelift.setup.settings import QUALITIES, Quality
from smokelift.setup.shot import Shot
from smokelift.velocity.settings import LEVELS

BLACK = np.zeros(3, np.float32)

DIRECTIONS = 64
"""Lights of an environment in the richest model."""

SHOWN = 0.3
"""Least radiance of the brightest pixel in a row of pictures; darker rows are brightened to it."""

HEAD = ("clip", "scattering", "voxels", "directions", "grids", "time", "choosing", "front", "density", "new views, dB")
RUN = 24
"""Frames of the run whose time the time of choosing is divided by."""


@dataclass(frozen=True, eq=False)
class Known:
    """The same smoke in sunlight; frame n of the clip is its frame ``first + step n``."""

    scene: Scene
    truth: Truth
    views: BakedViews
    first: int
    step: int

    @staticmethod
    def load(text: str) -> Known:
        """Read FOLDER:FIRST:STEP."""
        name, first, step = text.split(":")
        folder = Path(name)
        truth, views = Truth.load(folder / "truth.npz"), BakedViews.load(folder)
        return Known(Scene.load(folder / "scene.toml"), truth, views, int(first), int(step))

    def seen(self, view: str, frame: int) -> Image:
        """Return the picture of the smoke alone, (rows, columns, 3)."""
        return self.views.seen(view, self.first + self.step * frame)

    def shown(self, density: Volume, view: str) -> Image:
        """Return what a volume shows in the same light."""
        scene = completed(self.scene)
        nx, ny, nz = density.shape
        scene = replace(scene, domain=replace(scene.domain, resolution=(nx, ny, nz)))
        return scene_renderer(scene, self.views.cameras[view], BLACK).image(density)


def sides(clip: Clip, scene: Scene, quality: Quality) -> dict[str, tuple[Scene, Settings]]:
    """Return what is compared, without made-up detail: everything left open, and the richest of everything."""
    chosen = replace(Settings.preset(quality, resolution="auto"), detail=0.0)
    rich = replace(Settings.preset(quality), detail=0.0)
    if scene.domain is None:  # the paper's method takes the most
        most = completed(prepare_shot(clip, scene, Settings.preset(quality, "paper")).scene)
        rich = replace(rich, resolution=most.domain.resolution)
    lights = tuple(
        replace(light, directions=DIRECTIONS) if isinstance(light, EnvironmentLight) else light
        for light in scene.lights
    )
    model: Scattering = "single" if lights else "unshadowed"
    richest = replace(rich, scattering=model, velocity=replace(rich.velocity, levels=LEVELS))
    return {"chosen": (scene, chosen), "richest": (replace(scene, lights=lights), richest)}


@dataclass(eq=False)
class Side:
    """One of two reconstructions that take turns."""

    shot: Shot
    choosing: float
    frames: Iterator[Frame]
    spent: list[float]
    found: list[Frame]

    @staticmethod
    def begin(clip: Clip, scene: Scene, settings: Settings) -> Side:
        """Prepare it, and time what that takes beyond the paper's method, which chooses nothing."""
        clocks = []
        for each in (Settings.preset(settings.quality, "paper"), settings):
            began = time.process_time()
            reconstruction = reconstruct(clip, scene, each)
            clocks.append(time.process_time() - began)
        return Side(reconstruction.shot, clocks[1] - clocks[0], iter(reconstruction), [], [])

    def step(self) -> None:
        """One more frame."""
        began = time.process_time()
        self.found.append(next(self.frames))
        self.spent.append(time.process_time() - began)

    @property
    def seconds(self) -> float:
        """A frame (s), the median."""
        return float(np.median(self.spent[UNTIMED:]))


def residual(side: Side, clip: Clip) -> float:
    """Return the L2 error of the front picture over all frames, relative to what the smoke changes there."""
    wrong = change = 0.0
    for frame in side.found:
        shot = side.shot
        picture = clip.frame(frame.number - 1)
        plate = shot.estimated_background
        renderer = scene_renderer(shot.scene, background=plate)
        behind = renderer.image(np.zeros_like(frame.density))
        wrong += float(np.sum(np.square(renderer.image(frame.density) - picture, dtype=np.float64)))
        change += float(np.sum(np.square(behind - picture, dtype=np.float64)))
    return float(np.sqrt(wrong / change))


def against(side: Side, known: Known) -> dict[str, float]:
    """Return the relative error of the density and the PSNR of new views (dB), means over the frames."""
    errors, decibels = [], []
    for frame in side.found:
        at = frame.number - 1
        true = known.truth.density(known.first + known.step * at)
        errors.append(relative_error(resampled(frame.density, known.truth.shape), true))
        decibels += [psnr(known.shown(frame.density, view), known.seen(view, at)) for view in list(VIEWS)[1:]]
    return {"density_error": float(np.mean(errors)), "psnr_new": float(np.mean(decibels))}


def compare(path: Path, known: Known | None, frames: int, quality: Quality) -> tuple[dict[str, Any], list[Image]]:
    """Return both sides of a clip: figures, and pictures of the last frame."""
    scene = Scene.load(path)
    if scene.clip is None:
        raise ValueError(f"{path}: has no [clip].")
    first = scene.clip.first
    source = replace(scene.clip, frames=(first, first + frames - 1))
    row: dict[str, Any] = {"clip": path.parent.name, "frames": frames}
    with Clip.open(source) as clip:
        scene = replace(scene, clip=source)
        both = {name: Side.begin(clip, *side) for name, side in sides(clip, scene, quality).items()}
        for _ in range(frames):
            for side in both.values():
                side.step()
        for name, side in both.items():
            shot = side.shot
            row[name] = {
                "scattering": shot.scene.scattering,
                "resolution": list(shot.scene.domain.resolution),
                "directions": [light.directions for light in shot.scene.lights if isinstance(light, EnvironmentLight)],
                "levels": shot.settings.velocity.levels,
                "seconds": side.seconds,
                "choosing": side.choosing,
                "residual": residual(side, clip),
                **({} if known is None else against(side, known)),
            }
        row["choices"] = [choice.as_dict() for choice in both["chosen"].shot.choices]
        tiles = [clip.frame(frames - 1)]
        for side in both.values():
            plate = side.shot.estimated_background
            tiles.append(scene_renderer(side.shot.scene, background=plate).image(side.found[-1].density))
        if known is not None:
            tiles.append(known.seen("90", frames - 1))
            tiles += [known.shown(side.found[-1].density, "90") for side in both.values()]
    return row, tiles


def main() -> None:
    """Compare, and write table, figures and pictures."""
    parser = argparse.ArgumentParser(description="Compare the chosen model with the richest one.")
    parser.add_argument("out", type=Path)
    parser.add_argument("clips", nargs="+", help="scene.toml, or scene.toml=FOLDER:FIRST:STEP")
    parser.add_argument("--frames", type=int, default=10)
    parser.add_argument("--quality", choices=QUALITIES, default="balanced")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rows, sheet = [], []
    for text in options.clips:
        path, _, truth = text.partition("=")
        known = Known.load(truth) if truth else None
        row, tiles = compare(Path(path), known, options.frames, options.quality)
        rows.append(row)
        small = [area_average(tile, 192, round(192 * tile.shape[0] / tile.shape[1])) for tile in tiles]
        gain = max(1.0, SHOWN / float(small[0].max()))  # a haze would be black
        sheet.append([eight_bit(gain * np.maximum(tile, 0)) for tile in small])
        print(markdown(HEAD, [cells(row)]).splitlines()[-1], flush=True)
        (options.out / "selection.json").write_text(json.dumps(rows, indent=1) + "\n")
    (options.out / "selection.md").write_text(markdown(HEAD, map(cells, rows)) + "\n")
    titles = ["clip", "chosen", "richest", "truth, 90", "chosen, 90", "richest, 90"]
    full = [row for row in sheet if len(row) == len(titles)]
    if full:
        labels = [row["clip"] for row, tiles in zip(rows, sheet, strict=True) if len(tiles) == len(titles)]
        write_sheet(options.out / "selection.png", full, titles, labels)


def cells(row: dict[str, Any]) -> list[str]:
    """Return a row of the table: as chosen, and in brackets the richest."""
    chosen, richest = row["chosen"], row["richest"]

    def pair(key: str, form: str) -> str:
        return f"{chosen[key]:{form}} ({richest[key]:{form}})" if key in chosen else "-"

    return [
        row["clip"],
        f"{chosen['scattering']} ({richest['scattering']})",
        " x ".join(map(str, chosen["resolution"])) + f" ({' x '.join(map(str, richest['resolution']))})",
        f"{chosen['directions'][0]} ({richest['directions'][0]})" if chosen["directions"] else "-",
        f"{chosen['levels']} ({richest['levels']})",
        f"{chosen['seconds'] / richest['seconds']:.2f}",
        f"{chosen['choosing'] / (RUN * richest['seconds']):.1%}",
        pair("residual", ".1%"),
        pair("density_error", ".2f"),
        pair("psnr_new", ".1f"),
    ]


if __name__ == "__main__":
    main()
