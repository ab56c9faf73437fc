"""Setting up a shot in parts, and the smoke over its clip in the compositor."""

import bpy
import numpy as np
import pytest

from addon.scene import compositing, plate, volume
from conftest import changed, made, pixels, rendered, ticked
from smokelift.footage.images import srgb_to_linear
from smokelift.output.images import write_image
from tests.example_shot import add_camera, add_sun, smoke

PLATE = 0.2
SIZE = 32
NOISE = 0.05


@pytest.fixture
def filmed(scene, tmp_path) -> bpy.types.Scene:
    """Smoke of `made` in front of a gray plate, its clip the plate with grain; the camera sees the floor below it."""
    rng = np.random.default_rng(0)
    for frame in range(1, 7):
        grain = rng.normal(0.0, NOISE, (SIZE, SIZE, 3)).astype(np.float32)
        write_image(tmp_path / f"clip_{frame:04d}.png", np.clip(PLATE + grain, 0.0, 1.0))
    write_image(tmp_path / "plate.png", np.full((SIZE, SIZE, 3), PLATE, np.float32))
    take = made(tmp_path / "out", camera={}, background={"image": str(tmp_path / "plate.png")})
    add_camera(scene, (0.4, -5.0, 3.5), (1.2, 0.0, 0.0))
    add_sun(scene, 40.0)
    settings = smoke(scene).smokelift
    settings.clip = bpy.data.movieclips.load(str(tmp_path / "clip_0001.png"))
    settings.camera_mode, settings.light_mode, settings.plate_place = "SCENE", "SCENE", "COMPOSITE"
    volume.show(smoke(scene), take)
    scene.cycles.samples, scene.cycles.use_denoising = 16, False
    scene.frame_set(3)
    return scene


def shown(scene: bpy.types.Scene, tmp_path, **inputs: float) -> np.ndarray:
    """The composite with some inputs of the group, after setting up."""
    assert bpy.ops.smokelift.set_up() == {"FINISHED"}
    node = tree(scene).nodes[compositing.GROUP]
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    return rendered(scene, tmp_path / "composite.exr")


def tree(scene: bpy.types.Scene) -> bpy.types.NodeTree:
    return scene.compositing_node_group if compositing.SINCE_5 else scene.node_tree


