"""The list of a batch."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from smokelift.batch.shots import read_shots


def take_all(_arguments: Sequence[str]) -> None:
    """Every option is right."""


def written(folder: Path, text: str) -> Path:
    path = folder / "shots.toml"
    path.write_text(text)
    return path


def test_a_shot_has_the_defaults_and_its_own_options(tmp_path) -> None:
    path = written(
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
    first, second = read_shots(path, take_all)
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
        ("[[shots]]\n", "shots.toml, line 1: input is missing"),
        (
            '[[shots]]\ninput = "a"\nqualty = "draft"',
            'shots.toml, line 3: there is no key "qualty" here; known are name, ',
        ),
        ('[[shots]]\ninput = "a"\nquality = ["draft"]', "shots.toml, line 3: quality cannot be"),
        ('[[shots]]\ninput = "a"\nnpz = 1', "shots.toml, line 3: npz must be true or false, not 1"),
        (
            '[[shots]]\ninput = "a/x.mp4"\n[[shots]]\ninput = "b/X.mov"',
            'shots.toml, line 3: several shots are called "X"',
        ),
        ('[[shots]]\ninput = "a"\nname = "../b"', "cannot be the name of a file"),
        ("shots = 3", "lists no shots"),
        ("out", "is not valid TOML"),
    ],
)
def test_a_mistake_is_said_with_its_line(tmp_path, text, sentence) -> None:
    with pytest.raises(ValueError) as caught:
        read_shots(written(tmp_path, text), take_all)
    assert sentence in str(caught.value)


def test_a_wrong_option_is_said_with_its_line(tmp_path) -> None:
    def refuse(_arguments: Sequence[str]) -> None:
        raise ValueError("argument --quality: invalid choice: 'best'")

    with pytest.raises(ValueError, match=r"shots\.toml, line 2: argument --quality: invalid choice: 'best'"):
        read_shots(written(tmp_path, '\n[[shots]]\ninput = "a"\nquality = "best"'), refuse)
