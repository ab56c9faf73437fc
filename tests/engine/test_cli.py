"""The command line: what it writes, what it says, and the exit status of every way to end."""

from __future__ import annotations

import gc
import json
import os
import re
import signal
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import smokelift
from smokelift.app import memory
from smokelift.app.cli import main
from smokelift.footage.clip import Clip
from smokelift.footage.images import read_image
from smokelift.output.images import eight_bit
from smokelift.output.sequence import Sequence
from smokelift.output.vdb import VdbUnavailable, vdb_module
from smokelift.output.video import write_video
from smokelift.render import device, render
from smokelift.scene import Camera, Inlet, Scene, completed, orbit

MODULE = [sys.executable, "-m", "smokelift"]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(smokelift.__file__).parents[1])}
QUICK = ("--quality", "draft")


@pytest.fixture(scope="module")
def shot(plume, tmp_path_factory) -> Path:
    """A complete scene file of the tiny plume."""
    path = tmp_path_factory.mktemp("shot") / "scene.toml"
    plume.scene.save(path)
    return path


@pytest.fixture(scope="module")
def finished(shot, tmp_path_factory) -> Path:
    """A finished sequence, made by the command line."""
    out = tmp_path_factory.mktemp("finished") / "smoke"
    assert main(["reconstruct", str(shot), "--out", str(out), "--npz", *QUICK]) == 0
    return out


def command(*words: object) -> int:
    """Run a command; also when its options are refused, which argparse does by leaving."""
    try:
        return main([str(word) for word in words])
    except SystemExit as leaving:
        assert isinstance(leaving.code, int)
        return leaving.code


def refused(capsys: pytest.CaptureFixture[str], *words: object, status: int = 2) -> str:
    """The one sentence that a command ends with."""
    capsys.readouterr()
    assert command(*words) == status
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err
    lines = captured.err.strip().splitlines()
    assert len(lines) == 1, lines
    return lines[0]


