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
