"""Pictures of a clip whose lens was calibrated, made straight, and of masks that are drawn in Blender."""

import tomllib
from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.core import ShotError
from addon.core.take import Take
from addon.result import shot_check, smoke_takes
from addon.scene import pictures
from addon.scene.clip import clip_table
from addon.scene.scene_file import footage_tables, shot_tables
from conftest import pixels
from smokelift.footage.clip import Clip
from smokelift.output.images import write_image
from smokelift.scene import Scene
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
    with pytest.raises(RuntimeError, match=name.partition("_")[0]):
        bpy.ops.smokelift.undistort()


@pytest.mark.parametrize("model", sorted(pictures.COEFFICIENTS))
def test_every_model_of_a_lens_counts(bent, model) -> None:
    clip = smoke(bent).smokelift.clip
    lens = clip.tracking.camera
    lens.k1, lens.distortion_model = 0.0, model
    assert not pictures.is_distorted(clip)
    setattr(lens, pictures.COEFFICIENTS[model][0], 0.01)
    assert pictures.is_distorted(clip)


RECTANGLE = ((0.3, 0.1), (0.7, 0.1), (0.7, 0.4), (0.3, 0.4))
"""Corners in shares of the picture's longer side, from its middle column and its lower edge."""


def draw(scene: bpy.types.Scene) -> bpy.types.MaskSpline:
    """Press New Mask and draw a closed line with sharp corners."""
    assert bpy.ops.smokelift.new_mask() == {"FINISHED"}
    line = smoke(scene).smokelift.drawn_mask.layers[0].splines.new()
    line.points.add(len(RECTANGLE) - len(line.points))
    line.use_cyclic = True
    put(line)
    return line


def put(line: bpy.types.MaskSpline, right: float = 0.0, up: float = 0.0) -> None:
    """Put the corners where the rectangle has them, moved."""
    for point, (x, y) in zip(line.points, RECTANGLE, strict=True):
        point.handle_type = "VECTOR"
        point.co = point.handle_left = point.handle_right = (x + right, y + up)


def white(picture: Path) -> np.ndarray:
    """Where a picture is white, row 0 at the top; it has hardly any other value than black."""
    values = pixels(picture)[..., 0]
    assert np.minimum(values, 1 - values).mean() < 0.01
    return values > 0.5


def test_inside_its_lines_smoke_may_be(shot, settings) -> None:
    """Where Blender's Mask node has them: a mask is measured from the middle, in shares of the longer side."""
    settings.mask = "//no such file.png"  # what is drawn comes first
    draw(shot)
    table = footage_tables(smoke(shot))["clip"]
    width, height = settings.clip.size
    seen = white(Path(table["mask"]))
    assert seen.shape == (height, width)
    wanted = (*(width / 2 + height * x for x in (-0.2, 0.2)), 0.6 * height, 0.9 * height)
    rows, columns = np.nonzero(seen)
    found = (columns.min(), columns.max() + 1, rows.min(), rows.max() + 1)
    assert found == pytest.approx(wanted, abs=1)
    assert seen.mean() == pytest.approx(0.4 * height * 0.3 * height / (width * height), rel=0.02)
    assert footage_tables(smoke(shot))["clip"] == table  # drawn once
    settings.drawn_mask.layers[0].invert = True
    assert (white(Path(footage_tables(smoke(shot))["clip"]["mask"])) == ~seen).mean() > 0.995
    assert len(bpy.data.scenes) == 1


def move(scene: bpy.types.Scene, line: bpy.types.MaskSpline, keys: dict[int, tuple[float, float]]) -> None:
    """Give a line shape keys: how far it is moved in some frames."""
    window = bpy.context.window_manager.windows[0]
    area = window.screen.areas[0]
    area.type = "CLIP_EDITOR"
    space, settings = area.spaces.active, smoke(scene).smokelift
    space.clip, space.mode, space.mask = settings.clip, "MASK", settings.drawn_mask
    region = next(region for region in area.regions if region.type == "WINDOW")
    for frame, (right, up) in keys.items():
        scene.frame_set(frame)
        put(line, right, up)
        with bpy.context.temp_override(window=window, area=area, region=region):
            for point in line.points:
                point.select = True
            assert bpy.ops.mask.shape_key_insert() == {"FINISHED"}


