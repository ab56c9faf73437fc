"""The figures of a run: its pictures in every view beside the true ones, its volumes beside the true ones."""

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage
from scipy.optimize import minimize_scalar

from benchmarks.accuracy import worker
from benchmarks.accuracy.runs import run_name, run_views
from benchmarks.accuracy.scenes import KnownScene
from benchmarks.baked import BLACK
from benchmarks.process import apart
from smokelift import Scene
from smokelift.evaluation import metrics
from smokelift.evaluation.orbit import SHAPES, orbit_scores
from smokelift.evaluation.truth import (
    Truth,
    eight_bit_values,
    finite_mean,
    means,
    on_grid,
    picture_figures,
    resampled,
    volume_means,
)
from smokelift.render import Image, scene_renderer
from smokelift.scene import CompleteScene, completed
from smokelift.transport import Array

BILLBOARDS = ("billboard", "blurred")
"""The input picture in every view, as it is and blurred."""

BASELINES = (*BILLBOARDS, "truth", "black")
"""Runs without a reconstruction."""

BLUR = 1 / 120
"""Standard deviation of the blurred billboard's Gaussian, as a fraction of a picture's longer side. Of 1, 2, 3 and 4 /
120 it is the best for camera 00 of the ScalarFlow capture, with and without a gain."""

LARGEST_GAIN = 4.0
"""Gains are searched for between this and its inverse."""

VIEW_FIGURES = ("psnr", "ssim")
ORBIT_FIGURES = ("patches", "patches_worst", "patches_own", "texture", "texture_own", "edges", "halo", "flicker")
"""Figures of the orbit beside the truth's, or beside the front where that is not known."""

SHAPE_FIGURES = (*SHAPES, *(f"{name}_truth" for name in SHAPES))
"""The same, of shapes along the camera's rays."""

VOLUME_FIGURES = (
    "density_error", "height_mass_error", "mass_ratio", "velocity_error", "velocity_cosine", "velocity_error_around",
    "velocity_cosine_around", "divergence", "divergence_truth", "warp_error", "warp_error_truth",
)  # fmt: skip
RUN_FIGURES = ("seconds", "solves", "memory_mib")


def reconstructed(known: KnownScene, run: str, folder: Path) -> dict[str, Any]:
    """Reconstruct in a process of its own, unless that is done already; returns what its run.json says."""
    done = folder / "run.json"
    if not done.exists():
        folder.mkdir(parents=True, exist_ok=True)
        span = known.frames[0], known.frames[-1]
        if failure := apart(worker.reconstruct, known.scene_path, run, span, folder):
            sys.exit(f"{run} of {known.name} failed: {failure}")
    found: dict[str, Any] = json.loads(done.read_text())
    return found


def images(known: KnownScene, run: str, folder: Path, frames: range) -> Iterator[tuple[int, dict[str, Image]]]:
    """Yield frames with the linear picture (rows, columns, 3) that a run shows in every view."""
    views, name = known.cameras, run_name(run)
    if name in BILLBOARDS:
        width = BLUR if name == "blurred" else 0.0
        for frame in frames:
            yield frame, {view: _blurred(known.billboard(view, frame), width) for view in views}
    elif run == "black":
        yield from ((frame, {view: 0 * known.seen(view, frame) for view in views}) for frame in frames)
    elif (densities := known_densities(known, run, folder)) is not None:
        scene, density = densities
        ours = {view: scene_renderer(scene, camera, BLACK) for view, camera in views.items()}
        for frame in frames:
            volume = density(frame)
            yield frame, {view: ours[view].image(volume) for view in views}


Densities = tuple[CompleteScene, Callable[[int], Array]]
"""A scene on the densities' grid with the scattering that they are rendered with, and what returns the density of a
frame of the clip, (nx, ny, nz)."""


def known_densities(known: KnownScene, run: str, folder: Path) -> Densities | None:
    """Return the densities of a run; None if it is a picture without any."""
    if run_name(run) in BILLBOARDS or run == "black":
        return None
    if run == "truth":
        if known.truth is None:
            sys.exit(f"{known.name}: its volumes are not known, so there is no run truth.")
        scene = replace(Scene.load(known.scene_path), scattering="single")
        return on_grid(completed(scene), known.truth.shape), known.truth.density
    about = json.loads((folder / "run.json").read_text())
    scene = replace(Scene.load(folder / "scene.toml"), scattering=about["scattering"])
    whole = on_grid(completed(scene), tuple(about["resolution"]))
    return whole, lambda frame: _volume(folder, known, frame)["density"]


def score(known: KnownScene, run: str, folder: Path) -> dict[str, Any]:
    """Return the figures of a run by the names of the columns; means over all new views end in _new.

    Parameters
    ----------
    known
        The scene.
    run
        The name of the run.
    folder
        Of its files.
    """
    row: dict[str, Any] = {"scene": known.name, "run": run, "frames": len(known.scored)}
    baseline = run_name(run) in BASELINES
    row["method"] = "baseline" if run_name(run) in BILLBOARDS else "reference"
    if not baseline:
        about = reconstructed(known, run, folder)
        row |= {name: about[name] for name in (*RUN_FIGURES, "method")}
        row["resolution"] = "x".join(map(str, about["resolution"]))
    row |= _view_figures(known, run, folder)
    if (densities := known_densities(known, run, folder)) is not None:
        scores = around(known, *densities)
        row |= {name: scores.get(name) for name in (*ORBIT_FIGURES, *SHAPE_FIGURES)}
    if known.truth is None:
        row |= _exposure_figures(known, run, folder)
    elif not baseline:
        row |= _volume_figures(known, known.truth, folder)
    return row


