"""How the smoke looks: presets and fire."""

from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.core.take import Take
from addon.scene import look, volume
from addon.scene.smoke import is_override, smokes
from conftest import MEDIUM, made, rendered
from smokelift.output.vdb import vdb_module
from smokelift.scene import Medium
from tests.addon.inside.panel.tab import drawn
from tests.example_shot import add_camera, add_sun, set_world, smoke


@pytest.fixture
def lit(scene) -> bpy.types.Scene:
    """A camera close to the smoke of `made`, a sun and a gray background; 8 x 8 pixels in Cycles."""
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.seed = 64, False, 1
    camera = add_camera(scene, (0.44, -3.0, 1.62), (np.pi / 2, 0.0, 0.0))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 0.5
    add_sun(scene, 5.0, (0.8, 0.0, 0.0))
    set_world(scene, (0.2, 0.2, 0.2))
    scene.frame_set(3)
    return scene


def node(scene: bpy.types.Scene) -> bpy.types.ShaderNode:
    return look.node_of(smoke(scene))


def blacken(scene: bpy.types.Scene, sun: bool = True) -> None:
    """Put black behind the smoke, and nothing but its fire into the scene where the sun is hidden too."""
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    bpy.data.objects["Sun"].hide_render = not sun


def burning(folder: Path, grid: str, medium: Medium, number: int = 1) -> Take:
    """A take of `made` whose third file has its density as the grid of a fire, too."""
    take = made(folder, medium=medium, number=number)
    file = take.directory / "smoke_0003.vdb"
    grids, metadata = vdb_module().readAll(str(file))
    fire = next(each for each in grids if each.name == "density").deepCopy()
    fire.name = grid
    vdb_module().write(str(file), [*grids, fire], metadata)
    return take


def middle(scene: bpy.types.Scene, preset: str) -> np.ndarray:
    assert bpy.ops.smokelift.use_look(preset=preset) == {"FINISHED"}
    return rendered(scene, Path("middle.exr").absolute())[2:6, 2:6].mean((0, 1))


def test_presets_look_different(lit, tmp_path) -> None:
    """In the sun before black: soot is dark, mist thin, dust red, steam white and brightest against the light."""
    blacken(lit)
    volume.show(smoke(lit), made(tmp_path, medium=Medium(4.0, 0.8)))
    seen = {name: middle(lit, name) for name in look.PRESETS}
    assert seen["SOOT"].max() < 0.3 * seen["SMOKE"].min()
    assert seen["SOOT"].max() < seen["MIST"].min() < 0.9 * seen["STEAM"].min()
    assert seen["DUST"][0] > 1.3 * seen["DUST"][2]
    assert np.ptp(seen["STEAM"]) < 0.1 * seen["STEAM"].mean()
    bpy.data.objects["Sun"].rotation_euler = (-1.4, 0.0, 0.0)
    steam, smoke_ = (middle(lit, name).mean() / seen[name].mean() for name in ("STEAM", "SMOKE"))
    assert steam > 2.0 * smoke_


def test_presets_keep_what_was_fitted_and_runs_keep_the_preset(lit, tmp_path) -> None:
    volume.show(smoke(lit), made(tmp_path, medium=MEDIUM))
    bpy.ops.smokelift.use_look(preset="DUST")
    volume.show(smoke(lit), made(tmp_path, medium=Medium(9.0, 0.5), number=2))
    found = {name: socket.default_value for name, socket in node(lit).inputs.items()}
    for name, value in look.PRESETS["DUST"][2].items():
        assert (found[name] if isinstance(value, float) else tuple(found[name])) == pytest.approx(value), name
    assert (found["Extinction"], found["Albedo"][0]) == (9.0, 0.5)
    bpy.ops.smokelift.use_look(preset="SMOKE")
    assert node(lit).inputs["Color"].default_value[:] == (1.0, 1.0, 1.0, 1.0)


@pytest.mark.parametrize(
    ("name", "value", "least", "most"),
    [("Edge Contrast", 2.0, 0.03, 0.25), ("Edge Contrast", 0.5, 1.8, 5.0), ("Density", 4.0, 3.0, 4.5)],
)
def test_edges_and_density(lit, tmp_path, name, value, least, most) -> None:
    blacken(lit)
    lit.cycles.samples = 512
    volume.show(smoke(lit), made(tmp_path, medium=Medium(0.02, 0.8)))  # so thin that all of it is an edge
    before = rendered(lit, tmp_path / "before.exr").sum()
    node(lit).inputs[name].default_value = value
    assert least < rendered(lit, tmp_path / "after.exr").sum() / before < most
    node(lit).inputs["Edge Density"].default_value = 1e-6  # nothing is an edge
    if name == "Edge Contrast":
        assert rendered(lit, tmp_path / "thick.exr").sum() == pytest.approx(before, rel=0.1)


