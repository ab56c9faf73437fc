"""The background that an artist gives: frames of the clip without smoke, and strokes painted on its frames."""

from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Color

from addon.core import ShotError
from addon.panel import element_panel
from addon.result.smoke_takes import output_folder
from addon.scene import volume
from addon.scene.scene_file import footage_tables
from conftest import changed, made, pixels, pixels_of, save_image
from smokelift.extraction.given_background import Strokes
from smokelift.scene import Background
from tests.addon.inside.panel.tab import drawn, know
from tests.example_shot import EXAMPLE, smoke

# frames of the clip as the clean plate


def test_frames_without_smoke_are_the_plate(shot, settings, tmp_path) -> None:
    settings.clip.frame_start, settings.clip.frame_offset = 101, 3
    for frame in (103, 101, 103):
        shot.frame_set(frame)
        assert bpy.ops.smokelift.plate_from_frame() == {"FINISHED"}
    assert (settings.plate_mode, settings.plate_frames) == ("FRAMES", "3, 1")
    assert Background(**footage_tables(smoke(shot))["background"]).frame == (3, 5)
    assert bpy.ops.smokelift.clear_plate_frames() == {"FINISHED"}
    assert (settings.plate_mode, settings.plate_frames) == ("ESTIMATE", "")
    assert "background" not in footage_tables(smoke(shot))


def test_frames_that_the_clip_does_not_have_are_refused(shot, settings) -> None:
    settings.plate_mode = "FRAMES"
    for text, said in (("", "Plate from This Frame"), ("0", "1 to 48"), ("2, x", "2, x")):
        settings.plate_frames = text
        with pytest.raises(ShotError, match=said):
            footage_tables(smoke(shot))
    settings.clip.frame_start = 11
    shot.frame_set(10)
    for operator in (bpy.ops.smokelift.plate_from_frame, bpy.ops.smokelift.extract):
        with pytest.raises(RuntimeError, match=r"frame 10\b.* 11 to 58"):
            operator()
    settings.clip = bpy.data.movieclips.load(str(EXAMPLE / "clip.mp4"))
    assert settings.plate_frames == ""


def test_one_color_is_the_background(shot, settings) -> None:
    """As the engine asks for it where the clip does not show what is behind its smoke."""
    settings.plate_mode = "COLOR"
    assert footage_tables(smoke(shot))["background"] == {"color": [0.0, 0.0, 0.0]}
    settings.plate_color = (0.25, 0.5, 2.0)
    assert Background(**footage_tables(smoke(shot))["background"]).color == (0.25, 0.5, 2.0)


# what the view through the camera shows behind the smoke


def test_the_view_has_the_plate_of_the_render_and_the_clip_at_a_switch(shot, tmp_path) -> None:
    """Also where a file of before shows the clip; a second set-up changes the plate alone."""
    obj, camera = smoke(shot), shot.camera.data
    for name in ("set_up_range", "set_up_light", "set_up_colors"):
        setattr(obj.smokelift, name, False)
    obj.smokelift.set_up_plate = False
    takes = [made(tmp_path, number=number) for number in (1, 2)]
    backgrounds = {"image": str(EXAMPLE / "plate.png")}, {"color": [0.2, 0.5, 1.0]}
    for take, background in zip(takes, backgrounds, strict=True):
        with changed(take) as index:
            index["scene"] |= {"background": background, "camera": {}}
    volume.show(obj, takes[0])
    bpy.ops.smokelift.set_up()
    (clip,) = camera.background_images
    assert (clip.clip, clip.show_background_image) == (obj.smokelift.clip, True)
    obj.smokelift.set_up_plate = True
    bpy.ops.smokelift.set_up()
    plate, clip = camera.background_images
    assert (Path(plate.image.filepath).name, plate.show_background_image) == ("plate.png", True)
    assert (clip.clip, clip.show_background_image) == (obj.smokelift.clip, False)
    assert "Clip in View" in drawn(shot, bpy.types.SMOKELIFT_PT_view_set_up)
    plate.show_background_image, clip.show_background_image = False, True
    volume.show(obj, takes[1])
    bpy.ops.smokelift.set_up()
    plate, clip = camera.background_images
    shown = Color(plate.image.generated_color[:3]).from_srgb_to_scene_linear()
    assert tuple(shown) == pytest.approx((0.2, 0.5, 1.0), abs=1e-3)
    assert (plate.show_background_image, clip.show_background_image) == (False, True)


def test_the_color_begins_with_the_one_that_was_found(shot, settings) -> None:
    """Unless there is none, or one was chosen; another clip has another."""
    for found, chosen, wanted in ((None, None, 0.0), (0.5, None, 0.5), (0.7, None, 0.5), (0.7, 0.9, 0.9)):
        know(shot, background_color=None if found is None else [found] * 3)
        settings.plate_mode = "ESTIMATE"
        if chosen is not None:
            settings.plate_color = [chosen] * 3
        settings.plate_mode = "COLOR"
        assert tuple(settings.plate_color) == pytest.approx([wanted] * 3)
    settings.plate_mode, settings.clip = "ESTIMATE", bpy.data.movieclips.load(str(EXAMPLE / "clip.mp4"))
    settings.plate_mode = "COLOR"
    assert tuple(settings.plate_color) == pytest.approx([0.7] * 3)
    assert "[ui.eyedropper_color]" in drawn(shot, bpy.types.SMOKELIFT_PT_view)