def events(text: str) -> list[dict[str, Any]]:
    """Every line as JSON, strictly."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    return [json.loads(line, parse_constant=refuse) for line in text.splitlines()]


def names(directory: Path) -> list[str]:
    return sorted(path.name for path in directory.iterdir())


# doctor


def test_doctor_in_a_process_of_its_own() -> None:
    """Versions, devices and what is missing, on standard output; nothing on the other."""
    done = subprocess.run([*MODULE, "doctor"], env=ENVIRONMENT, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0
    assert done.stdout.startswith(f"smokelift {smokelift.__version__}, Python 3.")
    for word in ("libraries: numpy ", "taichi ", "processor cores", "GiB free", "GPU: ", "OpenVDB"):
        assert word in done.stdout
    assert done.stderr == ""


def test_doctor_as_json(capsys) -> None:
    """Programs get the same lines as notes."""
    assert command("doctor", "--progress", "json") == 0
    told = events(capsys.readouterr().out)
    assert {event["event"] for event in told} == {"note"}
    assert any(event["text"].startswith("GPU:") for event in told)


# reconstruct


def test_reconstruct_writes_a_sequence(finished, plume) -> None:
    """All frames, complete, with the scene as it was given; a NumPy twin each."""
    sequence = Sequence.open(finished)
    assert sequence.complete
    assert sequence.frames == (1, 2, 3, 4, 5)
    assert sequence.scene == completed(plume.scene)
    assert {f"smoke_000{n}.npz" for n in range(1, 6)} <= set(names(finished))
    assert all(sequence.figures(n)["psnr"] >= 35 for n in sequence.frames)


def test_reconstruct_writes_vdb_files(shot, tmp_path, capsys) -> None:
    """OpenVDB is what is written by default, and the last line says where."""
    try:
        vdb_module()
    except VdbUnavailable as missing:
        pytest.skip(str(missing))
    assert command("reconstruct", shot, "--out", tmp_path / "out", "--frames", "0:1", *QUICK) == 0
    assert names(tmp_path / "out") == ["sequence.json", "smoke_0001.vdb", "smoke_0002.vdb"]
    out = "".join(capsys.readouterr().out.splitlines())
    assert "2 frames in" in out
    assert Sequence.open(tmp_path / "out").density(2).any()


def test_progress_as_json(plume, tmp_path, capsys) -> None:
    """Each line an object: notes, then start, then every frame, then done."""
    scene = replace(plume.scene, medium=None)
    scene.save(tmp_path / "scene.toml")
    out = tmp_path / "out"
    assert command("reconstruct", tmp_path / "scene.toml", "--out", out, "--npz", "--progress", "json", *QUICK) == 0
    captured = capsys.readouterr()
    told = events(captured.out)
    assert captured.err == ""
    notes = [event["text"] for event in told if event["event"] == "note"]
    assert [event["event"] for event in told] == [*["note"] * len(notes), "start", *["frame"] * 5, "done"]
    assert notes[0].startswith("Medium not given")
    start, *frames = told[len(notes) : -1]
    assert (start["total"], start["done"]) == (5, 0)
    assert [(event["frame"], event["done"], event["total"]) for event in frames] == [(n, n, 5) for n in range(1, 6)]
    assert all(event["figures"]["psnr"] > 30 for event in frames)
    assert told[-2]["seconds_left"] == 0
    assert (told[-1]["directory"], told[-1]["frames"]) == (str(out), 5)


def test_further_views_of_a_scene_file_are_used(two_views, tmp_path, capsys) -> None:
    """They are named before the run, keep step with a range of frames, and their fit is on record."""
    two_views.save(tmp_path / "scene.toml")
    told = "View 1: frame_####.png, 90 degrees from the input, frames 3 to 4."
    assert command("inspect", tmp_path / "scene.toml", "--frames", "2:3", *QUICK) == 0
    assert told in " ".join(capsys.readouterr().out.split())
    arguments = ("--npz", "--frames", "2:3", *QUICK)
    assert command("reconstruct", tmp_path / "scene.toml", "--out", tmp_path / "out", *arguments) == 0
    assert told in " ".join(capsys.readouterr().out.split())
    sequence = Sequence.open(tmp_path / "out")
    assert all(sequence.figures(number)["psnr_view_1"] > 30 for number in (1, 2))


def test_a_clip_alone_is_enough(plume, tmp_path, capsys) -> None:
    """A pattern of pictures instead of a scene file, with a range of frames and a resolution."""
    out = tmp_path / "out"
    clip = str(plume.scene.clip.path)
    arguments = ("--npz", "--frames", "1:3", "--resolution", "16,16,24", "--progress", "json", *QUICK)
    assert command("reconstruct", clip, "--out", out, *arguments) == 0
    assert [event["event"] for event in events(capsys.readouterr().out)].count("note") >= 5
    sequence = Sequence.open(out)
    assert sequence.frames == (1, 2, 3)
    assert sequence.scene.domain.resolution == (16, 16, 24)


def test_the_smoke_stands_where_the_command_says(shot, finished, tmp_path) -> None:
    """The depth of its axis reaches the settings and the smoke; before the middle of the box it is negative."""
    assert command("reconstruct", shot, "--out", tmp_path / "out", "--npz", "--axis-depth", "-0.2", *QUICK) == 0
    near, plain = Sequence.open(tmp_path / "out"), Sequence.open(finished)
    assert (near.settings["axis_depth"], plain.settings["axis_depth"]) == (-0.2, None)
    y = np.arange(24) * 1.2 / 24
    moved = [np.average(y, weights=sequence.density(1).sum(axis=(0, 2))) for sequence in (near, plain)]
    assert moved[0] - moved[1] == pytest.approx(-0.2, abs=0.04)


def test_a_depth_outside_the_box(shot, tmp_path, capsys) -> None:
    """One sentence, also before a run, and nothing is written."""
    for words in (("reconstruct", shot, "--out", tmp_path / "out"), ("inspect", shot)):
        sentence = refused(capsys, *words, "--axis-depth", "0.7", *QUICK)
        assert "outside the box, which reaches 0.6 m" in sentence
    assert not (tmp_path / "out").exists()


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
    ]  # fmt: skip
    assert json.loads((finished / "sequence.json").read_text())["choices"] == list(kept)
    assert command("inspect", shot, "--progress", "json", *QUICK) == 0
    *notes, done = events(capsys.readouterr().out)
    assert done["choices"] == list(kept)
    said = [event["text"] for event in notes]
    assert all(choice["reason"] in said for choice in kept)
    (scattering,) = (choice for choice in kept if choice["what"] == "scattering")
    assert scattering["chosen"] == Sequence.open(finished).settings["density"]["scattering"] == "single"
    assert scattering["measured"]["error_unshadowed"] > scattering["tolerance"]
    assert command("inspect", shot, *QUICK) == 0
    assert scattering["reason"] in "".join(capsys.readouterr().out.splitlines())


def test_scattering_and_resolution_by_option(shot, tmp_path, capsys) -> None:
    """What is said is used, and said to be by hand; auto measures the resolution of a given box."""
    out = tmp_path / "out"
    arguments = ("--npz", "--frames", "0:1", "--scattering", "unshadowed", "--resolution", "auto", *QUICK)
    assert command("reconstruct", shot, "--out", out, *arguments) == 0
    sequence = Sequence.open(out)
    assert sequence.settings["density"]["scattering"] == "unshadowed"
    by_hand = {choice["what"]: choice["by_hand"] for choice in sequence.choices}
    assert (by_hand["scattering"], by_hand["resolution"]) == (True, False)
    assert max(sequence.scene.domain.resolution) > 32
    assert command("reconstruct", shot, "--out", out, "--resume", *arguments) == 0
    assert "scattering" in refused(capsys, "reconstruct", shot, "--out", out, "--resume", *arguments[:3], *QUICK)


def test_an_inlet_outside_the_box(plume, tmp_path, capsys) -> None:
    """One sentence."""
    path = tmp_path / "scene.toml"
    plume.scene.save(path)
    path.write_text(path.read_text() + "\n[[inlet]]\ncentre = [9, 0, 0]\nradius = 1\n")
    assert command("inspect", path, *QUICK) == 2
    assert "[[inlet]] is outside the domain" in capsys.readouterr().err


def test_no_smoke_at_all_is_said(plume, tmp_path, capsys) -> None:
    """Empty frames, exit 0, and a note that names the threshold."""
    nothing = np.zeros_like(plume.densities[0])
    plume.write(tmp_path / "clip", [nothing] * 2).save(tmp_path / "scene.toml")
    out = tmp_path / "out"
    assert command("reconstruct", tmp_path / "scene.toml", "--out", out, "--npz", *QUICK) == 0
    assert "No smoke found" in capsys.readouterr().out
    assert not any(Sequence.open(out).density(n).any() for n in (1, 2))


def test_resuming_what_is_complete_changes_nothing(finished, shot) -> None:
    """Done already is done."""
    before = {path.name: path.read_bytes() for path in finished.glob("smoke_*")}
    assert command("reconstruct", shot, "--out", finished, "--npz", "--resume", *QUICK) == 0
    assert {path.name: path.read_bytes() for path in finished.glob("smoke_*")} == before


# bad input


def test_a_missing_file(tmp_path, capsys) -> None:
    """The path is named, for scenes, videos and pictures."""
    for name in ("shot.toml", "shot.mp4", "frame_####.png"):
        path = tmp_path / name
        assert name in refused(capsys, "reconstruct", path, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_file_that_is_no_video(tmp_path, capsys) -> None:
    """Text with a video's name."""
    (tmp_path / "shot.mp4").write_text("not a video " * 100)
    assert "shot.mp4" in refused(capsys, "reconstruct", tmp_path / "shot.mp4", "--out", tmp_path / "out")


