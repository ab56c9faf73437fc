"""The results of a file: which belong to it, which may be deleted, and where they are when it is saved elsewhere."""

import json
import shutil
from pathlib import Path

import bpy
import pytest

from addon.core.take import Take, takes
from addon.result import smoke_takes
from addon.scene import volume
from addon.scene.blender import absolute
from conftest import changed, known_run, made
from tests.addon.inside.panel.tab import drawn, words
from tests.example_shot import EXAMPLE, smoke


@pytest.fixture
def project(shot, tmp_path) -> Path:
    """A folder with the clip, and a smoke in a file of two folders below."""
    folder = tmp_path / "project"
    (folder / "shots" / "one").mkdir(parents=True)
    shutil.copy(EXAMPLE / "clip.mp4", folder / "clip.mp4")
    smoke(shot).smokelift.clip = bpy.data.movieclips.load(str(folder / "clip.mp4"))
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "shots" / "one" / "shot.blend"))
    return folder


def finished(direction: str = "", source: Take | None = None) -> Take:
    obj = smoke(bpy.context.scene)
    take = smoke_takes.write_take(obj)
    if source is not None:
        take.write_directed(direction, source, [])
        take.note_file(Path(bpy.data.filepath))
    made(take.directory.parent, number=int(take.directory.name[-4:]))
    return take


def doomed() -> list[int]:
    """The results that Delete Earlier Results deletes."""
    return [int(take.directory.name[-4:]) for take in smoke_takes.earlier_takes(bpy.context)]


def own() -> list[int]:
    return [int(take.directory.name[-4:]) for take in smoke_takes.own_takes(smoke(bpy.context.scene))]


def show(take: Take) -> Take:
    assert bpy.ops.smokelift.show_take(take=str(take.directory)) == {"FINISHED"}
    return take


def test_earlier_results_are_earlier_and_needed_by_none(project) -> None:
    first = finished()
    later = [finished(direction, first) for direction in ("continue", "retime", "loop")]
    show(first)
    assert bpy.ops.smokelift.remove_takes() == {"FINISHED"}
    assert own() == [1, 2, 3, 4]
    show(later[-1])
    assert doomed() == [2, 3]
    fresh = show(finished())
    assert doomed() == [1, 2, 3, 4]
    again = finished("loop", later[0])
    show(fresh)
    assert doomed() == [3, 4]
    said = smoke_takes.consequences(bpy.context, first)
    assert said == ["Made of it: Continued 2, Retimed 3, Loop 4."]
    assert smoke_takes.consequences(bpy.context, again) == []


def test_what_another_file_may_show_stays_and_each_file_has_its_own(project) -> None:
    """Saved as another, as a copy, copied and renamed outside of Blender; both find what they had."""
    folder = project / "shots" / "one"
    show(finished())
    show(finished())
    bpy.ops.wm.save_mainfile()
    assert doomed() == [1]
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "second.blend"))
    assert (own(), doomed()) == ([1, 2], [])
    third = show(finished())
    assert (own(), doomed()) == ([1, 2, 3], [])
    first = takes(third.directory.parent)[0]
    assert smoke_takes.consequences(bpy.context, first) == ["It may be shown by shot.blend."]
    bpy.ops.wm.save_mainfile()

    bpy.ops.wm.open_mainfile(filepath=str(folder / "shot.blend"))
    assert (own(), doomed()) == ([1, 2], [])
    smoke(bpy.context.scene).smokelift.mask = "//mask.png"
    bpy.ops.wm.save_as_mainfile(filepath=str(project / "copy.blend"), copy=True)
    assert "copy.blend" in smoke_takes.consequences(bpy.context, first)[0]
    bpy.ops.wm.open_mainfile(filepath=str(project / "copy.blend"))
    assert absolute(smoke(bpy.context.scene).smokelift.mask) == folder / "mask.png"
    assert own() == [1, 2]

    shutil.copy(folder / "second.blend", folder / "by hand.blend")
    bpy.ops.wm.open_mainfile(filepath=str(folder / "by hand.blend"))
    assert own() == [1, 2, 3]
    assert smoke_takes.consequences(bpy.context, third) == ["It may be shown by second.blend."]
    (folder / "second.blend").rename(folder / "renamed.blend")
    bpy.ops.wm.open_mainfile(filepath=str(folder / "renamed.blend"))
    assert own() == [1, 2, 3]


def test_what_a_linking_file_shows_is_known(project) -> None:
    show(finished())
    show(finished())
    bpy.ops.wm.save_mainfile()
    shot = bpy.data.filepath
    show(finished())
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(shot, link=True) as (there, linked):
        linked.objects = [name for name in there.objects if name.startswith("Smoke")]
    bpy.ops.wm.save_as_mainfile(filepath=str(project / "layout.blend"))
    bpy.ops.wm.open_mainfile(filepath=shot)
    second = takes(smoke_takes.output_folder(smoke(bpy.context.scene)))[1]
    assert smoke_takes.consequences(bpy.context, second) == ["It may be shown by layout.blend."]


def test_results_of_an_earlier_version_are_found_and_kept(project) -> None:
    """Their files do not say who shows them."""
    old = finished()
    old.request_file.write_text('{"options": []}')
    show(finished())
    bpy.ops.wm.save_mainfile()
    assert (own(), doomed()) == ([1, 2], [])
    assert "files" not in json.loads(old.request_file.read_text())
    (said,) = smoke_takes.consequences(bpy.context, old)
    assert said.startswith("An earlier version")


