"""From the Blender scene to the scene file: against Blender's own projection, and the engine's."""

import math
from pathlib import Path

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Euler, Matrix, Vector

from addon.core import ShotError
from addon.core.contract import BOX_VOXELS
from addon.core.take import Take
from addon.scene.geometry import box_corners, engine_to_world
from addon.scene.scene_file import options, shot_tables
from conftest import save_image
from smokelift.scene import Scene
from smokelift.scene.camera import project_points
from tests.example_shot import EXAMPLE, add, smoke


def engines(scene: bpy.types.Scene, folder: Path) -> Scene:
    """The scene as the engine reads it, through a file."""
    take = Take(folder / "take_0001")
    take.write(shot_tables(smoke(scene)), [])
    return Scene.load(take.scene_file)


def refusal(scene: bpy.types.Scene) -> str:
    with pytest.raises(ShotError) as caught:
        shot_tables(smoke(scene))
    return str(caught.value)


@pytest.fixture
def picture(shot, tmp_path):
    """Gives the shot a clip (of one picture) of another size, and the same render size."""

    def of_size(width: int, height: int) -> bpy.types.Scene:
        save_image(tmp_path / "picture.png", (width, height))
        smoke(shot).smokelift.clip = bpy.data.movieclips.load(str(tmp_path / "picture.png"))
        shot.render.resolution_x, shot.render.resolution_y = width, height
        smoke(shot).smokelift.plate_mode = "ESTIMATE"
        return shot

    return of_size


# camera


@pytest.mark.parametrize("size", [(256, 384), (640, 360), (300, 300)], ids=["portrait", "landscape", "square"])
@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
@pytest.mark.parametrize(
    "lens",
    [
        {"lens": 50.0},
        {"lens": 18.0, "sensor_width": 23.5, "sensor_height": 15.6},
        {"lens": 35.0, "shift_x": 0.13, "shift_y": -0.21},
        {"type": "ORTHO", "ortho_scale": 5.0, "shift_x": -0.1},
    ],
    ids=["plain", "small-sensor", "shifted", "orthographic"],
)
def test_points_fall_where_blender_sees_them(picture, tmp_path, size, fit, lens) -> None:
    scene = picture(*size)
    data = scene.camera.data
    data.sensor_fit = fit
    for name, value in lens.items():
        setattr(data, name, value)
    agree(scene, tmp_path)


@pytest.mark.parametrize("aspect", [(2.0, 1.0), (1.0, 1.5)])
def test_pixels_that_are_not_square_and_a_camera_that_is_turned_scaled_and_parented(picture, tmp_path, aspect) -> None:
    scene = picture(320, 240)
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = aspect
    scene.camera.data.shift_x = 0.1
    agree(scene, tmp_path)
    parent = add(scene, "Parent", None)
    parent.location, parent.rotation_euler, parent.scale = (1.0, 2.0, 0.5), (0.0, 0.0, 0.3), (2.0, 2.0, 2.0)
    scene.camera.parent = parent
    scene.camera.matrix_world = Matrix.LocRotScale((2.0, -6.0, 3.0), Euler((1.35, 0.05, 0.3)), (3.0, 3.0, 3.0))
    agree(scene, tmp_path)


def agree(scene: bpy.types.Scene, folder: Path) -> Scene:
    """Compare the picture's places of the box's corners, and of points inside, in pixels of the clip."""
    read, to_engine = engines(scene, folder), engine_to_world(smoke(scene)).inverted()
    points = [*box_corners(smoke(scene).smokelift.box), Vector((0.1, 0.2, 1.1)), Vector((-0.4, 0.3, 2.0))]
    found, _ = project_points(read.camera, np.array([to_engine @ point for point in points]))
    width, height = smoke(scene).smokelift.clip.size
    assert read.camera.size == (width, height)
    seen = [world_to_camera_view(scene, scene.camera, point) for point in points]
    wanted = np.array([(place.x * width, (1.0 - place.y) * height) for place in seen])
    np.testing.assert_allclose(found, wanted, atol=1e-3 * max(1.0, np.abs(wanted).max() / 1000))
    return read


