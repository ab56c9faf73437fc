"""What the engine says, in the words of the panel."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from addon.wording import in_panel

sys.path.insert(0, str(Path(__file__).parents[2] / "tools"))
from messages import all_messages

TOPICS = (
    "Command line",
    "Clip and background",
    "Set-up of the shot",
    "Density and rendering",
    "Velocity and transport",
    "Sequence and files",
    "Directed smoke",
)
"""What a run or a check of a shot can say; the add-on writes scene files itself, and starts no other command."""


@pytest.mark.parametrize("topic", TOPICS)
def test_no_word_of_a_scene_file_or_of_an_option_is_left(topic) -> None:
    """In none of the engine's sentences, of which there are some."""
    said = [in_panel(text) for text in all_messages()[topic] if "pip install" not in text]
    assert said
    assert [text for text in said if re.search(r"\[[a-z]|--[a-z]|scene file|smokelift inspect|[cC]olour", text)] == []


@pytest.mark.parametrize(
    ("engine", "panel"),
    [
        (
            "Only 3 frames show what is behind the smoke. Give a clean plate, or a colour, in [background].",
            "Only 3 frames show what is behind the smoke. Give a clean plate as Background.",
        ),
        (
            "track it in Blender, and give its matrices in [camera] and what is behind the smoke in [background].",
            "track it in Blender, and give a Clean Plate.",
        ),
        (
            "The picture changes at once between frames 4 and 5, as at a cut, so that no background fits both sides; "
            "use one of them, --frames 0:4 or 5:9.",
            "The picture changes at once between frames 5 and 6, as at a cut, so that no background fits both sides; "
            "use one of them, Frames 1 to 5 or 6 to 10.",
        ),
        (
            "it leaves 20 % unexplained. Give [[lights]] in a scene file.",
            "it leaves 20 % unexplained. Choose Scene Lights.",
        ),
        ("Smoke colour: undetermined, grey is taken.", "Smoke color: undetermined, grey is taken."),
        (
            "12 frames in /a b/take_0001 (28 s), 26.4 dB inside the smoke at the clip's pixels (median).",
            "12 frames made in 28 s. They match the clip to 26.4 dB; more is closer.",
        ),
        ("18 frames in C:\\take_0002, 6 of them simulated (9 s).", "18 frames made in 9 s, 6 of them simulated."),
        ("1 frame in take_0003, which repeat (9 s).", "1 frame made in 9 s, which repeat."),
        ("24 frames in /tmp/take_0004 (9 s).", "24 frames made in 9 s."),
        ("A proxy of 12 frames in /tmp/take_0003.", "The proxy of 12 frames is made."),
        ("/tmp/take_0003: has the frames 1 to 12; choose", "The result has the frames 1 to 12; choose"),
        (
            "As Taichi is not installed: install it (pip install 'smokelift[gpu]'; in Blender the extension's zip "
            "smokelift_gpu), or use --device cpu.",
            "As Taichi is not installed: install the extension smokelift_gpu, or choose Device CPU.",
        ),
        ("The axis depth 30 m is outside the box", "Known Depth: 30 m is outside the box"),
        (
            "finished frames stay (2), and --resume goes on from them",
            "finished frames stay (2), and Resume goes on from them",
        ),
        ("the largest that fits is --resolution 64,64,96", "the largest that fits is Resolution 64,64,96"),
        ("/in colour/[clip]--frames.mp4: no such file", "/in colour/[clip]--frames.mp4: no such file"),
    ],
)
def test_a_sentence(engine, panel) -> None:
    """Ends in what there is to do in the panel."""
    assert in_panel(engine) == panel
