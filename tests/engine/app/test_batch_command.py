"""``smokelift batch`` on real clips."""

import functools
import json
import sys

import pytest

from smokelift.app.cli import main
from smokelift.app.commands import batch
from smokelift.batch import work
from smokelift.output.sequence import Sequence

REFUSAL = json.dumps({"event": "error", "text": "missing.mp4: no such file", "status": 2, "later": False})
REFUSING = (sys.executable, "-S", "-c", f"print({REFUSAL!r}); raise SystemExit(2)")
"""Stands in for an engine whose clip is missing."""


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
"""
    )
    return path


def test_a_batch_runs_what_it_can_and_goes_on_later(shots, capsys, monkeypatch) -> None:
    folder, listed = shots.parent / "results", shots.read_text()
    assert main(["batch", str(shots)]) == 0
    assert Sequence.open(folder / "plume").complete
    made = (folder / "plume" / "sequence.json").stat().st_mtime_ns
    for name in ("inspect_shot", "finish_shot"):
        monkeypatch.setattr(batch, name, functools.partial(getattr(work, name), engine=REFUSING))
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
