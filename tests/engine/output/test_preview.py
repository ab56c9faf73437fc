"""Contact sheets and preview videos of the true volumes, and where in a picture the smoke is."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from small_sequence import at_rest

from smokelift.footage.clip import Clip
from smokelift.output.framing import MIN_ASPECT, frame_smoke
from smokelift.output.images import eight_bit, write_image
from smokelift.output.preview import (
    SHEET_ANGLES,
    SHEET_HEIGHT,
    STRIP_FRAMES,
    write_contact_sheet,
    write_orbit,
    write_preview,
    write_strip,
)
from smokelift.output.sequence import Sequence
from smokelift.output.viewer import Viewer
from smokelift.scene import Background, Camera, orbit


@pytest.mark.parametrize("count", [1, 5])
def test_a_contact_sheet_has_all_tiles(plume, tmp_path, count) -> None:
    """Rows of frames, columns of input and views, whatever the number of frames; smoke in every tile."""
    sequence = at_rest(plume.scene, plume.densities[:count], tmp_path / "out")
    with Clip.open(plume.scene.clip) as clip:
        write_contact_sheet(tmp_path / "sheet.png", sequence, clip, frame_smoke(sequence))
    with Image.open(tmp_path / "sheet.png") as sheet:
        pixels = np.asarray(sheet)
    columns = 1 + len(SHEET_ANGLES)
    width = framed(sequence).size[0]
    assert width * columns < pixels.shape[1] < (width + 8) * columns + 8
    assert pixels.shape[0] > SHEET_HEIGHT
    rows = pixels.shape[0] // SHEET_HEIGHT
    assert 1 <= rows <= count
    for column in range(columns):
        left = round((column + 0.25) * pixels.shape[1] / columns)
        assert pixels[:, left : left + width // 2].max() > 100


def framed(sequence: Sequence) -> Camera:
    """The camera of the pictures of a sheet."""
    return frame_smoke(sequence).camera(sequence.scene.camera, SHEET_HEIGHT)


def tiles(path, sequence: Sequence, rows: int, columns: int) -> list[list[np.ndarray]]:
    """The pictures of a sheet, by row and column."""
    width = framed(sequence).size[0]
    with Image.open(path) as sheet:
        pixels = np.asarray(sheet).astype(int)
    assert pixels.shape[:2] == (16 + rows * (SHEET_HEIGHT + 20), 4 + columns * (width + 4))
    return [
        [pixels[32 + y * (SHEET_HEIGHT + 20) :, 4 + x * (width + 4) :][:SHEET_HEIGHT, :width] for x in range(columns)]
        for y in range(rows)
    ]


def test_an_orbit_shows_one_moment_from_twelve_angles(plume, tmp_path) -> None:
    sequence = at_rest(plume.scene, plume.densities, tmp_path / "out")
    framing = frame_smoke(sequence)
    with Clip.open(plume.scene.clip) as clip:
        write_orbit(tmp_path / "orbit.png", sequence, clip, framing)
    shown = [tile for row in tiles(tmp_path / "orbit.png", sequence, 2, 6) for tile in row]
    assert all(tile.max() > 100 for tile in shown)
    viewer = Viewer(sequence.scene, framed(sequence))
    own = eight_bit(viewer.image(4, plume.densities[3]))
    assert np.abs(shown[0] - own).max() <= 1
    assert np.abs(shown[0] - shown[6][:, ::-1]).max() > 20


@pytest.mark.parametrize(("count", "columns"), [(1, 1), (5, 5), (14, STRIP_FRAMES)])
def test_a_strip_shows_consecutive_frames_from_the_side(plume, tmp_path, count, columns) -> None:
    densities = [plume.densities[min(n, 4)] for n in range(count)]
    scene = plume.write(tmp_path / "clip", densities, plume.scene)
    sequence = at_rest(scene, densities, tmp_path / "out")
    with Clip.open(scene.clip) as clip:
        write_strip(tmp_path / "strip.png", sequence, clip, frame_smoke(sequence))
    filmed, side = tiles(tmp_path / "strip.png", sequence, 2, columns)
    assert all(tile.max() > 100 for tile in (*filmed, *side))
    top = [np.flatnonzero(tile.max((1, 2)) > 100)[0] for tile in side]
    assert top == sorted(top, reverse=True)
    rise = {1: 0, 5: 9.6, 14: 0}[count]  # in the clip's pixels
    assert top[0] - top[-1] == pytest.approx(rise * SHEET_HEIGHT / frame_smoke(sequence).height, abs=10)


def test_the_video_turns_while_it_plays(plume, tmp_path) -> None:
    still = [plume.densities[2]] * 5
    scene = plume.write(tmp_path / "clip", still, plume.scene)
    scene = replace(scene, clip=replace(scene.clip, fps=4.0))
    sequence = at_rest(scene, still, tmp_path / "out")
    with Clip.open(scene.clip) as clip:
        write_preview(tmp_path / "preview.mp4", sequence, clip, frame_smoke(sequence))
    with Clip.open(tmp_path / "preview.mp4") as preview:
        width = preview.size[0] // 3
        front, turning = ([preview.frame(n)[:, p * width : (p + 1) * width] for n in (0, 4)] for p in (1, 2))
        assert np.abs(turning[0] - front[0]).mean() < 0.005
        assert np.abs(front[1] - front[0]).max() < 0.04
        assert np.abs(turning[1] - turning[0]).max() > 0.08


@pytest.mark.parametrize(
    ("plate", "scattering", "behind"),
    [
        ([0.4, 0.0], "single", 0.0),  # what is behind the smoke from aside is not known
        ([0.4, 0.0], "absorption", 0.2),  # before black it would not be seen
        ([0.4, 0.4], "single", 0.4),
    ],
)
def test_a_plate_does_not_turn_along(plume, tmp_path, plate, scattering, behind) -> None:
    """The turning view has one colour behind it, from its first frame on; the front has the plate."""
    picture = np.repeat(np.float32(plate), 28)[:, None, None] * np.ones((1, 40, 3), np.float32)
    write_image(tmp_path / "plate.exr", picture)
    scene = replace(plume.scene, background=Background(image=tmp_path / "plate.exr"), scattering=scattering)
    sequence = at_rest(scene, plume.densities, tmp_path / "out")
    framing = replace(frame_smoke(sequence), left=0, top=0, width=40, height=56)
    with Clip.open(scene.clip) as clip:
        write_preview(tmp_path / "preview.mp4", sequence, clip, framing)
    with Clip.open(tmp_path / "preview.mp4") as preview:
        for n in (0, 4):
            np.testing.assert_allclose(preview.frame(n)[[20, -20], -20], behind, atol=0.02)
            front = preview.frame(n)[[20, -20], preview.size[0] // 2]
            np.testing.assert_allclose(front.mean(-1), plate, atol=0.02)


def test_the_smoke_of_every_frame_is_in_the_part_from_all_sides(plume, tmp_path) -> None:
    """Smoke that leaves the middle of the box is turned about itself, and is not cut off at the edges."""
    moved = [np.roll(density, (6, -6), (0, 1)) for density in plume.densities]
    sequence = at_rest(plume.scene, moved, tmp_path / "out")
    framing = frame_smoke(sequence)
    assert framing.width * framing.height < 0.75 * 40 * 56
    for yaw in (0, 60, 90, 210):
        for number, density in ((1, moved[0]), (5, moved[4])):
            camera = orbit(framing.camera(sequence.scene.camera, 64), framing.box, yaw)
            shown = Viewer(sequence.scene, camera).image(number, density).mean(-1)
            assert shown.max() > 0.1
            edges = np.concatenate([shown[[0, -1]].ravel(), shown[:, [0, -1]].ravel()])
            assert edges.max() < 0.05 * shown.max()


def test_a_column_gets_room_beside_it(plume, tmp_path) -> None:
    column = np.zeros_like(plume.densities[0])
    column[15:17, 15:17, 4:40] = 1
    framing = frame_smoke(at_rest(plume.scene, [column], tmp_path / "out"))
    assert framing.width >= MIN_ASPECT * framing.height - 2


def test_without_smoke_the_box_is_shown(plume, tmp_path) -> None:
    sequence = at_rest(plume.scene, [np.zeros_like(plume.densities[0])], tmp_path / "out")
    assert frame_smoke(sequence).box == plume.scene.domain
