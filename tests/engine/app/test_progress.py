"""Progress: lines of JSON for programs, plain words for people, errors apart from results."""

import json
from types import SimpleNamespace
from typing import Any

import pytest

from smokelift.app import progress
from smokelift.app.progress import JsonReporter, Reporter
from smokelift.checks import Finding


def figures(seconds: float, smoky: float = 0.1, psnr: float = 41.23) -> dict[str, Any]:
    return {
        **({"psnr": psnr} if smoky > 0 else {}),
        "hull_share": smoky,
        "seconds_density": seconds / 2,
        "seconds_velocity": seconds / 2,
        "velocity": {"iterations": 3},
    }


def lines(capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


def test_json_events_are_a_line_each(capsys) -> None:
    with JsonReporter() as say:
        say.note('two\nlines and "quotes"')
        say.note(Finding("bars", doubt=True))
        say.start(4, 1)
        say.frame(2, figures(2.0))
        say.finish("done.", {"directory": "out"})
        say.fail("no.", 2)
    note, doubt, start, frame, done, error = lines(capsys)
    assert note == {"event": "note", "text": 'two\nlines and "quotes"', "doubt": False}
    assert (doubt["kind"], doubt["doubt"]) == ("bars", True)
    assert start == {"event": "start", "total": 4, "done": 1}
    assert (frame["event"], frame["frame"], frame["done"], frame["total"]) == ("frame", 2, 2, 4)
    assert frame["figures"] == figures(2.0)
    assert done == {"event": "done", "text": "done.", "directory": "out"}
    assert error == {"event": "error", "text": "no.", "status": 2, "later": False}


def test_a_forecast_is_corrected_by_the_runs_own_frames(capsys, monkeypatch) -> None:
    """It is all that is known before the first frame, one of two after that, and nothing after ten."""
    with JsonReporter() as say:
        say.start(24, 4, 80.0)
        for number in range(5, 25):
            say.frame(number, figures(2.0))
    start, *frames = lines(capsys)
    left = [start["seconds_left"], *(frame["seconds_left"] for frame in frames)]
    assert left[:3] == pytest.approx([20 * 4.0, 19 * 3.0, 18 * 8 / 3], abs=0.1)
    assert left[10:] == pytest.approx([2.0 * n for n in range(10, -1, -1)], abs=0.1)
    # what passes between frames counts, such as files that are written, and what a first frame took before the start
    clock = iter([0.0, 0.0, 5.0, 11.0])
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    say = JsonReporter()
    say.start(4, 0)
    for number, seconds in ((1, 30.0), (2, 2.0)):
        say.frame(number, figures(seconds))
    assert [line["seconds_left"] for line in lines(capsys)[1:]] == [90.0, 36.0]


def test_text_names_what_matters(capsys) -> None:
    with Reporter() as say:
        say.note("Light [not] given: /a/[bold]path")
        say.start(3, 0)
        for number, psnr in enumerate((40.0, 30.0, 20.0), 1):
            say.frame(number, figures(1.0, psnr=psnr))
        say.finish("3 frames in out.", {})
    with Reporter() as say:
        say.start(1, 0)
        say.frame(1, figures(1.0, smoky=0.0))
    out = capsys.readouterr().out
    for words in ("Light [not] given: /a/[bold]path", "3/3", "no smoke", "fit 30.0 dB", "3 frames in out."):
        assert words in out
