"""The list of a batch, what it still takes, and its page."""

import argparse
from pathlib import Path

import pytest
from PIL import Image

from smokelift.app.commands.clips import add_reconstruct_options
from smokelift.batch.shots import BatchShot, Record, duration, read_shots, remaining_work, write_report
from smokelift.output.index import Index


def read(folder: Path, text: str) -> tuple[BatchShot, ...]:
    path = folder / "shots.toml"
    path.write_text(text)
    parser = argparse.ArgumentParser(exit_on_error=False)
    add_reconstruct_options(parser)
    return read_shots(path, parser)


def test_a_shot_has_the_defaults_and_its_own_options(tmp_path) -> None:
    first, second = read(
        tmp_path,
        """
out = "there"
[defaults]
quality = "draft"
npz = true
[[shots]]
input = "a/steam.mp4"
[[shots]]
input = "pipe_####.png"
name = "pipe 2"
quality = "fine"
frames = [10, 99]
mask = "masks/pipe.png"
distance = 1.5
npz = false
""",
    )
    assert (first.name, first.input, first.options) == (
        "steam",
        tmp_path / "a" / "steam.mp4",
        ("--quality=draft", "--npz"),
    )
    assert first.directory == tmp_path / "there" / "steam"
    mask = tmp_path / "masks" / "pipe.png"
    assert second.options == ("--quality=fine", "--frames=10:99", f"--mask={mask}", "--distance=1.5")
    assert second.name == "pipe 2"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "shots.toml: lists no shots; write a table [[shots]] with an input for each"),
        ("[[shots]]\n", "shots.toml, line 1: [[shots]] lacks input"),
        (
            '[[shots]]\ninput = "a"\nqualty = "draft"',
            'shots.toml, line 3: [[shots]] there is no key "qualty" here; known are name, ',
        ),
        ('[[shots]]\ninput = "a"\nquality = ["draft"]', "shots.toml, line 3: [[shots]] quality cannot be"),
        ('[[shots]]\ninput = "a"\nnpz = 1', "npz cannot be 1"),
        (
            '[[shots]]\ninput = "a/x.mp4"\n[[shots]]\ninput = "b/X.mov"',
            'shots.toml, line 3: [[shots]] several shots are called "X"',
        ),
        ('[[shots]]\ninput = "a"\nname = "../b"', "cannot be the name of a file"),
        ('\n[[shots]]\ninput = "a"\nquality = "best"', "line 2: [[shots]] argument --quality: invalid choice: 'best'"),
        ('[[shots]]\ninput = "a"\nfrom = 1', 'there is no key "from" here'),
        ("shots = 3", "lists no shots"),
        ("out", "is not valid TOML"),
    ],
)
def test_a_mistake_is_said_with_its_line(tmp_path, text, sentence) -> None:
    with pytest.raises(ValueError) as caught:
        read(tmp_path, text)
    assert sentence in str(caught.value)


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
