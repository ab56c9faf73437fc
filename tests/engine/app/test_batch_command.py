"""``smokelift batch`` on real clips, what it still takes, and its page."""

import json

import pytest
from PIL import Image

from smokelift.app.cli import main
from smokelift.app.commands.batch import duration, remaining_work, write_report
from smokelift.batch.shots import BatchShot, Record
from smokelift.output.index import Index
from smokelift.output.sequence import Sequence


@pytest.fixture
def shots(shot, tmp_path):
    """A list of a short shot."""
    path = tmp_path / "shots.toml"
    path.write_text(
        f"""
[defaults]
quality = "draft"
npz = true
[[shots]]
input = "{shot.as_posix()}"
name = "plume"
frames = [0, 1]
detail = 0
"""
    )
    return path


def test_a_batch_runs_what_it_can_and_goes_on_later(shots, capsys) -> None:
    folder, listed = shots.parent / "results", shots.read_text()
    assert main(["batch", str(shots)]) == 0
    assert Sequence.open(folder / "plume").complete
    made = (folder / "plume" / "sequence.json").stat().st_mtime_ns
    shots.write_text(f'{listed}[[shots]]\ninput = "missing.mp4"\n')
    capsys.readouterr()
    assert main(["batch", str(shots), "--progress", "json"]) == 2
    events = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert events[-1]["text"].startswith("1 of 2 shots did not come to the end (missing)")
    assert "missing.mp4: no such file" in (folder / "report.html").read_text()
    shots.write_text(listed)
    assert main(["batch", str(shots)]) == 0
    assert (folder / "plume" / "sequence.json").stat().st_mtime_ns == made
    assert json.loads((folder / "plume.json").read_text())["runs"] == 1


def test_a_wrong_option_of_a_shot_is_refused(shots, capsys) -> None:
    shots.write_text(shots.read_text().replace('"draft"', '"best"'))
    assert main(["batch", str(shots)]) == 2
    sentence = capsys.readouterr().err
    assert sentence.startswith("shots.toml, line 5: [[shots]] argument --quality: invalid choice: 'best'")
    assert not (shots.parent / "results").exists()


@pytest.fixture
def filmed(tmp_path):
    """Make a shot with so many finished frames in its folder."""

    def make(name: str, count: int = 0, seconds: float = 1.0, complete: bool = False, psnr: float = 30.0):
        shot = BatchShot(name, tmp_path / f"{name}.mp4", (), tmp_path)
        shot.directory.mkdir(parents=True)
        frames = {str(n + 1): {"psnr": psnr + n, "seconds_density": seconds} for n in range(count)}
        Index({}, {}, frames=frames, complete=complete).write(shot.directory)
        return shot

    return make


def foretold(frames: int, seconds: float, memory: int = 1, **known) -> Record:
    return Record(of={}, forecast={"frames": frames, "seconds": seconds, "memory": memory}, **known)


def test_the_pace_is_measured_scaled_or_foretold(filmed) -> None:
    looked = foretold(10, 100.0, 7)
    new, begun = filmed("new"), filmed("begun", 4, 20.0)
    (alone,) = remaining_work({new: looked})
    assert (alone.frames, alone.seconds, alone.basis, alone.memory) == (10, 100.0, "foretold", 7)
    first, second = remaining_work({begun: looked, new: looked})
    assert (first.shot, first.seconds, first.basis) == (new, pytest.approx(200.0), "scaled")
    assert (second.shot, second.frames, second.seconds, second.basis) == (begun, 6, 120.0, "measured")


def test_finished_and_unknown_shots_are_left_out(filmed) -> None:
    done = foretold(2, 1.0, status="done")
    assert remaining_work({filmed("a", 2, complete=True): done, filmed("b"): Record(of={})}) == ()
    assert duration((), 3) == 0.0


def test_the_longest_go_first_to_whoever_is_free(filmed) -> None:
    left = remaining_work({filmed(f"{seconds}"): foretold(1, seconds) for seconds in (1.0, 5.0, 2.0, 3.0, 4.0)})
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
