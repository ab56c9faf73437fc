"""The element of a clip: what the engine is asked for, and what Blender shows of it."""

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import pytest

from addon.result import side_job
from addon.scene.plate import show_clip_behind
from conftest import save_image
from tests.addon.inside.panel.tab import said
from tests.example_shot import smoke

ENGINE = """
import json, shutil, sys
from pathlib import Path
words = sys.argv[1:]
Path({journal!r}).write_text(json.dumps(words))
out = words[words.index("--out") + 1]
first, last = words[words.index("--frames") + 1].split(":") if "--frames" in words else ("20", "31")
for number in range(int(first), int(last) + 1):
    shutil.copy({picture!r}, out.replace("####", f"{{number:04d}}"))
print(json.dumps({{"event": "note", "text": "The plate is noisy.", "doubt": True}}))
print(json.dumps({{"event": "done", "text": "Written."}}))
"""
"""Stands in for the engine: writes the same picture for every frame that it is asked for."""


@pytest.fixture
def asked(shot, tmp_path, stand_in) -> Callable[[], tuple[list[str], dict[str, Any]]]:
    """Gives what the engine was asked for: its arguments, and the tables of the scene file."""
    save_image(tmp_path / "red.exr", (2, 2), [0.25, 0.0, 0.0, 0.5] * 4)
    journal = tmp_path / "asked.json"
    stand_in(side_job, ENGINE.format(journal=str(journal), picture=str(tmp_path / "red.exr")))
    smoke(shot).smokelift.output = str(tmp_path / "out")

    def read() -> tuple[list[str], dict[str, Any]]:
        words = json.loads(journal.read_text())
        return words, tomllib.loads(Path(words[1]).read_text())

    return read


def test_extract_shows_the_element_of_this_frame(shot, asked, tmp_path) -> None:
    shot.frame_set(24)
    smoke(shot).smokelift.camera_mode = "SCENE"
    smoke(shot).smokelift.box = None  # it takes no box to see the element
    assert bpy.ops.smokelift.extract() == {"FINISHED"}
    words, tables = asked()
    folder = tmp_path / "out" / "element"
    scene, out = str(Path(bpy.app.tempdir) / "smokelift_element.toml"), str(folder / "element_####.exr")
    assert words == ["extract", scene, "--out", out, "--frames", "23:23", "--progress", "json"]
    assert sorted(tables) == ["background", "clip"]
    picture = folder / "element_0023.exr"  # as Render Element names it
    assert side_job.writing_job.sentence == f"Frame 24 of the clip is in {picture}."
    image = bpy.data.images[picture.name]
    assert image.alpha_mode == "PREMUL"
    assert list(image.pixels)[:4] == pytest.approx([0.25, 0.0, 0.0, 0.5])
    assert side_job.writing_job.doubts == [("", "The plate is noisy.")]
    assert bpy.ops.smokelift.extract() == {"FINISHED"}
    assert [image.name for image in bpy.data.images if "element" in image.name] == [picture.name]


def test_the_element_lies_over_what_the_view_shows_behind(shot, asked) -> None:
    """A second one takes the place of the first; the plate that is set up later lies over it."""
    camera = shot.camera.data
    show_clip_behind(smoke(shot), camera)
    for frame in (24, 25):
        shot.frame_set(frame)
        assert bpy.ops.smokelift.extract() == {"FINISHED"}
    clip, element = camera.background_images
    assert (clip.source, element.source, element.display_depth) == ("MOVIE_CLIP", "IMAGE", "BACK")
    assert element.image.name == "element_0024.exr" and element.show_background_image
    assert "Element in View" in said(shot, bpy.types.SMOKELIFT_PT_view_element)
    shot.camera = None
    assert bpy.ops.smokelift.extract() == {"FINISHED"}
    assert "Element in View" not in said(shot, bpy.types.SMOKELIFT_PT_view_element)


def test_render_element_writes_all_frames_that_are_used(settings, asked, tmp_path) -> None:
    settings.first, settings.last = 21, 32
    folder = tmp_path / "new" / "element"
    assert bpy.ops.smokelift.render_element(directory=str(folder)) == {"FINISHED"}
    words, tables = asked()
    scene = str(Path(bpy.app.tempdir) / "smokelift_element.toml")
    assert words == ["extract", scene, "--out", str(folder / "element_####.exr"), "--progress", "json"]
    assert tables["clip"]["frames"] == [20, 31]
    assert sorted(path.name for path in folder.iterdir()) == [f"element_{n:04d}.exr" for n in range(20, 32)]
    assert side_job.writing_job.sentence == f"The element is in {folder}."


def test_nothing_is_ended_half_written(shot, stand_in) -> None:
    stand_in(side_job, "import sys; sys.stdin.read()")
    side_job.writing_job.start(smoke(shot), [], lambda *_: None, "smokelift.render_element")
    assert not bpy.ops.smokelift.extract.poll()
    assert bpy.ops.smokelift.stop_writing() == {"FINISHED"}
    assert bpy.ops.smokelift.extract.poll()


@pytest.mark.parametrize("brush", [None, "a brush"])
def test_strokes_say_where_there_is_no_brush(shot, brush) -> None:
    """Builds of some distributions bring none, and Blender paints nothing then, without a word."""
    texts = " ".join(said(shot, bpy.types.SMOKELIFT_PT_strokes, brush=brush))
    assert ("without brushes" in texts) == (brush is None)
