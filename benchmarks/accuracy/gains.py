"""Even out the exposures of two cameras before baked smoke, and look from a third side.

    python -m benchmarks.accuracy.gains SCENES/plume-1 SCENES/jet-2 ... [--unlit]

A scene is a folder that `benchmarks.truth.picture` filled. The side's pictures are multiplied by a gain; what is unlit
has light from everywhere in place of the scene's.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.accuracy.scenes import camera_of
from benchmarks.background.clips import Smoke, exposed, filmed
from smokelift.density import reconstruct_density
from smokelift.footage.clip import Clip
from smokelift.footage.plate import known_plate
from smokelift.footage.working_picture import working_picture
from smokelift.render import scene_optics
from smokelift.scene import CompleteScene, DirectionalLight, Scene, completed
from smokelift.setup.settings import Settings
from smokelift.setup.shot import ShotView
from smokelift.setup.view_gain import balanced

FRAMES = (20, 10)
RESOLUTION = (32, 32, 48)
GAINS = {"1": (1.0, 1.0, 1.0), "0.65": (0.65,) * 3, "1.4": (1.4,) * 3, "0.60, 0.70, 0.85": (0.6, 0.7, 0.85)}
UNSEEN = "nov45"


def main() -> None:
    """Print what was found, and how the third side looks: without, with and as if both were exposed alike."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--unlit", action="store_true")
    options = parser.parse_args()
    print("| scene | gain of the side | found | third side (dB): as it is | evened out |")
    print("| --- | --- | --- | --- | --- |")
    for folder in options.scenes:
        scene = completed(Scene.load(folder / "scene.toml"))
        scene = replace(scene, domain=replace(scene.domain, resolution=RESOLUTION))
        if options.unlit:
            scene = _unlit(scene, float(Smoke.load(folder, "front").radiance.max()))
        for name, gain in GAINS.items():
            front, side = (
                _view(folder, view, scene, np.array(g)) for view, g in (("front", (1, 1, 1)), ("side", gain))
            )
            settings = Settings.preset("balanced", "default")
            tolerance, lit = settings.selection.scattering_error, not options.unlit
            even, found = balanced(1, front, side, scene, lit, FRAMES, settings.density, tolerance)
            seen = [f"{_third(folder, scene, front, each):.1f}" for each in (side, even)]
            print(
                f"| {folder.name} | {name} | {found[0].chosen if found else 'none'} | {' | '.join(seen)} |", flush=True
            )


def _unlit(scene: CompleteScene, brightest: float) -> CompleteScene:
    irradiance = (1.1 * brightest * 4 * np.pi / scene.medium.albedo,) * 3
    return replace(scene, lights=(DirectionalLight((0.0, 0.0, -1.0), irradiance),), scattering="unshadowed")


def _view(folder: Path, view: str, scene: CompleteScene, gain: npt.NDArray[np.float64]) -> ShotView:
    """A camera of a scene with its clip, multiplied by a gain, before black."""
    pictures = (Smoke.load(folder, view).radiance[..., None] * gain).astype(np.float32)
    clip: Clip = filmed(np.clip(exposed(pictures, np.ones(len(pictures))), 0, 1), view)
    camera = camera_of(folder / f"{view}.toml")
    return ShotView(clip, camera, known_plate(np.zeros(3), clip), working_picture(camera, scene.domain))


def _third(folder: Path, scene: CompleteScene, front: ShotView, side: ShotView) -> float:
    """PSNR of a picture that no density was fitted to, with peak 1, where there is smoke."""
    frame = FRAMES[0]
    seen, other = (each.observe(frame, scene.domain) for each in (front, side))
    assert seen is not None
    assert other is not None
    lit = replace(scene, camera=seen.camera)
    fitted = reconstruct_density(seen.image, lit, plate=seen.plate, views=(other,))
    working = working_picture(camera_of(folder / f"{UNSEEN}.toml"), scene.domain)
    truth = working.cut(np.repeat(Smoke.load(folder, UNSEEN).radiance[frame][..., None], 3, -1))
    shown = scene_optics(scene).renderer(working.camera, np.zeros(3, np.float32)).image(fitted.density)
    wrong = (shown - truth)[np.maximum(shown, truth).max(-1) > 0.01]
    return float(-10 * np.log10(np.mean(np.square(wrong))))


if __name__ == "__main__":
    main()
