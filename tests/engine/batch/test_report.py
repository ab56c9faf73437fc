"""The page of a batch."""

from __future__ import annotations

from PIL import Image

from smokelift.batch import Frames, Record, write_report
from smokelift.batch.record import Forecast


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
