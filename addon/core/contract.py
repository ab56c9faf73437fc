"""What the add-on repeats of the engine and of tools/, which it may not import: names, counting pictures, retiming.

`tests/addon/core/test_contract.py` holds all of it to the engine. The panel's choices and defaults stand in the
settings, because Blender has to know them without a process; `tests/addon/inside/register.py` holds those.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

DONE, BAD_INPUT, CANCELLED = 0, 2, 130  # exit statuses (by definition); 3 is a missing device or too little memory
INDEX_FILE = "sequence.json"  # file in a sequence's directory with scene, settings and finished frames
MADE_UP = "made up"  # origin, in the sequence's provenance, of what no camera shows and clips do not determine

FRAME_FILE = "smoke_{:04d}.vdb"
"""File of a frame in a sequence's directory, by the number of its file: frame 1 has ``start_number``, which is 1 at
first."""

MAX_START_NUMBER = 1_000_000  # largest of these numbers

PROXY_FILE = "proxy_{:04d}.vdb"  # there too, and in a folder with an export: the coarse copy of a frame
PROXY_VOXELS = 4_000_000  # voxels of a box from which on a run writes coarse copies (measured: MIN_PROXY_VOXELS)
EXPORT_FILE = "export.json"  # file in a folder with an export that says what was exported
ASSET_FILE = "smoke.blend"  # file in a folder with an export: the add-on's own, which the engine leaves alone

MOVING_CAMERA = "The camera moves, so what is behind the smoke cannot be found"
"""Beginning of the sentence that refuses a clip whose frames cannot be registered."""

QUALITIES = ("draft", "balanced", "fine", "final")  # how much of the clip's detail is kept

BOX_VOXELS = 64
"""Voxels along the box's longest side that give it its proportions where the engine chooses how many it really has:
it takes multiples of a quarter of them, which all of its own limits are."""

MIN_VOXELS = 8  # voxels along any side, at least

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".dpx", ".exr", ".hdr")
"""Pictures that the engine reads. It takes any other file for a video."""

PANORAMA_SUFFIXES = (".exr", ".hdr")  # pictures that the engine takes as an environment light
SIDES = ("x-", "y-", "z-", "x+", "y+", "z+")  # sides of the box that can be closed, in the order of the panel

DIRECTIONS = {
    "continue": (
        *("--frames", "--start", "--fade", "--room", "--buoyancy", "--dissipation"),
        *("--closed", "--wind", "--turbulence", "--fan"),
    ),
    "retime": ("--speed",),
    "loop": ("--frames", "--overlap"),
}
"""What the engine makes of a take, with the options that decide the result; ``--mesh`` names a file besides."""

SLOWEST, FASTEST = 0.01, 100.0  # speeds of retiming over the take's, at least and at most
SHORTEST = 4  # frames that a take has at least, if something is made of it
ZIP_FILE = "smokelift-{version}-{blenders}-{platform}.zip"  # name of the extension's zip; the platform has _ for -
BLENDERS = {"3.11": "blender4.2-5.0", "3.13": "blender5.1"}  # in a zip's name, by its version of Python

PLATFORMS = {("linux", "x86_64"): "linux-x64", ("win32", "amd64"): "windows-x64", ("darwin", "arm64"): "macos-arm64"}
"""Blender's platforms that there are zips for, by Python's names of system and processor."""

LISTED = 3  # names of missing pictures that are listed


@dataclass(frozen=True)
class ImageSequence:
    """A sequence of numbered pictures as the engine counts them; Blender ends it at its first gap."""

    count: int  # from the first to the last, with those that are missing in between
    missing: tuple[str, ...]  # names of these

    def missing_names(self) -> str:
        """The first names of those that are missing, and how many there are more."""
        listed = ", ".join(self.missing[:LISTED])
        more = len(self.missing) - LISTED
        return f"{listed} and {more} more" if more > 0 else listed


def image_sequence_from(first: Path) -> ImageSequence | None:
    """The sequence that begins with a numbered picture; None where there is none, or most of it is missing."""
    try:
        return _image_sequence_at(first, first.parent.stat().st_mtime_ns)
    except OSError:
        return None


@lru_cache(16)  # sequences: the panel asks with every redraw
def _image_sequence_at(first: Path, _time_of_folder: int) -> ImageSequence | None:
    named = re.fullmatch(r"(.*?)(\d+)(\.[^.]+)", first.name)
    if named is None or named[1].endswith("-"):
        return None
    prefix, number, suffix = named.groups()
    digits = len(number)
    name = re.compile(re.escape(prefix) + rf"(\d{{{digits},}})" + re.escape(suffix))
    found = {int(match[1]) for file in first.parent.iterdir() if (match := name.fullmatch(file.name))}
    found = {n for n in found if n >= int(number)}
    missing = sorted(set(range(int(number), max(found, default=0))) - found)
    if int(number) not in found or len(missing) > len(found):
        return None
    return ImageSequence(len(found) + len(missing), tuple(f"{prefix}{n:0{digits}d}{suffix}" for n in missing))


class Retiming(NamedTuple):
    """How a take is passed through: its place, from 0, and its speed are expressions for drivers."""

    place: str
    speed: str
    duration: float  # until the last frame has been shown for its time, in frames


def retiming(count: int, speeds: Sequence[float], time: str) -> Retiming:
    """The pace of a take of so many frames, with one speed or more, by an expression for the time in frames.

    Speeds lie evenly from the first frame to the last and change linearly in between, as in the engine's ``retime``.
    Where the speed goes from s0 by k for each frame, the place after a time t is s0 (exp(k t) - 1) / k.
    """
    length, begin, ramps = (count - 1) / max(1, len(speeds) - 1), 0.0, []
    for number, (before, after) in enumerate(pairwise(speeds if len(speeds) > 1 else (*speeds, *speeds))):
        first, since = f"{number * length:.9g}", f"({time}-{begin:.9g})"
        if length == 0.0 or math.isclose(before, after, rel_tol=1e-6):
            place, speed = f"{first}+{before:.9g}*{since}", f"{before:.9g}"
            begin += length / before
        else:
            change = (after - before) / length
            growth = f"exp({change:.9g}*{since})"
            place, speed = f"{first}+{before / change:.9g}*({growth}-1)", f"{before:.9g}*{growth}"
            begin += math.log(after / before) / change
        ramps.append((place, speed, begin))
    *earlier, (place, speed, _) = ramps
    for place_before, speed_before, end in reversed(earlier):
        place = f"({place_before} if {time}<{end:.9g} else {place})"
        speed = f"({speed_before} if {time}<{end:.9g} else {speed})"
    return Retiming(place, speed, begin + 1 / speeds[-1])
