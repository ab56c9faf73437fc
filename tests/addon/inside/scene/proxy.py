"""The proxy: what viewports show and renders use, when it plays, and whose it is."""

from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.scene import modifiers, volume
from conftest import FRAMES, changed, made, played, rendered
from tests.example_shot import add_camera, smoke


@pytest.fixture
def obj(scene, tmp_path) -> bpy.types.Object:
    """A smoke with a proxy."""
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
    assert volume.number_at(obj, 3) == 3
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
