"""Smokes are objects: several in a scene, each with its own clip, settings and results."""

from pathlib import Path

import bpy
import pytest
from mathutils import Matrix

from addon.core.take import Take, takes
from addon.result import smoke_takes
from addon.scene import shot_setup, volume
from addon.scene.geometry import new_box
from addon.scene.smoke import active_smoke, hide_default_cube, new_smoke
from conftest import changed, made, ticked
from tests.example_shot import EXAMPLE, add, add_box, add_camera, smoke

SUN = [{"irradiance": [1.0, 1.0, 1.0], "direction": [0.0, 0.0, -1.0]}]


def test_new_smoke_is_a_volume_that_is_selected_and_active(scene, clip) -> None:
    camera = add_camera(scene, (0.0, 0.0, 0.0))
    camera.select_set(True)
    obj = new_smoke(scene, clip)
    assert (obj.type, obj.name) == ("VOLUME", "Smoke clip.mp4")
    assert bpy.context.view_layer.objects.active == obj
    assert [other for other in scene.objects if other.select_get()] == [obj]
    assert (obj.smokelift.first, obj.smokelift.last) == (1, clip.frame_duration)


def test_the_active_smoke_is_that_of_the_active_object(scene, clip) -> None:
    first, second = new_smoke(scene, clip), new_smoke(scene, clip)
    box = second.smokelift.box = add_box(scene, (0, 0, 0), (1, 1, 1))
    layer = bpy.context.view_layer
    for active, wanted in ((first, first), (second, second), (box, second), (add_camera(scene, (0, 0, 0)), first)):
        layer.objects.active = active
        assert active_smoke(scene) == wanted
    bpy.data.objects.remove(first)
    bpy.data.objects.remove(second)
    assert active_smoke(scene) is None


def test_smokes_of_one_clip_have_folders_of_their_own(scene, clip, tmp_path) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    first, second = new_smoke(scene, clip), new_smoke(scene, clip)
    second.name = "Other"
    folders = [smoke_takes.output_folder(obj) for obj in (first, second)]
    assert folders == [tmp_path / "smokelift" / name for name in ("clip", "clip_2")]
    second.smokelift.clip = clip
    assert smoke_takes.output_folder(second) == folders[1]


@pytest.mark.parametrize(
    ("change", "hides"),
    [
        (lambda cube: None, True),
        (lambda cube: setattr(cube.location, "x", 3.0), False),
        (lambda cube: setattr(cube, "name", "Crate"), False),
        (lambda cube: setattr(cube.data.vertices[0].co, "x", -2.0), False),
    ],
)
def test_the_cube_of_a_new_file_does_not_hide_the_smoke(scene, change, hides) -> None:
    cube = add(scene, "Cube", new_box().data)
    change(cube)
    assert hide_default_cube(scene) == hides
    assert cube.hide_render == cube.hide_viewport == hides
    assert not hide_default_cube(scene)


def test_light_that_casts_no_shadow_says_how_it_lights_from_a_side(scene, clip, tmp_path) -> None:
    """Else to turn the light changes nothing, without a word why."""
    obj, take = new_smoke(scene, clip), made(tmp_path, lights=SUN)
    ticked(volume.show(obj, take), "light")
    for scattering, even in (("unshadowed", True), ("multiple", False)):
        with changed(take) as index:
            index["scene"]["medium"]["scattering"] = scattering
        assert ("give Smokelift Light a shadow" in " ".join(shot_setup.set_up(obj))) == even
        assert scene.objects["Smokelift Light"].data.use_shadow != even


