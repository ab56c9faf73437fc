"""A Blender without a window, with the add-on registered, as new for every test."""

import json
import os
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest

import addon
from addon.core.job import Job
from addon.core.take import Take
from addon.result.smoke_takes import Run, runs
from smokelift.output.vdb import write_proxy, write_vdb
from smokelift.scene import Domain, Medium, Scene, scene_to_dict
from tests.example_shot import EXAMPLE, set_up_example, smoke

# An installed Blender finds the modules that it comes with; USD's importer calls hooks in one of them.
sys.path += [str(folder) for folder in Path(bpy.utils.resource_path("LOCAL"), "python", "lib").glob("*/site-packages")]

FRAMES = 6
DOMAIN = Domain((-1.0, -1.0, 0.0), (1.0, 1.0, 3.0), (16, 16, 24))
MEDIUM = Medium(4.0, 0.8, 0.3)
"""Of a take that `made` makes."""

_status = 0


def pytest_sessionfinish(exitstatus: int) -> None:
    """Keep the status for the end."""
    global _status
    _status = int(exitstatus)


def pytest_unconfigure() -> None:
    """End without bpy 4.5's own end: it waits for ever to destroy what a thread of it waits on."""
    if bpy.app.version[:2] == (4, 5):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(_status)


@pytest.fixture(autouse=True)
def blender(tmp_path, monkeypatch) -> Iterator[Any]:
    """An empty file and no files of a session before; Blender's own talk goes to a log.

    To reset the preferences too would load every add-on of Blender anew, which takes longer than most tests.
    """
    monkeypatch.chdir(tmp_path)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    shutil.rmtree(bpy.app.tempdir)
    Path(bpy.app.tempdir).mkdir()
    addon.register()
    yield bpy
    addon.unregister()


@pytest.fixture
def scene(blender) -> bpy.types.Scene:
    """The empty scene; Cycles marches through volumes, which is ten times as fast as its default since Blender 5.0."""
    scene = bpy.context.scene
    if hasattr(scene.cycles, "volume_biased"):
        scene.cycles.volume_biased = True
    return scene


@pytest.fixture
def shot(scene) -> bpy.types.Scene:
    """The example as an artist would have it."""
    return set_up_example(scene)


@pytest.fixture
def settings(shot) -> bpy.types.PropertyGroup:
    return smoke(shot).smokelift


@pytest.fixture
def clip(blender) -> bpy.types.MovieClip:
    return bpy.data.movieclips.load(str(EXAMPLE / "clip.mp4"))


@pytest.fixture
def stand_in(monkeypatch) -> Callable[..., None]:
    """Lets a script stand in for the engine, which is another program, where a module of the add-on starts it."""

    def put(module: ModuleType, script: str, *words: str) -> None:
        command = [sys.executable, "-I", "-c", script, *words]
        monkeypatch.setattr(module, "engine_command", lambda arguments: [*command, *arguments])

    return put


def made(
    folder: Path,
    frames: int = FRAMES,
    medium: Medium = MEDIUM,
    number: int = 1,
    used: Sequence[int] | None = None,
    proxies: bool = False,
    **tables: Any,
) -> Take:
    """A take as the engine leaves it: smoke that fills a box in a corner of the domain, and the first frame empty.

    `used` are the first and the last frame of the clip (from 0), proxies are of smoke everywhere, and `tables` are of
    the scene.
    """
    take = Take(folder / f"take_{number:04d}")
    take.directory.mkdir(parents=True)
    for n in range(1, frames + 1):
        density = np.zeros(DOMAIN.resolution, np.float32)
        density[10:13, 3:5, 12:14] = 1.0 + n if n > 1 else 0.0
        write_vdb(take.directory / f"smoke_{n:04d}.vdb", density, np.ones((*DOMAIN.resolution, 3)), DOMAIN)
        if proxies:
            write_proxy(take.directory / f"proxy_{n:04d}.vdb", np.ones(DOMAIN.resolution, np.float32), DOMAIN)
    write_index(take, Scene(domain=DOMAIN, medium=medium), frames)
    with changed(take) as index:
        index["scene"] |= tables
        if used is not None:
            index["scene"]["clip"]["frames"] = list(used)
    return take


def write_index(take: Take, scene: Scene, frames: int) -> None:
    """Give a take the index of a finished run on the example's clip."""
    described = scene_to_dict(scene) | {"clip": {"path": str(EXAMPLE / "clip.mp4"), "fps": 24.0}}
    index = {"complete": True, "scene": described, "settings": {}, "frames": {str(n): {} for n in range(1, frames + 1)}}
    (take.directory / "sequence.json").write_text(json.dumps(index))


def known_run(smoke: bpy.types.Object, take: Take, outcome: str, sentence: str = "") -> Run:
    """A run of this session in a state, without a process."""
    run = Run(take, smoke.session_uid, Job([], take.log_file), (0, True))
    run.job.outcome, run.job.sentence = outcome, sentence
    runs.append(run)
    return run


@contextmanager
def changed(take: Take) -> Iterator[dict[str, Any]]:
    """The index of a take, to be changed."""
    file = take.directory / "sequence.json"
    index = json.loads(file.read_text())
    yield index
    file.write_text(json.dumps(index))


def played(obj: bpy.types.Object, frame: int) -> str:
    """Name of the file that the viewport shows of a Volume in a frame; empty where it shows none."""
    bpy.context.scene.frame_set(frame)
    data = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    data.grids.load()
    assert data.grids.error_message == ""
    return Path(data.grids.frame_filepath).name


def ticked(obj: bpy.types.Object, *parts: str) -> bpy.types.PropertyGroup:
    """Tick these parts of Set Up Shot alone; returns the settings of the smoke."""
    for part in ("range", "camera", "light", "colors", "plate"):
        setattr(obj.smokelift, f"set_up_{part}", part in parts)
    return obj.smokelift


def save_image(path: Path, size: tuple[int, int], values: Any = None) -> bpy.types.Image:
    """A new picture in a file: float in an .exr, else eight bits with alpha."""
    deep = path.suffix == ".exr"
    image = bpy.data.images.new(path.stem, *size, alpha=True, float_buffer=deep)
    if values is not None:
        image.colorspace_settings.name = "Non-Color"  # or it is written as displayed
        image.pixels.foreach_set(np.asarray(values, np.float32).ravel())
    image.filepath_raw, image.file_format = str(path), "OPEN_EXR" if deep else "PNG"
    image.save()
    return image


def rendered(scene: bpy.types.Scene, path: Path) -> np.ndarray:
    """The current frame as Cycles renders it: linear (rows, columns, 3) for .exr, else as displayed."""
    scene.render.filepath = str(path)
    scene.render.image_settings.file_format = "OPEN_EXR" if path.suffix == ".exr" else "PNG"
    scene.render.image_settings.color_mode = "RGB"
    quietly(lambda: bpy.ops.render.render(write_still=True))
    return np.ascontiguousarray(pixels(path)[..., :3])


def pixels(path: Path) -> np.ndarray:
    """A picture file as Blender keeps its numbers, row 0 at the top, with alpha."""
    image = bpy.data.images.load(str(path))
    values = pixels_of(image)
    bpy.data.images.remove(image)
    return values


def pixels_of(image: bpy.types.Image) -> np.ndarray:
    """The colors and the alpha of an image, row 0 at the top."""
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], -1)[::-1]


def quietly(do: Any) -> None:
    """Keep what Blender prints by itself out of the tests' output."""
    sys.stdout.flush()
    kept = os.dup(1)
    with Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), 1)
    try:
        do()
    finally:
        os.dup2(kept, 1)
        os.close(kept)