def test_the_plate_is_behind_the_smoke_and_its_shadow(filmed, tmp_path) -> None:
    found = shown(filmed, tmp_path, Grain=0.0)
    assert filmed.render.film_transparent
    assert found[SIZE * 3 // 4 :].min() < 0.7 * PLATE
    assert found.max() > 1.2 * PLATE
    assert np.median(found) == pytest.approx(PLATE, abs=0.01)
    smoke(filmed).hide_render = True
    assert shown(filmed, tmp_path, Grain=0.0) == pytest.approx(np.full_like(found, PLATE), abs=0.01)


@pytest.mark.parametrize(("scale", "strength", "correlation"), [(1, 0.92, 0.9), (4, 0.75, 0.8)])
def test_grain_is_the_clips(filmed, tmp_path, scale, strength, correlation) -> None:
    """A pixel of the clip may be several of the render: between them even white noise has coarse parts, no grain."""
    smoke(filmed).hide_render = True
    filmed.render.resolution_percentage = 100 * scale
    still = shown(filmed, tmp_path, Grain=0.0)
    grain = shown(filmed, tmp_path, Grain=1.0) - still
    clip = shown(filmed, tmp_path, Foreground=1.0)
    wanted = clip - PLATE
    assert grain.std() == pytest.approx(strength * wanted.std(), rel=0.08)
    assert np.corrcoef(grain.ravel(), wanted.ravel())[0, 1] > correlation
    assert shown(filmed, tmp_path, Foreground=0.0, Grain=2.0).std() > 1.5 * grain.std()


def test_the_clip_is_in_front_where_the_mask_says_so(filmed, tmp_path) -> None:
    found = shown(filmed, tmp_path, Foreground=1.0)
    assert found == pytest.approx(srgb_to_linear(pixels(tmp_path / "clip_0003.png")[..., :3]), abs=0.01)


def test_what_is_held_out_hides_the_smoke(filmed, tmp_path) -> None:
    bpy.ops.smokelift.set_up()
    mesh = bpy.data.meshes.new("Wall")
    mesh.from_pydata([(-9, 0, -9), (9, 0, -9), (9, 0, 9), (-9, 0, 9)], [], [(0, 1, 2, 3)])
    wall = bpy.data.objects.new("Wall", mesh)
    wall.location.y = -3.0
    bpy.data.collections[compositing.HOLDOUTS].objects.link(wall)
    found = shown(filmed, tmp_path, Grain=0.0)
    assert found == pytest.approx(np.full_like(found, PLATE), abs=0.01)


def test_a_second_time_adds_nothing(filmed) -> None:
    bpy.ops.smokelift.set_up()
    nodes = tree(filmed).nodes
    group = nodes[compositing.GROUP]
    own = nodes.new("CompositorNodeRGB")
    nodes.remove(nodes[f"{compositing.GROUP} Plate"])
    tree(filmed).links.new(own.outputs[0], group.inputs["Plate"])
    filmed.objects[compositing.FLOOR].location.z = -1.0
    kinds = (bpy.data.objects, bpy.data.node_groups, bpy.data.collections, bpy.data.images, nodes, tree(filmed).links)
    before = [len(kind) for kind in kinds]
    bpy.ops.smokelift.set_up()
    assert [len(kind) for kind in kinds] == before
    assert group.inputs["Plate"].links[0].from_node == own
    assert filmed.objects[compositing.FLOOR].location.z == -1.0


def test_the_artists_compositor_comes_first(filmed) -> None:
    if compositing.SINCE_5:
        own = filmed.compositing_node_group = bpy.data.node_groups.new("Own", "CompositorNodeTree")
        own.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        output = own.nodes.new("NodeGroupOutput")
    else:
        filmed.use_nodes = True
        own = filmed.node_tree
        own.nodes.clear()
        output = own.nodes.new("CompositorNodeComposite")
    blur = own.nodes.new("CompositorNodeBlur")
    own.links.new(own.nodes.new("CompositorNodeRLayers").outputs["Image"], blur.inputs["Image"])
    own.links.new(blur.outputs[0], output.inputs[0])
    bpy.ops.smokelift.set_up()
    assert tree(filmed) == own
    group = own.nodes[compositing.GROUP]
    assert group.inputs["Render"].links[0].from_node == blur
    assert output.inputs[0].links[0].from_node == group


def state(scene: bpy.types.Scene) -> dict[str, object]:
    """What each tick changes."""
    return {
        "range": (scene.render.resolution_x, scene.frame_end),
        "camera": scene.camera.data.show_background_images,
        "light": scene.render.engine,
        "colors": scene.view_settings.view_transform,
        "plate": scene.world is not None and "Smokelift" in scene.world.node_tree.nodes,
    }


@pytest.mark.parametrize("part", ["range", "camera", "light", "colors", "plate"])
def test_each_tick_sets_up_its_part_alone(filmed, part) -> None:
    ticked(smoke(filmed), part).plate_place = "WORLD"
    filmed.render.engine, filmed.view_settings.view_transform = "BLENDER_WORKBENCH", "Raw"
    before = state(filmed)
    assert bpy.ops.smokelift.set_up() == {"FINISHED"}
    after = state(filmed)
    assert [name for name in before if before[name] != after[name]] == [part]


PLANES = (compositing.FLOOR, plate.CARD)
PLACES = ("WORLD", "COMPOSITE", "PROJECTION")


def traces(scene: bpy.types.Scene) -> dict[str, object]:
    """What the three places of a plate change, as it counts in a render."""
    nodes = tree(scene).nodes if tree(scene) is not None else {}
    of_world = scene.world.node_tree if scene.world is not None else None
    world = of_world.nodes if of_world is not None else {}  # before 5.0 a new world has none
    return {
        "film": scene.render.film_transparent,
        "engine": scene.render.engine,
        "composited": compositing.GROUP in nodes and not nodes[compositing.GROUP].mute,
        "world": "Smokelift" in world and not world["Smokelift"].mute,
        "held out": any(each.holdout for each in scene.view_layers[0].layer_collection.children),
        "objects": {obj.name for obj in scene.objects if obj.name in PLANES and not obj.hide_render},
    }


@pytest.fixture
def plates(filmed) -> bpy.types.Scene:
    """`filmed` with a camera that a plate can be projected from, few pixels, and no other part ticked."""
    ticked(smoke(filmed), "plate")
    bpy.context.view_layer.update()
    table = {"type": "perspective", "size": [SIZE, SIZE], "fx": 40.0, "fy": 40.0, "cx": SIZE / 2, "cy": SIZE / 2}
    with changed(volume.shown_take(smoke(filmed))) as index:
        index["scene"]["camera"] = table | {"matrix": [list(row) for row in filmed.camera.matrix_world]}
    filmed.render.resolution_x = filmed.render.resolution_y = SIZE
    filmed.world = bpy.data.worlds.new("Own")
    return filmed


@pytest.mark.parametrize("after", PLACES)
def test_a_place_of_the_plate_undoes_the_one_before(plates, tmp_path, after) -> None:
    file = str(tmp_path / "fresh.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    found, pictures = {}, {}
    for before in (None, *PLACES):
        bpy.ops.wm.open_mainfile(filepath=file)
        scene = bpy.context.scene
        assert scene.render.engine != "CYCLES"
        for place in filter(None, (before, after)):
            smoke(scene).smokelift.plate_place = place
            assert bpy.ops.smokelift.set_up() == {"FINISHED"}
        found[before] = traces(scene)
        scene.render.engine = "CYCLES"
        pictures[before] = rendered(scene, tmp_path / "found.exr")
    own = {"COMPOSITE": {compositing.FLOOR}, "PROJECTION": {plate.CARD}}
    assert found[None]["objects"] == own.get(after, set())
    for before in PLACES:
        assert found[before] == found[None], before
        assert pictures[before] == pytest.approx(pictures[None], abs=0.01), before
