"""What a caller can do wrong: the documented kind of error, exactly, and what to do in its sentence."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import smokelift
from smokelift.footage.frame_source import ClipError
from smokelift.footage.images import ImageError
from smokelift.output.index import SequenceError
from smokelift.scene import SceneError

NAN, SMALL, BOX = np.full((8, 8, 8), np.nan, np.float32), np.zeros((4, 8, 8)), np.zeros((8, 8, 8))
STILL = smokelift.Velocity.zero((8, 8, 8), 0.1)

SCENES: dict[str, Callable[[Path], object]] = {
    "a part of a scene": lambda _: smokelift.Scene(camera=3),  # type: ignore[arg-type]
    "a list in a scene": lambda _: smokelift.Scene(lights=[3]),  # type: ignore[arg-type]
    "a value": lambda _: smokelift.Medium(albedo=2),
    "a file that is missing": lambda folder: smokelift.Scene.load(folder / "none.toml"),
    "a choice in settings": lambda _: smokelift.Settings.preset("best"),  # type: ignore[arg-type]
    "a number in settings": lambda _: replace(smokelift.Settings.preset(), detail=3),
    "a seed": lambda _: replace(smokelift.Settings.preset(), seed=-1),
}

FILES: dict[type[ValueError], Callable[[Path], object]] = {
    ClipError: lambda folder: smokelift.Clip.open(folder / "none.mp4"),
    ImageError: lambda folder: smokelift.Clip.open(folder / "frame_0001.png", mask=folder / "none.png"),
    SequenceError: lambda folder: smokelift.Sequence.open(folder),
}

ARRAYS: dict[str, Callable[[], object]] = {
    "set them to 0": lambda: smokelift.advect(NAN, STILL, 0.1),
    "holds densities that are not finite; set": lambda: smokelift.estimate_velocity(NAN, BOX, 0.1, 0.1),
    "negative densities; set": lambda: smokelift.estimate_velocity(BOX - 1, BOX, 0.1, 0.1),
    "resample it": lambda: smokelift.advect(SMALL, STILL, 0.1),
    "bring one to the other's size": lambda: smokelift.metrics.psnr(BOX, SMALL),
    "replace those that are not": lambda: smokelift.metrics.psnr(NAN, BOX),
    "give one value at least": lambda: smokelift.metrics.psnr([], []),
}


@pytest.mark.parametrize("call", SCENES.values(), ids=SCENES.keys())
def test_scenes_and_settings_have_one_kind(call, tmp_path) -> None:
    with pytest.raises(SceneError):
        call(tmp_path)


@pytest.mark.parametrize(("kind", "call"), FILES.items())
def test_files_have_the_kind_of_what_they_hold(kind, call, tmp_path, plume) -> None:
    picture = Path(str(plume.scene.clip.path).replace("####", "0001"))
    (tmp_path / "frame_0001.png").write_bytes(picture.read_bytes())
    with pytest.raises(kind) as caught:
        call(tmp_path)
    assert type(caught.value) is kind


def test_a_directory_that_is_none_is_a_sequences_error() -> None:
    with pytest.raises(SequenceError, match="path of a directory"):
        smokelift.Sequence.open(None)  # type: ignore[arg-type]


@pytest.mark.parametrize(("advice", "call"), ARRAYS.items())
def test_arrays_are_refused_with_what_to_do(advice, call) -> None:
    with pytest.raises(ValueError, match=advice) as caught:
        call()
    assert type(caught.value) is ValueError