# a camera that moves


@pytest.fixture
def tracked(shot) -> bpy.types.Scene:
    """The example's camera on a parent that is driven by, turned to something by a constraint, before black."""
    dolly = add(shot, "Dolly", None)
    for frame, place in ((1, (-0.5, 0.0, 0.0)), (48, (0.5, 0.3, 0.2))):
        dolly.location = place
        dolly.keyframe_insert("location", frame=frame)
    shot.camera.parent = dolly
    look = shot.camera.constraints.new("TRACK_TO")
    look.target = add(shot, "Target", None)
    look.target.location = (0.0, 0.0, 1.5)
    look.track_axis, look.up_axis = "TRACK_NEGATIVE_Z", "UP_Y"
    smoke(shot).smokelift.plate_mode = "ESTIMATE"
    smoke(shot).smokelift.first, smoke(shot).smokelift.last = 11, 30
    return shot


@pytest.mark.parametrize("angle", [0.0, 0.5])
def test_a_camera_that_moves_has_a_matrix_for_every_frame(tracked, tmp_path, angle) -> None:
    smoke(tracked).smokelift.box.rotation_euler = (0.0, 0.0, angle)
    tracked.frame_set(7, subframe=0.5)
    camera = engines(tracked, tmp_path).camera
    assert (tracked.frame_current, tracked.frame_subframe) == (7, 0.5)
    assert len(camera.matrices) == 20
    for index, frame in enumerate(range(11, 31)):
        tracked.frame_set(frame)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        wanted = engine_to_world(smoke(tracked)).inverted() @ tracked.camera.evaluated_get(depsgraph).matrix_world
        np.testing.assert_allclose(camera.matrices[index], wanted, atol=1e-5)


def test_one_picture_is_no_clean_plate_of_a_moving_camera(tracked, tmp_path) -> None:
    settings = smoke(tracked).smokelift
    settings.plate_mode = "FILE"
    assert "one picture cannot" in refusal(tracked)
    first = tmp_path / "plate_0001.png"
    first.write_bytes((EXAMPLE / "plate.png").read_bytes())
    for plate in (first, EXAMPLE / "clip.mp4"):
        settings.plate = str(plate)
        assert shot_tables(smoke(tracked))["background"] == {"image": str(plate)}


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda s, own: setattr(s, "camera", None), "no camera"),
        (lambda s, own: setattr(s.camera.data, "type", "PANO"), "panoramic"),
        (lambda s, own: setattr(s.render, "resolution_x", 1920), "Match Scene to Clip"),
        (lambda s, own: setattr(own, "clip", None), "Choose a clip"),
        (lambda s, own: setattr(own, "last", 49), "frames 1 to 48"),
        (lambda s, own: setattr(own, "first", 30) or setattr(own, "last", 20), "Frames 30 to 20"),
        (lambda s, own: setattr(own, "plate", ""), "Choose the clean plate"),
        (lambda s, own: setattr(own, "plate", "//none.png"), "none.png is not there"),
        (lambda s, own: setattr(own, "mask", "//mask.png"), "mask.png is not there"),
        (lambda s, own: setattr(own, "box", None), "Make Box"),
        (lambda s, own: setattr(own.box, "scale", (1.0, 0.0, 1.0)), "flat"),
        (lambda s, own: setattr(own.box, "location", (30.0, 0.0, 1.5)), "not in the camera's picture"),
        (lambda s, own: setattr(own.box, "location", (0.0, -30.0, 1.5)), "not in the camera's picture"),
        (lambda s, own: setattr(s.camera, "scale", (1.0, 1.0, -1.0)), "mirrored"),
        (lambda s, own: setattr(own.clip, "filepath", "//moved.mp4"), "moved.mp4 is not there"),
        (lambda s, own: bpy.data.objects.remove(bpy.data.objects["Sun"]), "no sun"),
        (lambda s, own: setattr(add_lamp(s, "POINT"), "location", (0.0, 0.0, 1.0)), "inside the box"),
        (lambda s, own: setattr(add_lamp(s, "AREA"), "name", "Window"), "Window cannot be used"),
        (lambda s, own: zoom(s.camera.data), "camera zooms"),
        (lambda s, own: setattr(add_inlet(s), "location", (0.0, 0.0, -2.0)), "inlet is outside the box"),
        (lambda s, own: setattr(add_inlet(s), "scale", (0.0, 0.0, 0.0)), "inlet has no size"),
    ],
)
def test_what_is_missing_is_said(shot, settings, spoil, words) -> None:
    shot_tables(smoke(shot))
    spoil(shot, settings)
    bpy.context.view_layer.update()
    assert words in refusal(shot)


