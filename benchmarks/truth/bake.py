"""Bake scenes with a known flow by Mantaflow, in a Blender of Debian that is installed for it.

    python -m benchmarks.truth.bake OUT [choose | report | NAME ...] [--resolution 64x64x96] [--steps 1]

writes OUT/NAME/truth.npz for each scene that is not there yet. Needs root on Linux and mmdebstrap.
"""

import argparse
import hashlib
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

from benchmarks.truth.scenes import BOX_SIZE, FRAMES, SEEDS, names, scene

HERE = Path(__file__).resolve().parent
ENTER = HERE.parents[1] / "tests" / "blender" / "root" / "enter.sh"
ROOT = Path.home() / ".cache" / "smokelift-tests" / "bookworm"


def debian_root() -> Path:
    """The Debian root with Blender 3.4.1, built unless it is there, made by the same recipe."""
    recipe, stamp = HERE / "make_root.sh", ROOT / "made-by"
    made_by = hashlib.sha256(recipe.read_bytes()).hexdigest()
    if stamp.is_file() and stamp.read_text() == made_by:
        return ROOT
    if not sys.platform.startswith("linux") or os.geteuid() != 0 or shutil.which("mmdebstrap") is None:
        sys.exit("Baking builds a Debian root: install mmdebstrap, and run this again as root on Linux.")
    print(f"building a Debian root in {ROOT}", flush=True)
    subprocess.run([recipe, ROOT], check=True, stdout=subprocess.DEVNULL)
    stamp.write_text(made_by)
    return ROOT


def bake(name: str, across: int, frames: int, steps: int, folder: Path) -> None:
    """Bake a scene into a folder, which appears whole or not at all."""
    part = folder.with_suffix(".part")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    # the root sees one folder only, so the scripts are copied into it
    scripts = [shutil.copy(HERE / script, part) for script in ("manta_scene.py", "mantaflow.py", "scenes.py")]
    blender = ("blender", "-b", "--factory-startup", "--python-exit-code", "1", "-P", scripts[0])
    command = [ENTER, debian_root(), part, *blender, "--", name, *map(str, (across, frames, steps)), part / "truth.npz"]
    log = part / "bake.log"
    with log.open("w") as stream:
        done = subprocess.run(command, stdout=stream, stderr=subprocess.STDOUT)
    if done.returncode != 0 or not (part / "truth.npz").is_file():
        sys.exit(f"{name} was not baked; the last that Blender said is in {log}.")
    for script in scripts:
        Path(script).unlink()
    log.unlink()
    shutil.rmtree(part / "__pycache__", ignore_errors=True)
    part.rename(folder)


def voxels_across(text: str) -> int:
    """Voxels along x of a resolution like "64x64x96", which has to have the box's proportions."""
    across = int(text.split("x")[0])
    if text != "x".join(f"{across * size / BOX_SIZE[0]:g}" for size in BOX_SIZE):
        raise argparse.ArgumentTypeError(f"{text} has not the proportions of the box: say for instance 48x48x72.")
    return across


def main() -> None:
    """Bake what is asked for and not there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("scenes", nargs="+", help="a use (choose, report) or names such as plume-1")
    parser.add_argument("--resolution", type=voxels_across, default=64, help="as 48x48x72; 64x64x96 unless said")
    parser.add_argument("--frames", type=int, default=FRAMES, help=f"{FRAMES} unless said")
    parser.add_argument(
        "--steps", type=int, default=1, help="of the solver, a frame; with more than one no velocity is kept"
    )
    options = parser.parse_args()
    wanted = [name for word in options.scenes for name in (names(word) if word in SEEDS else [word])]
    try:
        for name in wanted:
            scene(name)
    except ValueError as unknown:
        parser.error(str(unknown))
    for name in wanted:
        folder = options.out.resolve() / name
        if not folder.exists():
            began = time.monotonic()
            bake(name, options.resolution, options.frames, options.steps, folder)
            print(f"{folder / 'truth.npz'}: {time.monotonic() - began:.0f} s", flush=True)


if __name__ == "__main__":
    main()
