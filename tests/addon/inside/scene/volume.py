"""The result in Blender: what plays when, where it is, and what it is made of."""

import math
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Vector

from addon.core.take import Take
from addon.result import smoke_takes
from addon.scene import look, shot_setup, volume
from addon.scene.geometry import box_corners
from conftest import FRAMES, changed, made, played, quietly, rendered
from smokelift.output.images import write_image, write_video
from smokelift.scene import Camera, Medium, Scene, scene_to_dict
from tests.example_shot import smoke

HALF_VOXEL_TOO_FAR = bpy.app.version < (5, 0, 0)


def plays(scene: bpy.types.Scene, frame: int) -> int | None:
    name = played(smoke(scene), frame)
    return int(name[6:10]) if name else None


# what plays when


@pytest.mark.parametrize(
    ("speed", "fps", "wanted"),
    [
        ("FRAMES", 24, [None, 1, 2, 3, 4, 5, 6, None, None]),
        ("REAL", 48, [None, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, None]),
        ("REAL", 12, [None, 1, 3, 5, None]),
        ("REAL", 30, [None, 1, 1, 2, 3, 4, 5, 5, 6, None]),
    ],
)
def test_frames_have_their_files_and_nothing_plays_before_or_after(shot, tmp_path, speed, fps, wanted) -> None:
    shot.render.fps, smoke(shot).smokelift.speed = fps, speed
    data = volume.show(smoke(shot), made(tmp_path)).data
    assert [plays(shot, frame) for frame in range(len(wanted))] == wanted
    assert data.velocity_scale == 1.0
    if speed == "FRAMES":
        assert (data.frame_start, data.frame_duration, data.frame_offset) == (1, FRAMES, 0)
        assert data.animation_data is None or not data.animation_data.drivers


TRACKED = {"matrices": [np.eye(4).tolist()] * FRAMES}
"""A camera that moves."""


@pytest.mark.parametrize("kind", ["pictures", "video"])
def test_the_plate_of_a_moving_camera_plays_beside_the_clip(shot, tmp_path, kind) -> None:
    """A render of every frame shows its own plate behind the smoke; the smoke itself stands still in the world."""
    levels = [0.1 * n for n in range(1, FRAMES + 1)]
    plates = [np.full((16, 16, 3), level, np.float32) for level in levels]
    path = tmp_path / ("plate.mp4" if kind == "video" else "plate_0101.png")
    if kind == "video":
        write_video(path, plates, 24.0)
    else:
        for number, plate in enumerate(plates, 101):
            write_image(tmp_path / f"plate_{number:04d}.png", plate)
    obj = volume.show(smoke(shot), made(tmp_path, camera=TRACKED, background={"image": str(path)}))
    places = []
    for _ in range(2):
        shot_setup.set_up(smoke(shot))
    shot.render.resolution_x, shot.render.resolution_y = 16, 24
    shot.cycles.samples, shot.cycles.use_denoising = 1, False
    for frame in (2, 5):
        shot.frame_set(frame)
        behind = np.median(rendered(shot, tmp_path / "out.exr"), axis=(0, 1))
        assert behind == pytest.approx([levels[frame - 1]] * 3, abs=0.02)
        places.append(obj.matrix_world.copy())
    assert places[0] == places[1]


@pytest.mark.parametrize(("model", "bounces"), [("multiple", shot_setup.BOUNCES), ("single", 0), ("unshadowed", 0)])
def test_cycles_scatters_light_as_often_as_what_was_fitted(shot, tmp_path, model, bounces) -> None:
    take = made(tmp_path)
    with changed(take) as index:
        index["scene"]["medium"]["scattering"] = model
    volume.show(smoke(shot), take)
    shot.cycles.volume_bounces, shot.cycles.max_bounces = 3, 4
    shot_setup.set_up(smoke(shot))
    assert shot.cycles.volume_bounces == bounces
    assert shot.cycles.max_bounces == max(4, bounces)
    shot.cycles.volume_bounces = shot.cycles.max_bounces = 7
    shot_setup.set_up(smoke(shot))
    assert (shot.cycles.volume_bounces, shot.cycles.max_bounces) == (7, 7)


def test_a_set_up_needs_no_denoiser_that_is_not_there(shot, tmp_path, monkeypatch) -> None:
    """Cycles of some distributions has none, and ends a render in an error if it is asked for."""
    shot.cycles.use_denoising = True
    volume.show(smoke(shot), made(tmp_path))
    for there in (True, False):
        monkeypatch.setattr(shot_setup, "has_denoiser", lambda there=there: there)
        assert ("no denoiser" in " ".join(shot_setup.set_up(smoke(shot)))) == (not there)
        assert shot.cycles.use_denoising == there


