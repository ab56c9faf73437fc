"""``smokelift batch`` on real clips."""

import json

import pytest

from smokelift.app.cli import main
from smokelift.output.sequence import Sequence


@pytest.fixture
def shots(shot, tmp_path):
    """A list of a short shot and of one whose clip is missing."""
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
[[shots]]
input = "missing.mp4"
"""
    )
    return path


def test_a_batch_runs_what_it_can_and_goes_on_later(shots, capsys) -> None:
    folder = shots.parent / "results"
    assert main(["batch", str(shots), "--progress", "json"]) == 2
    events = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert events[-1]["text"].startswith("1 of 2 shots did not come to the end (missing)")
    assert Sequence.open(folder / "plume").complete
    assert "missing.mp4: no such file" in (folder / "report.html").read_text()
    made = (folder / "plume" / "sequence.json").stat().st_mtime_ns
    shots.write_text(shots.read_text().split('[[shots]]\ninput = "missing')[0])
    assert main(["batch", str(shots)]) == 0
    assert (folder / "plume" / "sequence.json").stat().st_mtime_ns == made
    assert json.loads((folder / "plume.json").read_text())["runs"] == 1


def test_a_wrong_option_of_a_shot_is_refused(shots, capsys) -> None:
    shots.write_text(shots.read_text().replace('"draft"', '"best"'))
    assert main(["batch", str(shots)]) == 2
    sentence = capsys.readouterr().err
    assert sentence.startswith("shots.toml, line 5: [[shots]] argument --quality: invalid choice: 'best'")
    assert not (shots.parent / "results").exists()
