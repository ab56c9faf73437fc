"""The figures of a run: its pictures in every view beside the true ones, its volumes beside the true ones."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.accuracy.runs import run_views
from benchmarks.accuracy.scenes import KnownScene
from benchmarks.process import run_module
from smokelift import Scene
from smokelift.evaluation import metrics
from smokelift.evaluation.copies import CopiedDetail
from smokelift.evaluation.frame_means import PictureMeans, VolumeMeans, smoke_picture
from smokelift.evaluation.picture_statistics import MOTION, PictureSeries, PictureStatistics, beside_references
from smokelift.evaluation.series import finite_mean
from smokelift.evaluation.truth import Truth
from smokelift.render import Image, Renderer, scene_renderer
from smokelift.scene import completed
from smokelift.transport import Array

FRONT, BETWEEN, SIDE = "0", "45", "90"
"""The input's view, one between, and the one in which a wrong distribution along the rays shows most."""

ALONG_RAYS = 1
"""Axis of the voxels that the front camera looks along."""

BASELINES = ("billboard", "truth", "black")
"""Runs without a reconstruction."""

BLACK = np.zeros(3, np.float32)

VIEW_FIGURES = (
    "psnr", "ssim", "psnr_shifted", "spectrum_distance", *(f"spectrum_{low:.0f}" for low, _ in metrics.OCTAVES),
    "row_constant_detail", "row_constant_detail_truth", "reference_distance", "reference_distance_truth",
)  # fmt: skip
CONSECUTIVE_FIGURES = tuple(f"{name}{which}" for name in ("flicker", *MOTION) for which in ("", "_truth"))
"""Of views, from frames that follow each other."""

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
        span = str(known.frames[0]), str(known.frames[-1])
        ended = run_module("benchmarks.accuracy.worker", str(known.scene_path), run, *span, str(folder))
        if ended.returncode != 0:
            sys.exit(f"{run} of {known.name} failed with status {ended.returncode}:\n{ended.stderr}")
    found: dict[str, Any] = json.loads(done.read_text())
    return found


def images(known: KnownScene, run: str, folder: Path, frames: range) -> Iterator[tuple[int, dict[str, Image]]]:
    """Yield frames with the linear picture (rows, columns, 3) that a run shows in every view."""
    views = known.cameras
    if run == "billboard":
        yield from ((frame, {view: known.billboard(view, frame) for view in views}) for frame in frames)
    elif run == "black":
        yield from ((frame, {view: 0 * known.seen(view, frame) for view in views}) for frame in frames)
    elif run == "truth":
        if known.truth is None:
            sys.exit(f"{known.name}: its volumes are not known, so there is no run truth.")
        ours = _renderers(known, replace(Scene.load(known.scene_path), scattering="single"), known.truth.shape)
        for frame in frames:
            yield frame, {view: ours[view].image(known.truth.density(frame)) for view in views}
    else:
        about = json.loads((folder / "run.json").read_text())
        scene = replace(Scene.load(folder / "scene.toml"), scattering=about["scattering"])
        ours = _renderers(known, scene, tuple(about["resolution"]))
        for frame in frames:
            density = _volume(folder, known, frame)["density"]
            yield frame, {view: ours[view].image(density) for view in views}


def front_statistics(known: KnownScene) -> PictureStatistics:
    """Return what a scene's clip looks like from the front: what its views from elsewhere should look like."""
    front = next(iter(known.cameras))
    series = PictureSeries()
    for frame in known.scored:
        series.add(smoke_picture(known.seen(front, frame), BLACK))
    return series.statistics()


def score(known: KnownScene, run: str, folder: Path, references: Sequence[PictureStatistics]) -> dict[str, Any]:
    """Return the figures of a run by the names of the columns; means over all new views end in _new.

    Parameters
    ----------
    known
        The scene.
    run
        The name of the run.
    folder
        Of its files.
    references
        Fronts of other clips, to compare the views with in their statistics.
    """
    row: dict[str, Any] = {"scene": known.name, "run": run, "frames": len(known.scored)}
    row["method"] = "baseline" if run == "billboard" else "reference"
    if run not in BASELINES:
        about = reconstructed(known, run, folder)
        row |= {name: about[name] for name in (*RUN_FIGURES, "method")}
        row["resolution"] = "x".join(map(str, about["resolution"]))
    row |= _view_figures(known, run, folder, references)
    if known.truth is not None and run not in BASELINES:
        row |= _volume_figures(known, known.truth, folder)
    return row


