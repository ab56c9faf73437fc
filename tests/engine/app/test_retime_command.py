"""``smokelift retime`` and ``smokelift loop``: what they write, say and refuse."""

from __future__ import annotations

from command_line import command, events, names, refused


def test_retime_writes_slow_motion(finished, tmp_path, capsys) -> None:
    out = tmp_path / "slow"
    frames = len([name for name in names(finished) if name.endswith(".npz")])
    assert command("retime", finished, "--out", out, "--speed", 0.5, "--npz", "--progress", "json") == 0
    said = events(capsys.readouterr().out)
    assert said[-1]["frames"] == 2 * frames - 1
    assert "no longer those of the clip" in refused(capsys, "evaluate", out)
    assert said[0] == {"event": "start", "total": 2 * frames - 1, "done": 0}


def test_loop_writes_a_loop(finished, tmp_path, capsys) -> None:
    out = tmp_path / "loop"
    assert command("loop", finished, "--out", out, "--overlap", 1, "--npz", "--progress", "json") == 0
    said = events(capsys.readouterr().out)
    assert said[-1]["frames"] == len([name for name in names(out) if name.endswith(".npz")])


def test_mistakes_end_in_one_sentence(finished, tmp_path, capsys) -> None:
    out = ("--out", tmp_path / "out")
    assert "--speed 0" in refused(capsys, "retime", finished, *out, "--speed", 0)
    assert "--speed 1e+06" in refused(capsys, "retime", finished, *out, "--speed", 1, 1e6)
    assert command("retime", finished, *out, "--speed", "slow") == 2
    assert "slow: expected a number from" in capsys.readouterr().err
    assert "holds no sequence" in refused(capsys, "retime", tmp_path, *out, "--speed", 1)
    assert "not 1 to 99" in refused(capsys, "loop", finished, *out, "--frames", "1:99")
    assert "overlap" in refused(capsys, "loop", finished, *out, "--overlap", 40)
    assert not (tmp_path / "out").exists()