# strokes


def paint(image: bpy.types.Image, color: tuple[float, float, float], opacity: float, rows: slice) -> None:
    """Paint some rows of an image, as a brush does."""
    values = pixels_of(image).copy()
    values[rows, :, :3] += opacity * (color - values[rows, :, :3])
    image.pixels.foreach_set(values[::-1].ravel())


def test_strokes_are_painted_on_the_clips_frame(shot, settings, tmp_path) -> None:
    """Below them is the clip; the file has the strokes alone, and follows before a run."""
    settings.output = str(tmp_path / "out")
    shot.frame_set(20)
    assert bpy.ops.smokelift.paint_strokes() == {"FINISHED"}
    image, file = settings.strokes, output_folder(smoke(shot)) / "strokes.png"
    assert Path(bpy.path.abspath(image.filepath)) == file
    first = pixels_of(image).copy()
    assert first[..., 3].min() == 1.0 and first[..., :3].max() > 0.5
    assert footage_tables(smoke(shot))["background"] == {"image": str(EXAMPLE / "plate.png"), "strokes": str(file)}
    assert not pixels(file).any()
    green, red, black = (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for color, opacity, rows in ((green, 0.8, slice(9)), (red, 1.0, slice(9, 12)), (black, 1.0, slice(4))):
        paint(image, color, opacity, rows)
    footage_tables(smoke(shot))
    found = pixels(file)
    assert (found[4:9] == (*green, 1.0)).all() and (found[9:12] == (*red, 1.0)).all()
    assert not found[:4].any() and not found[12:].any()
    assert not image.is_dirty
    # another frame below: the strokes stay, and the frame is seen where they were erased
    shot.frame_set(40)
    assert bpy.ops.smokelift.paint_strokes() == {"FINISHED"}
    second = pixels_of(image)
    assert (second[4:9] == (*green, 1.0)).all() and second[..., 3].min() == 1.0
    assert np.abs(second[12:] - first[12:]).max() > 0.05
    image.save()  # by the artist, with the frame below
    footage_tables(smoke(shot))
    assert (pixels(file) == found).all()
    assert len(bpy.data.scenes) == 1
    assert [each for each in bpy.data.images if each.source != "VIEWER"] == [image]
    # they are opened again where they were made
    bpy.data.images.remove(image)
    assert settings.strokes is None
    assert bpy.ops.smokelift.paint_strokes() == {"FINISHED"}
    assert (pixels_of(settings.strokes)[4:9] == (*green, 1.0)).all()


def test_other_images_are_strokes_too(shot, tmp_path) -> None:
    image = smoke(shot).smokelift.strokes = save_image(tmp_path / "mine.png", smoke(shot).smokelift.clip.size)
    paint(image, (0.3, 0.6, 0.3), 1.0, slice(4))
    assert Background(**footage_tables(smoke(shot))["background"]).strokes == tmp_path / "mine.png"
    assert pixels(tmp_path / "mine.png")[:4, :, 1] == pytest.approx(0.6, abs=0.01)


def test_a_stroke_of_another_color_is_left_for_the_engine_to_refuse(shot, settings, tmp_path) -> None:
    settings.output = str(tmp_path / "out")
    assert bpy.ops.smokelift.paint_strokes() == {"FINISHED"}
    for color, rows in (((1.0, 1.0, 0.0), slice(4)), ((0.0, 1.0, 0.0), slice(8, 12))):
        paint(settings.strokes, color, 1.0, rows)
    file = footage_tables(smoke(shot))["background"]["strokes"]
    assert (pixels(Path(file))[:4] == (1.0, 1.0, 0.0, 1.0)).all()
    with pytest.raises(ValueError, match=r"strokes\.png"):
        Strokes.read(Path(file), tuple(settings.clip.size))


def test_strokes_that_cannot_be_written_are_named(shot, tmp_path) -> None:
    smoke(shot).smokelift.output = str(tmp_path / "out")
    bpy.ops.smokelift.paint_strokes()
    (tmp_path / "file").touch()
    smoke(shot).smokelift.strokes.filepath_raw = str(tmp_path / "file" / "strokes.png")
    with pytest.raises(ShotError, match=r"strokes\.png"):
        footage_tables(smoke(shot))


@pytest.mark.parametrize(("size", "saved", "said"), [((8, 8), True, "8 x 8"), ((256, 384), False, "mine")])
def test_an_image_that_does_not_fit_is_refused(shot, tmp_path, size, saved, said) -> None:
    file = tmp_path / "mine.png"
    image = save_image(file, size) if saved else bpy.data.images.new("mine", *size, alpha=True)
    smoke(shot).smokelift.strokes = image
    with pytest.raises(ShotError, match=said):
        footage_tables(smoke(shot))


@pytest.mark.parametrize("means", element_panel.COLORS)
def test_a_stroke_has_the_color_that_says_it(shot, means) -> None:
    assert bpy.ops.smokelift.stroke(means=means) == {"FINISHED"}
    paint = shot.tool_settings.image_paint
    holder = getattr(paint, "unified_paint_settings", None) or shot.tool_settings.unified_paint_settings
    assert tuple(holder.color) == element_panel.COLORS[means]
