"""Contact sheets and preview videos of the true volumes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from smokelift.footage.clip import Clip
from smokelift.output.images import write_image
from smokelift.output.preview import SHEET_ANGLES, SHEET_HEIGHT, write_contact_sheet, write_preview
from smokelift.output.sequence import Sequence
from smokelift.output.writer import SequenceWriter
from smokelift.scene import Background, completed
from smokelift.transport import Velocity


def written(scene, densities, folder) -> Sequence:
    rest = Velocity.zero(scene.domain.resolution, scene.domain.voxel_size).faces
    with SequenceWriter(folder, completed(scene), {}, npz=True) as writer:
        for number, density in enumerate(densities, 1):
            writer.write(number, density, rest)
    return Sequence.open(folder)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_a_contact_sheet_has_all_tiles(plume, tmp_path, count) -> None:
    """Rows of frames, columns of input and views, whatever the number of frames; smoke in every tile."""
    sequence = written(plume.scene, plume.densities[:count], tmp_path / "out")
    with Clip.open(plume.scene.clip) as clip:
        write_contact_sheet(tmp_path / "sheet.png", sequence, clip)
    with Image.open(tmp_path / "sheet.png") as sheet:
        pixels = np.asarray(sheet)
    columns = 1 + len(SHEET_ANGLES)
    width = round(40 * SHEET_HEIGHT / 56)
    assert width * columns < pixels.shape[1] < (width + 8) * columns + 8
    assert pixels.shape[0] > SHEET_HEIGHT
    rows = pixels.shape[0] // SHEET_HEIGHT
    assert 1 <= rows <= count
    for column in range(columns):
        left = round((column + 0.25) * pixels.shape[1] / columns)
        assert pixels[:, left : left + width // 2].max() > 100


def test_a_preview_shows_three_views(plume, tmp_path) -> None:
    """Input, front and turned view side by side, a frame each, at the clip's rate."""
    sequence = written(plume.scene, plume.densities, tmp_path / "out")
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


def test_a_moving_camera_and_its_plates_are_followed(plume, tracked, tmp_path) -> None:
    """They are in front only, and change from frame to frame."""
    scene = replace(tracked, background=Background(image=tmp_path / "plate_#.exr"))
    for n in range(5):
        write_image(tmp_path / f"plate_{n}.exr", np.full((56, 40, 3), 0.1 * n, np.float32))
    sequence = written(scene, plume.densities, tmp_path / "out")
    with Clip.open(tracked.clip) as clip:
        write_contact_sheet(tmp_path / "sheet.png", sequence, clip)
        write_preview(tmp_path / "preview.mp4", sequence, clip)
    with Clip.open(tmp_path / "preview.mp4") as preview:
        corners = [preview.frame(n)[:40, 380:640] for n in (0, 4)]
        assert corners[0].mean() < 0.02 < 0.3 < corners[1].mean()
