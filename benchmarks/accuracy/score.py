"""The figures of a run: its pictures in every view beside the true ones, its volumes beside the true ones."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.accuracy.runs import run_views
from benchmarks.accuracy.scenes import KnownScene
from benchmarks.process import run_module
from smokelift import Scene
from smokelift.evaluation import metrics
from smokelift.evaluation.frame_means import PictureMeans, VolumeMeans, eight_bit_values, finite_mean
from smokelift.render import Image, Renderer, scene_renderer
from smokelift.scene import completed
from smokelift.transport import Array

FRONT, SIDE = "0", "90"
"""The input's view, and the one in which a wrong distribution along the rays shows most."""

ALONG_RAYS = 1
"""Axis of the voxels that the front camera looks along."""

BASELINES = ("billboard", "truth", "black")
"""Runs without a reconstruction."""

BLACK = np.zeros(3, np.float32)

VIEW_FIGURES = ("psnr", "ssim", "psnr_shifted", "spectrum_distance", "flicker", "flicker_truth")
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


def score(known: KnownScene, run: str, folder: Path) -> dict[str, Any]:
    """Return the figures of a run by the names of the columns; means over all new views end in _new."""
    row: dict[str, Any] = {"scene": known.name, "run": run, "frames": len(known.scored)}
    row["method"] = "baseline" if run == "billboard" else "reference"
    if run not in BASELINES:
        about = reconstructed(known, run, folder)
        row |= {name: about[name] for name in (*RUN_FIGURES, "method")}
        row["resolution"] = "x".join(map(str, about["resolution"]))
    scores = {view: PictureMeans(BLACK) for view in known.cameras}
    depth: list[dict[str, float]] = []
    for frame, shown in images(known, run, folder, known.scored):
        for view, image in shown.items():
            scores[view].add(image, known.seen(view, frame))
        if SIDE in shown:
            seen = {view: known.seen(view, frame) for view in (FRONT, SIDE)}
            of_truth = {f"{name}_truth": value for name, value in _from_the_side(seen).items()}
            depth.append(_from_the_side(shown) | of_truth)
    found = {view: pictures.figures() for view, pictures in scores.items()}
    used = {next(iter(known.cameras)), *run_views(run)}
    for name in VIEW_FIGURES if known.scored.step == 1 else VIEW_FIGURES[:-2]:  # flicker needs frames in a row
        row |= {f"{name}_{view}": figures[name] for view, figures in found.items()}
        new = [figures[name] for view, figures in found.items() if view not in used and figures[name] is not None]
        row[f"{name}_new"] = float(np.mean(new)) if new else None
    if known.truth is not None and run not in BASELINES:
        volumes = VolumeMeans(known.truth)
        for number, frame in enumerate(known.scored):
            arrays = _volume(folder, known, frame)
            volumes.add(frame, arrays["density"], arrays.get("velocity"))
            depth[number] |= {
                "depth_anisotropy": metrics.depth_anisotropy(arrays["density"], ALONG_RAYS),
                "depth_anisotropy_truth": metrics.depth_anisotropy(known.truth.density(frame), ALONG_RAYS),
            }
        figures = volumes.figures()
        row |= {name: figures.get(name) for name in VOLUME_FIGURES}
        row |= {f"layer_{name}": figures[name] for name in ("flicker", "flicker_truth")}
    row |= {name: finite_mean(figures[name] for figures in depth) for name in (depth[0] if depth else ())}
    return row


def _renderers(known: KnownScene, scene: Scene, shape: tuple[int, int, int]) -> dict[str, Renderer]:
    complete = completed(scene)
    complete = replace(complete, domain=replace(complete.domain, resolution=shape))
    return {view: scene_renderer(complete, camera, BLACK) for view, camera in known.cameras.items()}


def _volume(folder: Path, known: KnownScene, frame: int) -> dict[str, Array]:
    """Read the density and, if there is one, the velocity of a frame of the clip."""
    with np.load(folder / f"{frame - known.frames[0] + 1:04d}.npz") as file:
        return {name: file[name].astype(np.float32) for name in file.files}


def _from_the_side(shown: dict[str, Image]) -> dict[str, float]:
    """Return two figures that a wrong distribution along the rays raises in the picture from the side."""
    front, side = (eight_bit_values(shown[view]).mean(axis=-1) for view in (FRONT, SIDE))
    return {
        "row_constant_detail": metrics.row_constant_detail(side),
        "detail_correlation": metrics.detail_correlation(side, front),
    }