def test_smoke_evaporates_on_its_way_up(lit, tmp_path) -> None:
    blacken(lit)
    volume.show(smoke(lit), made(tmp_path, medium=Medium(4.0, 0.8)))
    inputs = node(lit).inputs
    assert (inputs["Floor"].default_value, inputs["Height"].default_value) == (0.0, 3.0)
    seen = []
    for evaporation, density in ((0.0, 0.125), (20.0, 0.125), (80.0, 0.125), (80.0, 0.01)):
        inputs["Evaporation"].default_value, inputs["Edge Density"].default_value = evaporation, density
        seen.append(float(rendered(lit, tmp_path / "seen.exr").sum()))
    assert seen[0] > seen[1] > 0.0
    assert seen[2] == 0.0
    assert seen[3] > 0.8 * seen[0]
    inputs["Edge Density"].default_value, inputs["Floor"].default_value = 0.125, 2.0
    assert rendered(lit, tmp_path / "below.exr").sum() == pytest.approx(seen[0], rel=0.1)


@pytest.mark.parametrize("grid", ["flame", "temperature"])
def test_fire_glows_where_a_file_has_it(lit, tmp_path, grid) -> None:
    blacken(lit, sun=False)
    volume.show(smoke(lit), made(tmp_path))
    assert rendered(lit, tmp_path / "dark.exr").max() == 0.0
    volume.show(smoke(lit), burning(tmp_path, grid, MEDIUM, number=2))
    assert rendered(lit, tmp_path / "fire.exr").max() > 0.01


def test_fire_is_as_bright_as_the_grid_says_in_the_color_of_the_clip(lit, tmp_path) -> None:
    blacken(lit, sun=False)
    lit.cycles.samples = 4096
    medium = Medium(1e-4, 0.8, flame_color=(1.0, 0.4, 0.1))
    volume.show(smoke(lit), burning(tmp_path, "flame", medium))
    assert node(lit).inputs["Flame Color"].default_value[:] == pytest.approx((1.0, 0.4, 0.1, 1.0))
    seen = rendered(lit, tmp_path / "fire.exr")
    np.testing.assert_allclose(seen[3:5, 3:5].mean((0, 1)), (1.0, 0.4, 0.1), rtol=0.03)
    node(lit).inputs["Flame Color"].default_value = (0.0, 0.0, 1.0, 1.0)
    volume.show(smoke(lit), made(tmp_path, medium=Medium(1.0, 0.8, flame_color=(1.0, 0.5, 0.2)), number=2))
    assert node(lit).inputs["Flame Color"].default_value[:] == (0.0, 0.0, 1.0, 1.0)


def test_an_override_of_a_linked_smoke_gets_a_look_of_its_own(lit, tmp_path) -> None:
    volume.show(smoke(lit), made(tmp_path, medium=MEDIUM))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.objects = ["Smoke"]
    (linked,) = wanted.objects
    scene = bpy.context.scene
    scene.collection.objects.link(linked)
    override = linked.override_create(remap_local_usages=True)
    assert smokes(scene) == [] and not bpy.ops.smokelift.use_look.poll(), "it is not active"
    bpy.context.view_layer.objects.active = override
    texts = drawn(scene, bpy.types.SMOKELIFT_PT_view_look)
    assert "Density" not in texts and "View Density" not in texts
    assert bpy.ops.smokelift.use_look(preset="SOOT") == {"FINISHED"}
    assert "Density" in drawn(scene, bpy.types.SMOKELIFT_PT_view_look)
    look.node_of(override).inputs["Density"].default_value = 3.0
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    override = next(obj for obj in bpy.context.scene.objects if is_override(obj))
    assert look.node_of(override).inputs["Density"].default_value == 3.0
    assert look.node_of(override).inputs["Color"].default_value[0] == pytest.approx(0.05)
    assert look.node_of(override.override_library.reference).inputs["Density"].default_value == 1.0
