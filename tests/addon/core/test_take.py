"""The files of a run: numbered, never overwritten, found again."""

import json
import os
import tomllib
from pathlib import Path

import pytest

from addon.core import ShotError
from addon.core.take import Take, new_take, takes

TABLES = {"clip": {"path": "/a b/clip.mp4", "frames": [0, 9]}}


def begun(folder: Path) -> Take:
    take = new_take(folder)
    take.write(TABLES, ["--quality", "draft"])
    return take


def with_sequence(take: Take, frames: int, complete: bool) -> None:
    """Write the index as the engine does: whole, in place of the one before."""
    take.directory.mkdir(exist_ok=True)
    index = {"complete": complete, "frames": {str(n): {} for n in range(1, frames + 1)}}
    (take.directory / "new").write_text(json.dumps(index))
    (take.directory / "new").replace(take.directory / "sequence.json")


def test_takes_are_numbered_and_never_overwritten(tmp_path) -> None:
    """The next is one above the highest, also where one was taken away or only some of its files are left."""
    folder = tmp_path / "new" / "folder"
    assert takes(folder) == []
    first, second = begun(folder), begun(folder)
    assert [take.directory.name for take in (first, second)] == ["take_0001", "take_0002"]
    for take in (first, second):
        with_sequence(take, 1, complete=True)
        take.log_file.write_text("log")
        take.thumbnail_file.write_text("picture")
    first.remove()
    assert {path.name[:9] for path in folder.iterdir()} == {"take_0002"}
    (folder / "take_0007.log").write_text("all that is left")
    (folder / "holiday.jpg").write_text("not ours")
    assert new_take(folder).directory.name == "take_0008"
    assert [take.directory.name for take in takes(folder)] == ["take_0002", "take_0007"]


def test_a_take_knows_how_the_engine_is_called(tmp_path) -> None:
    take = begun(tmp_path)
    assert tomllib.loads(take.scene_file.read_text()) == TABLES
    arguments = Take(take.directory).arguments()  # as another session would
    assert arguments[:2] == ["reconstruct", str(take.scene_file)]
    assert arguments[arguments.index("--out") + 1] == str(take.directory)
    assert "--resume" in arguments
    assert arguments[-2:] == ["--quality", "draft"]
    assert arguments[arguments.index("--progress") + 1] == "json"


def test_frames_and_completeness(tmp_path) -> None:
    """The index of another program is none."""
    take = begun(tmp_path)
    assert (take.read().frames, take.read().complete, take.read().resumable) == (0, False, True)
    for count, complete in ((3, False), (1, True)):
        with_sequence(take, count, complete)
        assert (take.read().frames, take.read().complete, take.read().resumable) == (count, complete, not complete)
    for foreign in ("half a fi", '{"format": 1}', '{"frames": [], "complete": true}', "[]", '{"frames": {}}'):
        (take.directory / "sequence.json").write_text(foreign)
        assert (take.read().index, take.read().frames, take.read().complete) == ({}, 0, False)
        assert [found.read().frames for found in takes(tmp_path)] == [0]


def test_a_redraw_reads_no_file_that_has_not_changed(tmp_path, monkeypatch) -> None:
    take = begun(tmp_path)
    with_sequence(take, 3, complete=False)
    before = (take.read().frames, take.read().title, take.size())
    with monkeypatch.context() as blocked:
        blocked.setattr(Path, "read_text", None)
        blocked.setattr(os, "scandir", None)
        assert (take.read().frames, take.read().title, take.size()) == before
    with_sequence(take, 4, complete=True)
    assert (take.read().frames, take.read().complete) == (4, True)
    assert take.size() > before[2]


@pytest.mark.parametrize("meshes", [[b"mesh"], [b"one", b"two", b"three"]])
def test_what_is_made_of_a_take(tmp_path, meshes) -> None:
    """It knows the other take, also after both were moved, and its obstacles, still or moving."""
    source = begun(tmp_path / "old" / "first")
    take = new_take(tmp_path / "old" / "second")
    assert (take.read().direction, take.read().source) == (None, None)
    take.write_directed("continue", source, ["--frames", "5", "--wind", "-1.5", "0", "0"], meshes)
    (tmp_path / "old").rename(tmp_path / "new")
    take, source = (Take(tmp_path / "new" / t.directory.relative_to(tmp_path / "old")) for t in (take, source))
    assert (take.read().direction, take.read().source, take.read().title) == ("continue", source, "Continued 1")
    arguments = take.arguments()
    assert arguments[:2] == ["continue", str(source.directory)]
    assert arguments[arguments.index("--mesh") + 1 :] == [str(take.directory) + "_####.stl"]
    assert [path.read_bytes() for path in sorted(take.directory.parent.glob("*.stl"))] == meshes
    assert new_take(take.directory.parent).directory.name == "take_0002"
    assert arguments[arguments.index("--wind") + 1] == "-1.5"
    assert "--resume" in arguments
    assert take.read().resumable
    take.give_title("Windy")
    assert (take.read().title, take.read().direction) == ("Windy", "continue")
    take.remove()
    assert list(take.directory.parent.iterdir()) == []


@pytest.mark.parametrize(
    ("request_", "named"),
    [
        *(({"options": words}, words[0]) for words in (["--out", "/etc"], ["--ou=/etc"], ["--npz"], ["-h"])),
        ({"direction": "continue", "source": "x", "options": ["--mesh", "/etc"]}, "--mesh"),
        ({"direction": "retime", "source": "x", "options": ["--wind", "1"]}, "--wind"),
        ({"direction": "doctor", "source": "x", "options": []}, "take_0001"),
        ({"direction": "loop", "source": 3, "options": []}, "take_0001"),
        ({"direction": "loop", "options": []}, "take_0001"),
        *((damage, "take_0001") for damage in ("", "{", "[]", '{"options": 3}')),
    ],
)
def test_nothing_but_what_decides_the_result_reaches_the_engine(tmp_path, request_, named) -> None:
    take = begun(tmp_path)
    take.request_file.write_text(request_ if isinstance(request_, str) else json.dumps(request_))
    with pytest.raises(ShotError, match=named):
        take.arguments()


def test_a_scene_file_is_told_where_its_files_went(tmp_path) -> None:
    (tmp_path / "plate.png").write_text("picture")
    take = new_take(tmp_path)
    tables = {
        "clip": {"path": str(tmp_path / "gone" / "clip.mp4"), "mask": str(tmp_path / "gone" / "mask.png")},
        "background": {"image": str(tmp_path / "plate.png")},
    }
    take.write(tables, [])
    places = {("clip", "path"): "clip.mp4", ("clip", "mask"): "mask.png", ("background", "image"): "other.png"}
    files = {key: tmp_path / name for key, name in places.items()}
    take.update_moved_files(files)
    assert tomllib.loads(take.scene_file.read_text()) == tables
    for file in files.values():
        file.write_text("found")
    take.update_moved_files(files)
    tables["clip"] = {"path": str(tmp_path / "clip.mp4"), "mask": str(tmp_path / "mask.png")}
    assert tomllib.loads(take.scene_file.read_text()) == tables
    take.scene_file.write_text("[clip")
    with pytest.raises(ShotError, match=str(take.scene_file)):
        take.update_moved_files(files)


def test_a_folder_that_cannot_be_written_to(tmp_path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(ShotError, match=str(tmp_path / "file")):
        Take(tmp_path / "file" / "take_0001").write(TABLES, [])
