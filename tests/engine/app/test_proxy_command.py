"""``smokelift proxy``: what it writes, says and refuses."""

from __future__ import annotations

import shutil

import pytest
from command_line import command, events, names, refused

from smokelift.output.vdb import VdbUnavailable, vdb_module


def test_every_frame_gets_a_coarse_copy(finished, tmp_path, capsys) -> None:
    there = shutil.copytree(finished, tmp_path / "there")
    try:
        vdb_module()
    except VdbUnavailable:
        assert "no OpenVDB module" in refused(capsys, "proxy", there)
        pytest.skip("there is no OpenVDB module")
    assert command("proxy", there, "--progress", "json") == 0
    start, *frames, done = events(capsys.readouterr().out)
    assert start["total"] == len(frames) == done["frames"]
    new = set(names(there)) - set(names(finished))
    assert new == {f"proxy_{frame['frame']:04d}.vdb" for frame in frames}
    assert "no sequence" in refused(capsys, "proxy", tmp_path)
