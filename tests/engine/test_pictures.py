"""Pictures to look at: right colours and sizes, and videos that play."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from smokelift.footage.clip import Clip
from smokelift.output.images import write_image
from smokelift.output.pictures import (
    SHEET_ANGLES,
    TILE_HEIGHT,
    Viewer,
    eight_bit,
    write_contact_sheet,
    write_preview,
    write_video,
)
from smokelift.output.sequence import Sequence, SequenceWriter
from smokelift.render import render
from smokelift.scene import Background, orbit
from smokelift.transport import Velocity


def written(scene, densities, folder) -> Sequence:
    rest = Velocity.zero(scene.domain.resolution, scene.domain.voxel_size).faces
    with SequenceWriter(folder, scene, {"density": {"scattering": "single"}}, npz=True) as writer:
        for number, density in enumerate(densities, 1):
            writer.write(number, density, rest)
    return Sequence.open(folder)


@pytest.fixture(scope="module")
def sequence(plume, tmp_path_factory) -> Sequence:
    """The true volumes as a sequence."""
    return written(plume.scene, plume.densities, tmp_path_factory.mktemp("pictures") / "out")


def test_eight_bit_is_srgb() -> None:
    """Linear light is encoded, rounded and cut at both ends."""
    image = np.array([[[0, 0.2159, 1], [-1, 7, 0.0031308]]], np.float32)
    np.testing.assert_array_equal(eight_bit(image), [[[0, 128, 255], [0, 255, 10]]])
    assert eight_bit(image).dtype == np.uint8


@pytest.mark.parametrize("name", ["video.mp4", "video.mkv", "video.mov", "video.webm"])
def test_a_video_reads_back(tmp_path, name) -> None:
    """Frames, rate and grey levels survive in every kind of file that is offered; odd sides lose a pixel."""
    levels = [0.1, 0.3, 0.6]
    frames = (np.full((33, 47, 3), level, np.float32) for level in levels)
    write_video(tmp_path / name, frames, 12.0)
    with Clip.open(tmp_path / name) as clip:
        assert clip.fps == pytest.approx(12)
        assert clip.size == (46, 32)
        found = [float(frame.mean()) for frame in clip]
    assert found == pytest.approx(levels, abs=0.02)
    assert [file.name for file in tmp_path.iterdir()] == [name]


def test_a_video_of_fractional_rate(tmp_path) -> None:
    """24000 / 1001 stays what it is."""
    write_video(tmp_path / "a.mp4", [np.zeros((16, 16, 3), np.float32)] * 4, 24000 / 1001)
    with Clip.open(tmp_path / "a.mp4") as clip:
        assert clip.fps == pytest.approx(24000 / 1001, rel=1e-6)


def test_a_video_that_breaks_off_leaves_nothing(tmp_path) -> None:
    """Files appear whole or not at all."""

    def frames():
        yield np.zeros((16, 16, 3), np.float32)
        raise RuntimeError

    with pytest.raises(RuntimeError):
        write_video(tmp_path / "a.mp4", frames(), 24.0)
    assert list(tmp_path.iterdir()) == []


def test_the_front_is_the_scenes_own_view(plume, sequence) -> None:
    """Without another camera the picture is that of the scene."""
    image = Viewer(sequence).image(3, plume.densities[2])
    np.testing.assert_allclose(image, render(plume.densities[2], plume.scene), atol=1e-6)


def test_a_turned_camera_is_taken(plume, sequence) -> None:
    """Another camera's picture is that camera's."""
    camera = orbit(plume.scene.camera, plume.scene.domain, 90)
    for viewer in (Viewer(sequence, camera), Viewer(sequence, turn=(90, 0))):
        image = viewer.image(3, plume.densities[2])
        np.testing.assert_allclose(image, render(plume.densities[2], plume.scene, camera), atol=1e-6)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_a_contact_sheet_has_all_tiles(plume, tmp_path, count) -> None:
    """Rows of frames, columns of input and views, whatever the number of frames; smoke in every tile."""
    sequence = written(plume.scene, plume.densities[:count], tmp_path / "out")
    with Clip.open(plume.scene.clip) as clip:
        write_contact_sheet(tmp_path / "sheet.png", sequence, clip)
    with Image.open(tmp_path / "sheet.png") as sheet:
        pixels = np.asarray(sheet)
    columns = 1 + len(SHEET_ANGLES)
    width = round(40 * TILE_HEIGHT / 56)
    assert width * columns < pixels.shape[1] < (width + 8) * columns + 8
    assert pixels.shape[0] > TILE_HEIGHT
    rows = pixels.shape[0] // TILE_HEIGHT
    assert 1 <= rows <= count
    for column in range(columns):
        left = round((column + 0.25) * pixels.shape[1] / columns)
        assert pixels[:, left : left + width // 2].max() > 100


def test_a_preview_shows_three_views(plume, sequence, tmp_path) -> None:
    """Input, front and turned view side by side, a frame each, at the clip's rate."""
    with Clip.open(plume.scene.clip) as clip:
        write_preview(tmp_path / "preview.mp4", sequence, clip)
        rate = clip.fps
    with Clip.open(tmp_path / "preview.mp4") as preview:
        assert len(preview) == len(plume.densities)
        assert preview.fps == pytest.approx(rate)
        thirds = np.array_split(preview.frame(2), 3, axis=1)
        assert all(third.max() > 0.2 for third in thirds)
        # the reconstruction is the truth here, so the first two are alike
        width = preview.size[0] // 3
        first, second = (preview.frame(2)[:, n * width : (n + 1) * width].mean() for n in (0, 1))
        assert second == pytest.approx(first, rel=0.1)


