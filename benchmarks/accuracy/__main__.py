"""How near reconstructions from the front video alone come to the truth: volumes, motion, and the view from elsewhere.

    python -m benchmarks.accuracy OUT SCENE... [--runs balanced paper smear billboard truth] [--frames 24]
    python -m benchmarks.accuracy OUT --real FOLDER [--runs balanced billboard black]

A SCENE is a folder with truth.npz and what truth/picture.py makes of it. A run is a quality, "paper", or either with
changes (`balanced:transport=0`, `fine:velocity.levels=2`, `draft:resolution=32x32x48`, `balanced:without=hull`: see
`worker.leave_out`) or further views that are used (`balanced+90`, `balanced+90+45`; with --real
`balanced+camera00`), or one of the baselines:
`smear` (front fit, constant along the rays), `billboard` (the front picture, unshifted, in every view), `truth` (the
true density in our renderer), `black`. Each reconstruction has a process of its own; what is in OUT is not run again.

OUT gets accuracy.md, accuracy.csv and accuracy.png (real.* with --real). docs/accuracy.md says what is measured.
"""

from __future__ import annotations

import argparse
import csv
import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.accuracy.worker import SMEAR, VIEWS, run_views
from benchmarks.machine import describe
from benchmarks.process import environment
from smokelift import Camera, Clip, Scene
from smokelift.evaluation import metrics
from smokelift.evaluation.scores import PictureScore, VolumeScore, eight_bit_values, finite_mean
from smokelift.evaluation.truth import Truth
from smokelift.footage.images import area_average
from smokelift.output.images import eight_bit
from smokelift.output.sheet import write_sheet
from smokelift.render import Renderer, scene_renderer
from smokelift.scene import completed
from smokelift.scene.projection import project, ray_through_pixels

FRONT, SIDE = "0", "90"
"""Views between which a guess of the depth shows most: bands, and the front's picture seen from the side."""

ALONG_RAYS = 1
"""Axis of the voxels that the front camera looks along."""

BASELINES = ("billboard", "truth", "black")
"""Runs without a reconstruction."""

BLACK = np.zeros(3, np.float32)
SHOWN = ("billboard", "paper")
"""Runs on the contact sheet, behind the truth and the first run, unless others are asked for."""

REAL_SIZE = (270, 480)
REAL_FRAMES = range(10, 111, 10)

VIEW_FIGURES = ("psnr", "ssim", "psnr_shifted", "spectrum_distance", "flicker", "flicker_truth")
VOLUME_FIGURES = (
    "density_error", "height_mass_error", "mass_ratio", "velocity_error", "velocity_cosine", "velocity_error_around",
    "velocity_cosine_around", "divergence", "divergence_truth", "warp_error", "warp_error_truth",
)  # fmt: skip
RUN_FIGURES = ("seconds", "solves", "memory_mib")

Images = Iterator[tuple[int, dict[str, np.ndarray]]]
"""Frames with a linear picture (rows, columns, 3) for each view."""


@dataclass(frozen=True, eq=False)
class Subject:
    """A clip to reconstruct, and what its results are compared with.

    Attributes
    ----------
    name
        Of the scene.
    scene_path
        The scene file that a reconstruction may see.
    frames
        Of the clip, that are reconstructed.
    scored
        Those that are scored.
    cameras
        By the name of the view; the first is the input's.
    seen
        What they saw, linear (rows, columns, 3), of a view and a frame.
    billboard
        The input picture put into a view, of a view and a frame.
    truth
        Volumes, if they are known.
    """

    name: str
    scene_path: Path
    frames: range
    scored: range
    cameras: dict[str, Camera]
    seen: Callable[[str, int], np.ndarray]
    billboard: Callable[[str, int], np.ndarray]
    truth: Truth | None

    @staticmethod
    def baked(folder: Path, frames: int) -> Subject:
        """A scene of picture.py."""
        truth = Truth.load(folder / "truth.npz")
        count = min(frames, truth.frames)
        stored = {}
        for view, name in VIEWS.items():
            with np.load(folder / f"{name}.npz") as file:
                stored[view] = file["image"][:count]

        def seen(view: str, frame: int) -> np.ndarray:
            return np.repeat(stored[view][frame][..., None].astype(np.float32), 3, axis=-1)

        cameras = {view: Scene.load(folder / f"{name}.toml").camera for view, name in VIEWS.items()}
        span = range(count)

        def billboard(_: str, frame: int) -> np.ndarray:
            return seen("0", frame)

        return Subject(folder.name, folder / "scene.toml", span, span, cameras, seen, billboard, truth)

    @staticmethod
    def real(folder: Path) -> Subject:
        """The ScalarFlow capture: input camera 02, scored on camera 00, which no reconstruction sees."""
        scene, other = Scene.load(folder / "scene.toml"), Scene.load(folder / "camera00.toml")
        cameras = {"input": scene.camera.resized(*REAL_SIZE), "camera00": other.camera.resized(*REAL_SIZE)}
        clips = {"input": Clip.open(scene.clip), "camera00": Clip.open(other.clip)}

        def seen(view: str, frame: int) -> np.ndarray:
            return area_average(clips[view].frame(frame), *REAL_SIZE)

        def billboard(view: str, frame: int) -> np.ndarray:
            return put_on_axis(seen("input", frame), cameras["input"], cameras[view], np.array(scene.domain.centre))

        frames = range(REAL_FRAMES[-1] + 1)
        return Subject(folder.name, folder / "scene.toml", frames, REAL_FRAMES, cameras, seen, billboard, None)


