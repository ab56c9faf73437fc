"""The extension in a real Blender, 4.3.2 from Debian trixie, without a window and with one.

It runs in a Debian root in a folder of its own, which is kept between runs. Always without a network.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from engine_wheels import ROOT
from smokelift.evaluation.metrics import psnr
from smokelift.footage.clip import Clip
from smokelift.footage.images import area_average, linear_to_srgb
from tests.blender.setting import LIFECYCLE, WORK, pytest_words, run, shipped, unavailable, user_folder, variables

SCRIPTS = ROOT / "tests" / "blender" / "root"
PLACE = Path(os.environ.get("SMOKELIFT_BLENDER_ROOT", Path.home() / ".cache" / "smokelift-tests" / "trixie"))
"""The Debian root; 1.2 GB."""

PYTHON = "3.13"
"""Of Debian, and so of its Blender; the official 4.3 has 3.11."""

FIRST, LAST = 19, 30
LONGEST_SIDE = 48
WANTED_DB = 25.0
LONGEST_GAP = 2.0
"""Seconds. How long gaps are is up to the machine; a Blender that waited for the engine would stand still longer."""


@pytest.fixture(scope="module")
def root() -> Path:
    """The Debian root, built unless it is there, made by the same script."""
    script = SCRIPTS / "make.sh"
    stamp = PLACE / "made-by"
    recipe = hashlib.sha256(script.read_bytes()).hexdigest()
    if not sys.platform.startswith("linux") or os.geteuid() != 0:
        unavailable("it takes root on Linux to build a Debian root and to enter it: run make test-blender as root")
    if stamp.is_file() and stamp.read_text() == recipe:
        return PLACE
    if shutil.which("mmdebstrap") is None:
        if shutil.which("apt-get") is None:
            unavailable("mmdebstrap was not found: install it, and run make test-blender again")
        quiet = {"check": True, "stdout": subprocess.DEVNULL}
        subprocess.run(["apt-get", "update", "-q"], **quiet)
        subprocess.run(["apt-get", "install", "-yq", "--no-install-recommends", "mmdebstrap"], **quiet)
    done = subprocess.run([script, PLACE], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        unavailable(f"the Debian root could not be built: {done.stdout.strip()[-2000:]}")
    stamp.write_text(recipe)
    return PLACE


def inside(root: Path, folder: Path, *command: str | Path | int) -> str:
    """Run a command in the Debian root, with the repository at its own path; returns what it said."""
    words = [f"{name}={value}" for name, value in variables(folder, PYTHON).items()]
    return run([str(SCRIPTS / "enter.sh"), str(root), str(ROOT), "env", *words, *map(str, command)])


@pytest.fixture(scope="module")
def installed(root) -> Path:
    """The folder of a user who has installed the zip on the command line."""
    folder = user_folder("debian")
    install = ("--command", "extension", "install-file", "--repo", "user_default", "--enable", shipped(PYTHON))
    inside(root, folder, "blender", "-b", *install)
    return folder


def test_from_install_to_uninstall(root) -> None:
    folder = user_folder("debian-story")
    run_pytest = LIFECYCLE.with_name("run_pytest.py")
    inside(root, folder, "blender", "-b", "--python", run_pytest, "--", *pytest_words(LIFECYCLE, folder))


def test_command_makes_smoke_that_renders_like_the_clip(root, installed) -> None:
    """``blender -b shot.blend --command smokelift reconstruct``, and a Cycles render from the clip's camera."""
    blend = installed / "plume" / "shot.blend"
    make_shot = ("--python", SCRIPTS / "make_shot.py", "--", blend, FIRST, LAST, LONGEST_SIDE)
    # what installing says of its success cannot be trusted: this fails if the add-on is not enabled
    inside(root, installed, "blender", "-b", "--python-exit-code", "1", *make_shot)
    picture = blend.with_name("render.png")
    command = ("--command", "smokelift", "reconstruct", "--set-up", "--save", "--render", picture)
    said = inside(root, installed, "blender", "-b", blend, *command)
    frames = LAST - FIRST + 1
    assert f"frame {frames} of {frames}" in said
    found = np.asarray(Image.open(picture).convert("RGB"), np.float32) / 255
    with Clip.open(ROOT / "tests" / "plume" / "clip.mp4") as clip:
        height, width = found.shape[:2]
        wanted, plate = (linear_to_srgb(area_average(clip.frame(number), width, height)) for number in (LAST - 1, 0))
    smoke = np.abs(wanted - plate).max(-1) > 0.05
    assert smoke.mean() > 0.05
    whole, within = psnr(found, wanted), psnr(found, wanted, smoke)
    print(f"PSNR {whole:.1f} dB, where there is smoke {within:.1f} dB")
    assert whole > WANTED_DB + 5 and within > WANTED_DB


def test_script_makes_smoke_too(root, installed) -> None:
    """``blender -b shot.blend -P addon/batch.py`` uses the add-on that is enabled, and has its exit status."""
    blend = installed / "plume" / "shot.blend"
    script = ("-P", ROOT / "addon" / "batch.py", "--", "--output", installed / "by script")
    said = inside(root, installed, "blender", "-b", blend, *script, "--frames", f"{LAST - 2}:{LAST - 1}")
    assert "frame 2 of 2" in said
    assert "Traceback" not in said and "registered before" not in said, said
    with pytest.raises(AssertionError, match="status 2 "):
        inside(root, installed, "blender", "-b", blend, *script, "--frames", "5:500")