def test_an_unknown_key(shot, tmp_path, capsys) -> None:
    """The key and its line."""
    text = shot.read_text().replace("[medium]\n", "[medium]\ncolour = 3\n")
    (tmp_path / "bad.toml").write_text(text)
    sentence = refused(capsys, "reconstruct", tmp_path / "bad.toml", "--out", tmp_path / "out")
    assert "bad.toml" in sentence
    assert "colour" in sentence
    assert str(text[: text.index("colour")].count("\n") + 1) in sentence


def test_a_scene_without_a_clip(plume, tmp_path, capsys) -> None:
    """There is nothing to reconstruct from."""
    replace(plume.scene, clip=None).save(tmp_path / "scene.toml")
    assert "[clip]" in refused(capsys, "reconstruct", tmp_path / "scene.toml", "--out", tmp_path / "out")


@pytest.mark.parametrize("span", ["2:9", "7:8"])
def test_frames_outside_the_clip(shot, tmp_path, capsys, span) -> None:
    """The range that was asked for, and the one there is."""
    sentence = refused(capsys, "reconstruct", shot, "--out", tmp_path / "out", "--frames", span)
    assert "0 to 4" in sentence
    assert not (tmp_path / "out").exists()


def test_frames_in_the_wrong_order(shot, tmp_path, capsys) -> None:
    """Last before first."""
    assert "frames" in refused(capsys, "reconstruct", shot, "--out", tmp_path / "out", "--frames", "3:1")


