"""Seconds a frame of whole runs, from decoding a clip to OpenVDB files on disk, and their peak of memory.

Every run has a process of its own. Machines differ and are shared, so times are also given in Poisson solves of the
same grid, which are timed between the frames.
"""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks import machine
from benchmarks.pipeline.clip import with_grid, write_clip
from benchmarks.pipeline.worker import Job, run_apart
from benchmarks.tables import size_text
from benchmarks.timing import UNTIMED
from smokelift.scene import Scene
from smokelift.setup.settings import MethodName, Quality

Shape = tuple[int, int, int]

LIBRARIES = ("numpy", "scipy", "taichi")


def run(
    scene_path: Path | None,
    sizes: Sequence[Shape],
    methods: Sequence[MethodName],
    quality: Quality,
    frames: int,
    say: Callable[[str], None],
    save: Callable[[dict[str, Any]], None],
) -> dict[str, Any]:
    """Time runs of every size and method.

    Parameters
    ----------
    scene_path
        A scene file with a clip; None takes the built-in clip.
    sizes
        Voxels along x, y and z.
    methods, quality
        As in `Settings`.
    frames
        How many are timed. Two more come before them, while compilers work.
    say
        Takes a sentence about each run.
    save
        Gets the results so far after each run.

    Returns
    -------
    dict
        ``date``, ``machine``, ``versions``, ``clip``, ``quality`` and ``runs``, a list of `Run`. Ready for JSON.
    """
    results: dict[str, Any] = {
        **machine.provenance(LIBRARIES),
        "clip": "built-in" if scene_path is None else scene_path.name,
        "quality": quality,
        "runs": [],
    }
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        known = Scene.load(scene_path) if scene_path is not None else write_clip(folder, UNTIMED + frames)
        for shape in sizes:
            path = folder / "scene.toml"
            (known if scene_path is not None else with_grid(known, shape)).save(path)
            for method in methods:
                found = run_apart(Job(str(path), shape, method, quality, frames), folder)
                results["runs"].append(asdict(found))
                outcome = found.failure or f"{found.seconds:.3g} s a frame, {found.solves:.0f} solves"
                say(f"{size_text(shape)}, {method}: {outcome}")
                save(results)
    return results