def test_results_of_a_file_that_was_never_saved_are_its(shot, tmp_path) -> None:
    shutil.copy(EXAMPLE / "clip.mp4", tmp_path / "clip.mp4")
    smoke(shot).smokelift.clip = bpy.data.movieclips.load(str(tmp_path / "clip.mp4"))
    show(finished())
    show(finished())
    assert (own(), doomed()) == ([1, 2], [1])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    assert (own(), doomed()) == ([1, 2], [1])
    with changed(volume.shown_take(smoke(bpy.context.scene))):
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    assert own() == [1, 2]


def test_results_that_were_moved_are_said_to_be_missing_and_found_in_their_new_folder(project) -> None:
    earlier, take = finished(), finished()
    for each in (earlier, take):
        show(each)
    bpy.ops.wm.save_mainfile()
    (project / "archive").mkdir()
    folder = take.directory.parent.rename(project / "archive" / "smoke")
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    scene = bpy.context.scene
    assert "are missing" in words(scene) and "[choose_results]" in words(scene)
    with pytest.raises(RuntimeError, match="take_0002"):
        bpy.ops.smokelift.choose_results(directory=str(project))
    for chosen in (folder / take.directory.name, folder):  # the result itself, or the folder that holds it
        assert bpy.ops.smokelift.choose_results(directory=str(chosen)) == {"FINISHED"}
    assert volume.shown_take(smoke(scene)) == Take(folder / take.directory.name)
    assert volume.take_before(smoke(scene)) == Take(folder / earlier.directory.name)
    assert own() == [1, 2] and "are missing" not in words(scene)


@pytest.mark.parametrize("frames", [0, 6])
def test_a_run_that_was_interrupted_is_said_when_its_file_is_opened(project, frames) -> None:
    """It goes on from its frames; one without any is in no list, and the next run takes its place."""
    show(finished())
    take = finished()
    take.log_file.touch()
    with changed(take) as index:
        index["complete"], index["frames"] = False, {str(n): {} for n in range(1, frames + 1)}
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    scene = bpy.context.scene
    assert "Take 2 was interrupted" in words(scene)
    assert ("[resume]" in words(scene)) == ("before its first frame" not in words(scene)) == bool(frames)
    listed = drawn(scene, bpy.types.SMOKELIFT_PT_view_results)
    assert listed.count("[show_take]") == (2 if frames else 1)
    assert smoke_takes.write_take(smoke(scene)).directory.name == ("take_0003" if frames else "take_0002")


@pytest.mark.parametrize("moved", [False, True])
def test_undo_after_saving_elsewhere_finds_all_files(project, moved) -> None:
    """Clip, Volume, pictures, results and what was chosen lead where they led, however often one goes back and forth.

    A project that was moved before is where it is, whatever its files remember.
    """
    shutil.copy(EXAMPLE / "plate.png", project / "plate.png")
    show(finished())
    obj = smoke(bpy.context.scene)
    obj.smokelift.mask, obj.smokelift_export.folder = "//mask.png", "//out"
    obj.smokelift.clip.filepath = "//../../clip.mp4"
    plate = bpy.data.images.load(str(project / "plate.png"))
    plate.use_fake_user, plate.filepath = True, "//../../plate.png"
    bpy.ops.wm.save_mainfile()
    if moved:
        project = project.rename(project.with_name("moved"))
        bpy.ops.wm.open_mainfile(filepath=str(project / "shots" / "one" / "shot.blend"))
    folder = project / "shots" / "one"
    for _ in range(3):
        obj = smoke(bpy.context.scene)
        obj.location.x += 1.0
        obj.smokelift.clip.frame_start += 1
        obj.data.display.density += 1.0
        bpy.data.images[0].use_fake_user ^= True
        bpy.ops.ed.undo_push(message="Change all")

    def check() -> None:
        obj = smoke(bpy.context.scene)
        settings = obj.smokelift
        assert absolute(settings.clip.filepath) == project / "clip.mp4"
        assert volume.shown_take(obj).directory == folder / "smokelift" / "clip" / "take_0001"
        assert own() == [1]
        assert absolute(bpy.data.images[0].filepath) == project / "plate.png"
        assert absolute(settings.mask) == folder / "mask.png"
        assert absolute(obj.smokelift_export.folder) == folder / "out"

    bpy.ops.ed.undo()
    check()
    (project / "delivery").mkdir()
    for file in (project / "delivery" / "final.blend", project / "flat.blend"):
        bpy.ops.wm.save_as_mainfile(filepath=str(file))
        for step in (bpy.ops.ed.undo, bpy.ops.ed.redo, bpy.ops.ed.redo, bpy.ops.ed.undo):
            check()
            assert step() == {"FINISHED"}
        check()
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(project / "flat.blend"))
    check()


@pytest.mark.parametrize("saved_elsewhere", [False, True])
def test_undo_to_before_a_run_finds_its_result(project, saved_elsewhere) -> None:
    """Also where the file was saved elsewhere while it ran: it is in the folder that the run wrote to."""
    obj = smoke(bpy.context.scene)
    bpy.ops.ed.undo_push(message="Before")
    obj.location.x += 1.0
    bpy.ops.ed.undo_push(message="Move")
    take = finished()
    bpy.ops.ed.undo_push(message="Make Smoke")
    if saved_elsewhere:
        (project / "delivery").mkdir()
        bpy.ops.wm.save_as_mainfile(filepath=str(project / "delivery" / "final.blend"))
    bpy.ops.ed.undo()
    bpy.ops.ed.undo()
    obj = smoke(bpy.context.scene)
    assert obj.location.x == 0.0
    assert smoke_takes.output_folder(obj) == take.directory.parent
    assert own() == [1]
    known_run(obj, take, "done")
    assert "[show_take]" in drawn(bpy.context.scene)  # beside what the run said
    show(take)
    assert volume.shown_take(obj) == take
