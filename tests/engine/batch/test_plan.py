"""What a batch still takes, and its page."""

import pytest
from PIL import Image

from smokelift.batch.plan import duration, remaining_work, write_report
from smokelift.batch.work import Record
from smokelift.output.index import Index


@pytest.fixture
def filmed(make_shot):
    """A shot with so many finished frames in its folder."""

    def make(name: str, count: int, seconds: float = 1.0, complete: bool = False, psnr: float = 30.0):
        shot = make_shot(name)
        shot.directory.mkdir(parents=True)
        frames = {str(n + 1): {"psnr": psnr + n, "seconds_density": seconds} for n in range(count)}
        Index({}, {}, frames=frames, complete=complete).write(shot.directory)
        return shot

    return make


def foretold(frames: int, seconds: float, memory: int = 1, **known) -> Record:
    return Record(of={}, forecast={"frames": frames, "seconds": seconds, "memory": memory}, **known)


def test_the_pace_is_measured_scaled_or_foretold(make_shot, filmed) -> None:
    looked = foretold(10, 100.0, 7)
    new, begun = make_shot("new"), filmed("begun", 4, 20.0)
    (alone,) = remaining_work({new: looked})
    assert (alone.frames, alone.seconds, alone.basis, alone.memory) == (10, 100.0, "foretold", 7)
    first, second = remaining_work({begun: looked, new: looked})
    assert (first.shot, first.seconds, first.basis) == (new, pytest.approx(200.0), "scaled")
    assert (second.shot, second.frames, second.seconds, second.basis) == (begun, 6, 120.0, "measured")


def test_finished_and_unknown_shots_are_left_out(make_shot, filmed) -> None:
    done = foretold(2, 1.0, status="done")
    assert remaining_work({filmed("a", 2, complete=True): done, make_shot("b"): Record(of={})}) == ()
    assert duration((), 3) == 0.0


def test_the_longest_go_first_to_whoever_is_free(make_shot) -> None:
    left = remaining_work({make_shot(f"{seconds}"): foretold(1, seconds) for seconds in (1.0, 5.0, 2.0, 3.0, 4.0)})
    assert [each.seconds for each in left] == [5.0, 4.0, 3.0, 2.0, 1.0]
    assert [duration(left, workers) for workers in (1, 2, 3, 9)] == [15.0, 8.0, 5.0, 5.0]


def test_a_row_a_shot_with_its_picture(filmed, tmp_path) -> None:
    done, broken = filmed("done", 3, complete=True), filmed("<b>", 2)
    Image.new("RGB", (4, 4)).save(done.file("png"))
    page = tmp_path / "report.html"
    write_report(
        page,
        "A & B",
        {
            done: Record(of={}, status="done", notes=["Assumed."], seconds=61.4),
            broken: foretold(9, 1, status="refused", sentence="No <video>."),
        },
    )
    text = page.read_text()
    assert text.count("<tr>") == 3
    assert text.count("<img ") == 1
    assert "<h1>A &amp; B</h1>\n<p>2 shots: 1 done, 1 refused.</p>" in text
    assert "31.0" in text and ">61<" in text and "Assumed." in text
    assert "&lt;b&gt;" in text and "No &lt;video&gt;." in text and "2 of 9" in text
