"""What the engine and the add-on have in common, from names to scene files and the retiming that is tried out."""

import math
import tomllib
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from addon.core import contract
from addon.core.contract import ImageSequence, image_sequence_from, retiming
from addon.core.take import toml_text
from extension_products import NAMED, PLATFORMS, Product
from smokelift.app.cli import command_parser
from smokelift.app.commands import directed
from smokelift.checks import Source
from smokelift.direct import state
from smokelift.direct.retiming import playback
from smokelift.extraction.camera_motion import MOVING_CAMERA
from smokelift.footage.frame_source import ClipError, numbered_files
from smokelift.footage.image_files import READABLE
from smokelift.output.export import ASSET, NOTE
from smokelift.output.index import INDEX, MAX_START_NUMBER, frame_path, proxy_path
from smokelift.output.vdb import MIN_PROXY_VOXELS
from smokelift.scene import SIDES, EnvironmentLight, SceneError
from smokelift.setup.settings import LIMITS, QUALITIES, Settings
from smokelift_command.exits import BAD_INPUT, CANCELLED, DONE


def test_names_are_the_engines() -> None:
    """Exit statuses, files of a sequence and of an export, and the words of settings and provenance."""
    assert (contract.DONE, contract.BAD_INPUT, contract.CANCELLED) == (DONE, BAD_INPUT, CANCELLED)
    assert contract.INDEX_FILE == INDEX
    assert contract.FRAME_FILE.format(12) == frame_path(Path(), 12, "vdb").name
    assert contract.MAX_START_NUMBER == MAX_START_NUMBER
    assert contract.PROXY_FILE.format(12) == proxy_path(Path(), 12).name
    assert contract.PROXY_VOXELS == MIN_PROXY_VOXELS
    assert (contract.EXPORT_FILE, contract.ASSET_FILE) == (NOTE, ASSET)
    assert contract.MADE_UP in get_args(Source)
    assert contract.QUALITIES == QUALITIES
    assert sorted(contract.SIDES) == sorted(SIDES)
    assert MOVING_CAMERA.startswith(contract.MOVING_CAMERA)


def test_zips_are_called_as_they_are_built() -> None:
    assert contract.BLENDERS == NAMED
    assert sorted(contract.PLATFORMS.values()) == sorted(platform.name for platform in PLATFORMS)
    for (system, processor), name in contract.PLATFORMS.items():
        (platform,) = (each for each in PLATFORMS if each.name == name)
        assert (platform.markers["sys_platform"], platform.markers["platform_machine"].lower()) == (system, processor)
        for python in NAMED:
            names = {"blenders": contract.BLENDERS[python], "platform": name.replace("-", "_")}
            built = Product("smokelift", "1.2.3", platform, python)
            assert contract.ZIP_FILE.format(version="1.2.3", **names) == built.file


