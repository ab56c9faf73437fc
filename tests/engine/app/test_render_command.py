"""``smokelift render``: images and videos from every camera that can be asked for."""

import numpy as np
import pytest
from command_line import command, refused

from smokelift import Clip, Sequence, render
from smokelift.footage.image_files import read_image
from smokelift.output.images import eight_bit
from smokelift.scene import Camera, Scene, orbit


@pytest.mark.parametrize(("word", "yaw", "pitch"), [("side", 90, 0), ("-30,10", -30, 10)])
def test_render_another_view_as_png(finished, plume, tmp_path, word, yaw, pitch) -> None:
    path = tmp_path / "a.png"
    assert command("render", finished, "--frame", 3, f"--camera={word}", "--out", path) == 0
    camera = orbit(plume.scene.camera, plume.scene.domain, yaw, pitch)
    wanted = eight_bit(render(Sequence.open(finished).density(3), plume.scene, camera))
    found = eight_bit(read_image(path))
    assert np.abs(found.astype(int) - wanted).max() <= 1
    assert found.max() > 50


def test_render_the_front_or_a_camera_file_as_exr(finished, plume, tmp_path) -> None:
    camera = Camera.look_at((3, -3, 1.5), (0, 0, 0.8), fov_y_degrees=30, size=(32, 24))
    Scene(camera=camera).save(tmp_path / "camera.toml")
    for words, seen_by in (((), None), (("--camera", tmp_path / "camera.toml"), camera)):
        assert command("render", finished, *words, "--out", tmp_path / "a.exr") == 0
        wanted = render(Sequence.open(finished).density(1), plume.scene, seen_by)
        np.testing.assert_allclose(read_image(tmp_path / "a.exr"), wanted, atol=1e-3)


def test_render_a_video(finished, tmp_path) -> None:
    assert command("render", finished, "--camera", "side", "--out", tmp_path / "a.mp4") == 0
    with Clip.open(tmp_path / "a.mp4") as clip:
        assert (len(clip), clip.fps, clip.size) == (5, 24.0, (40, 56))
        assert clip.frame(2).max() > 0.1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--camera", "above"), "--camera above"),
        (("--camera", "1,2,3"), "--camera 1,2,3"),
        (("--camera", "nan,0"), "--camera nan,0"),
        (("--camera", "none.toml"), "none.toml"),
        (("--frame=0",), "1 to 5"),
        (("--frame=6", "--out", "a.mp4"), "1 to 5"),
        (("--out", "a.gif"), "a.gif"),
        (("--out", "none/a.png"), "none"),
        (("--out", "none/a.mp4"), "none"),
    ],
)
def test_what_cannot_be_rendered_is_refused(finished, tmp_path, monkeypatch, capsys, words, said) -> None:
    monkeypatch.chdir(tmp_path)
    assert said in refused(capsys, "render", finished, "--out", "a.png", *words)
    assert not list(tmp_path.iterdir())


def test_files_that_show_nothing_are_refused(finished, tmp_path, capsys) -> None:
    Scene().save(tmp_path / "camera.toml")
    words = ("--camera", tmp_path / "camera.toml", "--out", tmp_path / "a.png")
    assert "camera.toml" in refused(capsys, "render", finished, *words)
    for verb, directory in (("render", tmp_path), ("preview", tmp_path / "none")):
        assert str(directory) in refused(capsys, verb, directory, "--out", tmp_path / "a.png")
