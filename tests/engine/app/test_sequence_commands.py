"""The commands on a finished sequence: what they write, say and refuse."""

import json
import shutil
from types import SimpleNamespace

import numpy as np
import psutil
import pytest
from command_line import command, events_of, names, refused

from smokelift import Clip, Sequence, render
from smokelift.direct.continuation import ROOM, Continuation, continue_sequence
from smokelift.direct.simulation import Physics
from smokelift.direct.state import open_source
from smokelift.footage.image_files import read_image
from smokelift.output.images import eight_bit
from smokelift.output.writer import SequenceWriter
from smokelift.scene import Camera, Scene, orbit
from tests.engine.direct.rising import SCENE, at_rest, blob, course, cube, free, write_stl
from tests.engine.output.small_sequence import needs_vdb


def test_a_whole_sequence_passes(finished, capsys) -> None:
    last = events_of(capsys, "check", finished)[-1]
    assert (last["event"], last["frames"], last["empty"]) == ("done", 5, 0)


@pytest.mark.parametrize(
    ("name", "damage", "said"),
    [
        ("smoke_0003.npz", lambda content: content[:-1], "smoke_0003.npz"),
        ("smoke_0002.npz", None, "the file of frame 2 is missing."),
        ("sequence.json", lambda content: content.replace(b'"complete": true', b'"complete": false'), "complete run"),
    ],
    ids=["damaged", "missing", "unfinished"],
)
def test_what_is_damaged_or_missing_fails(finished, tmp_path, capsys, name, damage, said) -> None:
    copy = shutil.copytree(finished, tmp_path / "smoke")
    content = (copy / name).read_bytes()
    for path in copy.glob(f"{name.split('.')[0]}.*"):
        path.unlink()
    if damage:
        (copy / name).write_bytes(damage(content))
    assert said in refused(capsys, "check", copy)


@needs_vdb
def test_every_frame_gets_a_coarse_copy(finished, tmp_path, capsys) -> None:
    there = shutil.copytree(finished, tmp_path / "there")
    start, *frames, done = events_of(capsys, "proxy", there)
    assert start["total"] == len(frames) == done["frames"]
    assert set(names(there)) - set(names(finished)) == {f"proxy_{frame['frame']:04d}.vdb" for frame in frames}
    assert "no sequence" in refused(capsys, "proxy", tmp_path)


@needs_vdb
def test_the_size_is_said_before(finished, tmp_path, capsys) -> None:
    out = tmp_path / "out"
    words = ("export", finished, "--out", out, "--precision", "quantized", "--proxy", 2)
    (sent,) = events_of(capsys, *words, "--size")
    assert sent["event"] == "done" and sent["size"] > 0
    assert not out.exists()
    note, start, *frames, done = events_of(capsys, *words)
    assert "MB" in note["text"] and start["total"] == len(frames) == done["frames"]
    assert done["size"] == pytest.approx(sent["size"], rel=0.2)
    assert len(names(out)) == 2 * done["frames"] + 2
    assert "sequence.json" in refused(capsys, "export", finished, "--out", finished)
    assert "no sequence" in refused(capsys, "export", out, "--out", tmp_path / "again")
    assert "proxy" in refused(capsys, "export", finished, "--out", out, "--proxy", 0)


def test_retime_and_loop_write_every_frame(finished, tmp_path, capsys) -> None:
    slow, loop = tmp_path / "slow", tmp_path / "loop"
    start, *_, done = events_of(capsys, "retime", finished, "--out", slow, "--speed", 0.5, "--npz")
    assert start == {"event": "start", "total": 9, "done": 0}
    assert done["frames"] == len(list(slow.glob("*.npz"))) == 9
    assert "no longer those of the clip" in refused(capsys, "evaluate", slow)
    looped = events_of(capsys, "loop", finished, "--out", loop, "--overlap", 1, "--npz")
    assert looped[-1]["frames"] == len(list(loop.glob("*.npz")))


