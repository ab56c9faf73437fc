"""``smokelift export``: what it writes, says and refuses."""

from __future__ import annotations

import pytest
from command_line import command, events, names, refused

from smokelift.output.vdb import VdbUnavailable, vdb_module


def test_the_size_is_said_before(finished, tmp_path, capsys) -> None:
    try:
        vdb_module()
    except VdbUnavailable:
        assert "no OpenVDB module" in refused(capsys, "export", finished, "--out", tmp_path / "out")
        pytest.skip("there is no OpenVDB module")
    out = tmp_path / "out"
    words = ("export", finished, "--out", out, "--precision", "quantised", "--proxy", 2, "--progress", "json")
    assert command(*words, "--size") == 0
    (sent,) = events(capsys.readouterr().out)
    assert sent["event"] == "done" and sent["size"] > 0
    assert not out.exists()
    assert command(*words) == 0
    note, start, *frames, done = events(capsys.readouterr().out)
    assert "MB" in note["text"] and start["total"] == len(frames) == done["frames"]
    assert done["size"] == pytest.approx(sent["size"], rel=0.2)
    assert len(names(out)) == 2 * done["frames"] + 2
    assert "sequence.json" in refused(capsys, "export", finished, "--out", finished)
    assert "no sequence" in refused(capsys, "export", out, "--out", tmp_path / "again")
    assert "proxy" in refused(capsys, "export", finished, "--out", out, "--proxy", 0)