# clip


def test_a_picture_sequence_has_the_scenes_rate(shot, tmp_path) -> None:
    for number in range(7, 12):
        (tmp_path / f"smoke_{number:03d}.png").write_bytes((EXAMPLE / "plate.png").read_bytes())
    smoke(shot).smokelift.clip = bpy.data.movieclips.load(str(tmp_path / "smoke_007.png"))
    shot.render.fps, shot.render.fps_base = 30, 1.001
    table = shot_tables(smoke(shot))["clip"]
    assert table["frames"] == [0, 4]
    assert table["path"].endswith("smoke_007.png")
    assert table["fps"] == pytest.approx(30 / 1.001)
    smoke(shot).smokelift.fps = 120.0
    smoke(shot).smokelift.transfer = "linear"
    table = shot_tables(smoke(shot))["clip"]
    assert (table["fps"], table["transfer"]) == (120.0, "linear")


def test_the_clips_color_space_counts_or_is_refused(shot) -> None:
    for space, transfer in (("sRGB", None), ("Linear Rec.709", "linear"), ("Non-Color", "linear")):
        smoke(shot).smokelift.clip.colorspace_settings.name = space
        assert shot_tables(smoke(shot))["clip"].get("transfer") == transfer
    smoke(shot).smokelift.clip.colorspace_settings.name = "Filmic Log"
    assert "Filmic Log" in refusal(shot)
    smoke(shot).smokelift.transfer = "srgb"
    assert shot_tables(smoke(shot))["clip"]["transfer"] == "srgb"


def test_paths_beside_the_blend(shot, tmp_path) -> None:
    for name in ("clip.mp4", "plate.png"):
        (tmp_path / name).write_bytes((EXAMPLE / name).read_bytes())
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    smoke(shot).smokelift.clip.filepath, smoke(shot).smokelift.plate = "//clip.mp4", "//plate.png"
    smoke(shot).smokelift.mask = "//masks/mask_####.png"
    tables = shot_tables(smoke(shot))
    assert tables["clip"]["path"] == str(tmp_path / "clip.mp4")
    assert tables["clip"]["mask"] == str(tmp_path / "masks" / "mask_####.png")
    assert tables["background"]["image"] == str(tmp_path / "plate.png")


# box


def test_the_box_becomes_cubes(shot, tmp_path) -> None:
    """The engine chooses how many in these proportions; the box holds all of the user's, and keeps its floor."""
    domain = engines(shot, tmp_path).domain
    assert max(domain.resolution) == BOX_VOXELS
    assert all(low <= -1.0 + 1e-6 for low in domain.min[:2])
    assert all(high >= 1.0 - 1e-6 for high in domain.max[:2])
    assert (domain.min[2], domain.max[2]) == pytest.approx((0.0, 3.0))
    assert domain.centre[:2] == pytest.approx((0.0, 0.0))


def test_a_resolution_that_is_left_open_is_measured(shot) -> None:
    assert options(smoke(shot))[-2:] == ["--resolution", "auto"]
    smoke(shot).smokelift.longest_side = 40
    assert "--resolution" not in options(smoke(shot))
    smoke(shot).smokelift.longest_side, smoke(shot).smokelift.camera_mode = 0, "ESTIMATE"
    assert "--resolution" not in options(smoke(shot))