def test_continue_adds_frames(finished, tmp_path, capsys) -> None:
    out = tmp_path / "out"
    words = ("continue", finished, "--out", out, "--frames", 3, "--npz", "--fade", 1, "--wind", 0.2, -0.1, 0)
    words += ("--turbulence", 0.3, 0.6, 1, "--turbulence", 0.1, 0.9, 2, "--closed", "z-", "x+")
    words += ("--buoyancy", -0.5, "--dissipation", 0.1)
    said = events_of(capsys, *words)
    assert said[-1]["event"] == "done"
    assert said[-1]["frames"] == len([event for event in said if event["event"] == "frame"])
    assert len([name for name in names(out) if name.endswith(".npz")]) == said[-1]["frames"]
    assert command("render", out, "--frame", said[-1]["frames"], "--out", tmp_path / "last.png") == 0


def test_what_is_resumed_is_counted_whole(finished, tmp_path, capsys) -> None:
    """A run that ended after its first simulated frame goes on: the time of that counts, not of those it copied."""
    out, source = tmp_path / "out", open_source(finished)
    for number, _ in continue_sequence(source, out, Continuation(3, room=ROOM), npz=True):
        if number == source.frames[-1] + 1:
            break
    index = json.loads((out / "sequence.json").read_text())
    index["frames"]["1"]["seconds_density"] = index["frames"][str(number)]["seconds_velocity"] = 1000.0
    (out / "sequence.json").write_text(json.dumps(index))
    start, *_, done = events_of(capsys, "continue", finished, "--out", out, "--npz", "--frames", 3, "--resume")
    assert (start["done"], start["total"]) == (number, number + 2)
    assert 1000 < done["seconds"] < 2000


def test_one_sentence_says_what_stops_a_continuation(finished, tmp_path, capsys, monkeypatch) -> None:
    """The box cannot grow, or memory does not suffice for it."""

    def said(*words: object) -> list[str]:
        start = ("continue", finished, "--out", tmp_path / "out", "--npz", "--frames", 8, "--wind", 6, 0, 0)
        return [event["text"] for event in events_of(capsys, *start, *words) if event["event"] == "note"]

    (sentence,) = said("--room", 1)
    assert "dissolves" in sentence and "more room than 1" in sentence
    assert said("--room", 1, "--resume") == []
    shutil.rmtree(tmp_path / "out")
    monkeypatch.setattr(psutil, "virtual_memory", lambda: SimpleNamespace(available=0))
    assert "grows to 1 times" in said()[0]


def test_a_fitted_buoyancy_that_contradicts_the_clip_is_said(tmp_path, capsys) -> None:
    """Smoke that rises ever slower, as if it were heavy."""
    with SequenceWriter(tmp_path / "smoke", SCENE, {}, npz=True) as writer:
        for number, state in enumerate(course(free(Physics(-3.0, 0.0)), at_rest(blob((0.0, 0.0, 1.5))), 11), 1):
            writer.write(number, state.density, tuple(-face for face in state.velocity.faces))
    said = events_of(capsys, "continue", tmp_path / "smoke", "--out", tmp_path / "out", "--npz", "--frames", 1)
    (note,) = (event for event in said if event.get("kind") == "contradicted buoyancy")
    assert note["figures"]["motion"] == "rises" and note["figures"]["buoyancy"] < 0


