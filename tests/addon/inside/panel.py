"""The tab: what is in it, in Blender's words, at the width that Blender gives it."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest

from addon import (
    advanced_panel,
    direct_panel,
    export,
    look_panel,
    panel,
    results_panel,
    setup_panel,
    shot_check,
    volume,
)
from addon.contract import QUALITIES
from addon.take import Take
from conftest import made
from smokelift.output.images import write_image
from tests.example_shot import smoke

WIDTH = 258
"""Pixels of the sidebar in a new window."""

LETTERS = 34
"""Of a label without an icon, at most, at that width."""


class Layout:
    """Keeps the texts that are drawn, in place of Blender's layout."""

    def __init__(self, texts: list[str]) -> None:
        object.__setattr__(self, "texts", texts)

    def __getattr__(self, _name: str) -> Any:
        def draw(*_values: Any, text: str = "", icon: str = "NONE", **_settings: Any) -> Layout:
            self.texts.append(text if icon == "NONE" else f"{text}    ")
            return self

        return draw

    def __setattr__(self, _name: str, _value: Any) -> None:
        """Blender's layout has settings; here they change nothing."""


def drawn(scene: bpy.types.Scene, *panels: type) -> list[str]:
    texts: list[str] = []
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    context = SimpleNamespace(
        scene=scene,
        region=SimpleNamespace(width=WIDTH),
        preferences=preferences,
        window_manager=bpy.context.window_manager,
    )
    for kind in panels:
        kind.draw(SimpleNamespace(layout=Layout(texts)), context)
    return texts


def test_no_line_is_cut_off(shot) -> None:
    """The longest that there are, in a sidebar of the usual width."""
    manager = bpy.context.window_manager
    state = manager.smokelift
    state.check_smoke, state.check_done, state.notes = smoke(shot).session_uid, True, "Background: a picture"
    know_costs(shot, seconds=86000.0, memory=112.4, disk=99900.0, lost=0.123)
    state.memory_free = 11.8
    for outcome in ("waiting", "running", "done", "failed"):
        row = manager.smokelift.jobs.add()
        row.smoke_uid, row.outcome, row.sentence = smoke(shot).session_uid, outcome, "One word after the other. " * 5
        row.done, row.total, row.seconds_left, row.warnings = 1250, 2500, 80000.0, "This is a warning. " * 5
    texts = drawn(shot, panel.SMOKELIFT_PT_view, advanced_panel.SMOKELIFT_PT_view_advanced)
    assert {"24 h", "112 G", "100 G", "12%"} <= set(texts)
    assert [text for text in texts if len(text) > LETTERS] == []


def test_no_line_of_a_result_is_cut_off(shot, tmp_path, monkeypatch) -> None:
    """Nor of a sub-panel that is shown once there is one; files of terabytes."""
    smoke(shot).smokelift.output = str(tmp_path)
    for number in (1, 2):
        volume.show(smoke(shot), made(tmp_path, number=number))
    monkeypatch.setattr(Take, "size", lambda take: 888_888.8)
    panels = (
        results_panel.SMOKELIFT_PT_view_results,
        look_panel.SMOKELIFT_PT_view_look,
        setup_panel.SMOKELIFT_PT_view_set_up,
        export.SMOKELIFT_PT_view_export,
    )
    texts = drawn(shot, *panels)
    for direction in direct_panel._DIRECTIONS:
        smoke(shot).smokelift.directing.direction = direction
        texts += drawn(shot, direct_panel.SMOKELIFT_PT_view_direct)
    assert "Delete Earlier Results: 888.9 GB" in texts
    assert "Loop Smoke    " in texts
    assert [text for text in texts if len(text) > LETTERS] == []


def know_costs(scene: bpy.types.Scene, **figures: float) -> None:
    """All qualities were estimated, each with these figures."""
    state = bpy.context.window_manager.smokelift
    usual = {"resolution": (48, 48, 64), "seconds": 12.0, "memory": 0.4, "disk": 30.0, "lost": 0.0772}
    for quality in QUALITIES:
        row = state.costs.add()
        row.name = quality
        for name, value in {**usual, **figures}.items():
            setattr(row, name, value)
    state.costs_smoke = smoke(scene).session_uid


def test_the_look_is_in_the_tab(shot, tmp_path) -> None:
    """Once there is smoke; every input by its name, and how it is shown."""
    assert not look_panel.SMOKELIFT_PT_view_look.poll(SimpleNamespace(scene=shot))
    volume.show(smoke(shot), made(tmp_path))
    assert look_panel.SMOKELIFT_PT_view_look.poll(SimpleNamespace(scene=shot))
    texts = drawn(shot, look_panel.SMOKELIFT_PT_view_look)
    assert {"Density", "Brightness", "Color", "Edge Contrast", "Absorption", "Anisotropy"} <= set(texts)
    assert {"Presets    ", "View Density", "Render Step"} <= set(texts)


