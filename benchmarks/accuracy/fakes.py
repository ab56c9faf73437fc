"""What the measures of a side view say about sides that are made to please one of them.

    python -m benchmarks.accuracy.fakes SCENE OTHER [SCENE OTHER ...] [--frames 24]

SCENE and OTHER are folders of `benchmarks.truth.picture`. Every fake is a series of pictures in place of SCENE's view
from 90 degrees; OTHER is a clip of other smoke. Prints means over the SCENEs as a Markdown table.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy import ndimage

from benchmarks import tables
from benchmarks.accuracy.scenes import BakedViews
from benchmarks.accuracy.score import FRONT, SIDE
from smokelift.evaluation.frame_means import Figures, PictureMeans
from smokelift.evaluation.metrics import PatchStatistics, flicker, mean_gradient
from smokelift.evaluation.orbit import grey
from smokelift.evaluation.series import finite_mean
from smokelift.footage.images import area_average
from smokelift.render import Image
from smokelift.transport import Array

BLUR = 8.0
"""Standard deviation (pixels) of the blurred side: two voxels."""

VOXEL = 4
"""Pixels: the measures look at a pixel a voxel."""

COLUMNS = (
    ("PSNR", "psnr", ".1f"),
    ("patches", "patches", ".3f"),
    ("patches, from the front", "patches_front", ".3f"),
    ("edges", "edges", ".2f"),
    ("flicker", "flicker", ".2f"),
)


def fakes(views: BakedViews, other: BakedViews, frames: int) -> Iterator[tuple[str, list[Image]]]:
    """Yield names and pictures, linear (rows, columns, 3) of every frame, that are shown as the side."""
    side, front = ([views.seen(view, frame) for frame in range(frames)] for view in (SIDE, FRONT))
    smooth = [np.asarray(ndimage.gaussian_filter(picture, (BLUR, BLUR, 0)), np.float32) for picture in side]
    yield "truth", side
    yield "blurred truth", smooth
    yield "rows of the truth's means", [_lathe(picture) for picture in side]
    yield "front", front
    yield "blurred truth with new noise in every frame", _noisy(side, smooth)
    yield "front of other smoke", [other.seen(FRONT, frame) for frame in range(frames)]


def main() -> None:
    """Print the table, means over the scenes."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.accuracy.fakes")
    parser.add_argument("scenes", type=Path, nargs="+", metavar="SCENE OTHER", help="folders, in pairs")
    parser.add_argument("--frames", type=int, default=24)
    options = parser.parse_args()
    if len(options.scenes) % 2:
        parser.error("give each SCENE with its OTHER")
    found: dict[str, list[Figures]] = {}
    for folder, other in zip(options.scenes[::2], options.scenes[1::2], strict=True):
        views = BakedViews.load(folder)
        for name, pictures in fakes(views, BakedViews.load(other), options.frames):
            found.setdefault(name, []).append(measured(views, pictures))
    rows = [
        [name, *(_cell(finite_mean(figures[key] for figures in scenes), form) for _, key, form in COLUMNS)]
        for name, scenes in found.items()
    ]
    print(tables.markdown(["side", *(heading for heading, _, _ in COLUMNS)], rows))


def measured(views: BakedViews, pictures: list[Image]) -> Figures:
    """Return the figures of pictures of consecutive frames that are shown as a scene's side."""
    means = PictureMeans()
    for frame, picture in enumerate(pictures):
        means.add(picture, views.seen(SIDE, frame))
    shown = [_grey(picture) for picture in pictures]
    side, front = ([_grey(views.seen(view, frame)) for frame in range(len(shown))] for view in (SIDE, FRONT))
    found, true, ahead = ([PatchStatistics.of(picture) for picture in clip] for clip in (shown, side, front))
    return {
        "psnr": means.figures()["psnr"],
        "patches": finite_mean(one.distance(other) for one, other in zip(found, true, strict=True)),
        "patches_front": finite_mean(one.distance(other) for one, other in zip(found, ahead, strict=True)),
        "edges": finite_mean(mean_gradient(a) / mean_gradient(b) for a, b in zip(shown, side, strict=True)),
        "flicker": flicker(np.stack(shown)) / flicker(np.stack(side)),
    }


def _grey(picture: Image) -> Array:
    rows, columns = picture.shape[:2]
    return grey(area_average(picture, columns // VOXEL, rows // VOXEL))


def _cell(value: float | None, form: str) -> str:
    return "-" if value is None else f"{value:{form}}"


def _lathe(picture: Image) -> Image:
    """A picture whose rows have their mean over the smoke's width."""
    smoke = picture > 0.05 * picture.max()
    widths = np.maximum(smoke.sum(1, keepdims=True), 1)
    return np.asarray(np.where(smoke, (picture * smoke).sum(1, keepdims=True) / widths, 0), np.float32)


def _noisy(side: list[Image], smooth: list[Image]) -> list[Image]:
    """Smooth pictures with noise in place of the detail, as strong and as fine."""
    random = np.random.default_rng(0)
    found = []
    for picture, blurred in zip(side, smooth, strict=True):
        detail = np.fft.fft2(picture[..., 0] - blurred[..., 0])
        noise = np.fft.fft2(random.standard_normal(detail.shape))
        other = np.fft.ifft2(np.abs(detail) * noise / np.abs(noise)).real
        masked = blurred[..., 0] + np.where(blurred[..., 0] > 0.05 * blurred.max(), other, 0)
        found.append(np.repeat(np.maximum(masked, 0)[..., None], 3, axis=-1).astype(np.float32))
    return found


if __name__ == "__main__":
    main()