@pytest.mark.parametrize(
    ("change", "hidden", "doubled"),
    [
        (lambda lamp, obj: None, True, False),
        (lambda lamp, obj: setattr(lamp.location, "x", 1.0), False, True),
        (lambda lamp, obj: setattr(lamp.data, "energy", 100.0), False, True),
        (lambda lamp, obj: lamp.keyframe_insert("location", frame=1), False, True),
        (lambda lamp, obj: setattr(lamp, "hide_render", True), False, False),
        (lambda lamp, obj: setattr(obj.smokelift, "light_mode", "SCENE"), False, False),
    ],
)
def test_the_lamp_of_a_new_file_does_not_light_smoke_that_has_its_light(blender, tmp_path, change, hidden, doubled):
    """Set Up Shot hides it and says so; a lamp that anybody changed, or that the smoke was made with, stays."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    lamp, obj = scene.objects["Light"], new_smoke(scene, bpy.data.movieclips.load(str(EXAMPLE / "clip.mp4")))
    ticked(obj, "light")
    change(lamp, obj)
    before = lamp.hide_render
    volume.show(obj, made(tmp_path, lights=SUN))
    said = " ".join(shot_setup.set_up(obj))
    assert ("lamp of the new file is hidden" in said) == lamp.hide_viewport == hidden
    assert lamp.hide_render == (hidden or before)
    assert ("has that of Light" in said) == doubled
    assert scene.cycles.samples == shot_setup.SAMPLES


def test_samples_that_the_artist_chose_stay(shot, tmp_path) -> None:
    ticked(volume.show(smoke(shot), made(tmp_path)), "light")
    for samples, wanted in ((4096, shot_setup.SAMPLES), (4096, shot_setup.SAMPLES), (128, 128)):
        shot.cycles.samples = samples
        assert bpy.ops.smokelift.set_up() == {"FINISHED"}
        assert shot.cycles.samples == wanted


def test_results_are_picked_named_and_deleted(shot, tmp_path) -> None:
    smoke(shot).smokelift.output = str(tmp_path / "out")
    first, second = (smoke_takes.write_take(smoke(shot)) for _ in range(2))
    for number in (1, 2):
        made(tmp_path / "out", number=number)
    assert bpy.ops.smokelift.show_take(take=str(first.directory)) == {"FINISHED"}
    assert volume.shown_take(smoke(shot)) == first
    assert bpy.ops.smokelift.name_take(take=str(first.directory), title="Slow and thick") == {"FINISHED"}
    assert Take(first.directory).read().title == "Slow and thick"
    assert first.arguments()[0] == "reconstruct"
    with pytest.raises(RuntimeError):
        bpy.ops.smokelift.remove_take(take=str(first.directory))
    assert bpy.ops.smokelift.remove_take(take=str(second.directory)) == {"FINISHED"}
    assert takes(tmp_path / "out") == [first]
    with pytest.raises(RuntimeError):
        bpy.ops.smokelift.show_take(take=str(second.directory))
    assert volume.shown_take(smoke(shot)) == first


def test_files_begin_at_the_start_number(shot, tmp_path) -> None:
    settings = smoke(shot).smokelift
    settings.output = str(tmp_path / "out")
    assert not any(word.startswith("--start-number") for word in smoke_takes.write_take(smoke(shot)).arguments())
    settings.start_number = 1001
    assert "--start-number=1001" in smoke_takes.write_take(smoke(shot)).arguments()


def with_masses(folder: Path, masses: list[float], planned: int = 0, complete: bool = True, **tables: object) -> Take:
    """A take whose frames hold so much smoke, of so many that it will have."""
    take = made(folder, frames=len(masses), used=[10, 9 + (planned or len(masses))], **tables)
    with changed(take) as index:
        index["frames"] = {str(n): {"mass": mass} for n, mass in enumerate(masses, 1)}
        index["complete"] = complete
    return take


@pytest.fixture
def obj(scene, clip) -> bpy.types.Object:
    """A smoke that the scene's camera filmed."""
    obj = new_smoke(scene, clip)
    obj.smokelift.camera_mode = "SCENE"
    return obj


