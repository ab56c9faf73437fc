"""``smokelift extract``: a clip's smoke with alpha, its plate, and a check of both."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import OpenEXR
import pytest
from command_line import command, refused
from PIL import Image

from smokelift import Background, Clip, Scene, extract, reconstruct
from smokelift.footage.image_files import read_image
from smokelift.output.images import write_image


@pytest.fixture(scope="module")
def before_wall(plume, tmp_path_factory) -> Iterator[Path]:
    """The scene file of the blob before a wall of blocks, whose picture is given."""
    folder = tmp_path_factory.mktemp("wall")
    camera = plume.scene.camera.resized(80, 112)
    blocks = np.random.default_rng(0).uniform(0.05, 0.4, (28, 20, 3)).astype(np.float32)
    write_image(folder / "plate.exr", np.kron(blocks, np.ones((4, 4, 1), np.float32)))
    scene = replace(plume.scene, camera=camera, background=Background(image=folder / "plate.exr"))
    plume.write(folder / "clip", plume.densities, scene, ".exr").save(folder / "scene.toml")
    return folder / "scene.toml"


def test_elements_are_numbered_as_the_frames_of_the_file(before_wall, tmp_path) -> None:
    words = ("extract", before_wall, "--frames", "1:2", "--out", tmp_path / "element_###.exr")
    assert command(*words, "--plate", tmp_path / "plate.exr", "--preview", tmp_path / "check.png") == 0
    assert sorted(path.name for path in tmp_path.glob("element_*")) == ["element_001.exr", "element_002.exr"]
    scene, plate = Scene.load(before_wall), read_image(tmp_path / "plate.exr")
    with Clip.open(scene.clip, frames=(1, 2)) as clip:
        seen = clip.frame(1)
        _, element = extract(clip, scene)
    (part,) = OpenEXR.File(str(tmp_path / "element_002.exr")).parts
    pixels = np.asarray(part.channels["RGBA"].pixels, np.float32)
    assert 0.5 < pixels[..., 3].max() <= 1 and pixels[:8, :8, 3].max() < 0.05
    over = pixels[..., :3] + (1 - pixels[..., 3:]) * plate
    assert np.sqrt(np.mean((over - seen) ** 2)) < 0.02
    np.testing.assert_allclose(pixels[..., 3], 1 - element.transmittance, atol=0.02)
    with Image.open(tmp_path / "check.png") as check:
        assert check.size == (160, 112)


def test_a_directory_and_a_video_are_taken_too(before_wall, tmp_path) -> None:
    words = ("extract", before_wall, "--frames", "0:2", "--out", tmp_path / "elements")
    assert command(*words, "--preview", tmp_path / "check.mp4") == 0
    assert len(list((tmp_path / "elements").glob("element_*.exr"))) == 3
    with av.open(str(tmp_path / "check.mp4")) as video:
        assert sum(1 for _ in video.decode(video=0)) == 3


def test_an_element_is_reconstructed_again(before_wall, draft, tmp_path) -> None:
    assert command("extract", before_wall, "--frames", "1:1", "--out", tmp_path / "element_####.exr") == 0
    scene = replace(Scene.load(before_wall), clip=None, background=None)
    with Clip.open(tmp_path / "element_####.exr", fps=24) as clip:
        (frame,) = reconstruct(clip, scene, draft)
    assert frame.figures["psnr"] > 30


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--out", "a_##.tif"), "elements are written as .exr or .png"),
        (("--out", "out", "--plate", "plate.tif"), "plate.tif: is written as .exr or .png"),
        (("--out", "out", "--preview", "check.gif"), "check.gif: is written as"),
        (("--out", "out", "--plate", "missing/plate.exr"), "the folder missing does not exist"),
        (("--out", "there.txt"), "is a file"),
    ],
)
def test_what_cannot_be_written_is_said_before_anything_is_spent(
    before_wall, tmp_path, monkeypatch, capsys, words, said
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.txt").touch()
    assert said in refused(capsys, "extract", before_wall, *words)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["there.txt"]
