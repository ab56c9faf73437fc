"""What is made of a result: what the scene tells the engine, the tab, a whole run, and the pace that is tried out."""

import math
import shutil

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon.core import ShotError
from addon.core.take import Take, takes
from addon.result import directing, smoke_takes
from addon.scene import volume
from addon.scene.geometry import new_box
from addon.scene.smoke import activate, smokes
from conftest import changed, known_run
from smokelift.direct.mesh import Mesh
from smokelift.output.sequence import Sequence
from tests.engine.direct.rising import DOMAIN, in_box, write_plume
from tests.example_shot import smoke

FRAMES = 6


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    take = Take(folder / "take_0001")
    take.write({"clip": {"path": "clip.mp4"}}, [])
    write_plume(take.directory, FRAMES)
    return folder


@pytest.fixture
def result(shot, made, tmp_path):
    """The example's smoke, which shows the take."""
    folder = tmp_path / "out"
    shutil.copytree(made, folder)
    obj = smoke(shot)
    obj.smokelift.output = str(folder)
    shot.render.fps = 24
    activate(obj, shot)
    smoke_takes.present(obj, Take(folder / "take_0001"))
    return obj


@pytest.fixture
def acting(shot, result) -> bpy.types.Collection:
    collection = bpy.data.collections.new("Effectors")
    shot.collection.children.link(collection)
    result.smokelift.directing.effectors = collection
    return collection


def placed(collection, name, data=None, field="NONE", **values) -> bpy.types.Object:
    """An object in the collection, perhaps with a force field."""
    obj = bpy.data.objects.new(name, data)
    collection.objects.link(obj)
    for key, value in values.items():
        setattr(obj, key, value)
    if field != "NONE":
        bpy.context.view_layer.update()
        with bpy.context.temp_override(object=obj, active_object=obj):
            bpy.ops.object.forcefield_toggle()
        obj.field.type = field
    return obj


def cube(collection, scale=0.5, location=(0.0, 0.0, 1.5), name="Crate") -> bpy.types.Object:
    return placed(collection, name, new_box().data, location=location, scale=(scale,) * 3)


def words(options: list[str], name: str) -> list[list[float]]:
    """The numbers after an option, each time it is given."""
    _, *given = " ".join(options).split(f"{name} ")
    return [[float(word) for word in values.partition("--")[0].split()] for values in given]


def solid(content: bytes, tmp_path) -> np.ndarray:
    (tmp_path / "mesh.stl").write_bytes(content)
    return Mesh.read(tmp_path / "mesh.stl").voxels(DOMAIN)


# what the scene tells the engine


def test_frames_are_those_of_the_clip(shot, result) -> None:
    """Wherever the smoke stands in the scene's time, and whichever frames of the clip it was made of."""
    with changed(volume.shown_take(result)) as index:
        index["scene"]["clip"]["frames"] = [39, 44]
    settings = result.smokelift.directing
    settings.frames, settings.fade = 10, 4
    assert directing.engine_request(result) == ("continue", ["--frames", "10", "--fade", "4", "--room", "8.000000"], [])
    settings.use_buoyancy, settings.buoyancy = True, -0.5
    settings.use_dissipation = True
    assert directing.engine_request(result)[1][-4:] == ["--buoyancy", "-0.500000", "--dissipation", "0.000000"]
    result.data.frame_start = 101
    settings.use_start = True
    assert settings.start == 45
    settings.start = 44
    assert directing.engine_request(result)[1][-2:] == ["--start", "5"]
    for frame, said in ((41, "4 frames"), (46, "40 to 45")):
        settings.start = frame
        with pytest.raises(ShotError, match=said):
            directing.engine_request(result)
    settings.fade = 11
    with pytest.raises(ShotError, match="11"):
        directing.engine_request(result)


def test_meshes_are_obstacles(result, acting, tmp_path) -> None:
    """With their modifiers, also mirrored ones; those outside and the smoke's box count for nothing."""
    obj = cube(acting)
    acting.objects.link(result.smokelift.box)
    wanted = in_box((-0.5, -0.5, 1.0), (0.5, 0.5, 2.0))
    (content,) = directing.engine_request(result)[2]
    np.testing.assert_array_equal(solid(content, tmp_path), wanted)
    obj.scale.x = -0.5
    small = cube(acting, 0.25, (0.5, 0.0, 1.5), "Small")
    both = wanted | in_box((0.25, -0.25, 1.25), (0.75, 0.25, 1.75))
    np.testing.assert_array_equal(solid(*directing.engine_request(result)[2], tmp_path), both)
    obj.hide_viewport = True
    assert solid(*directing.engine_request(result)[2], tmp_path).sum() < both.sum()
    modifier = small.modifiers.new("Round", "SUBSURF")
    modifier.levels = 2
    assert len(directing.engine_request(result)[2][0]) > len(content)


