"""What the engine writes of a result: the files and assets that are handed on, and a proxy."""

import json
import shutil
from pathlib import Path

import bpy
import pytest

from addon.core.take import Take
from addon.result import export, smoke_takes
from addon.scene import look, volume
from smokelift.output.export import ExportSettings, export_sequence
from smokelift.output.sequence import Sequence
from tests.engine.direct.rising import SCENE, write_plume
from tests.example_shot import EXAMPLE, smoke

FRAMES = 3


@pytest.fixture
def made(scene, tmp_path) -> bpy.types.Object:
    """A smoke with a result of a few frames that were written without a reconstruction."""
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    obj = smoke(bpy.context.scene)
    obj.smokelift.clip = bpy.data.movieclips.load(str(EXAMPLE / "clip.mp4"))
    take = Take(smoke_takes.output_folder(obj) / "take_0001")
    write_plume(take.directory, FRAMES)
    smoke_takes.present(obj, take)
    return obj


def exported(obj: bpy.types.Object, **settings: object) -> None:
    """What the engine writes, in this process, which takes less long."""
    sequence = Sequence.open(volume.shown_take(obj).directory)
    list(export_sequence(sequence, export.folder_of(obj), ExportSettings(**settings)))


def grids(data: bpy.types.Volume, frame: int) -> tuple[str, set[str]]:
    """Name of the file that a Volume reads in a frame, and its grids."""
    bpy.context.scene.frame_set(frame)
    assert data.grids.load(), data.grids.error_message
    return Path(data.grids.frame_filepath).name, {grid.name for grid in data.grids}


def test_an_export_beside_the_results(made) -> None:
    export.folder_of(made).mkdir(parents=True)
    for name in ("export.json", "smoke.blend", "smoke_0009.vdb"):
        (export.folder_of(made) / name).write_text("of an earlier export")
    made.smokelift_export.use_velocity = False
    before = len(bpy.data.node_groups)
    assert bpy.ops.smokelift.export() == {"FINISHED"}
    folder = export.folder_of(made)
    assert folder.parent == smoke_takes.output_folder(made)
    names = {path.name for path in folder.iterdir()}
    frames = {f"smoke_{number:04d}.vdb" for number in range(1, FRAMES + 1)}
    assert names == {*frames, "export.json", "smoke.usda", "smoke.blend"}
    assert json.loads((folder / "export.json").read_text())["grids"] == ["density"]
    assert (folder / "smoke.blend").stat().st_size > 10_000
    assert [obj.type for obj in bpy.data.objects].count("VOLUME") == 1, "what was made for the asset is left"
    assert len(bpy.data.node_groups) == before


@pytest.mark.parametrize(("host", "velocity"), [("blender", "velocity"), ("houdini", "vel")])
def test_blender_reads_the_usd_file(made, host, velocity) -> None:
    """As a sequence of Volumes that look like the smoke and whose velocity is in meters per second."""
    exported(made, host=host)
    bpy.ops.wm.usd_import(filepath=str(export.folder_of(made) / "smoke.usda"))
    (obj,) = [obj for obj in bpy.data.objects if obj.type == "VOLUME" and obj != made]
    data = obj.data
    assert (data.is_sequence, data.frame_start, data.frame_duration) == (True, 1, FRAMES)
    assert grids(data, 2) == ("smoke_0002.vdb", {"density", velocity})
    assert (data.velocity_unit, data.velocity_grid) == ("SECOND", velocity)
    assert look.node_of(obj).inputs["Extinction"].default_value == pytest.approx(SCENE.medium.extinction)
    assert look.material_of(obj) != look.material_of(made)


def test_the_usd_file_is_sound(made) -> None:
    from pxr import Sdf, Usd, UsdGeom, UsdShade, UsdVol

    exported(made, proxy=2)
    stage = Usd.Stage.Open(str(export.folder_of(made) / "smoke.usda"))
    assert (UsdGeom.GetStageUpAxis(stage), stage.GetTimeCodesPerSecond()) == ("Z", 24.0)
    for prim in stage.Traverse():
        assert Sdf.Path.IsValidIdentifier(prim.GetName()), prim
        for attribute in prim.GetProperties():
            assert Sdf.Path.IsValidNamespacedIdentifier(attribute.GetName()), attribute
    volumes = [UsdVol.Volume(stage.GetPrimAtPath(f"/Smoke/{name}")) for name in ("Volume", "Proxy")]
    assert [sorted(each.GetFieldPaths()) for each in volumes] == [["density", "velocity"], ["density"]]
    assert [UsdGeom.Imageable(each).ComputePurpose() for each in volumes] == ["render", "proxy"]
    for each in volumes:
        for path in each.GetFieldPaths().values():
            asset = UsdVol.OpenVDBAsset(stage.GetPrimAtPath(path)).GetFilePathAttr().Get(2)
            assert Path(asset.resolvedPath).is_file()
        material, _ = UsdShade.MaterialBindingAPI(each).ComputeBoundMaterial()
        assert material.ComputeVolumeSource("mtlx")[0].GetIdAttr().Get() == "ND_volume"
    known = "".join(path.read_text() for path in Path(bpy.utils.resource_path("LOCAL")).rglob("*_defs.mtlx"))
    shaders = [UsdShade.Shader(prim) for prim in stage.Traverse() if prim.IsA(UsdShade.Shader)]
    assert len(shaders) == 5
    for shader in shaders:
        assert f'nodedef name="{shader.GetIdAttr().Get()}"' in known


def test_the_asset_is_used_in_another_file(made, tmp_path) -> None:
    material = made.data.materials[0].name
    exported(made)
    export.write_asset(made, export.folder_of(made))
    moved = tmp_path / "handed on"
    export.folder_of(made).rename(moved)
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(str(moved / "smoke.blend"), assets_only=True) as (there, here):
        here.objects = there.objects
    (obj,) = here.objects
    assert obj.type == "VOLUME" and not obj.smokelift.is_smoke
    assert obj.data.materials[0].name == material
    assert volume.take_of(obj.data) == Take(moved)
    bpy.context.scene.collection.objects.link(obj)
    start = obj.data.frame_start
    assert grids(obj.data, start + 1) == ("smoke_0002.vdb", {"density", "velocity"})


def test_the_size_is_that_of_what_is_on_show(made, monkeypatch) -> None:
    """And of the settings: it is asked for once."""
    asked = []
    monkeypatch.setattr(export, "call_later", lambda *_: asked.append(1))
    assert export.export_size(made) == export.export_size(made) == "" and len(asked) == 1
    export._size.update(dict.fromkeys(export._size, "About 3 MB"))
    assert export.export_size(made) == "About 3 MB"
    directory = volume.shown_take(made).directory
    shutil.copytree(directory, directory.with_name("take_0002"))
    volume.show(made, Take(directory.with_name("take_0002")))
    assert export.export_size(made) == "" and len(asked) == 2
    made.smokelift_export.proxy = "2"
    assert export.export_size(made) == "" and len(asked) == 3
