"""Arguments of another kind end in one sentence, whichever function of the API they are given to."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import smokelift
from smokelift import (
    Camera,
    Clip,
    ClipSource,
    DirectionalLight,
    Domain,
    Scene,
    Sequence,
    Settings,
    Velocity,
)
from smokelift.checks import numbers, radiance
from smokelift.density import Observation
from smokelift.output.images import write_image
from smokelift.pipeline import compose
from smokelift.scene import Inlet, View

CAMERA = Camera.look_at((0, -4, 0.8), (0, 0, 0.8), fov_y_degrees=27, size=(6, 8))
SCENE = Scene(camera=CAMERA, domain=Domain((-0.6, -0.6, 0), (0.6, 0.6, 1.6), (3, 3, 4)))
SMOKE = np.ones((3, 3, 4), np.float32)
PICTURE = np.zeros((8, 6, 3), np.float32)
WIND = Velocity.zero((3, 3, 4), 0.4)
SUN = DirectionalLight((0, 0, -1), (1, 1, 1))


def nonsense(value: Any) -> Any:
    """A value whose type is wrong on purpose."""
    return value


@pytest.fixture
def clip(tmp_path: Path) -> Iterator[Clip]:
    for number in range(2):
        write_image(tmp_path / f"frame_{number}.png", PICTURE)
    with Clip.open(ClipSource(tmp_path / "frame_#.png", fps=24)) as opened:
        yield opened


def refused(words: str, function: Callable[..., Any], *arguments: Any, **named: Any) -> None:
    with pytest.raises(ValueError) as caught:
        function(*arguments, **named)
    assert words in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"clip": "clip.mp4"}, 'clip must be a Clip (Clip.open("clip.mp4") opens one), not "clip.mp4"'),
        ({"clip": Path("clip.mp4")}, "not the path clip.mp4"),
        ({"clip": SCENE}, "not a Scene"),
        ({"clip": PICTURE}, "not an array of float32"),
        (
            {"scene": "scene.toml"},
            'scene must be a Scene (Scene() leaves all open, Scene.load reads a file), not "scene',
        ),
        ({"settings": "draft"}, 'settings must be Settings (Settings.preset makes them), not "draft"'),
        ({"method": "paper"}, "method must be a Method"),
    ],
)
def test_a_run_of_something_else(clip: Clip, given: dict[str, Any], words: str) -> None:
    arguments = {"clip": clip, "scene": SCENE, "settings": Settings.preset("draft"), **given}
    refused(words, lambda: smokelift.reconstruct(**nonsense(arguments)))
    if "method" not in given:
        refused(words, lambda: smokelift.prepare_shot(**nonsense(arguments)))


def test_a_reconstruction_of_something_else(clip: Clip) -> None:
    run = smokelift.reconstruct(clip, SCENE, Settings.preset("draft"))
    refused("shot must be a Shot", smokelift.Reconstruction, clip, run.method)
    refused("method must be a Method", smokelift.Reconstruction, run.shot, "paper")
    refused("directory must be the path of a directory, not 3", run.write, 3)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"clip": "clip.mp4"}, 'clip must be a ClipSource, such as ClipSource("clip.mp4"), not "clip.mp4"'),
        ({"camera": "front"}, "camera must be a Camera"),
        ({"domain": ((-1, -1, 0), (1, 1, 2))}, "domain must be a Domain, not a tuple"),
        ({"medium": 5}, "medium must be a Medium, not 5"),
        ({"background": "plate.png"}, "background must be a Background"),
        ({"lights": SUN}, "lights must be a list of lights, not a DirectionalLight"),
        ({"lights": ("sun",)}, 'lights must be a list of lights, but one of them is "sun"'),
        ({"views": [CAMERA]}, "views must be a list of Views, but one of them is a Camera"),
        ({"inlets": Inlet((0, 0, 0), 1)}, "inlets must be a list of Inlets, not an Inlet"),
    ],
)
def test_a_scene_of_other_parts(given: dict[str, Any], words: str) -> None:
    refused(words, Scene, **given)


def test_a_view_of_other_parts() -> None:
    refused("clip must be a ClipSource", View, CAMERA, "clip.mp4")
    refused("camera must be a Camera", View, "camera.toml", ClipSource(Path("clip.mp4")))


@pytest.mark.parametrize("opens", [Clip.open, Scene.load, SCENE.save, Sequence.open, ClipSource])
@pytest.mark.parametrize("path", [None, 3, "", b"clip.mp4"])
def test_a_path_that_is_none(opens: Callable[..., Any], path: Any) -> None:
    refused("must be the path of a", opens, path)


@pytest.mark.parametrize("opens", [Clip.open, Scene.load, SCENE.save, Sequence.open, ClipSource])
@pytest.mark.parametrize("address", ["http://example.com/clip.mp4", "rtsp://10.0.0.1/stream", "file:///clip.mp4"])
def test_an_address_is_no_path(opens: Callable[..., Any], address: str) -> None:
    refused("is an address; save the file on this computer", opens, address)
    refused(f'"{Path(address)}" is an address', opens, Path(address))


def test_a_drive_is_no_address(tmp_path: Path) -> None:
    assert ClipSource(nonsense("C:/clips/smoke.mp4")).path == Path("C:/clips/smoke.mp4")


def test_an_address_in_a_scene_file(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text('[clip]\npath = "https://example.com/clip.mp4"\n')
    refused("scene.toml, line 2: [clip]", Scene.load, path)
    refused("is an address", Scene.load, path)


@pytest.mark.parametrize("folder", [".", "..", "/", ""])
def test_a_scene_is_not_saved_as_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: str) -> None:
    monkeypatch.chdir(tmp_path)
    refused("is a folder; give the name of a file", SCENE.save, folder or tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_comments_of_a_scene_file_are_lines(tmp_path: Path) -> None:
    """A text alone would be a line a letter, and a line break would end the comment."""
    path = tmp_path / "scene.toml"
    refused('comments must be a list of lines, not "known"', SCENE.save, path, "known")
    SCENE.save(path, ["one\n[clip]"])
    assert Scene.load(path) == SCENE
    assert path.read_text().startswith("# one\\n[clip]\n")


@pytest.mark.parametrize(
    ("named", "words"),
    [
        ({"frames": (5,)}, "frames must be [first, last]"),
        ({"frames": 5}, "frames must be [first, last]"),
        ({"frames": (0.0, 1.0)}, "frames must be [first, last]"),
        ({"frames": "0:1"}, "frames must be [first, last]"),
        ({"fps": "24"}, 'fps must be a number above 0, not "24"'),
        ({"fps": True}, "fps must be a number above 0, not true"),
        ({"transfer": 2.2}, 'transfer must be "srgb" or "linear", not 2.2'),
    ],
)
def test_a_clip_read_in_no_way(clip: Clip, named: dict[str, Any], words: str) -> None:
    refused(f"{clip.path}: {words}", Clip.open, clip.path, **named)


@pytest.mark.parametrize("number", ["0", 1.0, None, 2, -1])
def test_a_frame_that_is_none(clip: Clip, number: Any) -> None:
    refused("there is no frame", clip.frame, number)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((None, SCENE), "The density must be an array of real numbers, not None"),
        (("smoke.npy", SCENE), 'The density must be an array of real numbers, not "smoke.npy"'),
        ((SMOKE.astype(complex), SCENE), "not an array of complex128"),
        (([[1, 2], [3]], SCENE), "The density must be an array of numbers, but its parts differ in shape"),
        ((SMOKE, "scene.toml"), "scene must be a Scene (Scene.load reads one from a file)"),
        ((SMOKE, SCENE, "side"), 'camera must be a Camera, not "side"'),
        ((SMOKE, SCENE, np.eye(4)), "camera must be a Camera, not an array of float64"),
    ],
)
def test_a_picture_of_something_else(arguments: tuple[Any, ...], words: str) -> None:
    refused(words, smokelift.render, *arguments)


def test_lists_of_numbers_are_arrays() -> None:
    assert np.array_equal(smokelift.render(nonsense(SMOKE.tolist()), SCENE), smokelift.render(SMOKE, SCENE))


def test_codes_are_no_light() -> None:
    """8 bits would be taken for a picture up to 255 times as bright as white."""
    codes = PICTURE.astype(np.uint8)
    refused("must be linear radiance, not codes of uint8", smokelift.render_gradient, SMOKE, SCENE, codes)
    refused("must be linear radiance, not codes of uint8", smokelift.reconstruct_density, codes, SCENE)
    refused("must be linear radiance, not codes of uint16", radiance, PICTURE.astype(np.uint16), "The picture")


@pytest.mark.parametrize(
    ("named", "words"),
    [
        ({"settings": Settings()}, "settings must be DensitySettings (settings.density of a run's), not a Settings"),
        ({"plate": PICTURE}, "plate must be a Plate (a known picture is the scene's background)"),
        ({"views": Observation(CAMERA, PICTURE)}, "views must be a list of Observations, not an Observation"),
        ({"views": [PICTURE]}, "views must be a list of Observations, but one of them is an array"),
        ({"initial": "smoke.npy"}, "The initial density must be an array of real numbers"),
    ],
)
def test_a_density_from_something_else(named: dict[str, Any], words: str) -> None:
    refused(words, smokelift.reconstruct_density, PICTURE, SCENE, **named)


def test_an_observation_of_something_else() -> None:
    refused("camera must be a Camera", Observation, PICTURE, CAMERA)
    refused("The picture must be an array", Observation, CAMERA, "picture.png")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"before": "a.npy"}, 'before must be an array of real numbers, not "a.npy"'),
        ({"dt": "1/24"}, 'dt must be positive and finite, from 1e-09 to 1e+09, not "1/24"'),
        ({"voxel_size": (0.1, 0.1, 0.1)}, "voxel_size must be positive and finite"),
        ({"settings": Settings()}, "settings must be VelocitySettings (settings.velocity of a run's), not a Settings"),
        ({"closed": "z-"}, 'closed must be a list of sides, some of x-, x+, y-, y+, z-, z+, not "z-"'),
        ({"inflow": True}, "inflow must be an array of booleans"),
        ({"prediction": WIND.faces}, "prediction must be a Velocity, not a tuple"),
    ],
)
def test_a_velocity_from_something_else(given: dict[str, Any], words: str) -> None:
    arguments: dict[str, Any] = {"before": SMOKE, "after": SMOKE, "dt": 1 / 24, "voxel_size": 0.4, **given}
    refused(words, smokelift.estimate_velocity, **arguments)


def test_a_velocity_of_something_else() -> None:
    refused("faces must be three arrays", Velocity, SMOKE, 0.4)
    refused("faces must be three arrays", Velocity, WIND.faces[:2], 0.4)
    refused("A box has three whole numbers of voxels", Velocity.zero, 8, 0.4)
    refused("A box has three whole numbers of voxels", Velocity.zero, (8.0, 8.0, 8.0), 0.4)
    refused("A box has three whole numbers of voxels", Velocity.zero, "8x8", 0.4)
    refused('not "z-"', Velocity.zero, (3, 3, 4), 0.4, "z-")
    assert Velocity.zero(nonsense(np.array([3, 3, 4])), 0.4).shape == (3, 3, 4)


def test_what_carries_and_is_carried() -> None:
    refused("velocity must be a Velocity, not an array of float32", smokelift.advect, SMOKE, SMOKE, 1 / 24)
    refused("the field must be an array of real numbers", smokelift.advect, "smoke.npy", WIND, 1 / 24)
    refused("velocity must be a Velocity, not a tuple", smokelift.project, WIND.faces)


def test_a_method_of_no_settings() -> None:
    refused('settings must be Settings (Settings.preset makes them), not "draft"', compose, "draft")


def test_numbers_that_fit_are_not_copied() -> None:
    assert numbers(SMOKE, "the density") is SMOKE
    assert numbers(SMOKE, "the density", np.float64).dtype == np.float64