def test_a_turned_box_turns_everything_else(shot, tmp_path) -> None:
    """The engine sees the same picture: points of the box, in its own axes, fall where Blender sees them."""
    box = smoke(shot).smokelift.box
    box.rotation_euler = (0.2, -0.1, 0.5)
    bpy.context.view_layer.update()
    found, world = agree(shot, tmp_path), engine_to_world(smoke(shot))
    corners = np.array([world.inverted() @ corner for corner in box_corners(box)])
    low, high = corners.min(0), corners.max(0)
    assert (np.array(found.domain.min) <= low + 1e-5).all()
    assert (np.array(found.domain.max) >= high - 1e-5).all()
    direction = world.to_3x3() @ Vector(found.lights[0].direction)
    assert direction.dot(Vector((0.57, 0.46, -0.68)).normalized()) == pytest.approx(1.0)


def add_lamp(scene: bpy.types.Scene, kind: str) -> bpy.types.Object:
    """A lamp that alone is rendered."""
    bpy.data.objects["Sun"].hide_render = True
    return add(scene, "Lamp", bpy.data.lights.new("Lamp", kind))


def zoom(lens: bpy.types.Camera) -> None:
    lens.keyframe_insert("lens", frame=1)
    lens.lens *= 1.2
    lens.keyframe_insert("lens", frame=40)


def add_inlet(scene: bpy.types.Scene) -> bpy.types.Object:
    """An Empty in the smoke, drawn 0.2 m large."""
    inlet = smoke(scene).smokelift.inlet = add(scene, "Inlet", None)
    inlet.location, inlet.empty_display_size = (0.1, -0.2, 0.3), 0.2
    return inlet


def test_closed_sides(shot, tmp_path) -> None:
    """Of the box that is given, and of one that is found, even where the scene's lights are used."""
    assert engines(shot, tmp_path).closed == ()
    smoke(shot).smokelift.closed = {"x+", "z-"}
    assert engines(shot, tmp_path).closed == ("x+", "z-")
    smoke(shot).smokelift.closed = {"z-"}
    smoke(shot).smokelift.camera_mode = "ESTIMATE"
    add(shot, "Lamp", bpy.data.lights.new("Lamp", "POINT"))
    assert shot_tables(smoke(shot))["domain"] == {"closed": ["z-"]}
    found = engines(shot, tmp_path)
    assert (found.domain, found.closed) == (None, ("z-",))


def test_an_inlet(shot, tmp_path) -> None:
    """Where the Empty is and as large as it is drawn, in the axes of the box; no more once it is deleted."""
    assert engines(shot, tmp_path).inlets == ()
    inlet = add_inlet(shot)
    inlet.scale = (1.0, 1.0, 1.5)
    smoke(shot).smokelift.box.rotation_euler = (0.2, -0.1, 0.5)
    bpy.context.view_layer.update()
    (found,) = engines(shot, tmp_path).inlets
    assert found.radius == pytest.approx(0.3)
    assert list(engine_to_world(smoke(shot)) @ Vector(found.centre)) == pytest.approx([0.1, -0.2, 0.3], abs=1e-6)
    bpy.data.objects.remove(inlet)
    assert engines(shot, tmp_path).inlets == ()


def test_a_distance(shot, settings) -> None:
    """Said to the engine if it is given, unless an inlet says it; by hand it begins at the middle of the box."""
    assert not any(word.startswith("--distance") for word in options(smoke(shot)))
    bpy.context.view_layer.update()
    settings.use_distance = True
    assert "--distance=7" in options(smoke(shot))
    settings.distance = 6.75
    assert "--distance=6.75" in options(smoke(shot))
    add_inlet(shot)
    assert not any(word.startswith("--distance") for word in options(smoke(shot)))
    settings.use_distance = False
    assert settings.distance == 0.0


# lights


def lights(scene: bpy.types.Scene) -> list[dict]:
    bpy.context.view_layer.update()
    return shot_tables(smoke(scene))["lights"]


