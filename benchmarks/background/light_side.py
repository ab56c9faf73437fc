"""Find from which side of the picture a baked scene's sun comes.

    python -m benchmarks.background.light_side SCENES/plume-1 SCENES/jet-2 ... [--estimated]

A scene is a folder that `benchmarks.truth.picture` filled. Its views stand in front of a brick wall, whose picture is
given or estimated. Thin smoke is the same with 0.3 of its optical depth.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from benchmarks.background.clips import Smoke, exposed, filmed, wall
from benchmarks.background.thickness import THIN
from smokelift.footage.plate import known_plate
from smokelift.scene import DirectionalLight, Scene
from smokelift.setup.background import find_plates
from smokelift.setup.light_side import LightSide, light_side
from smokelift.setup.smoke import sample_smoke
from smokelift.setup.thickness import smoke_thickness

VIEWS = ("front", "side", "nov45")
BRIGHTEST = 0.6
"""Linear radiance of the smoke's brightest hundredth."""


def main() -> None:
    """Print the angle in the picture's plane towards the sun, true and found, and whether a run would say it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--estimated", action="store_true", help="do not give the wall")
    options = parser.parse_args()
    print("| scene | view | smoke | true | found | sideways | sun | told | seconds |")
    print("| --- " * 9 + "|")
    for folder in options.scenes:
        for view in VIEWS:
            true = _true(folder, view)
            for kind, share in (("as baked", 1.0), ("thin", THIN)):
                start = f"| {folder.name} | {view} | {kind} | {'none' if true is None else f'{true:.0f}'}"
                print(f"{start} | {_row(Smoke.load(folder, view).thinned(share), options.estimated)} |", flush=True)


def _true(folder: Path, view: str) -> float | None:
    """Angle of the direction towards the sun in the picture's plane, if there is one."""
    light, camera = Scene.load(folder / "scene.toml").lights[0], Scene.load(folder / f"{view}.toml").camera
    if not isinstance(light, DirectionalLight) or camera is None:
        return None
    right, up, _ = -np.asarray(camera.matrix)[:3, :3].T @ light.direction
    return float(np.degrees(np.arctan2(up, right)))


def _row(smoke: Smoke, estimated: bool) -> str:
    """Angle found, its figures, whether it is told, and processor time."""
    lit = smoke.radiance[smoke.radiance > 0.01]
    smoke = Smoke(smoke.radiance * np.float32(BRIGHTEST / np.quantile(lit, 0.99)), smoke.transmittance)
    behind = wall((smoke.radiance.shape[1], smoke.radiance.shape[2]))
    clip = filmed(exposed(smoke.before(behind), np.ones(len(smoke.radiance))), "baked")
    plates = find_plates(clip, None, None).plates if estimated else known_plate(behind, clip)
    samples = sample_smoke(clip, plates)
    if smoke_thickness(samples.textures).source is None:
        return "- | - | - | no, thickness undetermined | 0"
    start = time.process_time()
    side: LightSide | None = light_side(samples.textures)
    spent = time.process_time() - start
    if side is None:
        return f"- | - | - | no, too little texture | {spent:.2f}"
    told = "yes" if side.told else "no"
    return f"{side.angle:.0f} | {side.sideways:.2f} | {side.sun:.2f} | {told} | {spent:.2f}"


if __name__ == "__main__":
    main()
