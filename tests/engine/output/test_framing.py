"""Where in a picture the smoke of a sequence is."""

from __future__ import annotations

import numpy as np

from smokelift.footage.clip import Clip
from smokelift.output.framing import MIN_ASPECT, frame_smoke
from smokelift.output.sequence import Sequence
from smokelift.output.viewer import Viewer
from smokelift.output.writer import SequenceWriter
from smokelift.scene import completed, orbit
from smokelift.transport import Velocity


def written(scene, densities, folder) -> Sequence:
    rest = Velocity.zero(scene.domain.resolution, scene.domain.voxel_size).faces
    with SequenceWriter(folder, completed(scene), {}, npz=True) as writer:
        for number, density in enumerate(densities, 1):
            writer.write(number, density, rest)
    return Sequence.open(folder)


def test_the_smoke_of_every_frame_is_in_the_part_from_all_sides(plume, tmp_path) -> None:
    """Smoke that leaves the middle of the box is turned about itself, and is not cut off at the edges."""
    moved = [np.roll(density, (6, -6), (0, 1)) for density in plume.densities]
    sequence = written(plume.scene, moved, tmp_path / "out")
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
    """The part is not so narrow that no neighbourhood is seen."""
    column = np.zeros_like(plume.densities[0])
    column[15:17, 15:17, 4:40] = 1
    framing = frame_smoke(written(plume.scene, [column], tmp_path / "out"))
    assert framing.width >= MIN_ASPECT * framing.height - 2


def test_without_smoke_the_box_is_shown(plume, tmp_path) -> None:
    """And nothing goes wrong."""
    sequence = written(plume.scene, [np.zeros_like(plume.densities[0])], tmp_path / "out")
    assert frame_smoke(sequence).box == plume.scene.domain


def test_a_moving_camera_keeps_the_smoke(plume, tracked, tmp_path) -> None:
    """One part of the picture for all frames, wherever the camera goes."""
    sequence = written(tracked, plume.densities, tmp_path / "out")
    framing = frame_smoke(sequence)
    with Clip.open(tracked.clip) as clip:
        for number in range(5):
            picture = clip.frame(number).sum(-1)
            assert framing.part(picture).sum() > 0.95 * picture.sum()