def test_meshes_that_move(shot, result, acting, tmp_path) -> None:
    """Are sampled in the frames of the scene that the new frames are shown in, as long as they move."""
    obj = cube(acting, 0.25)
    result.smokelift.directing.frames = 5
    last = volume.scene_frame(result, FRAMES)
    for frame, x in ((last + 1, 0.0), (last + 3, 0.5)):
        obj.location.x = x
        obj.keyframe_insert("location", index=0, frame=frame)
    before = shot.frame_current
    files = directing.engine_request(result)[2]
    assert shot.frame_current == before
    assert len(files) == 4  # at the start and 1, 2 and 3 frames later; then it stays
    assert files[0] == files[1]
    wanted = in_box((0.25, -0.25, 1.25), (0.75, 0.25, 1.75))
    np.testing.assert_array_equal(solid(files[-1], tmp_path), wanted)
    assert bpy.ops.smokelift.direct() == {"FINISHED"}
    (run,) = smoke_takes.runs
    assert (run.job.outcome, run.job.done) == ("done", FRAMES + 5), run.job.sentence
    moved = Sequence.open(volume.shown_take(result).directory)
    part = DOMAIN.slices_in(moved.scene.domain)
    assert not moved.density(FRAMES + 5)[part][wanted].any()
    assert len(smokes(bpy.context.scene)) == 1
    assert "Frames 7 to 11 are a simulation" in result.data[volume.PROVENANCE]
    build = obj.modifiers.new("Build", "BUILD")
    build.frame_start, build.frame_duration = last, 10
    with pytest.raises(ShotError, match="frame 13"):
        directing.engine_request(result)


def test_the_smokes_own_space_counts(result, acting, tmp_path) -> None:
    obj = cube(acting)
    turned = (0.0, math.pi / 2, 0.0)
    fan = placed(acting, "Fan", empty_display_size=0.5, location=(-0.8, 0.0, 0.6), rotation_euler=turned)
    before, options = directing.engine_request(result)[:0:-1]
    result.location, result.scale, result.rotation_euler = (3.0, 1.0, -2.0), (2.0, 2.0, 2.0), (0.0, 0.0, 1.2)
    bpy.context.view_layer.update()
    there = Matrix.Translation(result.location) @ result.rotation_euler.to_matrix().to_4x4() @ Matrix.Scale(2.0, 4)
    obj.matrix_basis, fan.matrix_basis = there @ obj.matrix_basis, there @ fan.matrix_basis
    after, found = directing.engine_request(result)[:0:-1]
    np.testing.assert_array_equal(solid(*after, tmp_path), solid(*before, tmp_path))
    # one meter in the scene is half a meter of the smoke's own
    np.testing.assert_allclose(words(found, "--fan")[0][:4], words(options, "--fan")[0][:4], atol=1e-5)
    np.testing.assert_allclose(words(found, "--fan")[0][4:], [0.5, 0.0, 0.0], atol=1e-5)


def test_winds_and_fans(result, acting) -> None:
    for name in ("One", "Two"):
        placed(acting, name, field="WIND", rotation_euler=(0.0, math.pi / 2, 0.0)).field.strength = 0.4
    placed(acting, "Empty", location=(0.1, 0.2, 0.3), empty_display_size=0.25)
    large = {"location": (0.0, 0.0, 1.0), "scale": (2.0, 2.0, 2.0), "empty_display_size": 0.1}
    placed(acting, "Force", field="FORCE", **large).field.strength = -2.0
    gust = placed(acting, "Gust", field="WIND", location=(0.0, 0.5, 1.0)).field
    gust.strength, gust.use_max_distance, gust.distance_max = 3.0, True, 0.3
    result.smokelift.directing.fan_speed = 1.5
    options = directing.engine_request(result)[1]
    np.testing.assert_allclose(words(options, "--wind"), [[0.8, 0.0, 0.0]], atol=1e-5)
    wanted = [
        [0.0, 0.0, 1.0, 0.2, 0.0, 0.0, -2.0],
        [0.0, 0.5, 1.0, 0.3, 0.0, 0.0, 3.0],
        [0.1, 0.2, 0.3, 0.25, 0.0, 0.0, 1.5],
    ]
    np.testing.assert_allclose(sorted(words(options, "--fan")), wanted, atol=1e-5)
    placed(acting, "Swirl", field="VORTEX")
    with pytest.raises(ShotError, match="Swirl"):
        directing.engine_request(result)


def test_turbulence(result, acting) -> None:
    field = placed(acting, "Stir", field="TURBULENCE").field
    field.strength, field.size, field.seed = 0.4, 0.25, 7
    assert words(directing.engine_request(result)[1], "--turbulence") == [[0.4, 0.25, 7.0]]
    result.scale, field.size = (2.0, 2.0, 2.0), 0.0
    bpy.context.view_layer.update()
    np.testing.assert_allclose(words(directing.engine_request(result)[1], "--turbulence"), [[0.2, 0.5, 7.0]], atol=1e-5)
    field.use_max_distance = True
    with pytest.raises(ShotError, match="Stir"):
        directing.engine_request(result)