@pytest.mark.parametrize(
    ("verb", "words", "said"),
    [
        ("retime", ("--speed", 0), "--speed 0"),
        ("retime", ("--speed", 1, 1e6), "--speed 1e+06"),
        ("loop", ("--frames", "1:99"), "not 1 to 99"),
        ("loop", ("--frames", "0:3"), "not 0 to 3"),
        ("loop", ("--overlap", 3), "by 2 at most, not by 3"),
        ("loop", ("--overlap", 0), "not by 0"),
        ("loop", ("--frames", "2:4", "--overlap", 1), "more frames (4 at least)"),
        ("continue", ("--frames", 0), "--frames 0"),
        ("continue", ("--fade", 4), "--fade 4"),
        ("continue", ("--fan", 0, 0, 1, -1, 0, 0, 1), "radius"),
        ("continue", ("--mesh", cube((50, 50, 50), (60, 60, 60))), "no voxel"),
        ("continue", ("--mesh", cube((2.5, -0.5, 0.5), (3.5, 0.5, 1.5)), "--room", 1), "the obstacle holds no voxel"),
        ("continue", ("--mesh", cube((-9, -9, -9), (9, 9, 9))), "fill the whole box"),
        ("continue", ("--fan", 0, 0, -1, 0.5, 0, 0, 1, "--closed", "z-"), "the fan holds no voxel"),
        ("continue", ("--room", 0.5), "--room 0.5"),
        ("continue", ("--dissipation", -1), "--dissipation -1"),
        ("continue", ("--turbulence", 1, 0, 0), "--turbulence 1 0 0"),
        ("continue", ("--turbulence", 1, 1, 0.5), "--turbulence 1 1 0.5"),
        ("continue", ("--turbulence", 1, 0.001, 0), "too small for voxels"),
        ("continue", ("--start", 77), "cannot go on from frame 77"),
        ("continue", ("--start", 3), "cannot go on from frame 3"),
        ("continue", ("--out", "SELF"), "the sequence itself"),
    ],
)
def test_what_cannot_be_made_of_a_sequence_is_refused(finished, tmp_path, capsys, verb, words, said) -> None:
    words = [finished if isinstance(word, str) and word == "SELF" else word for word in words]
    for place, word in enumerate(words):
        if isinstance(word, np.ndarray):
            words[place] = tmp_path / "obstacle.stl"
            write_stl(words[place], word)
    start = (verb, finished, "--out", tmp_path / "out", "--npz", *(("--frames", 3) if verb == "continue" else ()))
    assert said in refused(capsys, *start, *words)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("word", "yaw", "pitch"), [("side", 90, 0), ("-30,10", -30, 10)])
def test_render_another_view_as_png(finished, plume, tmp_path, word, yaw, pitch) -> None:
    path = tmp_path / "a.png"
    assert command("render", finished, "--frame", 3, f"--camera={word}", "--out", path) == 0
    camera = orbit(plume.scene.camera, plume.scene.domain, yaw, pitch)
    wanted = eight_bit(render(Sequence.open(finished).density(3), plume.scene, camera))
    found = eight_bit(read_image(path))
    assert np.abs(found.astype(int) - wanted).max() <= 1
    assert found.max() > 50


def test_render_the_front_or_a_camera_file_as_exr(finished, plume, tmp_path) -> None:
    camera = Camera.look_at((3, -3, 1.5), (0, 0, 0.8), fov_y_degrees=30, size=(32, 24))
    Scene(camera=camera).save(tmp_path / "camera.toml")
    for words, seen_by in (((), None), (("--camera", tmp_path / "camera.toml"), camera)):
        assert command("render", finished, *words, "--out", tmp_path / "a.exr") == 0
        wanted = render(Sequence.open(finished).density(1), plume.scene, seen_by)
        np.testing.assert_allclose(read_image(tmp_path / "a.exr"), wanted, atol=1e-3)


def test_render_a_video(finished, tmp_path) -> None:
    assert command("render", finished, "--camera", "side", "--out", tmp_path / "a.mp4") == 0
    with Clip.open(tmp_path / "a.mp4") as clip:
        assert (len(clip), clip.fps, clip.size) == (5, 24.0, (40, 56))
        assert clip.frame(2).max() > 0.1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--camera", "above"), "--camera above"),
        (("--camera", "1,2,3"), "--camera 1,2,3"),
        (("--camera", "nan,0"), "--camera nan,0"),
        (("--camera", "none.toml"), "none.toml"),
        (("--frame=0",), "1 to 5"),
        (("--frame=6", "--out", "a.mp4"), "1 to 5"),
        (("--out", "a.gif"), "a.gif"),
        (("--out", "none/a.png"), "none"),
        (("--out", "none/a.mp4"), "none"),
    ],
)
def test_what_cannot_be_rendered_is_refused(finished, tmp_path, monkeypatch, capsys, words, said) -> None:
    monkeypatch.chdir(tmp_path)
    assert said in refused(capsys, "render", finished, "--out", "a.png", *words)
    assert not list(tmp_path.iterdir())


def test_files_that_show_nothing_are_refused(finished, tmp_path, capsys) -> None:
    Scene().save(tmp_path / "camera.toml")
    words = ("--camera", tmp_path / "camera.toml", "--out", tmp_path / "a.png")
    assert "camera.toml" in refused(capsys, "render", finished, *words)
    for verb, directory in (("render", tmp_path), ("preview", tmp_path / "none")):
        assert str(directory) in refused(capsys, verb, directory, "--out", tmp_path / "a.png")
