"""What the scores of an orbit say about densities that are wrong in one way only.

    python -m benchmarks.accuracy.fakes SCENE OTHER [SCENE OTHER ...] [--frames 24]

SCENE and OTHER are folders of `benchmarks.truth.picture`, OTHER of other smoke of the same kind. Every fake is made of
SCENE's truth. Prints means over the SCENEs as a Markdown table, beside the truth and beside the fake's own front.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from scipy import ndimage

from benchmarks import tables
from benchmarks.accuracy.scenes import baked_scene
from benchmarks.accuracy.score import known_densities
from smokelift.evaluation.frame_means import SMOKE_SHARE, Figures
from smokelift.evaluation.orbit_scores import Densities, orbit_scores
from smokelift.evaluation.series import finite_mean
from smokelift.evaluation.truth import Truth
from smokelift.render import Volume
from smokelift.scene import CompleteScene

BLUR = 2.0
"""Standard deviation (voxels) of the blurred truth."""

HAZE = 0.1
"""Share of the mass that is spread evenly over the box."""

COLUMNS = (
    ("patches", "patches", ".3f"),
    ("worst", "patches_worst", ".3f"),
    ("own", "patches_own", ".3f"),
    ("texture", "texture", ".2f"),
    ("own", "texture_own", ".2f"),
    ("edges", "edges", ".2f"),
    ("halo", "halo", ".1%"),
    ("flicker", "flicker", ".2f"),
    ("patches, from the front", "front_patches", ".3f"),
    ("own", "front_patches_own", ".3f"),
    ("texture, from the front", "front_texture", ".2f"),
    ("own", "front_texture_own", ".2f"),
    ("edges", "front_edges", ".2f"),
    ("flicker", "front_flicker", ".2f"),
)


def fakes(truth: Truth, other: Truth) -> dict[str, Densities]:
    """Return what to call each fake, and the density (nx, ny, nz) that it has in a frame of the truth, from 0."""
    true = truth.density
    return {
        "truth": true,
        "turned by 90 degrees": lambda frame: np.ascontiguousarray(np.rot90(true(frame))),
        "other smoke": other.density,
        "blurred": lambda frame: _blurred(true(frame)),
        "turned on a lathe": lambda frame: _lathe(true(frame)),
        "front drawn out in depth": lambda frame: _drawn_out(true(frame)),
        "haze": lambda frame: (1 - HAZE) * true(frame) + np.float32(HAZE * true(frame).mean()),
        "blurred, new noise in every frame": lambda frame: _noisy(true(frame), frame),
        "every other frame twice": lambda frame: true(frame - frame % 2),
    }


def measured(scene: CompleteScene, count: int, truth: Truth, density: Densities) -> Figures:
    """Return the scores of a density in so many frames, beside the truth's and, named front, beside its own front."""
    front = orbit_scores(scene, count, density)
    return orbit_scores(scene, count, density, truth.density) | {f"front_{name}": front[name] for name in front}


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
        known = baked_scene(folder, options.frames)
        truth = Truth.load(folder / "truth.npz")
        about = known_densities(known, "truth", folder)
        assert about is not None
        for name, density in fakes(truth, Truth.load(other / "truth.npz")).items():
            found.setdefault(name, []).append(measured(about.scene, len(known.scored), truth, density))
    rows = [
        [name, *(_cell(finite_mean(figures[key] for figures in scenes), form) for _, key, form in COLUMNS)]
        for name, scenes in found.items()
    ]
    print(tables.markdown(["density", *(heading for heading, _, _ in COLUMNS)], rows))


def _cell(value: float | None, form: str) -> str:
    return "-" if value is None else f"{value:{form}}"


def _blurred(density: Volume) -> Volume:
    return np.asarray(ndimage.gaussian_filter(density, BLUR), np.float32)


def _lathe(density: Volume) -> Volume:
    """Every layer has its means over circles about its middle."""
    x, y = np.indices(density.shape[:2])
    turned = np.zeros_like(density)
    for z, layer in enumerate(np.moveaxis(density, 2, 0)):
        if (mass := float(layer.sum())) > 0:
            radius = np.hypot(x - (x * layer).sum() / mass, y - (y * layer).sum() / mass).round().astype(int)
            means = np.bincount(radius.ravel(), layer.ravel()) / np.maximum(np.bincount(radius.ravel()), 1)
            turned[..., z] = means[radius]
    return turned


def _drawn_out(density: Volume) -> Volume:
    """Every ray's smoke is spread evenly over the depth that its layer has."""
    deep = np.any(density > SMOKE_SHARE * density.max(), axis=0)
    evenly = density.sum(1, keepdims=True) / np.maximum(deep.sum(0), 1)
    return np.asarray(np.where(deep[None], evenly, 0), np.float32)


def _noisy(density: Volume, frame: int) -> Volume:
    """The blurred density with other noise in place of the detail, as strong as that where it is."""
    smooth = _blurred(density)
    strength = np.sqrt(_blurred((density - smooth) ** 2))
    noise = np.random.default_rng(frame).standard_normal(density.shape)
    return np.asarray(np.maximum(smooth + strength * noise, 0), np.float32)


if __name__ == "__main__":
    main()
