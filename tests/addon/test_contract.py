"""What the add-on repeats of the engine is the engine's own."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import get_args

import pytest

from addon import contract
from smokelift.app.commands import continue_, loop, retime
from smokelift.direct import new_sequence
from smokelift.footage.images import READABLE
from smokelift.output.export import ASSET, NOTE
from smokelift.output.layout import INDEX, frame_path, proxy_path
from smokelift.output.proxy_files import MIN_PROXY_VOXELS
from smokelift.report.provenance import Origin
from smokelift.scene import SIDES, EnvironmentLight, SceneError
from smokelift.setup.settings import LIMITS, QUALITIES, Settings
from smokelift_command import BAD_INPUT, CANCELLED, DONE


def test_exit_statuses() -> None:
    """Done, bad input, cancelled."""
    assert (contract.DONE, contract.BAD_INPUT, contract.CANCELLED) == (DONE, BAD_INPUT, CANCELLED)


def test_files_of_a_sequence() -> None:
    """The index, a frame, and its coarse copy."""
    assert contract.INDEX_FILE == INDEX
    assert contract.FRAME_FILE.format(12) == frame_path(Path(), 12, "vdb").name
    assert contract.PROXY_FILE.format(12) == proxy_path(Path(), 12).name
    assert contract.PROXY_VOXELS == MIN_PROXY_VOXELS


def test_files_of_an_export() -> None:
    """Its note, and the file that the engine leaves to the add-on."""
    assert (contract.EXPORT_FILE, contract.ASSET_FILE) == (NOTE, ASSET)


def test_origins() -> None:
    """The one that the add-on looks for."""
    assert contract.MADE_UP in get_args(Origin)


def test_resolutions() -> None:
    """Limits of the qualities can be reached in the box's proportions; the least that is accepted."""
    limits = [each for limit in LIMITS.values() for each in (limit.least, limit.most)]
    assert all(limit % (contract.BOX_VOXELS // 4) == 0 for limit in limits)
    fewest = contract.MIN_VOXELS
    Settings.preset("draft", "default", (fewest,) * 3)
    with pytest.raises(ValueError, match="resolution"):
        Settings.preset("draft", "default", (fewest, fewest, fewest - 1))


def test_qualities() -> None:
    """In their order."""
    assert contract.QUALITIES == QUALITIES


def test_sides() -> None:
    """Of the box, in another order."""
    assert sorted(contract.SIDES) == sorted(SIDES)


def test_directions() -> None:
    """Every option of a take that is made of another is the engine's, and the limits are."""
    parser = argparse.ArgumentParser()
    commands = parser.add_subparsers()
    for module in (continue_, retime, loop):
        module.add_parser(commands, argparse.ArgumentParser(add_help=False))
    values = {"--frames": {"continue": "9", "loop": "1:9"}, "--wind": "1 2 -3", "--fan": "1 2 3 1 -4 5 6"}
    values |= {"--turbulence": "1 2 3", "--closed": "x- z+"}
    for direction, options in contract.DIRECTIONS.items():
        for option in options:
            value = values.get(option, "2")
            words = (value if isinstance(value, str) else value[direction]).split()
            needed = ["--frames", "9"] if direction == "continue" else ["--speed", "2"] if direction == "retime" else []
            parser.parse_args([direction, "take", "--out", "new", *needed, option, *words])
    assert (contract.SLOWEST, contract.FASTEST) == retime.SPEEDS
    assert contract.SHORTEST == new_sequence.SHORTEST


def test_pictures() -> None:
    """Those that are read, and those that light a scene."""
    assert contract.IMAGE_SUFFIXES == READABLE
    for suffix in contract.IMAGE_SUFFIXES:
        if suffix in contract.PANORAMA_SUFFIXES:
            EnvironmentLight(Path(f"sky{suffix}"))
        else:
            with pytest.raises(SceneError, match="image"):
                EnvironmentLight(Path(f"sky{suffix}"))
