"""Reconstruct real clips of which nothing is known, and say how much of what could be given that costs.

    python -m benchmarks.accuracy.uncalibrated --capture CAPTURE --wall WALL/scene.toml

CAPTURE holds a scene.toml with camera, box and background, and camera00.toml of a camera that only scores. The clip is
reconstructed with all of that, with nothing, and with every choice between of what of the camera and the box is given;
each result is then laid where camera 00 sees it best (`laying`). WALL is a clip of smoke before something with a
pattern.

What is not given is estimated from the whole clip. Frames are then reconstructed one by one, as the first of a clip.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from benchmarks.accuracy.exchange import Given, partly
from benchmarks.accuracy.laying import Result, Score, Seen, best_laid, scores, starts
from benchmarks.accuracy.runs import run_settings
from benchmarks.accuracy.scenes import REAL_SIZE, camera_of
from smokelift import Clip, Reconstruction, Scene, Settings, prepare_shot
from smokelift.evaluation.metrics import psnr
from smokelift.footage.images import area_average, linear_to_srgb
from smokelift.pipeline import compose
from smokelift.render import Image, Volume, scene_renderer
from smokelift.scene import CompleteScene
from smokelift.setup.settings import SelectionSettings

RUN = "balanced:detail=0"
"""The usual quality, without detail that is made up."""

FRAMES = (30, 50, 70, 90)
"""Frames of a capture that are scored."""

WALL_STEP = 6
"""Every such frame of the clip before a wall is reconstructed."""

COVERED = 0.02
"""Share of the light behind that smoke takes away where the box of the smoke in a picture begins."""

WIDE = 6.0
"""Pixels over which a pattern is taken as one: its mean over them is left out."""

AWAY = (-21, -14, -7, 7, 14, 21)
"""Pixels down and to the right by which a background is moved to tell what correlates by chance."""

STRONGER = 2.0
"""Ratio of lights that fit the clip about equally: how much it costs that the light is unknown."""


@dataclass(frozen=True, eq=False)
class FrontFigures:
    """What a reconstructed frame shows where it was filmed from.

    Attributes
    ----------
    box
        PSNR of the input view in the box of the smoke in the picture, of displayed values (dB).
    inside
        PSNR inside the smoke as the reconstruction says it (dB).
    pattern
        Correlation of the optical depth along the pixels with what is behind, both without their means over `WIDE`.
    elsewhere : (36,)
        The same with the background of other places (`AWAY`), which no smoke can have.
    """

    box: float
    inside: float
    pattern: float
    elsewhere: npt.NDArray[np.float64]


def found(scene: Scene, settings: Settings, numbers: Iterable[int]) -> tuple[Result, list[FrontFigures]]:
    """Reconstruct single frames of a scene, by their numbers; those without smoke have no figures."""
    assert scene.clip is not None
    densities: dict[int, Volume] = {}
    figures = []
    with Clip.open(scene.clip) as clip:
        shot = prepare_shot(clip, scene, settings)
        for number in numbers:
            view = replace(shot.views[0], clip=shot.clip.part(number, number))
            one = replace(shot, views=(view,))
            (frame,) = Reconstruction(one, compose(one.settings))
            densities[number] = frame.density
            seen = view.observe(0, shot.scene.domain)
            if seen is not None and "psnr_working" in frame.figures:
                behind = seen.plate.image
                renderer = scene_renderer(shot.scene, seen.camera, behind)
                shown = renderer.image(frame.density)
                whole = front_figures(shown, seen.image, behind, renderer.transmittance, frame.figures["psnr_working"])
                figures += [whole] if whole else []
        return Result(shot.scene, densities), figures


def front_figures(shown: Image, seen: Image, behind: Image, passed: Image, inside: float) -> FrontFigures | None:
    """Compare what a density shows with what was seen; None where it covers nothing.

    Parameters
    ----------
    shown, seen, behind : (rows, columns, 3)
        Linear radiance.
    passed : (rows, columns)
        Share of the light behind that the smoke lets through.
    inside
        As in `FrontFigures`.
    """
    covered = passed < 1 - COVERED
    if not covered.any():
        return None
    window = ndimage.find_objects(covered.astype(int))[0]
    depth, grey = -np.log(np.maximum(passed, 1e-4)), behind.mean(-1)
    elsewhere = [_correlation(depth, np.roll(grey, (down, right), (0, 1)), covered) for down in AWAY for right in AWAY]
    box = psnr(linear_to_srgb(shown)[window], linear_to_srgb(seen)[window])
    return FrontFigures(box, inside, _correlation(depth, grey, covered), np.array(elsewhere))


def _correlation(depth: Image, behind: Image, where: npt.NDArray[np.bool_]) -> float:
    """Correlation of the fine parts of two pictures where the smoke is."""
    fine = [(each - ndimage.gaussian_filter(each, WIDE))[where] for each in (depth, behind)]
    return float(np.corrcoef(*fine)[0, 1]) if min(np.std(each) for each in fine) > 1e-6 else 0.0


def pattern_figures(frames: Sequence[FrontFigures]) -> dict[str, float]:
    """What frames say together of the pattern in the smoke.

    Returns
    -------
    dict
        ``mean`` of the correlations with their sign, its ``error`` by chance (deviation of the same mean over the
        places of `AWAY`), ``deviation`` over the frames, ``chance`` in one frame; ``largest`` without its sign, and
        ``largest_chance``, the same by chance (median over those places).
    """
    pattern = np.array([frame.pattern for frame in frames])
    elsewhere = np.array([frame.elsewhere for frame in frames])
    return {
        "mean": float(pattern.mean()),
        "error": float(elsewhere.mean(0).std()),
        "deviation": float(pattern.std()),
        "chance": float(elsewhere.std(1).mean()),
        "largest": float(np.abs(pattern).max()),
        "largest_chance": float(np.median(np.abs(elsewhere).max(0))),
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Print what was found of both."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--capture", type=Path)
    parser.add_argument("--wall", type=Path)
    parser.add_argument("--frames", type=int, nargs="+", default=FRAMES, help="those of CAPTURE that are scored")
    options = parser.parse_args(arguments)
    if options.wall:
        scene = Scene.load(options.wall)
        assert scene.clip is not None
        with Clip.open(scene.clip) as clip:
            numbers = range(clip.first, clip.first + len(clip), WALL_STEP)
        _say("before a wall", found(scene, run_settings(RUN), numbers)[1])
    if options.capture:
        _beside(options.capture, options.frames)


def _say(name: str, frames: Sequence[FrontFigures]) -> None:
    said = ", ".join(f"{key} {value:+.3f}" for key, value in pattern_figures(frames).items())
    box, inside = (_range([getattr(frame, key) for frame in frames]) for key in ("box", "inside"))
    print(f"{name}: box {box} dB, inside the smoke {inside} dB, {len(frames)} frames; pattern: {said}", flush=True)


def _range(values: Sequence[float]) -> str:
    return " / ".join(f"{each:.1f}" for each in (min(values), float(np.median(values)), max(values)))


def _beside(folder: Path, numbers: Sequence[int]) -> None:
    """Print what camera 00 sees of all that is given, of nothing, and of what is between."""
    side, known = Scene.load(folder / "camera00.toml"), Scene.load(folder / "scene.toml")
    assert side.clip is not None
    with Clip.open(side.clip) as clip:
        pictures = {number: area_average(clip.frame(number), *REAL_SIZE) for number in numbers}
    seen = Seen(camera_of(folder / "camera00.toml").resized(*REAL_SIZE), pictures)
    given, figures = found(known, run_settings(RUN), numbers)
    _say("all given", figures)
    alone, figures = found(Scene(clip=known.clip), run_settings(RUN), numbers)
    _say("nothing given", figures)
    _say_laid("all given", given, given.scene, seen)
    only = found(Scene(clip=known.clip, camera=known.camera), run_settings(RUN), numbers)[0]
    _say_laid("the camera given, without a box", only, given.scene, seen)
    _say_laid("nothing given", alone, given.scene, seen)
    # the densities alone are compared, and how light is scattered was the same on both sides
    plain = replace(run_settings(RUN), selection=SelectionSettings(measure=False))
    for focal, tilt, box in product((True, False), repeat=3):
        parts = Given(focal, tilt, box)
        camera, domain = partly(given.scene, alone.scene, parts)
        scene = Scene(clip=known.clip, camera=camera, domain=domain)
        result = found(scene, plain, numbers)[0]
        _say_laid(str(parts), result, given.scene, seen)
        if focal == tilt == box:
            lit = tuple(light.scaled(STRONGER) for light in result.scene.lights)
            stronger = replace(scene, lights=lit, scattering=result.scene.scattering)
            result = found(stronger, plain, numbers)[0]
            _say_laid(f"{parts}, light times {STRONGER:g}", result, given.scene, seen)


def _say_laid(name: str, result: Result, given: CompleteScene, seen: Seen) -> None:
    """Print what camera 00 sees of a result, as it lies where that is given, and laid best."""
    ways = starts(given, result.scene)
    laid = best_laid(result, ways, seen)
    best = scores(result, laid.camera, seen)
    if result.scene is given:
        _say_score(f"camera 00, {name}, as it lies", scores(result, seen.camera, seen))
    ends = " ".join(f"{end:.2f}" for end in laid.ends)
    _say_score(f"camera 00, {name}, laid best", best, f"; ends of the coarse searches {ends}")


def _say_score(name: str, score: Score, more: str = "") -> None:
    plain, gained = (np.array(each) for each in (score.plain, score.gained))
    frames = " ".join(f"{each:.2f}" for each in gained)
    print(f"{name}: {plain.mean():.2f} dB, with a gain {gained.mean():.2f} ({frames}){more}", flush=True)


if __name__ == "__main__":
    main()