def test_large_smoke_without_a_proxy_is_offered_one(shot, tmp_path) -> None:
    """An earlier result: a run writes it by itself."""
    take = made(tmp_path)
    volume.show(smoke(shot), take)
    bpy.context.window_manager.smokelift.check_smoke = smoke(shot).session_uid  # no check is under way
    offer = "This smoke is large"
    assert not [text for text in drawn(shot, panel.SMOKELIFT_PT_view) if text.startswith(offer)]
    index = json.loads((take.directory / "sequence.json").read_text())
    index["scene"]["domain"]["resolution"] = [160, 160, 240]
    (take.directory / "sequence.json").write_text(json.dumps(index))
    assert [text for text in drawn(shot, panel.SMOKELIFT_PT_view) if text.startswith(offer)]


@pytest.mark.parametrize("word", ["Captured At", "Pixels", "Processor", "Graphics Card", "Anew"])
def test_words_are_blenders(scene, word) -> None:
    """Frame rate, color space, CPU, GPU."""
    settings = smoke(scene).smokelift.bl_rna.properties
    names = [setting.name for setting in settings]
    names += [item.name for setting in settings if setting.type == "ENUM" for item in setting.enum_items]
    names += [getattr(bpy.ops.smokelift, name).get_rna_type().name for name in dir(bpy.ops.smokelift)]
    assert not [name for name in names if word in name]


def test_match_scene_to_clip_ends_the_error_that_asked_for_it(shot) -> None:
    """A new box and every setting forget it too."""
    state = bpy.context.window_manager.smokelift

    def choose() -> set[str]:
        smoke(shot).smokelift.quality = "fine"
        return {"FINISHED"}

    for press in (bpy.ops.smokelift.match_clip, bpy.ops.smokelift.make_box, choose):
        state.check_smoke, state.check_error = smoke(shot).session_uid, "The render size has another shape."
        assert press() == {"FINISHED"}
        assert (state.check_smoke, state.check_error) == (0, "")


def test_pictures_have_no_frame_rate(shot, tmp_path) -> None:
    """A sequence is compared with the scene by its size alone."""
    for frame in (1, 2):
        write_image(tmp_path / f"clip_{frame:04d}.png", np.zeros((8, 8, 3), np.float32))
    smoke(shot).smokelift.clip = bpy.data.movieclips.load(str(tmp_path / "clip_0001.png"))
    bpy.context.window_manager.smokelift.check_smoke = smoke(shot).session_uid
    text = " ".join(" ".join(drawn(shot, panel.SMOKELIFT_PT_view)).split())
    assert "8 x 8 pixels, the scene" in text
    assert "frames a second" not in text


def test_only_what_differs_from_the_clip_is_said(shot) -> None:
    """The rate alone, if the sizes are the same."""
    bpy.ops.smokelift.match_clip()
    shot.render.fps, shot.render.fps_base = 50, 1.0
    bpy.context.window_manager.smokelift.check_smoke = smoke(shot).session_uid  # no check is under way
    text = " ".join(" ".join(drawn(shot, panel.SMOKELIFT_PT_view)).split())
    assert f"The clip has {smoke(shot).smokelift.clip.fps:g} frames a second, the scene 50." in text


def test_waiting_is_seen(shot, tmp_path) -> None:
    """How long the clip has been read; and in Direct how far the run has come, whose bar is not seen above it."""
    state = bpy.context.window_manager.smokelift
    state.check_smoke, state.check_seconds = smoke(shot).session_uid, 12
    assert "Reading the clip: 12 s    " in drawn(shot, panel.SMOKELIFT_PT_view)
    volume.show(smoke(shot), made(tmp_path))
    row = state.jobs.add()
    row.smoke_uid, row.outcome, row.done, row.total = smoke(shot).session_uid, "running", 3, 8
    assert "3 of 8" in drawn(shot, direct_panel.SMOKELIFT_PT_view_direct)
    row.outcome = "done"
    assert "3 of 8" not in drawn(shot, direct_panel.SMOKELIFT_PT_view_direct)


@pytest.mark.parametrize("complete", [True, False])
def test_a_failed_result_has_no_other_variation(shot, tmp_path, complete) -> None:
    """What failed or was stopped is resumed, or started again."""
    take = made(tmp_path)
    file = take.directory / "sequence.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {"complete": complete}))
    volume.show(smoke(shot), take)
    names: list[str] = []
    layout = Layout([])
    object.__setattr__(layout, "operator", lambda name, **_words: names.append(name) or layout)
    context = SimpleNamespace(
        scene=shot,
        region=SimpleNamespace(width=WIDTH),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
        window_manager=bpy.context.window_manager,
    )
    panel._draw_run(layout, context, smoke(shot))
    assert ("smokelift.vary" in names) == complete


FACTS = [
    ("background", "one color, 0.2, 0.2, 0.2 (linear), 8% of it unknown"),
    ("exposure", "steady"),
    ("scale", "box of 1.29 x 1.29 x 1.71 m"),
    ("smoke colour", "grey"),
    ("light strength", "smoke of radiance 0.89, 0.87, 0.86"),
    ("sun's direction", "no sun"),
    ("place in depth", "-0.12 m behind the middle of the box, give or take 0.09 m"),
]


