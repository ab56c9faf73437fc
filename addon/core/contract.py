"""What the add-on repeats of the engine and of tools/, which it may not import.

`tests/addon/core/test_contract.py` holds every value to the engine's own. The panel's choices and defaults stand in
the settings, because Blender has to know them without a process; `tests/addon/inside/register.py` holds those.
"""

DONE, BAD_INPUT, CANCELLED = 0, 2, 130  # exit statuses of the command line; 3 is a missing device or too little memory
INDEX_FILE = "sequence.json"  # file in a sequence's directory with scene, settings and finished frames
MADE_UP = "made up"  # origin, in the sequence's provenance, of what no camera shows and clips do not determine

FRAME_FILE = "smoke_{:04d}.vdb"
"""File of a frame in a sequence's directory, by the number of its file: frame 1 has ``start_number``, which is 1 at
first."""

PROXY_FILE = "proxy_{:04d}.vdb"  # there too, and in a folder with an export: the coarse copy of a frame
PROXY_VOXELS = 4_000_000  # voxels of a box from which on a run writes coarse copies
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

SLOWEST, FASTEST = 0.01, 100.0  # speeds that retiming has
SHORTEST = 4  # frames that a take has at least, if something is made of it
ZIP_FILE = "smokelift-{version}-{blenders}-{platform}.zip"  # name of the extension's zip; the platform has _ for -
BLENDERS = {"3.11": "blender4.2-5.0", "3.13": "blender5.1"}  # in a zip's name, by its version of Python

PLATFORMS = {("linux", "x86_64"): "linux-x64", ("win32", "amd64"): "windows-x64", ("darwin", "arm64"): "macos-arm64"}
"""Blender's platforms that there are zips for, by Python's names of system and processor."""
