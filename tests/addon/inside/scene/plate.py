"""The plate as a projection: from where the clip was filmed it is the clip's, and it stays when the camera moves."""

from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Matrix, Vector

from addon.core.take import Take
from addon.scene import plate, volume
from conftest import changed, made, rendered
from smokelift.output.images import write_image
from smokelift.scene import Camera, Scene, scene_to_dict
from tests.example_shot import add, add_sun, smoke

WIDTH, HEIGHT = 48, 32
BEFORE = Camera.look_at((0.3, -6.0, 2.5), (0.0, 0.0, 1.5), fov_y_degrees=40, size=(WIDTH, HEIGHT))
TABLE = scene_to_dict(Scene(camera=BEFORE))["camera"]


def picture(shift: int = 0) -> np.ndarray:
    """Smooth colors that differ everywhere, so that a shift shows (linear light)."""
    x, y = np.meshgrid(np.linspace(0, 1, WIDTH), np.linspace(0, 1, HEIGHT))
    colors = np.stack([x, y, 0.5 + 0.3 * np.sin(9 * x + shift)], -1)
    return (0.1 + 0.6 * colors).astype(np.float32)


def filmed(scene: bpy.types.Scene, folder: Path, table: dict | None = None, plates: int = 1) -> bpy.types.Scene:
    """A smoke, not rendered, with a take that was filmed by a camera; the scene's camera stands there."""
    for number in range(1, 7):
        write_image(folder / f"clip_{number:04d}.png", picture())
    for number in range(1, plates + 1):
        write_image(folder / f"plate_{number:04d}.exr", picture(number - 1))
    background = {"image": str(folder / "plate_0001.exr")}
    take = made(folder / "out", used=[0, 5], camera=table or TABLE, background=background)
    settings = smoke(scene).smokelift
    settings.clip = bpy.data.movieclips.load(str(folder / "clip_0001.png"))
    settings.light_mode, settings.plate_place = "SCENE", "PROJECTION"
    volume.show(smoke(scene), take)
    smoke(scene).hide_render = True
    scene.cycles.samples, scene.cycles.use_denoising = 16, False
    assert bpy.ops.smokelift.set_up() == {"FINISHED"}
    return scene


def card(scene: bpy.types.Scene) -> bpy.types.Object:
    return scene.objects[plate.CARD]


def test_from_the_clips_camera_it_is_the_clips_plate(scene, tmp_path) -> None:
    found = rendered(filmed(scene, tmp_path), tmp_path / "found.exr")
    assert found == pytest.approx(picture(), abs=0.02)


def test_an_off_center_lens_and_a_tall_pixel(scene, tmp_path) -> None:
    filmed(scene, tmp_path, TABLE | {"cx": 30.0, "cy": 11.0})
    scene.camera = scene.objects[plate.PROJECTOR]
    assert rendered(scene, tmp_path / "found.exr") == pytest.approx(picture(), abs=0.02)


def test_it_stays_when_the_camera_moves(scene, tmp_path) -> None:
    """A point of the card has its color from anywhere; in the world the plate moves with the camera."""
    filmed(scene, tmp_path)
    obj = card(scene)
    scene.camera.location += Vector((1.2, 0.3, 0.4))
    scene.camera.rotation_euler.rotate(Matrix.Rotation(0.1, 3, "Z"))
    bpy.context.view_layer.update()
    moved = rendered(scene, tmp_path / "moved.exr")
    assert np.abs(moved - picture()).mean() > 0.03
    # what the moved camera sees at a pixel, by hand: where its ray meets the card, and where the clip shows that
    camera, checked = scene.camera, 0
    normal, on_card = obj.matrix_world.to_3x3().col[2], obj.matrix_world.translation
    for row, column in ((8, 10), (16, 24), (20, 6), (12, 30)):
        ray = Vector(((column + 0.5 - WIDTH / 2) / BEFORE.fx, (HEIGHT / 2 - row - 0.5) / BEFORE.fx, -1.0))
        ray = camera.matrix_world.to_3x3() @ ray
        origin = camera.matrix_world.translation
        point = origin + ray * ((on_card - origin).dot(normal) / ray.dot(normal))
        seen = Matrix(TABLE["matrix"]).inverted() @ point
        u, v = BEFORE.cx - BEFORE.fx * seen.x / seen.z, BEFORE.cy + BEFORE.fy * seen.y / seen.z
        if 1 <= u < WIDTH - 1 and 1 <= v < HEIGHT - 1:
            wanted = picture()[int(v), int(u)]
            assert moved[row, column] == pytest.approx(wanted, abs=0.04)
            checked += 1
    assert checked >= 3


def test_a_camera_that_moved_projects_each_frame_from_its_place(scene, tmp_path) -> None:
    poses = []
    for step in range(6):
        at = Camera.look_at((0.3 * step, -6.0, 2.5), (0.1 * step, 0.0, 1.5), fov_y_degrees=40, size=(WIDTH, HEIGHT))
        poses.append([list(row) for row in at.matrix])
    table = {key: value for key, value in TABLE.items() if key != "matrix"} | {"matrices": poses}
    scene.camera = add(scene, "Camera", bpy.data.cameras.new("Camera"))
    smoke(scene).smokelift.set_up_camera = False  # it needs an assumed one
    filmed(scene, tmp_path, table, plates=6)
    scene.camera = scene.objects[plate.PROJECTOR]
    for frame in (1, 4):
        scene.frame_set(frame)
        at = scene.camera.matrix_world
        assert np.allclose(np.array(at), np.array(poses[frame - 1]), atol=1e-5)
        assert rendered(scene, tmp_path / "found.exr") == pytest.approx(picture(frame - 1), abs=0.02)


def test_it_neither_lights_the_smoke_nor_shades_it(scene, tmp_path) -> None:
    filmed(scene, tmp_path)
    smoke(scene).hide_render = False
    card(scene).hide_render = True
    add_sun(scene, 10.0)
    scene.frame_set(3)
    alone = rendered(scene, tmp_path / "alone.exr")
    other = add(scene, "Roof", card(scene).data)
    other.location.z, other.visible_camera = 3.6, False
    assert rendered(scene, tmp_path / "roofed.exr") == pytest.approx(alone, abs=0.02)
    assert alone.max() > 0.1


def test_one_color(scene, tmp_path) -> None:
    filmed(scene, tmp_path)
    take = volume.shown_take(smoke(scene))
    assert isinstance(take, Take)
    with changed(take) as index:
        index["scene"]["background"] = {"color": [0.5, 0.1, 0.0]}
    bpy.ops.smokelift.set_up()
    assert rendered(scene, tmp_path / "found.exr")[5, 5] == pytest.approx([0.5, 0.1, 0.0], abs=0.01)