def test_the_smoke_keeps_step_with_a_clip_that_is_moved(shot, tmp_path) -> None:
    """Frames chosen for the next run move nothing; a start that the artist gave the Volume stays."""
    data = volume.show(smoke(shot), made(tmp_path, used=[10, 15])).data
    assert data.frame_start == 11
    smoke(shot).smokelift.first = 3
    smoke(shot).smokelift.clip.frame_start = 101
    volume.synchronize_playback()  # Blender calls it where there is a window
    assert data.frame_start == 111
    smoke(shot).smokelift.clip.frame_offset = 4
    volume.synchronize_playback()
    assert data.frame_start == 107
    data.frame_start = 500
    volume.synchronize_playback()
    assert data.frame_start == 500


# where it is


def test_grids_and_their_place(shot, tmp_path) -> None:
    volume.show(smoke(shot), made(tmp_path))
    shot.frame_set(3)
    obj = smoke(shot).evaluated_get(bpy.context.evaluated_depsgraph_get())
    obj.data.grids.load()
    grids = {grid.name: grid for grid in obj.data.grids}
    assert {name: grid.data_type for name, grid in grids.items()} == {"density": "FLOAT", "velocity": "VECTOR_FLOAT"}
    voxel = 0.125
    shift = -voxel / 2 if HALF_VOXEL_TOO_FAR else 0.0
    # Blender knows the blocks of 8 voxels that hold something (velocity two voxels beyond the smoke); from their first
    # voxel's center to their last's, and since 5.0 with the half voxel around them.
    around = 0.0 if HALF_VOXEL_TOO_FAR else voxel / 2
    blocks = [((first - 2) // 8 * 8, (last + 2) // 8 * 8 + 7) for first, last in ((10, 12), (3, 4), (12, 13))]
    low = np.array([-1.0, -1.0, 0.0]) + (np.array([first for first, _ in blocks]) + 0.5) * voxel
    high = np.array([-1.0, -1.0, 0.0]) + (np.array([last for _, last in blocks]) + 0.5) * voxel
    corners = np.array([obj.matrix_world @ Vector(corner) for corner in obj.bound_box])
    np.testing.assert_allclose(corners.min(0), low - around + shift, atol=1e-5)
    np.testing.assert_allclose(corners.max(0), high + around + shift, atol=1e-5)


def test_a_turned_box_turns_the_smoke(shot, tmp_path) -> None:
    smoke(shot).smokelift.box.rotation_euler = (0.1, 0.2, 0.7)
    bpy.context.view_layer.update()
    obj = volume.show(smoke(shot), made(tmp_path))
    bpy.context.view_layer.update()
    turn = obj.matrix_world.to_quaternion().rotation_difference(smoke(shot).smokelift.box.matrix_world.to_quaternion())
    assert turn.angle == pytest.approx(0.0, abs=1e-5)
    assert len(box_corners(smoke(shot).smokelift.box)) == 8
    shift = obj.matrix_world.to_3x3().inverted() @ obj.matrix_world.translation
    assert list(shift) == pytest.approx([-0.0625] * 3 if HALF_VOXEL_TOO_FAR else [0.0] * 3, abs=1e-6)


def test_smoke_that_was_moved_stays_where_it_was_put(shot, tmp_path) -> None:
    first = made(tmp_path)
    obj = volume.show(smoke(shot), first)
    obj.location.x, obj.rotation_euler.z, obj.scale = obj.location.x + 5.0, 0.5, (2.0, 2.0, 2.0)
    volume.show(smoke(shot), first)
    smoke(shot).smokelift.box.rotation_euler.z = 0.7
    bpy.context.view_layer.update()
    volume.show(smoke(shot), made(tmp_path, number=2))
    assert obj.location.x == pytest.approx(5.0)
    assert (obj.rotation_euler.z, obj.scale.x) == pytest.approx((0.5, 2.0))


# what it is made of


def test_the_material_is_the_mediums(shot, tmp_path) -> None:
    """Extinction, albedo and anisotropy that were fitted; clipping and velocity as the files need them."""
    obj = volume.show(smoke(shot), made(tmp_path))
    inputs = look.node_of(obj).inputs
    values = {name: inputs[name].default_value for name in ("Extinction", "Anisotropy", "Density", "Brightness")}
    assert values == {"Extinction": 4.0, "Anisotropy": pytest.approx(0.3), "Density": 1.0, "Brightness": 1.0}
    assert list(inputs["Albedo"].default_value) == pytest.approx([0.8, 0.8, 0.8, 1.0])
    data = obj.data
    assert (data.velocity_grid, data.velocity_unit, data.render.clipping) == ("velocity", "SECOND", 0.0)
    assert data.display.density == 4.0


def part(what: str, how: str = "", origin: str = "made up", **settings: float) -> dict[str, object]:
    return {"what": what, "origin": origin, "how": how, "settings": settings}


def directed(what: str, kind: str, **figures: int | str) -> dict[str, object]:
    return {**part(what), "kind": kind, "figures": figures}


OLD = "Frames 7 to 11 are a simulation that starts from frame 6."
FRAMES_MADE = {"frame": 6, "first": 7, "last": 11}
CONTINUED = directed("continue", "simulated frames", **FRAMES_MADE, given="")
GIVEN = directed("continue", "simulated frames with given values", **FRAMES_MADE, given="buoyancy")
CHAIN = [CONTINUED, part("retime", "All frames."), directed("loop", "overlap of a loop", first=1, last=3)]
MADE = "degrees beside it. Made up: Depth Detail 0.5, Variation 3."


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ([part("velocity", origin="estimated"), part("detail", detail=0.5, seed=3)], MADE),
        ([part("velocity", origin="estimated")], "degrees beside it. Nothing is made up"),
        ([], ""),
        ([CONTINUED], "Frames 46 to 50 are a simulation that starts from frame 45, with"),
        ([GIVEN], "but with a given buoyancy."),
        ([part("continue", OLD)], OLD),
        (CHAIN[:2], "All frames. Before that: Continued."),
        (CHAIN, "In frames 40 to 42 the end of the loop becomes its start"),
        (CHAIN, "Before that: Continued, Retimed."),
    ],
)
def test_what_is_made_up_is_said(shot, tmp_path, parts, said) -> None:
    """With the clip's frames; those of earlier results are not said of what was made of them.

    Results of earlier versions have a sentence alone.
    """
    assert smoke(shot).data.get(volume.PROVENANCE, "") == ""
    take = made(tmp_path, used=[39, 44])
    with changed(take) as index:
        index["provenance"] = parts
    volume.show(smoke(shot), take)
    note = smoke(shot).data[volume.PROVENANCE]
    assert said in note and bool(note) == bool(parts)
    assert ("simulation" in note) == (len(parts) == 1 and parts[0]["what"] == "continue")
    volume.show(smoke(shot), made(tmp_path, number=2))
    assert smoke(shot).data.get(volume.PROVENANCE, "") == ""


