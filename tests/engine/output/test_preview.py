"""What shows a sequence at a glance, of the true volumes, and where in a picture the smoke is."""

from dataclasses import replace

import numpy as np
import pytest
from small_sequence import at_rest, names

from smokelift import Clip, Sequence
from smokelift.output.images import write_image
from smokelift.output.index import PICTURES
from smokelift.output.preview import (
    MIN_ASPECT,
    ORBIT_COLUMNS,
    SHEET_ANGLES,
    SHEET_HEIGHT,
    STRIP_FRAMES,
    Preview,
    frame_smoke,
    write_previews,
)
from smokelift.output.sequence import Viewer
from smokelift.scene import Background, Scene, orbit


def preview(sequence: Sequence, scene: Scene) -> Preview:
    return Preview(sequence, Clip.open(scene.clip), frame_smoke(sequence))


@pytest.mark.parametrize("count", [1, 5])
def test_a_contact_sheet_has_the_input_and_every_view(plume, tmp_path, count) -> None:
    sequence = at_rest(plume.scene, plume.densities[:count], tmp_path / "out")
    rows, titles, labels = preview(sequence, plume.scene).contact_sheet()
    assert len(labels) == len(rows) and 1 <= len(rows) <= count
    for row in rows:
        assert len(row) == len(titles) == 2 + len(SHEET_ANGLES)
        assert {picture.shape for picture in row} == {row[0].shape} and len(row[0]) == SHEET_HEIGHT
        assert all(picture.max() > 0.13 for picture in row)


def test_an_orbit_shows_one_frame_from_twelve_angles(plume, tmp_path) -> None:
    sequence = at_rest(plume.scene, plume.densities, tmp_path / "out")
    shown = preview(sequence, plume.scene)
    rows, titles, labels = shown.orbit()
    assert [len(row) for row in rows] == [ORBIT_COLUMNS] * 2 == [len(titles)] * len(labels)
    pictures = [picture for row in rows for picture in row]
    assert all(picture.max() > 0.13 for picture in pictures)
    camera = shown.framing.camera(sequence.scene.camera, SHEET_HEIGHT)
    np.testing.assert_allclose(pictures[0], Viewer(sequence.scene, camera).image(4, plume.densities[3]), atol=1e-4)
    assert np.abs(pictures[0] - pictures[6][:, ::-1]).max() > 0.02


@pytest.mark.parametrize(("count", "columns"), [(1, 1), (5, 5), (9, STRIP_FRAMES)])
def test_a_strip_shows_consecutive_frames_from_the_side(plume, tmp_path, count, columns) -> None:
    densities = [plume.densities[min(n, 4)] for n in range(count)]
    scene = plume.write(tmp_path / "clip", densities, plume.scene)
    sequence = at_rest(scene, densities, tmp_path / "out")
    shown = preview(sequence, scene)
    filmed, side = shown.strip().rows
    assert len(filmed) == len(side) == columns
    assert all(picture.max() > 0.13 for picture in (*filmed, *side))
    top = [np.flatnonzero(picture.max((1, 2)) > 0.13)[0] for picture in side]
    assert top == sorted(top, reverse=True)
    rise = {1: 0, 5: 9.6, 9: 7.2}[count]  # in the clip's pixels
    assert top[0] - top[-1] == pytest.approx(rise * SHEET_HEIGHT / shown.framing.height, abs=10)


def test_the_video_turns_while_it_plays(plume, tmp_path, monkeypatch) -> None:
    for height in ("SHEET_HEIGHT", "PREVIEW_HEIGHT"):
        monkeypatch.setattr(f"smokelift.output.preview.{height}", 112)
    still = [plume.densities[2]] * 5
    scene = plume.write(tmp_path / "clip", still, plume.scene)
    scene = replace(scene, clip=replace(scene.clip, fps=4.0))
    sequence = at_rest(scene, still, tmp_path / "out")
    with Clip.open(scene.clip) as clip:
        write_previews(tmp_path, sequence, clip)
    assert set(PICTURES) < set(names(tmp_path))
    with Clip.open(tmp_path / "preview.mp4") as video:
        width = video.size[0] // 3
        front, turning = ([video.frame(n)[:, p * width : (p + 1) * width] for n in (0, 4)] for p in (1, 2))
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
    picture = np.repeat(np.float32(plate), 28)[:, None, None] * np.ones((1, 40, 3), np.float32)
    write_image(tmp_path / "plate.exr", picture)
    scene = replace(plume.scene, background=Background(image=tmp_path / "plate.exr"), scattering=scattering)
    sequence = at_rest(scene, plume.densities, tmp_path / "out")
    framing = replace(frame_smoke(sequence), left=0, top=0, width=40, height=56)
    for picture in Preview(sequence, Clip.open(scene.clip), framing).video():
        np.testing.assert_allclose(picture[[20, -20], -20], behind, atol=1e-3)
        front = picture[[20, -20], picture.shape[1] // 2]
        np.testing.assert_allclose(front.mean(-1), plate, atol=1e-3)


def test_the_smoke_of_every_frame_is_in_the_part_from_all_sides(plume, tmp_path) -> None:
    moved = [np.roll(density, (6, -6), (0, 1)) for density in plume.densities]
    sequence = at_rest(plume.scene, moved, tmp_path / "out")
    framing = frame_smoke(sequence)
    assert framing.width * framing.height < 0.75 * 40 * 56
    for yaw in (0, 60, 90, 210):
        viewer = Viewer(sequence.scene, orbit(framing.camera(sequence.scene.camera, 64), framing.box, yaw))
        for number in (1, 5):
            shown = viewer.image(number, moved[number - 1]).mean(-1)
            assert shown.max() > 0.1
            assert max(shown[[0, -1]].max(), shown[:, [0, -1]].max()) < 0.05 * shown.max()


def test_a_column_gets_room_beside_it_and_without_smoke_the_box_is_shown(plume, tmp_path) -> None:
    column = np.zeros_like(plume.densities[0])
    assert frame_smoke(at_rest(plume.scene, [column], tmp_path / "none")).box == plume.scene.domain
    column[15:17, 15:17, 4:40] = 1
    framing = frame_smoke(at_rest(plume.scene, [column], tmp_path / "column"))
    assert framing.width >= MIN_ASPECT * framing.height - 2