def test_resolutions() -> None:
    """Limits of the qualities can be reached in the box's proportions; the least that is accepted."""
    limits = [each for limit in LIMITS.values() for each in (limit.least, limit.most)]
    assert all(limit % (contract.BOX_VOXELS // 4) == 0 for limit in limits)
    fewest = contract.MIN_VOXELS
    Settings.preset("draft", "default", (fewest,) * 3)
    with pytest.raises(ValueError, match="resolution"):
        Settings.preset("draft", "default", (fewest, fewest, fewest - 1))


def test_directions() -> None:
    parser = command_parser()
    values = {"--frames": {"continue": "9", "loop": "1:9"}, "--wind": "1 2 -3", "--fan": "1 2 3 1 -4 5 6"}
    values |= {"--turbulence": "1 2 3", "--closed": "x- z+"}
    for direction, options in contract.DIRECTIONS.items():
        for option in options:
            value = values.get(option, "2")
            words = (value if isinstance(value, str) else value[direction]).split()
            needed = ["--frames", "9"] if direction == "continue" else ["--speed", "2"] if direction == "retime" else []
            parser.parse_args([direction, "take", "--out", "new", *needed, option, *words])
    assert (contract.SLOWEST, contract.FASTEST) == directed.SPEEDS
    assert contract.SHORTEST == state.MIN_FRAMES


def test_pictures() -> None:
    assert contract.IMAGE_SUFFIXES == READABLE
    for suffix in contract.IMAGE_SUFFIXES:
        if suffix in contract.PANORAMA_SUFFIXES:
            EnvironmentLight(Path(f"sky{suffix}"))
        else:
            with pytest.raises(SceneError, match="image"):
                EnvironmentLight(Path(f"sky{suffix}"))


@pytest.mark.parametrize(
    "names",
    [
        [f"frame_{n:04d}.png" for n in range(17, 30) if n not in (23, 26)],
        ["a9.png", "a10.png", "a12.png"],
        ["a09.png", "a10.png", "a7.png", "a00012.png"],
        ["shot2_7.exr", "shot2_8.exr", "shot1_9.exr", "shot2_9.png"],
        ["scan_1.png", "scan_2.png", "scan_90.png"],
        ["one.png"],
        ["a-1.png", "a0.png", "a1.png"],
    ],
)
def test_a_sequence_has_the_pictures_that_the_engine_finds(tmp_path, names) -> None:
    """From any of its pictures on, with those that are missing."""
    for name in names:
        (tmp_path / name).touch()
    for name in names:
        found = image_sequence_from(tmp_path / name)
        try:
            files = numbered_files(tmp_path / name)
        except ClipError:
            assert found is None
            continue
        if found is not None:  # of the others nothing is said
            assert found == ImageSequence(len(files), tuple(file.name for file in files if not file.is_file()))


def test_a_sequence_is_seen_with_what_it_lacks(tmp_path) -> None:
    for n in (17, 18, 20, 21):
        (tmp_path / f"frame_{n:04d}.png").touch()
    assert image_sequence_from(tmp_path / "frame_0017.png") == ImageSequence(5, ("frame_0019.png",))


TEXTS = st.text(st.characters(exclude_categories=["Cs"]))
NUMBERS = st.integers(-(2**31), 2**31) | st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=False)
VALUES = st.recursive(TEXTS | NUMBERS, lambda inner: st.lists(inner, max_size=4), max_leaves=8)
NAMES = st.text("abcdefghijklmnopqrstuvwxyz_", min_size=1, max_size=8)
TABLES = st.dictionaries(NAMES, VALUES, max_size=4)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.dictionaries(NAMES, TABLES | st.lists(TABLES, min_size=1, max_size=3), max_size=4))
def test_what_is_written_is_read_back(tables) -> None:
    assert tomllib.loads(toml_text(tables)) == tables


LONGEST_EXPRESSION = 256
"""Characters that Blender keeps of a driver's expression."""


@pytest.mark.parametrize("speeds", [(1.0,), (0.25,), (3.0,), (1.0, 0.2, 1.0), (0.5, 0.5, 2.0), (2.0, 1.0)])
def test_places_and_speeds_are_the_engines(speeds) -> None:
    count = 41
    retimed = retiming(count, speeds, "t")
    places, wanted = playback(count, speeds)
    for time, (place, speed) in enumerate(zip(places, wanted, strict=True)):
        found = [eval(text, {"t": time, "exp": math.exp}) for text in (retimed.place, retimed.speed)]
        np.testing.assert_allclose(found, (place, speed), rtol=2e-3, atol=2e-3)
    assert len(places) - 1 <= retimed.duration <= len(places) + 1 / speeds[-1]


def test_an_expression_is_short_enough_for_blender() -> None:
    retimed = retiming(1234, (0.123456789, 1.23456789, 0.987654321), "(frame-1234+0.001)/1.23456789")
    assert len(f"floor(min({retimed.place},1233))-(frame-1234)+1234") < LONGEST_EXPRESSION
