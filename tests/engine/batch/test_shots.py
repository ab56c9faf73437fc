"""The list of a batch."""

import argparse
from pathlib import Path

import pytest

from smokelift.app.commands.clips import add_reconstruct_options
from smokelift.batch.shots import BatchShot, read_shots


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
