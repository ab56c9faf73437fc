"""The commands of the manual's tour, run as they stand there on a tiny plume."""

import re
import shlex
from pathlib import Path

import pytest
from command_line import command

from tests.engine.output.small_sequence import has_vdb

PAGE = Path(__file__).resolve().parents[3] / "docs" / "tour.md"
LINES = re.findall(r"^ {4}smokelift (.*)$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
COMMANDS = {line.split()[0]: line for line in reversed(LINES)}.values()
"""The first of each; the options of the others are parsed in `test_manual`."""

WRITE_FILES = ("reconstruct", "continue", "retime", "loop")


@pytest.mark.parametrize("line", COMMANDS)
def test_a_command_of_the_tour_does_what_it_says(line, shot, finished, plume, tmp_path, monkeypatch) -> None:
    words = shlex.split(line)
    words = [str(plume.scene.clip.path) if word == "clip.mp4" else word for word in words]
    if words[0] in WRITE_FILES and not has_vdb():
        words.append("--npz")
    if words[0] == "reconstruct":
        words += ["--frames", "0:1"]
    monkeypatch.chdir(tmp_path)
    made = [words[n + 1] for n, word in enumerate(words) if word in ("--out", "--page", "--write", "--picture")]
    if words[0] != "inspect":
        (tmp_path / "scene.toml").symlink_to(shot)
    if "smoke" not in made:
        (tmp_path / "smoke").symlink_to(finished)
    if words[0] == "preview":
        words += ["--out", "."]
        made += ["contact_sheet.png", "preview.mp4"]
    assert command(*words) == 0
    assert all((tmp_path / name).exists() for name in made)
