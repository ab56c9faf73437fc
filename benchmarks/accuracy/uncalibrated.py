"""Reconstruct real clips of which nothing is known, and say how much of what could be told that costs.

    python -m benchmarks.accuracy.uncalibrated --capture CAPTURE --wall WALL/scene.toml

CAPTURE holds a scene.toml with camera and box, and camera00.toml of a camera that only scores. It is reconstructed as
it is, and with the clip alone; each result is then laid where camera 00 sees it best: turned, moved, scaled where no
length is told, and with one gain. WALL is a clip of smoke before something with a pattern.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from benchmarks.accuracy.exposure import best_gain
from benchmarks.accuracy.runs import run_settings
from benchmarks.accuracy.scenes import REAL_SIZE, camera_of
from smokelift import Camera, Clip, Scene, reconstruct
from smokelift.evaluation.frame_means import eight_bit_values
from smokelift.evaluation.metrics import psnr
from smokelift.footage.images import area_average, linear_to_srgb
from smokelift.render import Image, scene_renderer
from smokelift.scene import CompleteScene
from smokelift.setup.prepare import prepare_shot
from smokelift.transport import Array

RUN = "balanced:detail=0"
"""The usual quality, without detail that is made up."""

COVERED = 0.02
"""Share of the light behind that smoke takes away where the box of the smoke in a picture begins."""

FINE = 6.0
"""Pixels over which a pattern is taken as one: its mean over them is left out."""

COARSE = 3
"""Pixels along each side that are one while a result is laid."""

AWAY = (-21, -14, -7, 7, 14, 21)
"""Pixels down and to the right by which a background is moved to tell what correlates by chance."""

BLACK = np.zeros(3, np.float32)

Matrix = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Found:
    """A reconstruction of some frames.

    Attributes
    ----------
    scene
        With all that was estimated.
    densities
        By the number of the frame.
    box
        PSNR of each frame's input view in the box of the smoke in the picture, of displayed values (dB).
    inside
        PSNR inside the smoke as the reconstruction says it (dB).
    pattern
        Correlation of the optical depth along the pixels with what is behind, both without their means over `FINE`.
    chance
        Standard deviation of that correlation with the background of other places (`AWAY`), which no smoke can have.
    """

    scene: CompleteScene
    densities: dict[int, Array]
    box: list[float]
    inside: list[float]
    pattern: list[float]
    chance: list[float]


def found(scene: Scene, frames: range) -> Found:
    """Reconstruct frames of a scene, and compare each with its picture."""
    assert scene.clip is not None
    source = replace(scene.clip, frames=(frames[0], frames[-1]))
    settings = run_settings(RUN)
    densities, box, inside, pattern, chance = {}, [], [], [], []
    with Clip.open(source) as clip:
        shot = prepare_shot(clip, scene, settings)
        for number, frame in enumerate(reconstruct(clip, scene, settings, shot=shot)):
            seen = shot.views[0].observe(number, shot.scene.domain)
            if seen is None or "psnr" not in frame.figures:
                continue
            behind = seen.plate.image
            renderer = scene_renderer(shot.scene, seen.camera, behind)
            shown = renderer.image(frame.density)
            covered = renderer.transmittance < 1 - COVERED
            if not covered.any():
                continue
            window = ndimage.find_objects(covered.astype(int))[0]
            densities[frames[number]] = frame.density
            box.append(psnr(linear_to_srgb(shown)[window], linear_to_srgb(seen.image)[window]))
            inside.append(float(frame.figures["psnr"]))
            depth = -np.log(np.maximum(renderer.transmittance, 1e-4))
            grey = behind.mean(-1)
            pattern.append(_correlation(depth, grey, covered))
            elsewhere = (np.roll(grey, (down, right), (0, 1)) for down in AWAY for right in AWAY)
            chance.append(float(np.std([_correlation(depth, each, covered) for each in elsewhere])))
        return Found(shot.scene, densities, box, inside, pattern, chance)


def _correlation(depth: Image, behind: Image, where: npt.NDArray[np.bool_]) -> float:
    """Correlation of the fine parts of two pictures where the smoke is."""
    fine = [(each - ndimage.gaussian_filter(each, FINE))[where] for each in (depth, behind)]
    return float(np.corrcoef(*fine)[0, 1]) if min(np.std(each) for each in fine) > 1e-6 else 0.0


def main(arguments: Sequence[str] | None = None) -> None:
    """Print what was found of both."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--capture", type=Path)
    parser.add_argument("--wall", type=Path)
    parser.add_argument(
        "--frames", type=int, nargs=3, default=(40, 60, 5), help="first, last, and step of those scored"
    )
    options = parser.parse_args(arguments)
    first, last, step = options.frames
    frames = range(first, last + 1)
    if options.wall:
        _say("before a wall", found(Scene.load(options.wall), frames))
    if options.capture:
        known = Scene.load(options.capture / "scene.toml")
        told, alone = found(known, frames), found(Scene(clip=known.clip), frames)
        _say("told", told)
        _say("clip alone", alone)
        _beside(options.capture, told, alone, frames[::step])