def test_a_sun(shot) -> None:
    sun = bpy.data.objects["Sun"]
    sun.data.color = (1.0, 0.5, 0.25)
    sun.scale = (3.0, 3.0, 3.0)
    (table,) = lights(shot)
    assert table["type"] == "directional"
    assert table["irradiance"] == pytest.approx([20.0, 10.0, 5.0])
    assert table["direction"] == pytest.approx(list(Vector((0.57, 0.46, -0.68)).normalized()), abs=1e-6)


def test_a_point_light(shot) -> None:
    lamp = add(shot, "Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.location, lamp.data.energy = (2.0, -3.0, 4.0), 400.0
    table = next(table for table in lights(shot) if table["type"] == "point")
    assert table["position"] == pytest.approx([2.0, -3.0, 4.0])
    assert table["intensity"] == pytest.approx([400.0 / (4 * math.pi)] * 3)


@pytest.fixture
def panorama(shot, tmp_path):
    """A world lit by a picture; returns the picture's node."""
    tree = shot.world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = save_image(tmp_path / "sky.exr", (16, 8))
    tree.links.new(node.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    tree.nodes["Background"].inputs["Strength"].default_value = 1.5
    return node


def test_a_world_picture_that_is_turned(shot, panorama, tmp_path) -> None:
    """The Mapping node's rotation is applied to the direction that is looked up; the box's comes before it."""
    table = {"type": "environment", "image": str(tmp_path / "sky.exr"), "strength": 1.5}
    assert lights(shot)[-1] == table | {"rotation_degrees": pytest.approx(0.0)}
    tree = shot.world.node_tree
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value[2] = math.radians(30.0)
    tree.links.new(mapping.outputs[0], panorama.inputs["Vector"])
    assert lights(shot)[-1]["rotation_degrees"] == pytest.approx(30.0)
    mapping.vector_type = "TEXTURE"
    assert lights(shot)[-1]["rotation_degrees"] == pytest.approx(-30.0)
    smoke(shot).smokelift.box.rotation_euler[2] = math.radians(10.0)
    assert lights(shot)[-1]["rotation_degrees"] == pytest.approx(-20.0)
    smoke(shot).smokelift.box.rotation_euler[0] = math.radians(10.0)
    bpy.context.view_layer.update()
    assert "tilted" in refusal(shot)


def test_world_pictures_that_cannot_be_used(shot, panorama) -> None:
    panorama.projection = "MIRROR_BALL"
    assert "cannot be used" in refusal(shot)
    panorama.projection = "EQUIRECTANGULAR"
    panorama.image.filepath = "//gone.exr"
    assert "gone.exr is not there" in refusal(shot)
    panorama.image.filepath = "//sky.jpg"
    assert "cannot be used" in refusal(shot)


# medium


def test_a_medium_of_ones_own(shot, settings, tmp_path) -> None:
    assert engines(shot, tmp_path).medium is None
    settings.use_medium, settings.extinction, settings.albedo, settings.anisotropy = True, 7.0, 0.5, -0.25
    medium = engines(shot, tmp_path).medium
    assert (medium.extinction, medium.albedo, medium.anisotropy) == (7.0, 0.5, -0.25)


def with_camera_at(scene: bpy.types.Scene, y: float) -> dict:
    """The domain for a camera so far along Y, before a box that cubes do not fill: from -1 to 1, 4.5 cubes of 4."""
    smoke(scene).smokelift.box.scale = (1.0, 1.0, 1.777)
    scene.camera.location.y = y
    bpy.context.view_layer.update()
    return shot_tables(smoke(scene))["domain"]


def test_a_camera_beside_the_box_is_not_inside_it(shot) -> None:
    far = with_camera_at(shot, -7.0)
    assert far["min"][1] < -1.0
    for y in (-1.0, float(np.nextafter(np.float32(-1.0), np.float32(0.0))), far["min"][1] * 0.5 - 0.5):
        near = with_camera_at(shot, y)
        assert near["min"][1] > y
        assert near["resolution"] == far["resolution"]
        assert near["min"][1] == pytest.approx(-1.0, abs=1e-3)
        assert near["max"][1] - near["min"][1] == pytest.approx(far["max"][1] - far["min"][1])
    with pytest.raises(ShotError):
        with_camera_at(shot, -0.9)
