"""The same job without a window: what it says, what it leaves, and the exit status of every way to end."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy
import pytest

import addon
from addon.core.take import Take
from addon.result import command_line
from addon.scene import volume
from conftest import quietly
from smokelift.output.sequence import Sequence
from tests.example_shot import EXAMPLE, smoke

SCRIPT = Path(addon.__file__).with_name("batch.py")
# what ``blender -b FILE -P batch.py -- ...`` does, where there is no blender but its module
BLENDER = """
import runpy, sys, bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
runpy.run_path(sys.argv[2], run_name="__main__")
"""


@pytest.fixture
def saved(shot, tmp_path) -> Path:
    """The shot as a file, small and short."""
    settings = smoke(shot).smokelift
    settings.first, settings.last, settings.longest_side = 27, 30, 32
    shot.render.resolution_percentage, shot.cycles.samples, shot.cycles.use_denoising = 25, 1, False
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    return tmp_path / "shot.blend"


def command(blend: Path, *words: object) -> list[str]:
    return [sys.executable, "-c", BLENDER, str(blend), str(SCRIPT), "--", *map(str, words)]


def blender(blend: Path, *words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command(blend, *words), capture_output=True, text=True, check=False, timeout=300)


def test_a_shot_from_the_command_line(saved, tmp_path) -> None:
    """Progress on standard output, status 0, and the result in the file: the same as the panel's."""
    done = blender(saved, "--save", "--set-up", "--render", tmp_path / "still.png")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert [line for line in lines if line.startswith("frame ")][-1] == "frame 4 of 4"
    assert any("4 frames in" in line for line in lines)
    take = Take(saved.parent / "smokelift" / "clip" / "take_0001")
    assert take.read().complete
    quietly(lambda: bpy.ops.wm.open_mainfile(filepath=str(saved)))
    scene = bpy.context.scene
    assert volume.shown_take(smoke(scene)) == take
    assert smoke(scene).data.frame_duration == 4
    assert scene.render.engine == "CYCLES"
    assert (tmp_path / "still.png").is_file()
    smoke(scene).smokelift.output = str(tmp_path / "panel")
    bpy.ops.smokelift.run()
    ours, theirs = Sequence.open(take.directory), Sequence.open(tmp_path / "panel" / "take_0001")
    assert ours.scene == theirs.scene
    assert ours.settings == theirs.settings
    for number in ours.frames:
        assert ours.figures(number)["psnr"] == theirs.figures(number)["psnr"]


def test_options_override_the_file(saved, tmp_path) -> None:
    clip = tmp_path / "other.mp4"
    clip.write_bytes((EXAMPLE / "clip.mp4").read_bytes())
    words = ("--clip", clip, "--frames", "1:2", "--quality", "fine", "--distance", "6.9")
    words += ("--detail", "0.5", "--seed", "3")
    assert blender(saved, *words, "--output", tmp_path / "elsewhere").returncode == 0
    sequence = Sequence.open(tmp_path / "elsewhere" / "take_0001")
    assert sequence.scene.clip.path == clip
    assert sequence.scene.clip.frames == (1, 2)
    assert sequence.settings["quality"] == "fine"
    assert sequence.settings["distance"] == pytest.approx(6.9)
    assert (sequence.settings["detail"], sequence.settings["seed"]) == (0.5, 3)


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (("--clip", "none.mp4"), 2, "none.mp4"),
        (("--frames", "40:48"), 2, "frames 0 to 47"),
        (("--frames", "-1:3"), 2, "--frames"),
        (("--frames=-1:3",), 2, "frames 0 to 47"),
        (("--frames", "5"), 2, "--frames"),
        (("--quality", "best"), 2, "--quality"),
        (("--distance", "far"), 2, "--distance"),
        (("--distance=-0.1",), 2, "a number from 0.0"),
        (("--detail", "1.5"), 2, "a number from 0.0 to 1.0"),
        (("--detail", "nan"), 2, "a number from 0.0 to 1.0"),
        (("--seed=-1",), 2, "a whole number from 0"),
        (("--seed", "1.5"), 2, "a whole number from 0"),
        (("--unknown",), 2, "--unknown"),
        (("--help",), 0, ""),
    ],
)
def test_bad_input(shot, words, status, said, capsys) -> None:
    assert command_line.main(words) == status
    captured = capsys.readouterr()
    assert said in captured.err
    assert "Traceback" not in captured.err


def test_the_command_wants_its_verb(shot, capsys) -> None:
    assert command_line.command([]) == 2
    assert "reconstruct" in capsys.readouterr().err
    assert command_line.command(["reconstruct", "--frames", "40:60"]) == 2
    assert "frames 0 to 47" in capsys.readouterr().err


@pytest.fixture
def running(saved) -> Iterator[subprocess.Popen[str]]:
    """A run whose first frames are finished."""
    words = command(saved, "--frames", "0:47", "--quality", "fine")
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if line.startswith("frame ") and int(line.split()[1]) >= 3:  # two may finish between two polls
                break
        yield process
        process.kill()


def first_frame(take: Take) -> tuple[Path, int]:
    first = min(take.directory.glob("*.vdb"))
    return first, first.stat().st_mtime_ns


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals to send")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_cancelled_and_gone_on_with(running, saved, number) -> None:
    running.send_signal(number)
    _, said = running.communicate(timeout=60)
    assert running.returncode == 130
    assert "finished frames stay" in said
    take = Take(saved.parent / "smokelift" / "clip" / "take_0001")
    there = take.read().frames
    assert 3 <= there < 48
    assert take.read().resumable
    written = first_frame(take)
    with subprocess.Popen(
        command(saved, "--resume"), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as again:
        assert again.stdout is not None
        first = next(line for line in again.stdout if line.startswith("frame "))
        again.send_signal(signal.SIGTERM)
        again.communicate(timeout=60)
    assert int(first.split()[1]) >= there
    assert first_frame(take) == written