def test_what_was_found_is_five_lines_in_the_panels_words(shot) -> None:
    """All else is in the report, whose button is below them."""
    lines = shot_check.found_lines({"what": what, "value": value} for what, value in FACTS)
    assert lines[0] == "Background: one color"
    assert lines[-1] == "Depth: -0.12 m behind the middle"
    assert len(lines) == 5
    assert max(map(len, lines)) <= LETTERS
    state = bpy.context.window_manager.smokelift
    state.check_smoke, state.check_done, state.notes = smoke(shot).session_uid, True, "\n".join(lines)
    assert set(lines) <= set(drawn(shot, advanced_panel.SMOKELIFT_PT_view_advanced))


def test_the_resolution_is_seen_when_it_is_guessed(shot) -> None:
    """With the cost, whatever the camera is."""
    state = bpy.context.window_manager.smokelift
    smoke(shot).smokelift.camera_mode = "ESTIMATE"
    know_costs(shot)
    state.check_smoke, state.check_done = smoke(shot).session_uid, True
    assert any(text.startswith("48 x 48 x 64 voxels") for text in drawn(shot, panel.SMOKELIFT_PT_view))


@pytest.mark.parametrize("name", ["longest_side", "fps", "overlap"])
def test_what_is_automatic_is_a_word_and_a_tick(shot, name) -> None:
    """In place of a 0 with a meaning of its own."""
    settings = smoke(shot).smokelift.directing if name == "overlap" else smoke(shot).smokelift
    smoke(shot).smokelift.directing.direction = "loop"
    panels = (advanced_panel.SMOKELIFT_PT_view_advanced, direct_panel.SMOKELIFT_PT_view_direct)
    words = drawn(shot, *panels).count("Automatic")
    setattr(settings, f"use_{name}", True)
    assert getattr(settings, name) > 0
    assert drawn(shot, *panels).count("Automatic") == words - 1
    setattr(settings, f"use_{name}", False)
    assert getattr(settings, name) == 0


def test_every_quality_says_what_it_takes_and_loses(shot) -> None:
    """Also while another setting is estimated; nothing of another smoke, nor of a shot that is refused."""
    state = bpy.context.window_manager.smokelift
    each = {"resolution": [48, 48, 64], "seconds": 12, "memory": 2**28, "memory_free": 2**33, "disk": 3e7}
    each |= {"lost": 0.0772}
    shot_check.keep_costs(state, smoke(shot).session_uid, {**each, "qualities": dict.fromkeys(QUALITIES, each)})
    cells = ("12 s", "0.2 G", "30 M", "8%")

    def shown() -> list[int]:
        texts = drawn(shot, panel.SMOKELIFT_PT_view)
        return [texts.count(cell) for cell in cells]

    state.check_smoke, state.check_done = smoke(shot).session_uid, True
    assert shown() == [4, 4, 4, 4]
    smoke(shot).smokelift.albedo = 0.5
    assert not state.check_done
    state.check_smoke = smoke(shot).session_uid
    assert shown() == [4, 4, 4, 4]
    state.check_smoke, state.check_error = smoke(shot).session_uid, "The box is flat."
    assert shown() == [0, 0, 0, 0]
    state.check_error, state.costs_smoke = "", state.costs_smoke + 1
    assert shown() == [0, 0, 0, 0]


def test_a_given_resolution_says_what_it_takes(shot) -> None:
    """What is lost was not measured."""
    state = bpy.context.window_manager.smokelift
    each = {"resolution": [48, 48, 64], "seconds": 12, "memory": 2**28, "memory_free": 2**33, "disk": 3e7, "lost": None}
    shot_check.keep_costs(state, smoke(shot).session_uid, {**each, "qualities": dict.fromkeys(QUALITIES, each)})
    state.check_smoke, state.check_done = smoke(shot).session_uid, True
    texts = drawn(shot, panel.SMOKELIFT_PT_view)
    assert texts.count("12 s") == 4
    assert not [text for text in texts if "%" in text]


def test_a_box_that_is_moved_is_estimated_anew(shot) -> None:
    """Blender draws the tab then, and drawing asks for an estimate."""
    state = bpy.context.window_manager.smokelift
    state.check_smoke, state.check_place = smoke(shot).session_uid, shot_check.place(smoke(shot))
    assert shot_check.is_checked(state, smoke(shot))
    smoke(shot).smokelift.box.scale.x *= 1.1
    bpy.context.view_layer.update()
    assert not shot_check.is_checked(state, smoke(shot))
    smoke(shot).smokelift.camera_mode = "ESTIMATE"
    state.check_smoke, state.check_place = smoke(shot).session_uid, shot_check.place(smoke(shot))
    smoke(shot).smokelift.box.scale.x *= 1.1
    bpy.context.view_layer.update()
    assert shot_check.is_checked(state, smoke(shot))