def test_a_new_result_replaces_the_old_one_and_what_was_changed_of_its_material_stays(shot, tmp_path) -> None:
    """Also what was changed of the view; the rest is the new medium's."""
    obj = volume.show(smoke(shot), made(tmp_path))
    inputs = look.node_of(obj).inputs
    inputs["Density"].default_value, inputs["Albedo"].default_value = 3.0, (1.0, 0.5, 0.2, 1.0)
    obj.data.display.density = 1.5
    before = [len(kind) for kind in (bpy.data.objects, bpy.data.volumes, bpy.data.materials)]
    volume.show(smoke(shot), made(tmp_path, frames=3, medium=Medium(9.0, 0.5, -0.2), number=2))
    assert [len(kind) for kind in (bpy.data.objects, bpy.data.volumes, bpy.data.materials)] == before
    assert "take_0002" in obj.data.filepath and obj.data.frame_duration == 3
    assert (inputs["Density"].default_value, inputs["Extinction"].default_value) == (3.0, 9.0)
    assert list(inputs["Albedo"].default_value) == pytest.approx([1.0, 0.5, 0.2, 1.0])
    assert inputs["Anisotropy"].default_value == pytest.approx(-0.2)
    assert obj.data.display.density == 1.5


def test_it_survives_saving_and_loading(shot, settings, tmp_path) -> None:
    """Settings, smoke, material; the files are found relative to the .blend, also after the folder moved."""
    home = tmp_path / "home"
    home.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(home / "shot.blend"))
    settings.first, settings.last, settings.quality, settings.output = 3, 8, "fine", "//out"
    shot.render.fps, settings.speed = 48, "REAL"
    volume.show(smoke(shot), made(home / "out"))
    assert smoke(shot).data.filepath == "//out/take_0001/smoke_0001.vdb"
    bpy.ops.wm.save_mainfile()
    moved = home.rename(tmp_path / "moved")
    quietly(lambda: bpy.ops.wm.open_mainfile(filepath=str(moved / "shot.blend")))
    scene = bpy.context.scene
    settings = smoke(scene).smokelift
    assert (settings.first, settings.last, settings.quality, settings.output) == (3, 8, "fine", "//out")
    assert settings.clip.name == "clip.mp4"
    assert settings.box.name == "Box"
    assert volume.shown_take(smoke(scene)) == Take(moved / "out" / "take_0001")
    assert plays(scene, 5) == 1
    assert plays(scene, 7) == 2
    assert look.node_of(smoke(scene)).inputs["Extinction"].default_value == 4.0