@pytest.mark.parametrize(
    "option",
    [
        ("--frames", "1-2"),
        ("--resolution", "64,64"),
        ("--quality", "best"),
        ("--resolution", "a,b,c"),
        ("--scattering", "many"),
        ("--axis-depth", "far"),
    ],
)
def test_options_that_make_no_sense(shot, tmp_path, capsys, option) -> None:
    """Status 2, and the last line names the option."""
    assert command("reconstruct", shot, "--out", tmp_path / "out", *option) == 2
    assert option[0] in capsys.readouterr().err.splitlines()[-1]


def test_a_resolution_too_low(shot, tmp_path, capsys) -> None:
    """The least number of voxels is said."""
    sentence = refused(capsys, "reconstruct", shot, "--out", tmp_path / "out", "--resolution", "4,4,4")
    assert "8 voxels" in sentence


def test_a_resolution_without_cubes(shot, tmp_path, capsys) -> None:
    """A calibrated box fixes the shape."""
    sentence = refused(capsys, "reconstruct", shot, "--out", tmp_path / "out", "--resolution", "16,16,16")
    assert "cubic voxels" in sentence


def test_a_directory_of_other_files(shot, tmp_path, capsys) -> None:
    """Nothing is overwritten, and the directory is named."""
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "holiday.jpg").write_text("precious")
    sentence = refused(capsys, "reconstruct", shot, "--out", tmp_path / "photos", "--npz", *QUICK)
    assert "photos" in sentence
    assert "holiday.jpg" in sentence
    assert names(tmp_path / "photos") == ["holiday.jpg"]


def test_a_file_as_directory(shot, tmp_path, capsys) -> None:
    """The path is named."""
    (tmp_path / "taken").write_text("precious")
    assert "taken" in refused(capsys, "reconstruct", shot, "--out", tmp_path / "taken", "--npz", *QUICK)
    assert (tmp_path / "taken").read_text() == "precious"


def test_again_without_resume(finished, shot, capsys) -> None:
    """The sentence says how to go on."""
    sentence = refused(capsys, "reconstruct", shot, "--out", finished, "--npz", *QUICK)
    assert "--resume" in sentence
    assert finished.name in sentence


def test_resume_with_other_settings(finished, shot, capsys) -> None:
    """The difference is named."""
    sentence = refused(capsys, "reconstruct", shot, "--out", finished, "--npz", "--resume", "--quality", "balanced")
    assert "quality" in sentence


def test_errors_as_json(tmp_path, capsys) -> None:
    """Programs get the sentence and the status as the last event."""
    assert command("reconstruct", tmp_path / "no.mp4", "--out", tmp_path / "out", "--progress", "json") == 2
    captured = capsys.readouterr()
    assert captured.err == ""
    last = events(captured.out)[-1]
    assert (last["event"], last["status"]) == ("error", 2)
    assert "no.mp4" in last["text"]