def test_a_mask_that_moves_has_a_picture_for_every_frame_of_the_file(shot, settings) -> None:
    """By the numbers that the engine counts the frames by; a check takes the current frame's alone."""
    settings.clip.frame_start, settings.clip.frame_offset = 101, 3
    settings.first, settings.last = 5, 9
    line = draw(shot)
    move(shot, line, {105: (0.0, 0.0), 109: (0.0, 0.4)})
    shot.frame_set(107)
    pattern = Path(footage_tables(smoke(shot))["clip"]["mask"])
    assert pattern.name == "mask_####.png"

    def lower_edge(picture: Path) -> float:
        return np.flatnonzero(white(picture)[::-1].any(1))[0] / settings.clip.size[1]

    assert len(list(pattern.parent.iterdir())) == 3 + settings.clip.frame_duration
    # the frame 105 of the scene is the clip's fifth, which is number 7 of the file
    found = [lower_edge(pattern.with_name(f"mask_{number:04d}.png")) for number in (0, 7, 9, 11, 30)]
    assert found == pytest.approx([0.1, 0.1, 0.3, 0.5, 0.5], abs=0.01)
    quick = Path(shot_tables(smoke(shot), quick=True)["clip"]["mask"])
    assert quick.name == "mask.png"
    assert lower_edge(quick) == pytest.approx(0.3, abs=0.01)
    assert shot.frame_current == 107


def test_a_line_that_is_not_closed_says_what_to_do(shot) -> None:
    line = draw(shot)
    line.use_cyclic = False
    with pytest.raises(ShotError, match="Mask"):
        footage_tables(smoke(shot))
    smoke(shot).smokelift.drawn_mask = None
    assert "mask" not in footage_tables(smoke(shot))["clip"]
    smoke(shot).smokelift.mask = "//no such file.png"
    with pytest.raises(ShotError, match=r"no such file\.png"):
        footage_tables(smoke(shot))


@pytest.mark.parametrize("moves", [False, True])
def test_a_result_keeps_the_mask_that_it_was_made_with(shot, settings, tmp_path, moves) -> None:
    """Also where its folder is moved, or another file was chosen meanwhile; it goes with the result."""
    settings.output = str(tmp_path / "out")
    line = draw(shot)
    if moves:
        move(shot, line, {1: (0.0, 0.0), 11: (0.0, 0.4)})
    take = smoke_takes.write_take(smoke(shot))
    own = "take_0001_mask_####.png" if moves else "take_0001_mask.png"
    first = tmp_path / "out" / own.replace("####", "0000")
    before = first.read_bytes()

    def in_file() -> str:
        return tomllib.loads(take.scene_file.read_text())["clip"]["mask"]

    assert in_file() == own and 0.1 < white(first).mean() < 0.5
    line.use_cyclic = False
    settings.drawn_mask, settings.mask = None, str(first)
    smoke_takes.update_moved_files(smoke(shot), take)
    assert in_file() == own and first.read_bytes() == before
    (tmp_path / "out").rename(tmp_path / "moved")
    moved = Take(tmp_path / "moved" / "take_0001")
    with Clip.open(Scene.load(moved.scene_file).clip) as clip:
        assert (clip.seen(0, *clip.size) == white(tmp_path / "moved" / first.name)).all()
    moved.remove()
    assert list((tmp_path / "moved").iterdir()) == []


def test_a_mask_that_is_drawn_on_is_checked_anew(shot) -> None:
    """But not one that only moves because the clip plays, nor another one."""
    line, state = draw(shot), shot_check.state
    other = bpy.data.masks.new("Other").layers.new(name="Other").splines.new()
    bpy.context.view_layer.update()
    state.settings = shot_check.settings_text(smoke(shot))
    shot.frame_set(7)
    other.use_cyclic = True
    bpy.context.view_layer.update()
    shot_tables(smoke(shot), quick=True)
    assert state.settings
    line.points[0].co = (0.2, 0.1)
    bpy.context.view_layer.update()
    assert not state.settings


def test_there_is_one_mask_that_is_drawn_on_a_frame_that_is_used(shot, settings) -> None:
    settings.first, settings.last = 21, 30
    for frame, shown in ((5, 21), (25, 25)):
        shot.frame_set(frame)
        assert bpy.ops.smokelift.new_mask() == {"FINISHED"}
        assert shot.frame_current == shown
        assert [settings.drawn_mask] == list(bpy.data.masks)
        assert shown >= settings.drawn_mask.frame_start