def reopened(folder: Path) -> bpy.types.Scene:
    """Save the file in a folder and open it again; returns its scene."""
    folder.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "shot.blend"))
    quietly(lambda: bpy.ops.wm.open_mainfile(filepath=str(folder / "shot.blend")))
    return bpy.context.scene


@pytest.mark.parametrize("saved_first", [False, True])
def test_deleting_earlier_results_spares_what_is_on_show(shot, tmp_path, saved_first) -> None:
    """Whichever Volume of the file shows it, and however Blender writes the way to an output beside its folder."""
    output = tmp_path / "elsewhere"
    smoke(shot).smokelift.output = str(output)
    if saved_first:
        shot = reopened(tmp_path / "shot")
    for number in (1, 2, 3):
        made(output, number=number).request_file.write_text('{"files": []}')
    copy = volume.show(smoke(shot), Take(output / "take_0002")).copy()
    copy.data = copy.data.copy()
    shot.collection.objects.link(copy)
    volume.show(smoke(shot), Take(output / "take_0003"))
    shot = reopened(tmp_path / "later")
    assert bpy.ops.smokelift.remove_takes() == {"FINISHED"}
    assert sorted(path.name for path in output.iterdir() if path.is_dir()) == ["take_0002", "take_0003"]
    assert plays(shot, 3) == 3


def test_setting_up_keeps_the_plate_by_a_relative_path_and_no_old_world(shot, tmp_path) -> None:
    """The project can be moved; the artist who takes another world and sets up again finds one world of ours."""
    plate = tmp_path / "plate.png"
    write_image(plate, np.full((16, 16, 3), 0.2, np.float32))
    shot = reopened(tmp_path / "shot")
    volume.show(smoke(shot), made(tmp_path / "out", camera=TRACKED, background={"image": str(plate)}))
    own = shot.world
    for _ in range(3):
        shot.world = own
        shot_setup.set_up(smoke(shot))
    (image,) = (image for image in bpy.data.images if image.name == "plate.png")
    assert image.filepath == "//../plate.png"
    assert sorted(world.name for world in bpy.data.worlds) == ["Smokelift", "World"]


# the camera that is assumed


@pytest.mark.parametrize("size", [(256, 384), (384, 256)])
def test_an_assumed_camera_is_made(shot, tmp_path, size) -> None:
    from bpy_extras.object_utils import world_to_camera_view

    own = shot.camera
    smoke(shot).smokelift.camera_mode = "ESTIMATE"
    shot.render.resolution_x, shot.render.resolution_y = size
    camera = Camera.look_at((0.0, -5.0, 1.0), (0.0, 0.0, 1.0), fov_y_degrees=30.0, size=size)
    take = made(tmp_path, camera=scene_to_dict(Scene(camera=camera))["camera"])
    for _ in range(2):
        smoke_takes.present(smoke(shot), take)
    assert shot.camera == own
    (obj,) = (obj for obj in shot.objects if obj.type == "CAMERA" and obj != own)
    bpy.context.view_layer.update()
    place = world_to_camera_view(shot, obj, Vector((0.3, 0.5, 1.4)))
    column = camera.cx + camera.fx * 0.3 / 5.5
    row = camera.cy - camera.fy * 0.4 / 5.5
    assert (place.x * size[0], (1 - place.y) * size[1]) == pytest.approx((column, row), abs=1e-3)
    assert math.isclose(obj.data.lens, camera.fx * 36 / max(size), rel_tol=1e-5)
    shot.camera = None
    smoke_takes.present(smoke(shot), take)
    assert shot.camera == obj