def test_a_background_picture_is_shown_in_front_and_its_mean_beside(plume, tmp_path) -> None:
    """Only the scene's own camera stands before the clean plate."""
    plate = np.zeros((56, 40, 3), np.float32)
    plate[:, :20] = 0.5
    write_image(tmp_path / "plate.exr", plate)
    scene = replace(plume.scene, background=Background(image=tmp_path / "plate.exr"))
    sequence = written(scene, [np.zeros_like(plume.densities[0])], tmp_path / "out")
    np.testing.assert_allclose(Viewer(sequence).image(1, sequence.density(1)), plate, atol=1e-3)
    image = Viewer(sequence, turn=(45, 0)).image(1, sequence.density(1))
    np.testing.assert_allclose(image, 0.25, atol=1e-3)
    with Clip.open(plume.scene.clip) as clip:
        write_contact_sheet(tmp_path / "sheet.png", sequence, clip)
        write_preview(tmp_path / "preview.mp4", sequence, clip)


def test_a_moving_camera_is_followed(plume, tracked, tmp_path) -> None:
    """In front each frame is seen as it was filmed, before its own plate; turned by so much from there."""
    scene = replace(tracked, background=Background(image=tmp_path / "plate_#.exr"))
    for n in range(5):
        write_image(tmp_path / f"plate_{n}.exr", np.full((56, 40, 3), 0.1 * n, np.float32))
    sequence = written(scene, plume.densities, tmp_path / "out")
    front, turned = Viewer(sequence), Viewer(sequence, turn=(30, 0))
    for number in (1, 4, 2):
        density, camera = plume.densities[number - 1], tracked.camera.at(number - 1)
        before = replace(tracked, background=Background(color=[0.1 * (number - 1)] * 3))
        np.testing.assert_allclose(front.image(number, density), render(density, before, camera), atol=1e-3)
        aside = orbit(camera, scene.domain, 30)
        np.testing.assert_allclose(turned.image(number, density), render(density, tracked, aside), atol=1e-3)
    with Clip.open(tracked.clip) as clip:
        write_contact_sheet(tmp_path / "sheet.png", sequence, clip)
        write_preview(tmp_path / "preview.mp4", sequence, clip)


def test_a_moving_camera_is_no_picture_of_its_own(plume, tracked) -> None:
    """Which frame's is meant has to be said."""
    with pytest.raises(ValueError, match=r"camera\.at\(frame\)"):
        render(plume.densities[0], tracked)