def test_retime_and_loop(result) -> None:
    settings = result.smokelift.directing
    settings.direction, settings.speed = "retime", 0.25
    assert directing.engine_request(result)[:2] == ("retime", ["--speed", "0.250000"])
    settings.use_ramp = True
    assert len(directing.engine_request(result)[1]) == 4
    settings.direction = "loop"
    assert directing.engine_request(result)[:2] == ("loop", [])
    settings.use_part = True
    settings.part_first, settings.part_last, settings.overlap = 2, 6, 2
    assert directing.engine_request(result)[1] == ["--frames", "2:6", "--overlap", "2"]
    settings.part_last = 4
    with pytest.raises(ShotError, match="4 frames"):
        directing.engine_request(result)


# whole runs


def test_a_loop_repeats_and_slow_motion_lasts(result, tmp_path) -> None:
    settings = result.smokelift.directing
    settings.direction = "loop"
    assert bpy.ops.smokelift.direct() == {"FINISHED"}
    assert result.data.sequence_mode == "REPEAT"
    assert result.data.frame_duration == 4
    before = volume.take_before(result)
    assert bpy.ops.smokelift.show_take(take=str(before.directory)) == {"FINISHED"}
    assert (result.data.sequence_mode, result.data.frame_duration) == ("CLIP", FRAMES)
    settings.direction, settings.speed, settings.live = "retime", 0.5, True
    assert bpy.ops.smokelift.direct() == {"FINISHED"}
    assert result.data.frame_duration == 2 * FRAMES - 1
    assert result.data.velocity_scale == 1.0  # its files hold the velocity that is seen
    assert [take.read().title for take in takes(tmp_path / "out")] == ["Take 1", "Loop 2", "Retimed 3"]


@pytest.mark.parametrize("outcome", ["cancelled", "failed", "done"])
def test_frames_of_a_stopped_run_do_not_stay_on_show(result, tmp_path, outcome) -> None:
    shown, take = volume.shown_take(result), Take(tmp_path / "out" / "take_0002")
    shutil.copytree(shown.directory, take.directory)
    run = known_run(result, take, "running")
    run.before = shown
    smoke_takes.show_while_made(result, run)
    assert volume.shown_take(result) == take
    run.job.outcome = outcome
    smoke_takes.show_while_made(result, run)
    assert volume.shown_take(result) == (take if outcome == "done" else shown)


def test_what_the_artist_shows_while_a_run_goes_on_stays(result, tmp_path) -> None:
    """Also the result from before, unless it is an undo that brings that back."""
    shown, take = volume.shown_take(result), Take(tmp_path / "out" / "take_0002")
    shutil.copytree(shown.directory, take.directory)
    both = [known_run(result, take, outcome) for outcome in ("running", "waiting")]
    both[0].before = shown
    smoke_takes.show_while_made(result, both[0])
    assert [run.left for run in both] == [False, False]
    assert bpy.ops.smokelift.show_take(take=str(shown.directory)) == {"FINISHED"}
    assert volume.shown_take(result) == shown
    assert [run.left for run in both] == [True, False]
    assert bpy.ops.smokelift.show_take(take=str(take.directory)) == {"FINISHED"}
    assert [run.left for run in both] == [False, False]


# the pace that is tried out


@pytest.mark.parametrize("speeds", [(0.5,), (2.0,), (1.0, 0.25, 1.0)])
def test_a_pace_is_seen_at_once(shot, result, speeds) -> None:
    """The frame that is shown, how long it lasts, and the velocity for motion blur; and all of it goes away again."""
    settings = result.smokelift.directing
    settings.speed, settings.use_ramp = speeds[0], len(speeds) > 1
    if len(speeds) > 1:
        settings.speed_middle, settings.speed_end = speeds[1:]
    settings.live = True
    data, first = result.data, result.data.frame_start
    shown, scales = [], []
    for frame in range(data.frame_duration):
        shot.frame_set(first + frame)
        seen = result.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        shown.append(1 + frame + seen.frame_offset)
        scales.append(seen.velocity_scale)
    if speeds == (0.5,):
        assert shown == [1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6]
    elif speeds == (2.0,):
        assert shown == [1, 3, 5]
    else:
        assert shown == sorted(shown)
        assert (shown[0], shown[-1]) == (1, FRAMES)
        assert scales[0] == pytest.approx(1.0, abs=1e-3)
        assert 0.25 <= min(scales) < 0.4
    if len(speeds) == 1:
        assert scales == pytest.approx(list(speeds) * len(scales))
    settings.live = False
    assert (data.frame_duration, data.velocity_scale) == (FRAMES, 1.0)
    assert not data.animation_data.drivers
