"""What is refused by name at the functions that others call, and how messages say numbers and values."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import smokelift
from smokelift import Camera, Clip, ClipSource, DirectionalLight, Domain, Scene, Sequence, Settings, Velocity
from smokelift.checks import counted, numbers, radiance, shown
from smokelift.density import Observation
from smokelift.output.images import write_image
from smokelift.output.index import SequenceError
from smokelift.pipeline import compose
from smokelift.scene import Inlet, SceneError, View

CAMERA = Camera.look_at((0, -4, 0.8), (0, 0, 0.8), fov_y_degrees=27, size=(6, 8))
SCENE = Scene(camera=CAMERA, domain=Domain((-0.6, -0.6, 0), (0.6, 0.6, 1.6), (3, 3, 4)))
SMOKE = np.ones((3, 3, 4), np.float32)
NAN = np.full_like(SMOKE, np.nan)
PICTURE = np.zeros((8, 6, 3), np.float32)
WIND = Velocity.zero((3, 3, 4), 0.4)
DENSITY = {"image": PICTURE, "scene": SCENE}
SUN = DirectionalLight((0, 0, -1), (1, 1, 1))


def nonsense(value: Any) -> Any:
    """A value whose type is wrong on purpose."""
    return value


@pytest.fixture
def clip(tmp_path) -> Iterator[Clip]:
    for number in range(2):
        write_image(tmp_path / f"frame_{number}.png", PICTURE)
    with Clip.open(ClipSource(tmp_path / "frame_#.png", fps=24)) as opened:
        yield opened


def refused(words: str, function: Callable[..., Any], *arguments: Any, **named: Any) -> type[Exception]:
    """The kind of error that a call ends with, whose one line says the words."""
    with pytest.raises(ValueError) as caught:
        function(*arguments, **named)
    assert words in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1
    return type(caught.value)


RUN = {"scene": SCENE, "settings": Settings.preset("draft")}
STEP = {"before": SMOKE, "after": SMOKE, "dt": 1 / 24, "voxel_size": 0.4}
OTHERS: list[tuple[str, Callable[[Any], Any], dict[str, Any]]] = [
    ("clip", smokelift.reconstruct, RUN | {"clip": "clip.mp4"}),
    ("clip.mp4", smokelift.prepare_shot, RUN | {"clip": Path("clip.mp4")}),
    ("float32", smokelift.reconstruct, RUN | {"clip": PICTURE}),
    ("shot", smokelift.Reconstruction, {"shot": SCENE, "method": compose(Settings.preset("draft"))}),
    ("settings", compose, {"settings": "draft"}),
    ("clip", Scene, {"clip": "clip.mp4"}),
    ("camera", Scene, {"camera": "front"}),
    ("domain", Scene, {"domain": ((-1, -1, 0), (1, 1, 2))}),
    ("medium", Scene, {"medium": 5}),
    ("background", Scene, {"background": "plate.png"}),
    ("lights", Scene, {"lights": SUN}),
    ('"sun"', Scene, {"lights": ("sun",)}),
    ("Camera", Scene, {"views": [CAMERA]}),
    ("inlets", Scene, {"inlets": Inlet((0, 0, 0), 1)}),
    ("clip", View, {"camera": CAMERA, "clip": "clip.mp4"}),
    ("None", smokelift.render, {"density": None, "scene": SCENE}),
    ("complex128", smokelift.render, {"density": SMOKE.astype(complex), "scene": SCENE}),
    ("shape", smokelift.render, {"density": [[1, 2], [3]], "scene": SCENE}),
    ("scene", smokelift.render, {"density": SMOKE, "scene": "scene.toml"}),
    ("camera", smokelift.render, {"density": SMOKE, "scene": SCENE, "camera": np.eye(4)}),
    # 8 bits would be taken for a picture up to 255 times as bright as white
    ("uint8", smokelift.reconstruct_density, DENSITY | {"image": PICTURE.astype(np.uint8)}),
    ("uint16", radiance, {"values": PICTURE.astype(np.uint16), "name": "The picture"}),
    ("settings", smokelift.reconstruct_density, DENSITY | {"settings": Settings()}),
    ("plate", smokelift.reconstruct_density, DENSITY | {"plate": PICTURE}),
    ("views", smokelift.reconstruct_density, DENSITY | {"views": [PICTURE]}),
    ("initial", smokelift.reconstruct_density, DENSITY | {"initial": "smoke.npy"}),
    ("camera", Observation, {"camera": PICTURE, "image": CAMERA}),
    ("before", smokelift.estimate_velocity, STEP | {"before": "a.npy"}),
    ("dt", smokelift.estimate_velocity, STEP | {"dt": "1/24"}),
    ("voxel_size", smokelift.estimate_velocity, STEP | {"voxel_size": (0.1, 0.1, 0.1)}),
    ("settings", smokelift.estimate_velocity, STEP | {"settings": Settings()}),
    ("closed", smokelift.estimate_velocity, STEP | {"closed": "z-"}),
    ("inflow", smokelift.estimate_velocity, STEP | {"inflow": True}),
    ("prediction", smokelift.estimate_velocity, STEP | {"prediction": WIND.faces}),
    ("faces", Velocity, {"faces": WIND.faces[:2], "voxel_size": 0.4}),
    ("three", Velocity.zero, {"shape": (8.0, 8.0, 8.0), "voxel_size": 0.4}),
    ("velocity", smokelift.advect, {"field": SMOKE, "velocity": SMOKE, "dt": 1 / 24}),
    ("field", smokelift.advect, {"field": "smoke.npy", "velocity": WIND, "dt": 1 / 24}),
    ("velocity", smokelift.project, {"velocity": WIND.faces}),
    ("albedo", smokelift.Medium, {"albedo": 2}),
    ("quality", Settings.preset, {"quality": "best"}),
    ("detail", Settings, {"detail": 3}),
    ("directory", Sequence.open, {"directory": None}),
    # what to do about an array
    ("set them to 0", smokelift.advect, {"field": NAN, "velocity": WIND, "dt": 0.1}),
    ("finite", smokelift.estimate_velocity, STEP | {"before": NAN}),
    ("negative", smokelift.estimate_velocity, STEP | {"before": -SMOKE}),
    ("resample it", smokelift.advect, {"field": SMOKE[1:], "velocity": WIND, "dt": 0.1}),
    ("bring one to the other's size", smokelift.metrics.psnr, {"a": SMOKE, "b": SMOKE[1:]}),
    ("replace those that are not", smokelift.metrics.psnr, {"a": NAN, "b": SMOKE}),
    ("give one value at least", smokelift.metrics.psnr, {"a": [], "b": []}),
]

OWN_KINDS = (SceneError, SequenceError)
"""Errors of scenes and settings, and of sequences; of all else it is ValueError itself."""


@pytest.mark.parametrize(("words", "function", "named"), OTHERS)
def test_what_is_no_such_thing_is_refused(words, function, named) -> None:
    kind = refused(words, function, **named)
    owned = (Scene, smokelift.Medium, Settings, Settings.preset, Sequence.open)
    assert kind in OWN_KINDS if function in owned or "closed" in named else kind is ValueError


@pytest.mark.parametrize("opens", [Clip.open, Scene.load, SCENE.save, Sequence.open, ClipSource])
@pytest.mark.parametrize("path", [None, 3, "", b"clip.mp4"])
def test_a_path_that_is_none(opens, path) -> None:
    refused("path", opens, path)


@pytest.mark.parametrize("opens", [Clip.open, Scene.load, SCENE.save, Sequence.open, ClipSource])
@pytest.mark.parametrize("address", ["http://example.com/clip.mp4", "file:///clip.mp4"])
def test_an_address_is_no_path(opens, address) -> None:
    refused(address, opens, address)
    refused(f'"{Path(address)}" is an address', opens, Path(address))
    assert ClipSource(nonsense("C:/clips/smoke.mp4")).path == Path("C:/clips/smoke.mp4"), "a drive is none"


@pytest.mark.parametrize("folder", [".", "/", ""])
def test_a_scene_is_not_saved_as_a_folder(tmp_path, monkeypatch, folder) -> None:
    monkeypatch.chdir(tmp_path)
    refused("is a folder; give the name of a file", SCENE.save, folder or tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_comments_of_a_scene_file_are_lines(tmp_path) -> None:
    path = tmp_path / "scene.toml"
    refused('comments must be a list of lines, not "known"', SCENE.save, path, "known")
    SCENE.save(path, ["one\n[clip]"])
    assert Scene.load(path) == SCENE
    assert path.read_text().startswith("# one\\n[clip]\n")


@pytest.mark.parametrize(
    ("named", "words"),
    [
        *(({"frames": frames}, "frames must be [first, last]") for frames in ((5,), 5, (0.0, 1.0), "0:1")),
        ({"fps": "24"}, 'fps must be a number above 0, not "24"'),
        ({"fps": True}, "fps must be a number above 0, not true"),
        ({"transfer": 2.2}, 'transfer must be "srgb" or "linear", not 2.2'),
    ],
)
def test_a_clip_read_in_no_way(clip, named, words) -> None:
    refused(f"{clip.path}: {words}", Clip.open, clip.path, **named)


@pytest.mark.parametrize("number", ["0", 1.0, None, 2, -1])
def test_a_frame_that_is_none(clip, number) -> None:
    refused("there is no frame", clip.frame, number)


def test_lists_of_numbers_are_arrays() -> None:
    assert np.array_equal(smokelift.render(nonsense(SMOKE.tolist()), SCENE), smokelift.render(SMOKE, SCENE))
    assert Velocity.zero(nonsense(np.array([3, 3, 4])), 0.4).shape == (3, 3, 4)
    assert numbers(SMOKE, "the density") is SMOKE, "what fits is not copied"
    assert numbers(SMOKE, "the density", np.float64).dtype == np.float64


def test_one_of_something_is_no_plural() -> None:
    assert [counted(number, "frame") for number in (0, 1, 2)] == ["0 frames", "1 frame", "2 frames"]


@pytest.mark.parametrize(
    ("value", "words"), [(True, "true"), ((1, 2), "[1, 2]"), ("a\nb", r'"a\nb"'), ("x" * 100, '"' + "x" * 56 + "...")]
)
def test_a_value_is_shown_as_in_a_scene_file(value, words) -> None:
    assert shown(value) == words