def around(known: KnownScene, scene: CompleteScene, density: Callable[[int], Array]) -> dict[str, Any]:
    """Return the `orbit_scores` of a run over the frames from the first to the last that is scored."""
    truth, frames = known.truth, range(known.scored[0], known.scored[-1] + 1)
    if truth is None:
        return orbit_scores(scene, len(frames), lambda index: density(frames[index]))
    shape = truth.shape
    return orbit_scores(
        on_grid(scene, shape),
        len(frames),
        lambda index: resampled(density(frames[index]), shape),
        lambda index: truth.density(frames[index]),
    )


def _view_figures(known: KnownScene, run: str, folder: Path) -> dict[str, Any]:
    """Return the figures of the pictures in every view, and their means over the new views."""
    scores: dict[str, list[dict[str, Any]]] = {view: [] for view in known.cameras}
    for frame, shown in images(known, run, folder, known.scored):
        for view, image in shown.items():
            scores[view].append(picture_figures(image, known.seen(view, frame)))
    found = {view: means(frames) for view, frames in scores.items()}
    used = {next(iter(known.cameras)), *run_views(run)}
    row: dict[str, Any] = {}
    for name in VIEW_FIGURES:
        row |= {f"{name}_{view}": figures[name] for view, figures in found.items()}
        row[f"{name}_new"] = finite_mean(figures[name] for view, figures in found.items() if view not in used)
    return row


def _exposure_figures(known: KnownScene, run: str, folder: Path) -> dict[str, Any]:
    """Return what PSNR and SSIM become with one gain per camera, since real cameras differ in exposure; and the
    gains."""
    shown: dict[str, list[Image]] = {view: [] for view in known.cameras}
    for _, pictures in images(known, run, folder, known.scored):
        for view, picture in pictures.items():
            shown[view].append(picture)
    row: dict[str, Any] = {}
    for view, ours in shown.items():
        seen = [known.seen(view, frame) for frame in known.scored]
        gain = row[f"gain_{view}"] = best_gain(ours, seen)
        gained = (np.float32(gain) * picture for picture in ours)
        pairs = [(eight_bit_values(a), eight_bit_values(b)) for a, b in zip(gained, seen, strict=True)]
        row[f"gain_psnr_{view}"] = finite_mean(metrics.psnr(*pair) for pair in pairs)
        row[f"gain_ssim_{view}"] = finite_mean(metrics.ssim(*pair) for pair in pairs)
    used = {next(iter(known.cameras)), *run_views(run)}
    for name in ("gain_psnr", "gain_ssim"):
        row[f"{name}_new"] = finite_mean(row[f"{name}_{view}"] for view in known.cameras if view not in used)
    return row


def best_gain(shown: Sequence[Image], seen: Sequence[Image]) -> float:
    """Return the factor to the radiance shown in all frames that comes nearest to what was seen, in 8-bit sRGB values.

    Parameters
    ----------
    shown, seen : sequence of (rows, columns, 3)
        Linear radiance of the same frames; 1 is returned if nothing is shown.
    """
    lit = [picture > 0 for picture in shown]  # a gain changes nothing else
    ours = np.concatenate([picture[where] for picture, where in zip(shown, lit, strict=True)])
    true = eight_bit_values(np.concatenate([picture[where] for picture, where in zip(seen, lit, strict=True)]))
    if not ours.size:
        return 1.0

    def misfit(stops: float) -> float:
        return float(np.mean((eight_bit_values(2**stops * ours) - true) ** 2))

    most = np.log2(LARGEST_GAIN)
    found = minimize_scalar(misfit, bounds=(-most, most), method="bounded", options={"xatol": 0.005})
    return float(2**found.x)


def _volume_figures(known: KnownScene, truth: Truth, folder: Path) -> dict[str, Any]:
    """Return the figures of densities and velocities."""
    volumes = ((frame, _volume(folder, known, frame)) for frame in known.scored)
    figures = volume_means(truth, ((frame, held["density"], held.get("velocity")) for frame, held in volumes))
    return {name: figures.get(name) for name in VOLUME_FIGURES}


def _blurred(picture: Image, width: float) -> Image:
    """Return a picture (rows, columns, 3) after a Gaussian, as wide as a fraction of its longer side."""
    sigma = width * max(picture.shape[:2])
    return np.asarray(ndimage.gaussian_filter(picture, (sigma, sigma, 0)), np.float32)


def _volume(folder: Path, known: KnownScene, frame: int) -> dict[str, Array]:
    """Read the density and, if there is one, the velocity of a frame of the clip."""
    with np.load(folder / f"{frame - known.frames[0] + 1:04d}.npz") as file:
        return {name: file[name].astype(np.float32) for name in file.files}