def _say(name: str, result: Found) -> None:
    largest = max(map(abs, result.pattern))
    print(
        f"{name}: box {_range(result.box)} dB, inside the smoke {_range(result.inside)} dB, correlation with what is "
        f"behind: mean {np.mean(result.pattern):+.2f}, largest {largest:.2f}, by chance {np.mean(result.chance):.2f}; "
        f"{result.scene.domain.resolution}, "
        f"{result.scene.scattering}, {len(result.densities)} frames",
        flush=True,
    )


def _range(values: Sequence[float]) -> str:
    return " / ".join(f"{each:.1f}" for each in (min(values), float(np.median(values)), max(values)))


def _beside(folder: Path, told: Found, alone: Found, scored: range) -> None:
    """Print what camera 00 sees of both, before and after each is laid best."""
    side = Scene.load(folder / "camera00.toml")
    assert side.clip is not None
    with Clip.open(side.clip) as clip:
        seen = {frame: area_average(clip.frame(frame), *REAL_SIZE) for frame in scored}
    camera = camera_of(folder / "camera00.toml").resized(*REAL_SIZE)
    for name, result in (("told", told), ("clip alone", alone)):
        view = View(camera, laid_on(told.scene, result.scene), np.array(result.scene.domain.centre))
        laid = best_laid(result, view, seen, scaled=result is alone)
        for which, by in (
            ("from the same side of the input's camera", np.zeros(7)),
            (f"laid best {laid.round(3)}", laid),
        ):
            plain, gained = scores(result, view.moved(by), seen)
            print(f"camera 00, {name}, {which}: {plain:.2f} dB, with a gain {gained:.2f}", flush=True)


@dataclass(frozen=True, eq=False)
class View:
    """A camera that looks at a result whose world is another one.

    Attributes
    ----------
    camera
        In the world that is told.
    start : (4, 4)
        From the world that is told to that of the result: turn, shift and one scale.
    centre : (3,)
        Of the result's box.
    """

    camera: Camera
    start: Matrix
    centre: Matrix

    def moved(self, by: Matrix) -> Camera:
        """The camera in the result's world.

        Parameters
        ----------
        by : (7,)
            Rotation vector about the centre, shift as a share of the distance to it, logarithm of a scale.
        """
        matrix = self.start @ np.array(self.camera.matrix)
        matrix[:3, :3] /= np.cbrt(np.linalg.det(matrix[:3, :3]))
        away = matrix[:3, 3] - self.centre
        turn = Rotation.from_rotvec(by[:3]).as_matrix()
        matrix[:3, :3] = turn @ matrix[:3, :3]
        matrix[:3, 3] = self.centre + np.exp(by[6]) * turn @ away + np.linalg.norm(away) * by[3:6]
        return replace(self.camera, matrix=tuple(map(tuple, matrix.tolist())))


def best_laid(result: Found, view: View, seen: dict[int, Image], *, scaled: bool) -> Matrix:
    """Return what `View.moved` takes so that the camera sees the result best, with one gain."""
    free = 7 if scaled else 6
    steps = np.array([0.1, 0.1, 0.1, 0.02, 0.02, 0.02, 0.1])[:free]

    columns, rows = (side // COARSE for side in view.camera.size)
    small = {frame: area_average(picture, columns, rows) for frame, picture in seen.items()}

    def misfit(by: Matrix) -> float:
        moved = view.moved(np.pad(by * steps, (0, 7 - free)))
        return -scores(result, moved.resized(columns, rows), small)[1]

    limits, options = [(-8.0, 8.0)] * free, {"maxfev": 250, "xtol": 0.02, "ftol": 1e-4}
    best = minimize(misfit, np.zeros(free), method="Powell", bounds=limits, options=options)
    return np.pad(best.x * steps, (0, 7 - free))


def laid_on(told: CompleteScene, other: CompleteScene) -> Matrix:
    """From the world that is told to the one that was found: what is up stays up.

    The boxes' middles lie on each other, the input's cameras look there from the same side, and both see them equally
    large.
    """
    middles = [np.array(scene.domain.centre) for scene in (told, other)]
    aways = [np.array(scene.camera.matrix)[:3, 3] - at for scene, at in zip((told, other), middles, strict=True)]
    ours, theirs = (np.arctan2(away[1], away[0]) for away in aways)
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_euler("z", theirs - ours).as_matrix()
    matrix[:3, :3] *= np.linalg.norm(aways[1]) / np.linalg.norm(aways[0])
    matrix[:3, 3] = middles[1] - matrix[:3, :3] @ middles[0]
    return matrix


def scores(result: Found, camera: Camera, seen: dict[int, Image]) -> tuple[float, float]:
    """PSNR of displayed values over all of the picture before black, as it is and with one gain, mean of the frames."""
    renderer = scene_renderer(result.scene, camera, BLACK)
    shown = [renderer.image(result.densities[frame]) for frame in seen]
    gain = best_gain(shown, list(seen.values()))
    plain, gained = (
        [
            psnr(eight_bit_values(g * ours), eight_bit_values(true))
            for ours, true in zip(shown, seen.values(), strict=True)
        ]
        for g in (1.0, gain)
    )
    return float(np.mean(plain)), float(np.mean(gained))


if __name__ == "__main__":
    main()
