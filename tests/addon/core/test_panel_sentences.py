"""What the engine says, in the words of the panel."""

import re
import sys
from pathlib import Path
from string import Formatter

import pytest

from addon.core.sentences import REMEDIES, SENTENCES, advice, match, repeats, sentence, spent, stopped
from smokelift.report.sentences import SENTENCES as OWN

sys.path.insert(0, str(Path(__file__).parents[3] / "tools"))
from messages import all_messages

TOPICS = (
    "Clip and background",
    "Set-up of the shot",
    "Shot and result",
    "Density and rendering",
    "Velocity and transport",
    "Sequence and files",
    "Directed smoke",
)
"""What a run or a check of a shot can say; the add-on writes scene files and options itself, which are not wrong."""

FOREIGN = ("smokelift inspect", "pip install", "--npz")
"""Words of sentences that the panel has its own for, and of libraries that the extension brings with it."""


def figures(words: str) -> set[str]:
    """Names of what a sentence fills in."""
    return {name for _, name, _, _ in Formatter().parse(words) if name}


@pytest.mark.parametrize("kind", SENTENCES)
def test_the_engine_gives_the_figures_of_the_panels_sentences(kind) -> None:
    assert figures(SENTENCES[kind]) <= figures(OWN[kind])


def test_no_word_of_a_scene_file_or_of_an_option_is_in_the_others() -> None:
    messages = all_messages()
    said = [text for topic in TOPICS for text in messages[topic] if not any(words in text for words in FOREIGN)]
    assert [text for text in said if re.search(r"\[[a-z]|--[a-z]|scene file|[cC]olour", text)] == []


def test_only_sentences_of_the_panels_own_name_a_command() -> None:
    assert {kind for kind, words in OWN.items() if "smokelift inspect" in words} <= set(SENTENCES)


def finding(kind: str, **figures: float) -> dict[str, object]:
    return {"text": "As it is.", "kind": kind, "figures": figures}


@pytest.mark.parametrize(
    ("message", "said"),
    [
        ({"text": "As it is."}, "As it is."),
        (finding("black background"), "As it is."),
        (finding("reconstructed", frames=12, seconds=28.2, psnr=26.44), "fair (26.4 dB). 12 frames in 28 s."),
        (finding("looped", frames=1, seconds=9, first=1, last=2), "A loop of 1 frame, made in 9 s."),
        (finding("cut", before=4, after=5, first=0, last=9), "Choose Frames 1 to 5 or 6 to 10."),
    ],
)
def test_a_sentence(message, said) -> None:
    assert said in sentence(message)


def test_frames_of_a_result_are_counted_on_from_the_clips() -> None:
    assert "frame 109 on" in sentence(finding("dissolving smoke", frame=70, room=8.0), before=39)
    assert "In frames 40 to 42 the end" in sentence(finding("overlap of a loop", first=1, last=3), before=39)


@pytest.mark.parametrize("kind", REMEDIES)
def test_advice_names_what_is_left(kind) -> None:
    *settings, last = (setting for setting, _ in REMEDIES[kind])
    assert last == "" and "" not in settings
    for number in range(len(settings)):
        left = [words for setting, words in REMEDIES[kind] if setting in settings[number:]]
        said = advice(kind, settings[:number])
        assert said.lower().count(left[0].lower()) == 1 and all(words in said for words in left[1:])
    assert advice(kind, settings).lower() == f"{REMEDIES[kind][-1][1]}.".lower()
    assert advice("cut") == ""


def test_a_doubt_is_repeated_by_its_own_kind_and_by_that_of_the_result() -> None:
    assert repeats("not all may be smoke", ["not all is smoke"]) and repeats("cut", ["cut"])
    assert not repeats("not all is smoke", ["not all may be smoke"]) and not repeats("", [""])


def test_a_match_before_a_background_that_may_hold_smoke_is_not_praised() -> None:
    message = finding("reconstructed", frames=12, seconds=28.2, psnr=35.6)
    said = sentence(message, doubts=["cut", "smoke in the background"])
    assert "35.6 dB" in said and "good" not in said
    assert "very good" in sentence(message, doubts=["cut"])


def test_times_matches_and_frames_in_words() -> None:
    assert "0" not in stopped(0)
    times = {0.2: "1 s", 59.4: "59 s", 59.6: "1 min 0 s", 387: "6 min 27 s", 7380: "2 h 3 min"}
    assert {seconds: spent(seconds) for seconds in times} == times
    matches = {41.0: "very good", 34.0: "very good", 33.9: "good", 9.0: "poor"}
    assert {psnr: match(psnr) for psnr in matches} == matches
