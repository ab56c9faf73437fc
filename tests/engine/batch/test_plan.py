"""What a batch still takes, and its page."""

import pytest
from PIL import Image

from smokelift.batch import Frames, Record, duration, remaining_work, write_report
from smokelift.batch.record import Forecast


def test_the_pace_is_measured_scaled_or_foretold(make_shot) -> None:
    looked = Record(of={}, forecast=Forecast(10, 100.0, 7))
    half = Frames(4, seconds=[20.0] * 4)
    new, begun = make_shot("new"), make_shot("begun")
    (alone,) = remaining_work([(new, looked, Frames())])
    assert (alone.frames, alone.seconds, alone.basis, alone.memory) == (10, 100.0, "foretold", 7)
    first, second = remaining_work([(begun, looked, half), (new, looked, Frames())])
    assert (first.shot, first.seconds, first.basis) == (new, pytest.approx(200.0), "scaled")
    assert (second.shot, second.frames, second.seconds, second.basis) == (begun, 6, 120.0, "measured")


def test_finished_and_unknown_shots_are_left_out(make_shot) -> None:
    looked = Record(of={}, status="done", forecast=Forecast(2, 1.0, 1))
    known = [(make_shot("a"), looked, Frames(2, True, [9.0, 9.0])), (make_shot("b"), Record(of={}), Frames())]
    assert remaining_work(known) == ()
    assert duration((), 3) == 0.0


def test_the_longest_go_first_to_whoever_is_free(make_shot) -> None:
    shots = [
        (make_shot(f"{seconds}"), Record(of={}, forecast=Forecast(1, seconds, 1)), Frames())
        for seconds in (1.0, 5.0, 2.0, 3.0, 4.0)
    ]
    left = remaining_work(shots)
    assert [each.seconds for each in left] == [5.0, 4.0, 3.0, 2.0, 1.0]
    assert [duration(left, workers) for workers in (1, 2, 3, 9)] == [15.0, 8.0, 5.0, 5.0]


def test_a_row_a_shot_with_its_picture(make_shot) -> None:
    done, broken = make_shot("done"), make_shot("<b>")
    done.folder.mkdir()
    Image.new("RGB", (4, 4)).save(done.picture)
    page = write_report(
        done.folder,
        "A & B",
        [
            (
                done,
                Record(of={}, status="done", notes=("Assumed.",), seconds=61.4),
                Frames(3, True, [1.0], [30.0, 32.0]),
            ),
            (broken, Record(of={}, status="refused", sentence="No <video>.", forecast=Forecast(9, 1, 1)), Frames(2)),
        ],
    )
    text = page.read_text()
    assert text.count("<tr>") == 3
    assert text.count("<img ") == 1
    assert "<h1>A &amp; B</h1>\n<p>2 shots: 1 done, 1 refused.</p>" in text
    assert "31.0" in text and ">61<" in text and "Assumed." in text
    assert "&lt;b&gt;" in text and "No &lt;video&gt;." in text and "2 of 9" in text