def test_window(root, installed) -> None:
    """The tab is drawn, a click on a button runs the job beside a Blender that goes on, and smoke appears."""
    pictures = WORK / "pictures"
    # where an artist would have it; the folder is gone with the command
    blend = Path("/home/artist/plume/shot.blend")
    report = story(root, installed, "drive_panel.py", pictures, (blend, FIRST, LAST, LONGEST_SIDE))
    frames = LAST - FIRST + 1
    for name in ("view_3d", "clip_editor"):
        seen = report[name]
        assert seen["outcome"] == "done"
        assert seen["progress"][-1] == frames
        assert len(seen["progress"]) > 3, "the count did not move while the job ran"
        assert set(seen["playhead"]) == {LAST}, "the playhead was moved"
        stages = ("closed", "idle", "running", "done")
        closed, idle, running, done = (load(pictures / f"{name}_{stage}.png") for stage in stages)
        for picture in (closed, idle, running, done):
            assert picture.std() > 10, "the screen is blank"
        assert change(closed, idle, seen["sidebar"]) > 2, "the tab looks like the one before it"
        assert change(idle, running, seen["sidebar"]) > 2, "no progress is to be seen"
        assert change(running, done, seen["sidebar"]) > 1, "the end is not to be seen"
        if name == "view_3d":
            assert seen["seconds_to_first_drawing"] < seen["seconds"], "no smoke was drawn before the end"
            x, y, width, height = report["viewport"]
            middle = [x + width // 3, y + height // 4, width // 4, height // 2]  # the camera's picture
            assert change(idle, done, middle) > 1, "no smoke is to be seen"
    assert max(report["clip_editor"]["longest_gaps"]) < LONGEST_GAP
    assert report["volumes"] == 1, "the second run did not replace the first"
    assert report["moved_with_the_clip"] == 5
    assert report["looks_through"] == "CAMERA", "the view is not that of the camera that was set up"
    assert report["variation"] == 1, "the second run is no other variation"
    assert change(load(pictures / "view_3d_done.png"), load(pictures / "rendered.png"), middle) > 10
    assert abs(report["distance"] - 7.4) < 0.1, "a click on the floor does not say how far that is"


def test_trouble_at_the_window(root, installed) -> None:
    """Undo, deleting, renaming, saving elsewhere, Esc, queues, failures, switching off and quitting during a run."""
    pictures = WORK / "trouble"
    blend = installed / "ein Räuchlein 煙" / "shot.blend"
    first = LAST - 23  # so many that none of the runs ends before the artist is done with it
    report = story(root, installed, "drive_trouble.py", pictures, (blend, first, LAST, 32))
    frames = LAST - first + 1
    for name in ("undo", "rename", "restored", "save_elsewhere", "resumed", "enabled"):
        seen = report[name]
        assert (seen["outcomes"], seen["volumes"], seen["frames"]) == (["done"], 1, frames), name
        assert seen["file"], f"{name}: the smoke's files are not found"
    assert (report["deleted"]["outcomes"], report["deleted"]["volumes"]) == (["cancelled"], 0)
    assert report["stopped"]["outcomes"] == ["cancelled"]
    assert 2 <= report["stopped"]["done"] < frames
    assert report["stopped"]["frames"] == frames, "the earlier take is not on show again"
    assert report["queue"]["outcomes"] == ["done", "done"], "the run that was cancelled before it began is still there"
    assert report["queue"]["volumes"] == 1
    assert report["failed"]["outcomes"] == ["failed"]
    assert "is not a video" in report["failed"]["sentence"]
    assert not report["log_opened_by_itself"], "the log covers Blender"
    assert "is not a video" in report["log"], "the log was not opened"
    assert report["disabled"] == {"known": False, "stopped": True}
    last = Path(report["last_take"])
    index = json.loads((last / "sequence.json").read_text())
    assert not index["complete"]
    assert 2 <= len(index["frames"]) == len(list(last.glob("smoke_*.vdb")))


def test_a_video_is_dragged_into_the_view(root, installed) -> None:
    """By a mouse, out of Blender's own File Browser; Blender asks what it shall become, and the tab is opened."""
    blend = Path("/home/artist/plume/shot.blend")
    report = story(root, installed, "drive_drop.py", WORK / "drop", (blend, FIRST, LAST, 32))
    assert (report["type"], report["is_smoke"], report["clip"]) == ("VOLUME", True, "another.mp4")
    assert report["active"]


def story(root: Path, user: Path, script: str, pictures: Path, shot: tuple[Path, int, int, int]) -> Any:
    """Play an artist's story at a window, on a shot as make_shot.py makes it; returns its report."""
    shutil.rmtree(pictures, ignore_errors=True)
    pictures.mkdir()
    said = inside(root, user, SCRIPTS / "window.sh", script, pictures, *shot)
    report = json.loads((pictures / "report.json").read_text())
    assert "failure" not in report, report["failure"] + said
    assert "Traceback" not in said, said
    print(json.dumps(report, indent=1))
    return report


def load(path: Path) -> Any:
    return np.asarray(Image.open(path).convert("L"), np.float32)


def change(before: Any, after: Any, region: list[int]) -> float:
    """Mean difference of two pictures in a region (gray levels of 255)."""
    x, y, width, height = region
    rows, columns = slice(y, y + height), slice(x, x + width)
    return float(np.abs(after[rows, columns] - before[rows, columns]).mean())