def test_a_new_result_is_seen(scene, obj, tmp_path) -> None:
    """The range is the result's, also of one that is still made; the playhead goes to smoke unless it shows some."""
    take = with_masses(tmp_path, [0.0, 0.0, 1.0, 1.0])
    smoke_takes.present(obj, take)
    assert (scene.frame_start, scene.frame_end) == (11, 14)
    assert volume.go_to_smoke(obj)
    assert scene.frame_current == 13
    scene.frame_set(14)
    assert volume.go_to_smoke(obj)
    assert scene.frame_current == 14
    scene.frame_set(16)
    smoke_takes.present(obj, with_masses(tmp_path / "begun", [1.0, 1.0], planned=6, complete=False))
    assert (scene.frame_start, scene.frame_end) == (11, 16)
    assert volume.go_to_smoke(obj)
    assert scene.frame_current == 16
    smoke_takes.present(obj, with_masses(tmp_path / "longer", [1.0] * 80))
    assert scene.frame_end == 90
    bpy.ops.smokelift.match_clip()
    assert (scene.frame_start, scene.frame_end) == (11, 90)
    scene.frame_end = 60
    smoke_takes.present(obj, take)
    assert scene.frame_end == 60
    smoke_takes.present(obj, with_masses(tmp_path / "empty", [0.0, 0.0]))
    assert not volume.go_to_smoke(obj)


def test_the_cube_is_hidden_with_the_first_result_that_stands_where_it_does(scene, clip, tmp_path) -> None:
    """Not by a run that may fail; later the artist's choice stays."""
    bpy.ops.mesh.primitive_cube_add(size=2.0)
    cube, obj = bpy.context.object, new_smoke(scene, clip)
    obj.smokelift.output = str(tmp_path)
    smoke_takes.write_take(obj)
    assert not cube.hide_render
    camera = {"matrix": [list(row) for row in Matrix()], "fx": 50.0, "size": [32, 48]}
    take = with_masses(tmp_path / "made", [1.0], camera=camera)
    assert "cube" in smoke_takes.present(obj, take)
    assert cube.hide_render
    cube.hide_viewport = cube.hide_render = False
    assert smoke_takes.present(obj, take) == ""
    assert not cube.hide_render


def test_the_range_stays_while_a_directed_result_grows(scene, obj, tmp_path) -> None:
    first = with_masses(tmp_path, [1.0] * 8)
    smoke_takes.present(obj, first)
    before = (scene.frame_start, scene.frame_end)
    loop = with_masses(tmp_path / "loop", [1.0] * 2, complete=False)
    loop.write_directed("loop", first, [])
    smoke_takes.present(obj, loop)
    assert (scene.frame_start, scene.frame_end) == before
    with changed(loop) as index:
        index["complete"] = True
    smoke_takes.present(obj, loop)
    assert scene.frame_end == before[0] + 1


def test_other_objects_get_nothing(scene, clip, tmp_path) -> None:
    """Before 5.0 Blender shows what an add-on gives an object among its custom properties."""
    add_box(scene, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    obj = new_smoke(scene, clip)
    smoke_takes.own_takes(obj)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "other.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "other.blend"))
    assert not set(bpy.data.objects["Box"].keys())


def test_the_range_is_that_of_what_is_used_or_shown(scene, obj, clip, tmp_path) -> None:
    """Before a run that of the used frames, then the result's; of several smokes all; a longer one of a result is."""
    obj.smokelift.first, obj.smokelift.last = 10, 20
    bpy.ops.smokelift.match_clip()
    assert (scene.frame_start, scene.frame_end) == (10, 20)
    smoke_takes.present(obj, with_masses(tmp_path, [1.0] * 8))
    assert (scene.frame_start, scene.frame_end) == (11, 18)
    smoke_takes.present(obj, with_masses(tmp_path / "continued", [1.0] * 30, planned=8))
    assert (scene.frame_start, scene.frame_end) == (11, 40)
    other = new_smoke(scene, clip)
    other.smokelift.first, other.smokelift.last = 3, 5
    bpy.ops.smokelift.match_clip()
    assert (scene.frame_start, scene.frame_end) == (3, 40)
