"""The proxy, what viewports show in place of the smoke, and frames between those of a take."""

from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.core.take import Take
from addon.scene import modifiers, volume
from conftest import FRAMES, changed, made, played, rendered, write_index
from smokelift.output.vdb import vdb_module, write_proxy, write_vdb
from smokelift.scene import Domain, Medium, Scene
from tests.example_shot import add_camera, set_world, smoke


@pytest.fixture
def obj(scene, tmp_path) -> bpy.types.Object:
    return volume.show(smoke(scene), made(tmp_path, proxies=True))


def in_render(obj: bpy.types.Object) -> list[str]:
    """Names of the files that a render of the current frame uses."""
    found: list[str] = []

    def look(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        if depsgraph.mode == "RENDER":
            found.append(Path(obj.evaluated_get(depsgraph).data.filepath).name)

    for handlers in (bpy.app.handlers.frame_change_post, bpy.app.handlers.depsgraph_update_post):
        handlers.append(look)  # until the next test's file is read
    rendered(bpy.context.scene, Path("out.exr").absolute())
    return found


def test_viewports_show_the_proxy_and_renders_the_smoke(scene, obj, tmp_path) -> None:
    scene.render.engine, scene.cycles.samples, scene.cycles.seed = "CYCLES", 2, 1
    scene.render.resolution_x = scene.render.resolution_y = 8
    add_camera(scene, (0.44, -3.0, 1.62), (np.pi / 2, 0.0, 0.0)).data.ortho_scale = 0.5
    assert [played(obj, frame) for frame in (0, 1, 3, FRAMES + 1)] == ["", "proxy_0001.vdb", "proxy_0003.vdb", ""]
    scene.frame_set(3)
    assert set(in_render(obj)) == {"smoke_0001.vdb"}
    picture = rendered(scene, tmp_path / "with.exr")
    obj.modifiers.clear()
    np.testing.assert_array_equal(rendered(scene, tmp_path / "without.exr"), picture)


def test_it_has_a_switch(obj, tmp_path) -> None:
    modifiers.PROXY.modifier(obj).show_viewport = False
    volume.show(obj, volume.shown_take(obj))
    volume.show(obj, made(tmp_path, number=2, proxies=True))
    assert played(obj, 3) == "smoke_0003.vdb"
    assert modifiers.in_viewport(obj) == obj.data
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    obj = smoke(bpy.context.scene)
    modifiers.PROXY.modifier(obj).show_viewport = True
    assert played(obj, 3) == "proxy_0003.vdb"
    assert modifiers.in_viewport(obj) == modifiers.PROXY.volume(obj)


@pytest.mark.parametrize("speed", ["FRAMES", "REAL"])
def test_files_that_are_numbered_from_elsewhere_are_played(scene, tmp_path, speed) -> None:
    """From the first used frame of the clip's own numbers, say; the frames themselves count from 1."""
    take = made(tmp_path, proxies=True)
    for kind in ("smoke", "proxy"):
        for n in range(FRAMES, 0, -1):
            (take.directory / f"{kind}_{n:04d}.vdb").rename(take.directory / f"{kind}_{n + 1000}.vdb")
    with changed(take) as index:
        index["start_number"] = 1001
    scene.render.fps, smoke(scene).smokelift.speed = 24, speed
    obj = volume.show(smoke(scene), take)
    assert [played(obj, frame) for frame in (0, 1, 3, FRAMES + 1)] == ["", "proxy_1001.vdb", "proxy_1003.vdb", ""]
    modifiers.PROXY.modifier(obj).show_viewport = False
    assert [played(obj, frame) for frame in (1, 3)] == ["smoke_1001.vdb", "smoke_1003.vdb"]
    assert volume.shown(obj).numbers == list(range(1, FRAMES + 1))
    scene.render.fps = 48
    volume.synchronize_playback()
    for kind in ("smoke", "proxy"):
        modifiers.PROXY.modifier(obj).show_viewport = kind == "proxy"
        assert played(obj, 3) == f"{kind}_{1002 if speed == 'REAL' else 1003}.vdb"


def test_a_result_without_one_is_shown_itself(scene, obj, tmp_path) -> None:
    volume.show(obj, made(tmp_path, number=2))
    assert played(obj, 3) == "smoke_0003.vdb"
    assert list(bpy.data.volumes) == [obj.data] and not obj.modifiers
    assert modifiers.PROXY.volume(obj) is None


def test_a_duplicate_gets_a_proxy_of_its_own(scene, obj, tmp_path) -> None:
    twin = obj.copy()
    twin.data = obj.data.copy()
    scene.collection.objects.link(twin)
    volume.show(twin, made(tmp_path, number=2, proxies=True))
    beside = volume.show_beside(obj, made(tmp_path, number=3, proxies=True))
    proxies = [modifiers.PROXY.volume(each) for each in (obj, twin, beside)]
    assert len(set(proxies)) == 3
    assert [volume.take_of(data).directory.name for data in proxies] == ["take_0001", "take_0002", "take_0003"]
    assert len({tuple(data.materials) for data in proxies}) == 1


def test_it_follows_a_run(scene, tmp_path) -> None:
    take = made(tmp_path, proxies=True)
    for number in range(3, FRAMES + 1):
        (take.directory / f"proxy_{number:04d}.vdb").unlink()
    index = (take.directory / "sequence.json").read_text()
    obj = smoke(scene)
    volume.show(obj, take)
    assert modifiers.PROXY.modifier(obj) is None
    (take.directory / "sequence.json").write_text(index.replace(', "3": {}, "4": {}, "5": {}, "6": {}', ""))
    volume.show(obj, take)
    assert played(obj, 2) == "proxy_0002.vdb"


DOMAIN = Domain((-1.0, -1.0, 0.0), (1.0, 1.0, 3.0), (32, 32, 48))
LENGTH, FPS, VOXELS_PER_FRAME = 4, 24.0, 4.0
needs_nodes = pytest.mark.skipif(not modifiers.CAN_INTERPOLATE, reason="Blender moves grids since 5.0")


def ball(place: float) -> np.ndarray:
    """A soft ball at a place along x, in voxels."""
    x, y, z = np.meshgrid(*[np.arange(n) + 0.5 for n in DOMAIN.resolution], indexing="ij")
    distance = np.sqrt((x - place) ** 2 + (y - 16.0) ** 2 + (z - 24.0) ** 2)
    return np.clip(1.5 - distance / 4.0, 0.0, 1.0).astype(np.float32)


def flying(folder: Path, *, fire: bool = False, proxies: bool = False) -> Take:
    """A take of a ball that flies along x."""
    take = Take(folder / "take_0001")
    take.directory.mkdir(parents=True)
    velocity = np.zeros((*DOMAIN.resolution, 3), np.float32)
    velocity[..., 0] = VOXELS_PER_FRAME * DOMAIN.voxel_size * FPS
    for number in range(1, LENGTH + 1):
        rho = ball(8.0 + VOXELS_PER_FRAME * (number - 1))
        flame = 2.0 * rho if fire else None
        write_vdb(take.directory / f"smoke_{number:04d}.vdb", rho, velocity, DOMAIN, flame=flame)
        if proxies:
            write_proxy(take.directory / f"proxy_{number:04d}.vdb", rho, DOMAIN)
    write_index(take, Scene(domain=DOMAIN, medium=Medium(20.0, 0.8)), LENGTH)
    return take


@pytest.fixture
def slow(shot) -> bpy.types.Object:
    """A smoke at half its speed, with frames between."""
    shot.render.fps = 48
    settings = smoke(shot).smokelift
    settings.speed, settings.between = "REAL", True
    return smoke(shot)


def seen(obj: bpy.types.Object, frame: int, name: str = "density") -> np.ndarray:
    """A grid as the viewport shows it in a frame."""
    bpy.context.scene.frame_set(frame)
    data = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    data.grids.load()
    assert data.grids.save("seen.vdb")
    values = np.zeros(DOMAIN.resolution, np.float32)
    vdb_module().read("seen.vdb", gridname=name).copyToArray(values)
    return values


@needs_nodes
def test_the_smoke_is_where_it_would_be(slow, tmp_path) -> None:
    volume.show(slow, flying(tmp_path, fire=True))
    for frame in range(1, 2 * LENGTH + 1):
        place = min((frame - 1) / 2, LENGTH - 1)
        wanted = ball(8.0 + VOXELS_PER_FRAME * place)
        np.testing.assert_allclose(seen(slow, frame), wanted, atol=4e-3)
        np.testing.assert_allclose(seen(slow, frame, "flame"), 2.0 * wanted, atol=8e-3)


@needs_nodes
def test_a_render_has_them_and_their_motion_blur(slow, tmp_path) -> None:
    """What the ball hides is half a frame further, and wider with motion blur: the shutter is open for a frame."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples, scene.cycles.seed = "CYCLES", 32, 1
    scene.render.resolution_x, scene.render.resolution_y, scene.cycles.use_denoising = 32, 12, False
    camera = add_camera(scene, (0.0, -4.0, 1.5), (np.pi / 2, 0.0, 0.0))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2.0
    set_world(scene, (1.0, 1.0, 1.0))
    bpy.data.objects["Sun"].hide_render = True
    volume.show(slow, flying(tmp_path))
    found = []
    for blur in (False, True):
        scene.render.use_motion_blur, scene.render.motion_blur_shutter = blur, 2.0
        scene.frame_set(4)
        hidden = 1.0 - rendered(scene, tmp_path / "out.exr").mean((0, 2))
        columns = np.arange(len(hidden)) + 0.5
        middle = (hidden * columns).sum() / hidden.sum()
        found.append((middle, np.sqrt((hidden * (columns - middle) ** 2).sum() / hidden.sum())))
    (middle, width), (blurred, wider) = found
    assert middle == pytest.approx(8.0 + 1.5 * VOXELS_PER_FRAME, abs=0.5)
    assert blurred == pytest.approx(middle, abs=0.5)
    assert wider**2 - width**2 == pytest.approx(VOXELS_PER_FRAME**2 / 12, rel=0.3), "as of a box as wide as it moves"


@needs_nodes
def test_only_renders_have_them_while_the_viewport_shows_a_proxy(slow, tmp_path) -> None:
    volume.show(slow, flying(tmp_path, proxies=True))
    first, second = slow.modifiers
    assert (first.name, first.show_viewport, first.show_render) == (modifiers.FRAMES_BETWEEN.name, False, True)
    assert (second, second.show_render) == (modifiers.PROXY.modifier(slow), False)


def test_they_are_taken_away(slow, tmp_path) -> None:
    """Where they are switched off, and where every frame of the scene has a file; or where Blender lacks the nodes."""
    volume.show(slow, flying(tmp_path))
    assert bool(slow.modifiers) == modifiers.CAN_INTERPOLATE
    for name, on, off in (("between", True, False), ("speed", "REAL", "FRAMES")):
        setattr(slow.smokelift, name, off)
        assert not slow.modifiers and list(bpy.data.volumes) == [slow.data]
        assert not slow.animation_data or not slow.animation_data.drivers
        setattr(slow.smokelift, name, on)
    assert bool(slow.modifiers) == modifiers.CAN_INTERPOLATE