def _view_figures(known: KnownScene, run: str, folder: Path, references: Sequence[PictureStatistics]) -> dict[str, Any]:
    """Return the figures of the pictures in every view, and their means over the new views."""
    scores = {view: PictureMeans(BLACK) for view in known.cameras}
    side, true_side = SideCopies(), SideCopies()
    for frame, shown in images(known, run, folder, known.scored):
        seen = {view: known.seen(view, frame) for view in known.cameras}
        for view, image in shown.items():
            scores[view].add(image, seen[view])
        if SIDE in shown:
            side.add(shown)
            true_side.add(seen)
    found: dict[str, dict[str, Any]] = {}
    for view, pictures in scores.items():
        figures = pictures.figures()
        octaves = figures["spectrum_octaves"] or [None] * len(metrics.OCTAVES)
        figures |= {f"spectrum_{low:.0f}": ratio for (low, _), ratio in zip(metrics.OCTAVES, octaves, strict=True)}
        for which, statistics in zip(("", "_truth"), pictures.statistics(), strict=True):
            distance = beside_references(statistics, references)["reference_distance"]
            figures |= {f"reference_distance{which}": distance}
        found[view] = figures
    used = {next(iter(known.cameras)), *run_views(run)}
    row: dict[str, Any] = {}
    for name in (*VIEW_FIGURES, *(CONSECUTIVE_FIGURES if known.scored.step == 1 else ())):
        row |= {f"{name}_{view}": figures[name] for view, figures in found.items()}
        row[f"{name}_new"] = finite_mean(figures[name] for view, figures in found.items() if view not in used)
    if SIDE in known.cameras:
        row |= side.figures() | {f"{name}_truth": value for name, value in true_side.figures().items()}
    return row


def _volume_figures(known: KnownScene, truth: Truth, folder: Path) -> dict[str, Any]:
    """Return the figures of densities and velocities."""
    volumes = VolumeMeans(truth)
    changes, true_changes = [], []
    for frame in known.scored:
        arrays = _volume(folder, known, frame)
        volumes.add(frame, arrays["density"], arrays.get("velocity"))
        changes.append(metrics.depth_anisotropy(arrays["density"], ALONG_RAYS))
        true_changes.append(metrics.depth_anisotropy(truth.density(frame), ALONG_RAYS))
    figures = volumes.figures()
    return {
        **{name: figures.get(name) for name in VOLUME_FIGURES},
        **{f"layer_{name}": figures[name] for name in ("flicker", "flicker_truth")},
        "depth_anisotropy": finite_mean(changes),
        "depth_anisotropy_truth": finite_mean(true_changes),
    }


class SideCopies:
    """What the side view's fine detail has in common with other views of the same density."""

    def __init__(self) -> None:
        self._front, self._between = CopiedDetail(), CopiedDetail()
        self._in_place: list[float] = []

    def add(self, shown: dict[str, Image]) -> None:
        """Add the pictures of a frame in all views, linear (rows, columns, 3) before black."""
        front, between, side = (smoke_picture(shown[view], BLACK) for view in (FRONT, BETWEEN, SIDE))
        self._in_place.append(metrics.detail_correlation(side, front))
        self._front.add(side, front)
        self._between.add(side, between)

    def figures(self) -> dict[str, float | None]:
        """Return the means over the frames."""
        return {
            "detail_correlation": finite_mean(self._in_place),
            "copied_detail": self._front.same_moment(),
            "copied_detail_moments": self._front.any_moment(),
            "copied_detail_between": self._between.same_moment(),
        }


def _renderers(known: KnownScene, scene: Scene, shape: tuple[int, int, int]) -> dict[str, Renderer]:
    complete = completed(scene)
    complete = replace(complete, domain=replace(complete.domain, resolution=shape))
    return {view: scene_renderer(complete, camera, BLACK) for view, camera in known.cameras.items()}


def _volume(folder: Path, known: KnownScene, frame: int) -> dict[str, Array]:
    """Read the density and, if there is one, the velocity of a frame of the clip."""
    with np.load(folder / f"{frame - known.frames[0] + 1:04d}.npz") as file:
        return {name: file[name].astype(np.float32) for name in file.files}
