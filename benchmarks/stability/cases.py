"""The classes of cases: what is damaged and which command reads it, and what of the system fails."""

import json
import shutil
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.stability.environments import ENVIRONMENTS
from benchmarks.stability.forked import Ended, files_of, run, verdict
from benchmarks.stability.mutations import damaged_bytes, damaged_json, damaged_text, extreme_array
from benchmarks.stability.recovery import recovered
from benchmarks.stability.shot import TinyShot
from smokelift.app.cli import main

INSPECT = ("inspect", "scene.toml", "--quality", "draft", "--device", "cpu")
EXTRACT = ("extract", "scene.toml", "--out", "new_####.exr", "--plate", "new.exr", "--device", "cpu")
RENDER = ("render", "out", "--frame", "2", "--out", "new.png", "--device", "cpu")
RESUME = ("reconstruct", "scene.toml", "--quality", "draft", "--device", "cpu", "--out", "out", "--npz", "--resume")

Damage = np.random.Generator | None
"""What decides how files are damaged; without it they stay sound."""

Prepare = Callable[[TinyShot, Path, Damage], tuple[str, ...]]
"""Makes a folder with something damaged in it, and returns the words of the command."""


def scene(shot: TinyShot, folder: Path, random: Damage) -> tuple[str, ...]:
    """A scene file with hostile values."""
    shutil.copytree(shot.pictures, folder)
    path = folder / "scene.toml"
    if random:
        path.write_text(damaged_text(path.read_text(), random))
    return INSPECT


def clip(shot: TinyShot, folder: Path, random: Damage) -> tuple[str, ...]:
    """A damaged video."""
    shutil.copytree(shot.video, folder)
    _damage(folder / "clip.mp4", random)
    return INSPECT


def picture(shot: TinyShot, folder: Path, random: Damage) -> tuple[str, ...]:
    """A damaged picture of the clip, or a damaged plate."""
    shutil.copytree(shot.pictures, folder)
    _damage(folder / ("plate.exr" if random and random.random() < 0.5 else "frame_0001.png"), random)
    return INSPECT


def index(shot: TinyShot, folder: Path, random: Damage) -> tuple[str, ...]:
    """A `sequence.json` with hostile values."""
    shutil.copytree(shot.finished, folder)
    path = folder / "out" / "sequence.json"
    if random:
        path.write_text(damaged_json(path.read_text(), random))
    return RENDER


def twin(shot: TinyShot, folder: Path, random: Damage) -> tuple[str, ...]:
    """A damaged NumPy twin in a sequence without checksums, which would tell."""
    shutil.copytree(shot.finished, folder)
    path = folder / "out" / "sequence.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "checksums": {}}))
    _damage_archive(folder / "out" / "smoke_0002.npz", random)
    return RENDER


def vdb(shot: TinyShot, folder: Path, random: Damage) -> tuple[str, ...]:
    """A damaged OpenVDB file."""
    shutil.copytree(shot.finished, folder)
    (folder / "out" / "smoke_0002.npz").unlink()
    path = folder / "out" / "smoke_0002.vdb"
    if path.exists():  # where there is no OpenVDB module the frame is missing
        _damage(path, random)
    return RENDER


def state(shot: TinyShot, folder: Path, random: Damage) -> tuple[str, ...]:
    """A damaged state of a run that is resumed."""
    shutil.copytree(shot.begun, folder)
    path = folder / "out" / "sequence.json"  # the run of a shot in this folder
    path.write_text(path.read_text().replace(str(shot.begun), str(folder)))
    _damage_archive(folder / "out" / "resume.npz", random)
    return RESUME


def painted(shot: TinyShot, folder: Path, random: Damage) -> tuple[str, ...]:
    """A damaged plate, mask, stroke or picture of what is extracted, or a scene file that says other things of them."""
    shutil.copytree(shot.painted, folder)
    names = ("plate.exr", "mask.png", "strokes.png", "frame_0001.png", "scene.toml")
    path = folder / names[int(random.integers(len(names)))] if random else folder / "scene.toml"
    if random and path.suffix == ".toml":
        path.write_text(damaged_text(path.read_text(), random))
    else:
        _damage(path, random)
    return EXTRACT


DAMAGED: Mapping[str, tuple[Prepare, str]] = {
    "NumPy twin": (twin, "new"),
    "OpenVDB": (vdb, "new"),
    "clip": (clip, "new"),
    "picture": (picture, "new"),
    "resume.npz": (state, "out/"),
    "scene file": (scene, "new"),
    "sequence.json": (index, "new"),
}
"""How a case of each class of damaged files is made, and how the names begin that its command may write."""

EXTRACTED: Mapping[str, tuple[Prepare, str]] = {"extraction": (painted, "new")}
"""Classes of damaged files that came after the failing systems, made in the same way."""


def damaged(prepare: Prepare, out: str, shot: TinyShot, place: Path, random: Damage) -> tuple[Ended, str]:
    """Run a command on damaged files.

    Parameters
    ----------
    prepare, out
        Of a class.
    shot
        What is damaged.
    place
        A folder to be made.
    random
        What decides how; without it the files stay sound.

    Returns
    -------
    ended
        How the command ended.
    wrong
        In a word what is wrong with that; "" if nothing is.
    """
    words = prepare(shot, place, random)
    before = files_of(place)
    ended = run(main, words, place)
    return ended, verdict(ended, before, files_of(place), out)


CLASSES: Mapping[str, Callable[[TinyShot, Path, Damage], tuple[Ended, str]]] = {
    **{name: partial(damaged, *damage) for name, damage in DAMAGED.items()},
    **{name: partial(recovered, environment) for name, environment in ENVIRONMENTS.items()},
    **{name: partial(damaged, *damage) for name, damage in EXTRACTED.items()},
}
"""Each class by what runs one case of it. New ones go to the end: a class's place decides how its cases are drawn."""


def _damage(path: Path, random: Damage) -> None:
    if random:
        path.write_bytes(damaged_bytes(path.read_bytes(), random))


def _damage_archive(path: Path, random: Damage) -> None:
    """Damage the bytes of an archive, or put other arrays into a sound one."""
    if random is None:
        return
    if random.random() < 0.5:
        _damage(path, random)
        return
    with np.load(path) as file:
        arrays = dict(file)
    name = list(arrays)[int(random.integers(len(arrays)))]
    np.savez(path, **{**arrays, name: extreme_array(arrays[name], random)})
