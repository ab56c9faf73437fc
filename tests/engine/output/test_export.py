"""What an export leaves out, and that it does not show."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_sequence import BURNING, SCENE, SETTINGS, frame, names, needs_vdb, write

from smokelift import Medium, Sequence
from smokelift.output import export, vdb
from smokelift.output.export import ExportSettings, export_sequence
from smokelift.output.index import SequenceError
from smokelift.output.writer import SequenceWriter

DOMAIN, EXTINCTION = SCENE.domain, SCENE.medium.extinction


@pytest.fixture
def sequence(tmp_path) -> Sequence:
    """Smoke in the middle of thin air, without its OpenVDB files where there is no module."""
    with SequenceWriter(tmp_path / "smoke", SCENE, SETTINGS, npz=True) as writer:
        for number in (1, 2, 3):
            rho, faces = frame(number)
            rho[:, :, 6:] = 1e-6
            writer.write(number, rho, faces)
    return Sequence.open(tmp_path / "smoke")


def exported(sequence: Sequence, out: Path, **settings: object) -> list[tuple[int, int]]:
    return list(export_sequence(sequence, out, ExportSettings(**settings)))  # type: ignore[arg-type]  # by name


def grids(path: Path) -> dict[str, object]:
    return {grid.name: grid for grid in vdb.vdb_module().readAll(str(path))[0]}


@needs_vdb
def test_an_export_has_files_with_the_numbers_of_the_sequences(tmp_path) -> None:
    out, sequence = tmp_path / "out", write(tmp_path / "smoke", [1, 2], start_number=1001)
    written = exported(sequence, out, proxy=2)
    frames = [f"{kind}_100{n}.vdb" for kind in ("proxy", "smoke") for n in (1, 2)]
    assert names(out) == sorted([*frames, "export.json", "smoke.usda"])
    assert sum(size for _, size in written) == sum((out / name).stat().st_size for name in frames)
    note = json.loads((out / "export.json").read_text())
    assert note["complete"] and note["frames"] == [1001, 1002] and note["medium"]["extinction"] == EXTINCTION


@needs_vdb
def test_thin_air_is_left_out_and_smoke_is_kept(sequence, tmp_path) -> None:
    exported(sequence, tmp_path / "out")
    rho, u = (vdb.read_grid(tmp_path / "out" / "smoke_0002.vdb", name, DOMAIN) for name in ("density", "velocity"))
    assert not rho[:, :, 6:].any() and not u[:, :, 8:].any()
    np.testing.assert_allclose(rho[:, :, :6], sequence.density(2)[:, :, :6], atol=1e-3)
    np.testing.assert_allclose(u[:, :, :6], sequence.velocity_at_centres(2)[:, :, :6], atol=2e-3)


@needs_vdb
def test_quantized_shows_in_no_picture_of_8_bits(sequence, tmp_path) -> None:
    exported(sequence, tmp_path / "out", precision="quantized")
    rho, u = (vdb.read_grid(tmp_path / "out" / "smoke_0001.vdb", name, DOMAIN) for name in ("density", "velocity"))
    true = sequence.density(1)
    assert not np.array_equal(rho, true)
    for axis in range(3):
        seen, wanted = (np.exp(-EXTINCTION * DOMAIN.voxel_size * r.sum(axis)) for r in (rho, true))
        assert np.abs(seen - wanted).max() < 1 / 255
    voxels_per_frame = DOMAIN.voxel_size * 24
    near = rho > 0
    assert np.abs(u - sequence.velocity_at_centres(1))[near].max() <= voxels_per_frame / 32


@needs_vdb
def test_other_files_are_not_overwritten(sequence, tmp_path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "holiday.jpg").touch()
    for out in (sequence.directory, tmp_path / "out", tmp_path / "out" / "holiday.jpg"):
        with pytest.raises(SequenceError):
            exported(sequence, out)
    with pytest.raises(SequenceError):
        export.require_space(tmp_path / "new" / "er", 10**15)


@needs_vdb
@pytest.mark.parametrize("precision", ["half", "quantized"])
def test_fire_is_exported(tmp_path, precision) -> None:
    flame = frame(7)[0]
    exported(write(tmp_path / "smoke", [1, 2], BURNING, flame), tmp_path / "out", precision=precision)
    np.testing.assert_allclose(vdb.read_grid(tmp_path / "out" / "smoke_0001.vdb", "flame", DOMAIN), flame, atol=4e-3)
    assert set(grids(tmp_path / "out" / "smoke_0002.vdb")) == {"density", "velocity", "flame"}
    assert 'OpenVDBAsset "flame"' in (tmp_path / "out" / "smoke.usda").read_text()
    assert json.loads((tmp_path / "out" / "export.json").read_text())["grids"] == ["density", "velocity", "flame"]


def placed(path: Path, name: str, axis: int) -> tuple[float, float]:
    """Where along an axis of the world the active voxels of a grid begin and end, between their outer faces."""
    grid: Any = grids(path)[name]
    low, high = grid.evalActiveVoxelBoundingBox()
    half = DOMAIN.voxel_size / 2
    return grid.transform.indexToWorld(low)[axis] - half, grid.transform.indexToWorld(high)[axis] + half


@needs_vdb
def test_files_for_houdini(sequence, tmp_path) -> None:
    exported(sequence, tmp_path / "out", host="houdini", proxy=2)
    path = tmp_path / "out" / "smoke_0002.vdb"
    assert set(grids(path)) == {"density", "vel"}
    before = [placed(sequence.directory / "smoke_0002.vdb", "density", axis) for axis in range(3)]
    x, y, z = (placed(path, "density", axis) for axis in range(3))
    assert x == pytest.approx(before[0]) and z == pytest.approx((-before[1][1], -before[1][0]))
    assert y == pytest.approx((DOMAIN.min[2], DOMAIN.min[2] + 6 * DOMAIN.voxel_size)), "thin air above is left out"
    grid: Any = grids(path)["vel"]
    vel = np.zeros((8, 12, 8, 3), np.float32)
    grid.copyToArray(vel)
    u = sequence.velocity_at_centres(2)
    np.testing.assert_allclose(vel[2, 1, 4], u[2, 3, 1][[0, 2, 1]] * [1, 1, -1], atol=2e-3)
    text = (tmp_path / "out" / "smoke.usda").read_text()
    assert 'upAxis = "Y"' in text and "rel field:vel =" in text
    (proxy,) = grids(tmp_path / "out" / "proxy_0002.vdb").values()
    assert proxy.transform.indexToWorld((0, 0, 0)) == pytest.approx((-0.75, 0.25, -0.75))  # type: ignore[attr-defined]  # no stubs


@needs_vdb
def test_files_for_unreal(sequence, tmp_path) -> None:
    """Densities are 256 steps up to 1, their extinction is what they were divided by, and the pivot stays in place."""
    exported(sequence, tmp_path / "out", proxy=2)  # which is replaced, all of it
    exported(sequence, tmp_path / "out", host="unreal")
    assert names(tmp_path / "out") == ["export.json", *(f"smoke_{number:04d}.vdb" for number in sequence.frames)]
    peak = max(float(sequence.density(number).max()) for number in sequence.frames)
    medium = json.loads((tmp_path / "out" / "export.json").read_text())["medium"]
    assert medium["extinction"] == pytest.approx(EXTINCTION * peak)
    for number in sequence.frames:
        path = tmp_path / "out" / f"smoke_{number:04d}.vdb"
        rho, u = (
            vdb.read_grid(path, name, DOMAIN)[:, ::-1] for name in ("density", "velocity")
        )  # its axes are left-handed
        assert np.abs(rho * 255 - np.round(rho * 255)).max() < 0.1, "to the precision of 16 bits"
        assert rho.max() <= 1.0
        np.testing.assert_allclose(rho[:, :, :6] * peak, sequence.density(number)[:, :, :6], atol=peak / 400)
        wanted = sequence.velocity_at_centres(number)[:, :, :6] * [1, -1, 1]
        np.testing.assert_allclose(u[:, :, :6], wanted, atol=2e-3)
        for axis in range(3):
            for name in ("density", "velocity"):
                assert placed(path, name, axis) == pytest.approx((DOMAIN.min[axis], DOMAIN.max[axis]))
        density: Any = grids(path)["density"]
        assert density["extinction"] == pytest.approx(EXTINCTION * peak)


@needs_vdb
def test_every_frame_has_its_file(tmp_path) -> None:
    clip, medium = replace(SCENE.clip, fps=23.976), Medium(5.0, 0.8, 0.1, color=(1.0, 0.5, 0.25))
    sequence = write(tmp_path / "smoke", [1, 2], replace(SCENE, clip=clip, medium=medium), start_number=3)
    exported(sequence, tmp_path / "out", proxy=2)
    text = (tmp_path / "out" / "smoke.usda").read_text()
    assert text.startswith("#usda 1.0\n")
    for line in (
        "startTimeCode = 3",
        "endTimeCode = 4",
        "timeCodesPerSecond = 23.976",
        "double extinction = 5",
        'uniform token purpose = "proxy"',
        "rel field:velocity = </Smoke/Volume/velocity>",
        "4: @./smoke_0004.vdb@,",
        "3: @./proxy_0003.vdb@,",
        "float3[] extent = [(-1, -1, 0), (1, 1, 3)]",
        "rel material:binding = </Smoke/Material>",
        "float3 inputs:in1 = (4, 2, 1)",
        "float3 inputs:in1 = (1, 3, 4)",
        "float inputs:anisotropy = 0.1",
        'fieldName = "velocity"\n            token vectorDataRoleHint = "Vector"',
    ):
        assert line in text
    assert text.count("field:velocity") == text.count("vectorDataRoleHint") == 1
    assert text.count("{") == text.count("}")
