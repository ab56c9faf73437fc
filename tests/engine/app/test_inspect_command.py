"""``smokelift inspect``: what is assumed and chosen."""

from __future__ import annotations

import json
from dataclasses import replace

from command_line import QUICK, command, events

from smokelift.output.sequence import Sequence
from smokelift.scene import Inlet


def test_inspect_says_how_smoke_gets_in_and_out(plume, tmp_path, capsys) -> None:
    """Marked inlets and closed sides, and the scene that would be run."""
    scene = replace(plume.scene, closed=("z-",), inlets=(Inlet((0, 0, 0.2), 0.1),))
    scene.save(tmp_path / "scene.toml")
    assert command("inspect", tmp_path / "scene.toml", "--progress", "json", *QUICK) == 0
    *notes, done = events(capsys.readouterr().out)
    said = " ".join(event["text"] for event in notes)
    assert "Smoke enters at 1 marked inlet" in said
    assert "Closed sides of the box: z-;" in said
    assert done["scene"]["domain"]["closed"] == ["z-"]
    assert done["scene"]["inlet"] == [{"centre": [0.0, 0.0, 0.2], "radius": 0.1}]


def test_choices_are_said_and_kept(shot, finished, capsys) -> None:
    """The same from inspect, as sentences and as JSON, and with the sequence, each with its figures."""
    kept = Sequence.open(finished).choices
    assert [choice["what"] for choice in kept] == [
        "resolution", "domain", "scattering", "iterations", "velocity grid coarsening", "velocity levels",
        "axis depth",
    ]  # fmt: skip
    assert json.loads((finished / "sequence.json").read_text())["choices"] == list(kept)
    assert command("inspect", shot, "--progress", "json", *QUICK) == 0
    *notes, done = events(capsys.readouterr().out)
    assert done["choices"] == list(kept)
    said = [event["text"] for event in notes]
    assert all(choice["reason"] in said for choice in kept)
    (scattering,) = (choice for choice in kept if choice["what"] == "scattering")
    assert scattering["chosen"] == Sequence.open(finished).scene.scattering == "single"
    assert scattering["measured"]["error_unshadowed"] > scattering["tolerance"]
    assert command("inspect", shot, *QUICK) == 0
    assert scattering["reason"] in "".join(capsys.readouterr().out.splitlines())


def test_an_inlet_outside_the_box(plume, tmp_path, capsys) -> None:
    """One sentence."""
    path = tmp_path / "scene.toml"
    plume.scene.save(path)
    path.write_text(path.read_text() + "\n[[inlet]]\ncentre = [9, 0, 0]\nradius = 1\n")
    assert command("inspect", path, *QUICK) == 2
    assert "[[inlet]] is outside the domain" in capsys.readouterr().err