# device and memory


def test_a_gpu_that_is_not_there(shot, tmp_path) -> None:
    """Status 3, and what can be done."""
    if device.available_gpu() in ("cuda", "metal"):
        pytest.skip("there is a GPU here that cannot be hidden")
    done = subprocess.run(
        [*MODULE, "reconstruct", str(shot), "--out", str(tmp_path / "out"), "--device", "gpu"],
        env={**ENVIRONMENT, "VK_DRIVER_FILES": "/none", "VK_ICD_FILENAMES": "/none"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 3
    assert done.stderr.startswith("No GPU")
    assert "--device cpu" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_grid_too_large_for_the_memory(plume, tmp_path, capsys) -> None:
    """Status 3 before anything is written, and the resolution that is named would fit."""
    clip = str(plume.scene.clip.path)
    sentence = refused(
        capsys, "reconstruct", clip, "--out", tmp_path / "out", "--resolution", "4000,4000,4000", *QUICK, status=3
    )
    named = re.search(r"--resolution (\d+),(\d+),(\d+)", sentence)
    assert named
    x, y, z = (int(count) for count in named.groups())
    assert memory.needed((x, y, z)) < 1.1 * memory.psutil.virtual_memory().available + 2**30
    assert not (tmp_path / "out").exists()


def test_the_named_resolution_is_accepted(shot, tmp_path, capsys, monkeypatch) -> None:
    """Whoever follows the advice on a calibrated domain gets a sequence."""
    little = SimpleNamespace(available=memory.needed((23, 23, 31)))
    monkeypatch.setattr(memory.psutil, "virtual_memory", lambda: little)
    sentence = refused(capsys, "reconstruct", shot, "--out", tmp_path / "out", "--npz", *QUICK, status=3)
    named = re.search(r"--resolution (\S+?)\.?$", sentence)
    assert named
    arguments = ("--npz", "--frames", "0:1", "--resolution", named[1], *QUICK)
    assert command("reconstruct", shot, "--out", tmp_path / "out", *arguments) == 0


# cancelled


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT to send")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_cancelled_run_can_be_resumed(plume, tmp_path, number) -> None:
    """Status 130 in the middle; --resume gives the rest, bit for bit as without the break."""
    heights = np.linspace(0.3, 0.9, 12)
    filmed = plume.write(tmp_path / "clip", [plume.blob(plume.scene, height) for height in heights])
    filmed.save(tmp_path / "scene.toml")
    out = tmp_path / "out"
    # paths relative to the working directory are what people type
    words = ["reconstruct", "scene.toml", "--npz", "--progress", "json", *QUICK]
    with subprocess.Popen(
        [*MODULE, *words, "--out", "out"],
        cwd=tmp_path,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # a test run in the background may ignore SIGINT, which children inherit
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        told = []
        for line in process.stdout:
            told.append(json.loads(line))
            if told[-1]["event"] == "frame":
                process.send_signal(number)
                break
        told += events(process.stdout.read())
        errors = process.stderr.read()
        assert process.wait(60) == 130
    assert "KeyboardInterrupt" not in errors
    assert (told[-1]["event"], told[-1]["status"]) == ("error", 130)
    assert "--resume" in told[-1]["text"]
    begun = Sequence.open(out)
    assert 1 <= len(begun.frames) < 12
    assert not [name for name in names(out) if name.endswith(".tmp") or name == "run.lock"]
    done = subprocess.run(
        [*MODULE, *words, "--out", "out", "--resume"],
        cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    told = events(done.stdout)
    start = next(event for event in told if event["event"] == "start")
    assert (start["done"], start["total"]) == (len(begun.frames), 12)
    assert Sequence.open(out).frames == tuple(range(1, 13))
    assert command("reconstruct", tmp_path / "scene.toml", "--out", tmp_path / "whole", "--npz", *QUICK) == 0
    for path in sorted((tmp_path / "whole").glob("*.npz")):
        with np.load(path) as whole, np.load(out / path.name) as resumed:
            for name in whole.files:
                np.testing.assert_array_equal(resumed[name], whole[name], err_msg=f"{path.name} {name}")


def test_an_interrupt_while_writing_is_quiet(shot, tmp_path, capsys, monkeypatch) -> None:
    """Ctrl-C in the middle of a file: one sentence, no half file, and nothing cries out afterwards."""
    cries: list[Any] = []
    opened = []
    real = zipfile.ZipFile.open

    def interrupted(archive: zipfile.ZipFile, name: Any, mode: Any = "r", *rest: Any, **options: Any) -> Any:
        if mode == "w":
            opened.append(name)
            if len(opened) == 11:  # within the second frame's files
                raise KeyboardInterrupt
        return real(archive, name, mode, *rest, **options)

    with monkeypatch.context() as patch:
        patch.setattr(sys, "unraisablehook", cries.append)
        patch.setattr(zipfile.ZipFile, "open", interrupted)
        sentence = refused(capsys, "reconstruct", shot, "--out", tmp_path / "out", "--npz", *QUICK, status=130)
        gc.collect()
    assert sentence.startswith("Cancelled")
    assert "--resume" in sentence
    assert Sequence.open(tmp_path / "out").frames == (1,)
    assert not [name for name in names(tmp_path / "out") if name.endswith(".tmp")]
    assert command("reconstruct", shot, "--out", tmp_path / "out", "--npz", "--resume", *QUICK) == 0
    assert [cry.exc_value for cry in cries] == []


# render


def test_render_the_front_as_exr(finished, plume, tmp_path) -> None:
    """The scene's own view in linear light, of the first frame by default."""
    assert command("render", finished, "--out", tmp_path / "a.exr") == 0
    image = read_image(tmp_path / "a.exr")
    np.testing.assert_allclose(image, render(Sequence.open(finished).density(1), plume.scene), atol=1e-3)


@pytest.mark.parametrize(("word", "yaw", "pitch"), [("side", 90, 0), ("-30,10", -30, 10), ("15.5,-4", 15.5, -4)])
def test_render_another_view_as_png(finished, plume, tmp_path, word, yaw, pitch) -> None:
    """Words and angles are cameras that orbit the domain."""
    path = tmp_path / "a.png"
    assert command("render", finished, "--frame", 3, f"--camera={word}", "--out", path) == 0
    camera = orbit(plume.scene.camera, plume.scene.domain, yaw, pitch)
    wanted = eight_bit(render(Sequence.open(finished).density(3), plume.scene, camera))
    found = eight_bit(read_image(path))
    assert np.abs(found.astype(int) - wanted).max() <= 1
    assert found.max() > 50


def test_render_a_camera_file(finished, plume, tmp_path) -> None:
    """A scene file with a camera alone; its size is the picture's."""
    camera = Camera.look_at((3, -3, 1.5), (0, 0, 0.8), fov_y_degrees=30, size=(32, 24))
    Scene(camera=camera).save(tmp_path / "camera.toml")
    words = ("--camera", tmp_path / "camera.toml", "--out", tmp_path / "a.exr")
    assert command("render", finished, *words) == 0
    wanted = render(Sequence.open(finished).density(1), plume.scene, camera)
    np.testing.assert_allclose(read_image(tmp_path / "a.exr"), wanted, atol=1e-3)


def test_render_a_video(finished, tmp_path) -> None:
    """All frames at the clip's rate."""
    assert command("render", finished, "--camera", "side", "--out", tmp_path / "a.mp4") == 0
    with Clip.open(tmp_path / "a.mp4") as clip:
        assert (len(clip), clip.fps, clip.size) == (5, 24.0, (40, 56))
        assert clip.frame(2).max() > 0.1


def test_a_video_has_the_rate_of_its_clip(plume, tmp_path) -> None:
    """Also where only the video file itself says it."""
    frames = [render(density, plume.scene) for density in plume.densities[:3]]
    write_video(tmp_path / "clip.mp4", frames, 12.0)
    out = tmp_path / "out"
    arguments = ("--npz", "--resolution", "16,16,24", *QUICK)
    assert command("reconstruct", tmp_path / "clip.mp4", "--out", out, *arguments) == 0
    assert command("render", out, "--out", tmp_path / "a.mp4") == 0
    with Clip.open(tmp_path / "a.mp4") as clip:
        assert clip.fps == pytest.approx(12)


@pytest.mark.parametrize("name", ["a.mkv", "a.mov", "a.webm"])
def test_render_other_kinds_of_video(finished, tmp_path, name) -> None:
    """Every suffix that a refusal offers is written."""
    assert command("render", finished, "--out", tmp_path / name) == 0
    with Clip.open(tmp_path / name) as clip:
        assert len(clip) == 5


@pytest.mark.parametrize("word", ["above", "1,2,3", "left,right", "nan,0"])
def test_a_wrong_word_for_the_camera(finished, tmp_path, capsys, word) -> None:
    """What is understood is listed."""
    sentence = refused(capsys, "render", finished, "--camera", word, "--out", tmp_path / "a.png")
    assert f"--camera {word}" in sentence
    assert "front, side" in sentence
    assert not list(tmp_path.iterdir())


def test_a_camera_file_without_a_camera(finished, tmp_path, capsys) -> None:
    """The file is named; so is one that is not there."""
    Scene().save(tmp_path / "camera.toml")
    for name in ("camera.toml", "none.toml"):
        words = ("--camera", tmp_path / name, "--out", tmp_path / "a.png")
        assert name in refused(capsys, "render", finished, *words)


@pytest.mark.parametrize("number", [0, 6, -1])
@pytest.mark.parametrize("name", ["a.png", "a.mp4"])
def test_a_frame_that_is_not_there(finished, tmp_path, capsys, number, name) -> None:
    """The frames that are there are named, and nothing is written."""
    sentence = refused(capsys, "render", finished, f"--frame={number}", "--out", tmp_path / name)
    assert "1 to 5" in sentence
    assert not list(tmp_path.iterdir())


def test_a_kind_of_picture_that_is_not_written(finished, tmp_path, capsys) -> None:
    """The kinds that are written are named."""
    sentence = refused(capsys, "render", finished, "--out", tmp_path / "a.gif")
    assert "a.gif" in sentence
    assert ".png" in sentence
    assert ".mp4" in sentence


@pytest.mark.parametrize("verb", ["render", "preview"])
def test_a_directory_without_a_sequence(tmp_path, capsys, verb) -> None:
    """The directory is named, whether it exists or not."""
    for directory in (tmp_path, tmp_path / "none"):
        sentence = refused(capsys, verb, directory, "--out", tmp_path / "a.png")
        assert str(directory) in sentence


def test_a_folder_for_the_picture_that_is_not_there(finished, tmp_path, capsys) -> None:
    """The path that cannot be written is named."""
    for name in ("a.png", "a.exr", "a.mp4"):
        sentence = refused(capsys, "render", finished, "--out", tmp_path / "none" / name)
        assert name in sentence
        assert "none" in sentence


# preview


def test_preview_writes_sheet_and_video(finished, tmp_path, capsys) -> None:
    """Both files, in the folder that was asked for; the paths are said."""
    out = tmp_path / "look"
    assert command("preview", finished, "--out", out, "--progress", "json") == 0
    assert names(out) == ["contact_sheet.png", "preview.mp4"]
    done = events(capsys.readouterr().out)[-1]
    assert done["event"] == "done"
    assert done["files"] == [str(out / "contact_sheet.png"), str(out / "preview.mp4")]
    assert read_image(out / "contact_sheet.png").max() > 0.5
    with Clip.open(out / "preview.mp4") as clip:
        assert len(clip) == 5


def test_preview_lies_in_the_sequence(finished) -> None:
    """By default; the sequence can still be resumed, and two in one folder do not overwrite each other's."""
    before = names(finished)
    assert command("preview", finished) == 0
    assert names(finished) == sorted([*before, "contact_sheet.png", "preview.mp4"])
