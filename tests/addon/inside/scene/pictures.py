"""A clip whose lens was calibrated, made straight."""

import bpy
import numpy as np
import pytest

from addon.scene import pictures
from addon.scene.clip import clip_table
from conftest import pixels
from smokelift.output.images import write_image
from tests.example_shot import smoke

SIZE = 64


@pytest.fixture
def bent(scene, tmp_path) -> bpy.types.Scene:
    """Three pictures of a bright line near the left edge, by a lens with distortion; frame 101 is the first."""
    picture = np.full((SIZE, SIZE, 3), 0.1, np.float32)
    picture[:, 8:12] = 0.8
    for number in (1, 2, 3):
        picture[:4] = 0.2 * number
        write_image(tmp_path / f"bent_{number:04d}.png", picture)
    clip = bpy.data.movieclips.load(str(tmp_path / "bent_0001.png"))
    clip.frame_start = 101
    lens = clip.tracking.camera
    lens.sensor_width, lens.focal_length, lens.k1 = 36.0, 35.0, -0.5
    settings = smoke(scene).smokelift
    settings.clip, settings.output = clip, str(tmp_path / "out")
    settings.first, settings.plate_frames = 2, "3"
    return scene


def line(picture: np.ndarray, row: int) -> float:
    """Column of the bright line in a row."""
    weights = np.maximum(picture[row, : SIZE // 2, 0] - 0.5, 0.0)
    return float(np.average(np.arange(SIZE // 2), weights=weights))


def test_the_clip_is_made_straight(bent, tmp_path) -> None:
    """As Blender undistorts it: a straight line bends the other way, the middle stays, and so do frames and range."""
    scenes = len(bpy.data.scenes)
    before = smoke(bent).smokelift.clip
    folder = smoke(bent).smokelift.folder
    assert pictures.is_distorted(before)
    assert bpy.ops.smokelift.undistort() == {"FINISHED"}
    settings = smoke(bent).smokelift
    assert settings.clip != before
    assert not pictures.is_distorted(settings.clip)
    assert (settings.clip.frame_start, settings.clip.frame_duration) == (101, 3)
    assert (settings.first, settings.last, settings.folder, settings.plate_frames) == (2, 3, folder, "3")
    assert clip_table(smoke(bent))["frames"] == [1, 2]
    files = sorted((tmp_path / "out" / "undistorted").iterdir())
    assert [file.name for file in files] == [f"undistorted_{number:04d}.png" for number in (101, 102, 103)]
    picture = pixels(files[1])[..., :3]
    assert abs(line(picture, SIZE // 4) - line(picture, SIZE // 2)) > 0.3
    assert picture[SIZE // 2, SIZE // 2] == pytest.approx([0.1] * 3, abs=0.002)  # 16 bits are read as linear
    assert len(bpy.data.scenes) == scenes
    assert not bpy.ops.smokelift.undistort.poll()


@pytest.mark.parametrize(("name", "value"), [("plate_mode", "FILE"), ("mask", "//mask.png"), ("strokes", None)])
def test_what_is_distorted_too_is_refused(bent, name, value) -> None:
    setattr(smoke(bent).smokelift, name, value or bpy.data.images.new("strokes.png", SIZE, SIZE, alpha=True))
    with pytest.raises(RuntimeError, match=f"{name.partition('_')[0]} .*distorted"):
        bpy.ops.smokelift.undistort()


@pytest.mark.parametrize("model", sorted(pictures.COEFFICIENTS))
def test_every_model_of_a_lens_counts(bent, model) -> None:
    clip = smoke(bent).smokelift.clip
    lens = clip.tracking.camera
    lens.k1, lens.distortion_model = 0.0, model
    assert not pictures.is_distorted(clip)
    setattr(lens, pictures.COEFFICIENTS[model][0], 0.01)
    assert pictures.is_distorted(clip)