def put_on_axis(picture: np.ndarray, source: Camera, view: Camera, centre: np.ndarray) -> np.ndarray:
    """A picture on an upright screen through a point, which turns to face whoever looks."""

    def across(camera: Camera) -> np.ndarray:
        right = np.array(camera.matrix)[:2, 0]
        return np.array([*right / np.linalg.norm(right), 0.0])

    origin, direction = ray_through_pixels(view)
    facing = np.cross(across(view), [0.0, 0.0, 1.0])
    points = origin + direction * (((centre - origin) @ facing) / (direction @ facing))[..., None]
    lateral, height = (points - centre) @ across(view), points[..., 2] - centre[2]
    pixels, _ = project(source, centre + lateral[..., None] * across(source) + height[..., None] * [0.0, 0.0, 1.0])
    columns, rows = (np.rint(pixels[..., axis] - 0.5).astype(int) for axis in (0, 1))
    inside = (rows >= 0) & (rows < picture.shape[0]) & (columns >= 0) & (columns < picture.shape[1])
    put = np.zeros((*inside.shape, 3), np.float32)
    put[inside] = picture[rows[inside], columns[inside]]
    return put


def reconstructed(subject: Subject, run: str, folder: Path) -> dict[str, Any]:
    """Reconstruct in a process of its own, unless it is done; what run.json says."""
    done = folder / "run.json"
    if not done.exists():
        folder.mkdir(parents=True, exist_ok=True)
        worker = (sys.executable, "-m", "benchmarks.accuracy.worker")
        span = str(subject.frames[0]), str(subject.frames[-1])
        ended = subprocess.run([*worker, subject.scene_path, run, *span, folder], env=environment(), check=False)
        if ended.returncode != 0:
            sys.exit(f"{run} of {subject.name} failed with status {ended.returncode}; see above.")
    return json.loads(done.read_text())


def volume(folder: Path, subject: Subject, frame: int) -> dict[str, np.ndarray]:
    """Density and, if there is one, velocity of a frame of the clip."""
    with np.load(folder / f"{frame - subject.frames[0] + 1:04d}.npz") as file:
        return {name: file[name].astype(np.float32) for name in file.files}


def renderers(subject: Subject, scene: Scene, scattering: str, shape: tuple[int, ...]) -> dict[str, Renderer]:
    """For all views, before black."""
    scene = completed(replace(scene, domain=replace(scene.domain, resolution=shape), scattering=scattering))
    return {view: scene_renderer(scene, camera, BLACK) for view, camera in subject.cameras.items()}


def images(subject: Subject, run: str, folder: Path, frames: range) -> Images:
    """What a run shows in every view."""
    views = subject.cameras
    if run == "billboard":
        yield from ((frame, {view: subject.billboard(view, frame) for view in views}) for frame in frames)
    elif run == "black":
        yield from ((frame, {view: 0 * subject.seen(view, frame) for view in views}) for frame in frames)
    elif run == "truth":
        ours = renderers(subject, Scene.load(subject.scene_path), "single", subject.truth.shape)
        for frame in frames:
            yield frame, {view: ours[view].image(subject.truth.density(frame)) for view in views}
    else:
        about = json.loads((folder / "run.json").read_text())
        ours = renderers(subject, Scene.load(folder / "scene.toml"), about["scattering"], tuple(about["resolution"]))
        for frame in frames:
            density = volume(folder, subject, frame)["density"]
            yield frame, {view: ours[view].image(density) for view in views}


