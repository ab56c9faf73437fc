"""``smokelift render``: images and videos from every camera that can be asked for."""

from __future__ import annotations

import numpy as np
import pytest
from command_line import QUICK, command, refused

from smokelift.footage.clip import Clip
from smokelift.footage.images import read_image
from smokelift.output.images import eight_bit
from smokelift.output.sequence import Sequence
from smokelift.output.video_file import write_video
from smokelift.render import render
from smokelift.scene import Camera, Scene, orbit


def test_render_the_front_as_exr(finished, plume, tmp_path) -> None:
    """The scene's own view in linear light, of the first frame by default."""
    assert command("render", finished, "--out", tmp_path / "a.exr") == 0
    image = read_image(tmp_path / "a.exr")
    np.testing.assert_allclose(image, render(Sequence.open(finished).density(1), plume.scene), atol=1e-3)


@pytest.mark.parametrize(("word", "yaw", "pitch"), [("side", 90, 0), ("-30,10", -30, 10), ("15.5,-4", 15.5, -4)])
def test_render_another_view_as_png(finished, plume, tmp_path, word, yaw, pitch) -> None:
    """Words and angles are cameras that orbit the domain."""
    path = tmp_path / "a.png"
    assert command("render", finished, "--frame", 3, f"--camera={word}", "--out", path) == 0
    camera = orbit(plume.scene.camera, plume.scene.domain, yaw, pitch)
    wanted = eight_bit(render(Sequence.open(finished).density(3), plume.scene, camera))
    found = eight_bit(read_image(path))
    assert np.abs(found.astype(int) - wanted).max() <= 1
    assert found.max() > 50


def test_render_a_camera_file(finished, plume, tmp_path) -> None:
    """A scene file with a camera alone; its size is the picture's."""
    camera = Camera.look_at((3, -3, 1.5), (0, 0, 0.8), fov_y_degrees=30, size=(32, 24))
    Scene(camera=camera).save(tmp_path / "camera.toml")
    words = ("--camera", tmp_path / "camera.toml", "--out", tmp_path / "a.exr")
    assert command("render", finished, *words) == 0
    wanted = render(Sequence.open(finished).density(1), plume.scene, camera)
    np.testing.assert_allclose(read_image(tmp_path / "a.exr"), wanted, atol=1e-3)


def test_render_a_video(finished, tmp_path) -> None:
    """All frames at the clip's rate."""
    assert command("render", finished, "--camera", "side", "--out", tmp_path / "a.mp4") == 0
    with Clip.open(tmp_path / "a.mp4") as clip:
        assert (len(clip), clip.fps, clip.size) == (5, 24.0, (40, 56))
        assert clip.frame(2).max() > 0.1


def test_a_video_has_the_rate_of_its_clip(plume, tmp_path) -> None:
    """Also where only the video file itself says it."""
    frames = [render(density, plume.scene) for density in plume.densities[:3]]
    write_video(tmp_path / "clip.mp4", frames, 12.0)
    out = tmp_path / "out"
    arguments = ("--npz", "--resolution", "16,16,24", *QUICK)
    assert command("reconstruct", tmp_path / "clip.mp4", "--out", out, *arguments) == 0
    assert command("render", out, "--out", tmp_path / "a.mp4") == 0
    with Clip.open(tmp_path / "a.mp4") as clip:
        assert clip.fps == pytest.approx(12)


@pytest.mark.parametrize("name", ["a.mkv", "a.mov", "a.webm"])
def test_render_other_kinds_of_video(finished, tmp_path, name) -> None:
    """Every suffix that a refusal offers is written."""
    assert command("render", finished, "--out", tmp_path / name) == 0
    with Clip.open(tmp_path / name) as clip:
        assert len(clip) == 5


@pytest.mark.parametrize("word", ["above", "1,2,3", "left,right", "nan,0"])
def test_a_wrong_word_for_the_camera(finished, tmp_path, capsys, word) -> None:
    """What is understood is listed."""
    sentence = refused(capsys, "render", finished, "--camera", word, "--out", tmp_path / "a.png")
    assert f"--camera {word}" in sentence
    assert "front, side" in sentence
    assert not list(tmp_path.iterdir())


def test_a_camera_file_without_a_camera(finished, tmp_path, capsys) -> None:
    """The file is named; so is one that is not there."""
    Scene().save(tmp_path / "camera.toml")
    for name in ("camera.toml", "none.toml"):
        words = ("--camera", tmp_path / name, "--out", tmp_path / "a.png")
        assert name in refused(capsys, "render", finished, *words)


@pytest.mark.parametrize("number", [0, 6, -1])
@pytest.mark.parametrize("name", ["a.png", "a.mp4"])
def test_a_frame_that_is_not_there(finished, tmp_path, capsys, number, name) -> None:
    """The frames that are there are named, and nothing is written."""
    sentence = refused(capsys, "render", finished, f"--frame={number}", "--out", tmp_path / name)
    assert "1 to 5" in sentence
    assert not list(tmp_path.iterdir())


def test_a_kind_of_picture_that_is_not_written(finished, tmp_path, capsys) -> None:
    """The kinds that are written are named."""
    sentence = refused(capsys, "render", finished, "--out", tmp_path / "a.gif")
    assert "a.gif" in sentence
    assert ".png" in sentence
    assert ".mp4" in sentence


@pytest.mark.parametrize("verb", ["render", "preview"])
def test_a_directory_without_a_sequence(tmp_path, capsys, verb) -> None:
    """The directory is named, whether it exists or not."""
    for directory in (tmp_path, tmp_path / "none"):
        sentence = refused(capsys, verb, directory, "--out", tmp_path / "a.png")
        assert str(directory) in sentence


def test_a_folder_for_the_picture_that_is_not_there(finished, tmp_path, capsys) -> None:
    """The path that cannot be written is named."""
    for name in ("a.png", "a.exr", "a.mp4"):
        sentence = refused(capsys, "render", finished, "--out", tmp_path / "none" / name)
        assert name in sentence
        assert "none" in sentence