def score(subject: Subject, run: str, folder: Path) -> dict[str, Any]:
    """Figures of a run by the names of the columns; those of all new views together end in _new."""
    row: dict[str, Any] = {"scene": subject.name, "run": run, "frames": len(subject.scored)}
    row["method"] = "baseline" if run == "billboard" else "reference"
    if run not in BASELINES:
        about = reconstructed(subject, run, folder)
        row |= {name: about[name] for name in (*RUN_FIGURES, "method")}
        row["resolution"] = "x".join(map(str, about["resolution"]))
    scores = {view: PictureScore(BLACK) for view in subject.cameras}
    guessed: list[dict[str, float]] = []
    for frame, shown in images(subject, run, folder, subject.scored):
        for view, image in shown.items():
            scores[view].add(image, subject.seen(view, frame))
        if SIDE in shown:
            seen = {view: subject.seen(view, frame) for view in (FRONT, SIDE)}
            of_truth = {f"{name}_truth": value for name, value in from_the_side(seen).items()}
            guessed.append(from_the_side(shown) | of_truth)
    found = {view: judge.figures() for view, judge in scores.items()}
    used = {next(iter(subject.cameras)), *run_views(run)}
    for name in VIEW_FIGURES if subject.scored.step == 1 else VIEW_FIGURES[:-2]:  # flicker is of frames in a row
        row |= {f"{name}_{view}": figures[name] for view, figures in found.items()}
        new = [figures[name] for view, figures in found.items() if view not in used and figures[name] is not None]
        row[f"{name}_new"] = float(np.mean(new)) if new else None
    if subject.truth is not None and run not in BASELINES:
        judge = VolumeScore(subject.truth)
        for number, frame in enumerate(subject.scored):
            arrays = volume(folder, subject, frame)
            judge.add(frame, arrays["density"], arrays.get("velocity"))
            guessed[number] |= {
                "depth_anisotropy": metrics.depth_anisotropy(arrays["density"], ALONG_RAYS),
                "depth_anisotropy_truth": metrics.depth_anisotropy(subject.truth.density(frame), ALONG_RAYS),
            }
        figures = judge.figures()
        row |= {name: figures.get(name) for name in VOLUME_FIGURES}
        row |= {f"layer_{name}": figures[name] for name in ("flicker", "flicker_truth")}
    row |= {name: finite_mean(figures[name] for figures in guessed) for name in (guessed[0] if guessed else ())}
    return row


def from_the_side(shown: dict[str, np.ndarray]) -> dict[str, float]:
    """What a bad guess of the depth looks like from the side: bands, and the picture of the front."""
    front, side = (eight_bit_values(shown[view]).mean(axis=-1) for view in (FRONT, SIDE))
    return {
        "row_constant_detail": metrics.row_constant_detail(side),
        "detail_correlation": metrics.detail_correlation(side, front),
    }


def means(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The mean of every run over the scenes, if there are several."""
    if len({row["scene"] for row in rows}) < 2:
        return []
    found = []
    for run in dict.fromkeys(row["run"] for row in rows):
        mine = [row for row in rows if row["run"] == run]
        mean: dict[str, Any] = {"scene": "**mean**", "run": run}
        for name in mine[0]:
            values = [row.get(name) for row in mine]
            if all(isinstance(value, int | float) for value in values):
                mean[name] = float(np.mean(values))
        found.append(mean)
    return found


def markdown(rows: list[dict[str, Any]], views: list[str]) -> str:
    """The table to read."""
    columns: dict[str, Callable[[dict[str, Any]], str]] = {
        "scene": lambda row: row["scene"],
        "run": lambda row: row["run"],
        f"PSNR {' / '.join(views)}": lambda row: _join(row, [f"psnr_{view}" for view in views], ".1f"),
        "SSIM input, new": lambda row: _join(row, [f"ssim_{views[0]}", "ssim_new"], ".3f"),
        "shifted, new": lambda row: _join(row, ["psnr_shifted_new"], ".1f"),
        "spectrum, new": lambda row: _join(row, ["spectrum_distance_new"], ".1f"),
        "flicker (true), new": lambda row: _join(row, ["flicker_new", "flicker_truth_new"], ".4f"),
        "depth anisotropy (true)": lambda row: _join(row, ["depth_anisotropy", "depth_anisotropy_truth"], ".2f"),
        "row-constant detail (true)": lambda row: _join(
            row, ["row_constant_detail", "row_constant_detail_truth"], ".2f"
        ),
        "front in side (true)": lambda row: _join(row, ["detail_correlation", "detail_correlation_truth"], ".2f"),
        "density": lambda row: _join(row, ["density_error"], ".2f"),
        "height mass": lambda row: _join(row, ["height_mass_error"], ".2f"),
        "mass": lambda row: _join(row, ["mass_ratio"], ".2f"),
        "velocity, cosine": lambda row: _join(row, ["velocity_error", "velocity_cosine"], ".2f"),
        "around": lambda row: _join(row, ["velocity_error_around", "velocity_cosine_around"], ".2f"),
        "div (true)": lambda row: _join(row, ["divergence", "divergence_truth"], ".0e"),
        "warp (true)": lambda row: _join(row, ["warp_error", "warp_error_truth"], ".2f"),
        "s a frame": lambda row: _join(row, ["seconds"], ".2f"),
        "solves": lambda row: _join(row, ["solves"], ".0f"),
        "MiB": lambda row: _join(row, ["memory_mib"], ".0f"),
    }
    lines = [list(columns), ["---"] * len(columns)]
    lines += [[cell(row) for cell in columns.values()] for row in rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _join(row: dict[str, Any], names: list[str], form: str) -> str:
    values = [row.get(name) for name in names]
    return (
        ""
        if all(value is None for value in values)
        else " / ".join("-" if v is None else f"{v:{form}}" for v in values)
    )


def write(out: Path, name: str, rows: list[dict[str, Any]], subjects: list[Subject]) -> None:
    """The table as Markdown, on one page with the pictures, and every figure as CSV."""
    columns = dict.fromkeys(column for row in rows for column in row)
    with (out / f"{name}.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(rows)
    table = markdown(rows + means(rows), list(subjects[0].cameras))
    page = f"{rows[0]['machine']}, {rows[0]['date']}\n\n{table}\n![Pictures]({name}.png)\n"
    (out / f"{name}.md").write_text(page)


def contact_sheet(
    subjects: list[Subject], shown: list[str], folder: Callable[[Subject, str], Path], path: Path
) -> None:
    """The last scored frame: a row a scene; for every view the truth and the runs to be shown."""
    rows = []
    for subject in subjects:
        last = subject.scored[-1:]
        pictured = {run: next(images(subject, run, folder(subject, run), last))[1] for run in shown}
        half = [side // 2 for side in next(iter(subject.cameras.values())).size]
        tiles = [
            image
            for view in subject.cameras
            for image in (subject.seen(view, last[0]), *(pictured[run][view] for run in shown))
        ]
        rows.append([eight_bit(area_average(tile, *half)) for tile in tiles])
    titles = [f"{view}: {what}" for view in subjects[0].cameras for what in ("truth", *shown)]
    labels = [f"{subject.name}, frame {subject.scored[-1]}" for subject in subjects]
    write_sheet(path, rows, titles, labels)


def main() -> None:
    """Reconstruct what is not there, score everything, write table, CSV and sheet."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("scenes", type=Path, nargs="*", help="folders with truth.npz and its pictures")
    parser.add_argument("--real", type=Path, metavar="FOLDER", help="the ScalarFlow capture instead of scenes")
    parser.add_argument("--runs", nargs="+", help="qualities, paper, changes of them, baselines")
    parser.add_argument("--show", nargs="+", metavar="RUN", help="runs on the contact sheet")
    parser.add_argument("--frames", type=int, default=24, help="of every scene, from its first")
    options = parser.parse_args()
    if (options.real is None) == (not options.scenes):
        parser.error("give folders of scenes, or --real FOLDER")
    if options.real is not None:
        subjects, name = [Subject.real(options.real)], "real"
        runs = options.runs or ["balanced", SMEAR, "billboard", "black"]
    else:
        subjects, name = [Subject.baked(folder, options.frames) for folder in options.scenes], "accuracy"
        runs = options.runs or ["balanced", "paper", SMEAR, "billboard", "truth"]
    options.out.mkdir(parents=True, exist_ok=True)

    def folder(subject: Subject, run: str) -> Path:
        return options.out / "runs" / subject.name / run

    computer = describe()
    said = {"machine": f"{computer['processor']}, {computer['cores']} cores", "date": date.today().isoformat()}
    rows = []
    for done, subject in enumerate(subjects, 1):  # written after every one: the next may take an hour
        for run in runs:
            rows.append(score(subject, run, folder(subject, run)) | said)
            print(markdown(rows[-1:], list(subject.cameras)).splitlines()[-1], flush=True)
        write(options.out, name, rows, subjects[:done])
        shown = options.show or [run for run in dict.fromkeys([runs[0], *SHOWN]) if run in runs]
        contact_sheet(subjects[:done], shown, folder, options.out / f"{name}.png")


if __name__ == "__main__":
    main()
