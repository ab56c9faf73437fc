"""OpenVDB files: values and places survive, as Blender will see them, and coarse copies for viewports beside them."""

import json
import subprocess
import sys

import numpy as np
import pytest
from small_sequence import BURNING, SCENE, SETTINGS, frame, names, needs_vdb, write

from smokelift.output import vdb, writer
from smokelift.output.export import write_proxies
from smokelift.output.writer import SequenceWriter
from smokelift.scene import Domain
from smokelift.transport import StaggeredGrid, block_means, face_shapes

DOMAIN = Domain((-1.0, 0.5, 2.0), (-0.5, 0.75, 2.75), (20, 10, 30))


def noise() -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(5)
    density = np.zeros(DOMAIN.shape, np.float32)
    density[3:9, 2:7, 10:20] = random.random((6, 5, 10))
    return density, random.normal(size=(*DOMAIN.shape, 3)).astype(np.float32)


@needs_vdb
@pytest.mark.parametrize("order", ["C", "F"])
def test_a_frame_comes_back(tmp_path, order) -> None:
    density, velocity = noise()
    vdb.write_vdb(tmp_path / "a.vdb", np.asarray(density, order=order), np.asarray(velocity, np.float64, order), DOMAIN)
    rho, u = (vdb.read_grid(tmp_path / "a.vdb", name, DOMAIN) for name in ("density", "velocity"))
    np.testing.assert_allclose(rho, density, rtol=1e-3, atol=1e-7)
    near = np.zeros(DOMAIN.shape, bool)
    near[1:11, 0:9, 8:22] = True
    np.testing.assert_allclose(u[near], velocity[near], rtol=1e-3, atol=1e-7)
    assert not u[~near].any()
    assert [file.name for file in tmp_path.iterdir()] == ["a.vdb"]


@needs_vdb
def test_grids_are_what_blender_expects(tmp_path) -> None:
    density, velocity = noise()
    vdb.write_vdb(tmp_path / "a.vdb", density, velocity, DOMAIN, {"quality": "draft", "steps": 3})
    grids = {grid.name: grid for grid in vdb.vdb_module().readAll(str(tmp_path / "a.vdb"))[0]}
    assert set(grids) == {"density", "velocity"}
    fog = grids["density"]
    assert (fog.metadata["class"], fog.background) == ("fog volume", 0.0)
    assert fog.activeVoxelCount() == np.count_nonzero(density)
    assert grids["velocity"].activeVoxelCount() < density.size / 2
    assert json.loads(fog.metadata[vdb.SETTINGS]) == {"quality": "draft", "steps": 3}
    for grid in grids.values():
        for voxel in ((0, 0, 0), (3, 4, 5)):
            center = [low + (i + 0.5) * DOMAIN.voxel_size for low, i in zip(DOMAIN.min, voxel, strict=True)]
            assert grid.transform.indexToWorld(voxel) == pytest.approx(center)


@needs_vdb
def test_a_flame_comes_back(tmp_path) -> None:
    density, velocity = noise()
    flame = np.roll(density, (8, 0, 7), (0, 1, 2))
    vdb.write_vdb(tmp_path / "a.vdb", density, velocity, DOMAIN, flame=flame)
    np.testing.assert_allclose(vdb.read_grid(tmp_path / "a.vdb", "flame", DOMAIN), flame, rtol=1e-3, atol=1e-7)
    np.testing.assert_allclose(vdb.read_grid(tmp_path / "a.vdb", "density", DOMAIN), density, rtol=1e-3, atol=1e-7)
    vdb.write_vdb(tmp_path / "a.vdb", density, velocity, DOMAIN, flame=0 * flame)
    assert not vdb.read_grid(tmp_path / "a.vdb", "flame", DOMAIN).any()
    vdb.write_vdb(tmp_path / "a.vdb", density, velocity, DOMAIN)
    assert vdb.read_grid(tmp_path / "a.vdb", "flame", DOMAIN) is None
    with pytest.raises(ValueError):
        vdb.write_vdb(tmp_path / "a.vdb", density, velocity, DOMAIN, flame=-flame)
    with pytest.raises(FileNotFoundError):
        vdb.read_grid(tmp_path / "b.vdb", "flame", DOMAIN)
    (tmp_path / "a.vdb").write_bytes(b"nonsense")
    with pytest.raises(OSError):
        vdb.read_grid(tmp_path / "a.vdb", "flame", DOMAIN)


@needs_vdb
def test_a_velocity_on_faces_is_stored_at_centres(tmp_path) -> None:
    density, _ = noise()
    random = np.random.default_rng(6)
    x, y, z = (random.normal(size=shape).astype(np.float32) for shape in face_shapes(DOMAIN.shape))
    velocity = StaggeredGrid((x, y, z), DOMAIN.voxel_size)
    for name, given in (("faces", velocity), ("centres", velocity.centres())):
        vdb.write_vdb(tmp_path / f"{name}.vdb", density, given, DOMAIN)
    of_faces, of_centres = (
        vdb.read_grid(tmp_path / f"{name}.vdb", "velocity", DOMAIN) for name in ("faces", "centres")
    )
    assert of_faces.any()
    np.testing.assert_array_equal(of_faces, of_centres)
    with pytest.raises(ValueError):
        vdb.write_vdb(tmp_path / "a.vdb", density, StaggeredGrid.zero((3, 3, 3), 1.0), DOMAIN)


@needs_vdb
def test_a_frame_without_smoke_holds_both_grids_empty(tmp_path) -> None:
    vdb.write_vdb(tmp_path / "a.vdb", np.zeros(DOMAIN.shape), np.ones((*DOMAIN.shape, 3)), DOMAIN)
    grids = vdb.vdb_module().readAll(str(tmp_path / "a.vdb"))[0]
    assert sorted((grid.name, grid.activeVoxelCount()) for grid in grids) == [("density", 0), ("velocity", 0)]
    assert not any(vdb.read_grid(tmp_path / "a.vdb", name, DOMAIN).any() for name in ("density", "velocity"))


@needs_vdb
def test_what_cannot_be_written_is_refused_and_leaves_the_old_file(tmp_path) -> None:
    density, velocity = noise()
    path = tmp_path / "a.vdb"
    vdb.write_vdb(path, density, velocity, DOMAIN)
    before = path.read_bytes()
    for wrong in (-density, density * np.nan, density[1:]):
        with pytest.raises(ValueError):
            vdb.write_vdb(path, wrong, velocity, DOMAIN)
    with pytest.raises(OSError):
        vdb.write_vdb(tmp_path / "nowhere" / "a.vdb", density, velocity, DOMAIN)
    assert path.read_bytes() == before


@needs_vdb
def test_bpy_is_not_imported_for_it() -> None:
    code = "import sys; from smokelift.output.vdb import vdb_module; vdb_module(); print('bpy' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split()[-1] == "False"


def test_a_coarser_box_keeps_the_mass() -> None:
    domain = Domain((0, 0, 0), (0.5, 0.7, 0.9), (5, 7, 9))
    rho = np.random.default_rng(1).random((5, 7, 9)).astype(np.float32)
    coarse, wide = block_means(rho, 3), domain.coarser(3)
    assert coarse.shape == wide.shape == (2, 3, 3)
    assert wide.max == pytest.approx((0.6, 0.9, 0.9))
    assert coarse.sum() * 27 == pytest.approx(rho.sum(), rel=1e-5)


@needs_vdb
def test_a_large_sequence_has_proxies(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(writer, "MIN_PROXY_VOXELS", 1)
    write(tmp_path, [1], BURNING, frame(7)[0], npz=False)
    assert names(tmp_path) == ["proxy_0001.vdb", "sequence.json", "smoke_0001.vdb"]
    with SequenceWriter(tmp_path, BURNING, SETTINGS, resume=True) as out:
        assert out.finished == (1,)
    found = {grid.name for grid in vdb.vdb_module().readAllGridMetadata(str(tmp_path / "proxy_0001.vdb"))}
    assert found == {"density", "flame"}


@needs_vdb
@pytest.mark.parametrize("start", [1, 1001])
def test_a_small_sequence_has_none_until_they_are_made(tmp_path, start) -> None:
    sequence = write(tmp_path, [1, 2], start_number=start)
    before = {name: (tmp_path / name).read_bytes() for name in names(tmp_path)}
    assert not any(name.startswith("proxy") for name in before)
    assert list(write_proxies(sequence)) == [1, 2]
    assert {name: (tmp_path / name).read_bytes() for name in before} == before
    coarse = np.zeros([-(-n // vdb.PROXY_TIMES) for n in SCENE.domain.resolution], np.float32)
    vdb.vdb_module().read(str(tmp_path / f"proxy_{start + 1:04d}.vdb"), gridname="density").copyToArray(coarse)
    assert coarse.sum() * vdb.PROXY_TIMES**3 == pytest.approx(sequence.density(2).sum(), rel=1e-2)
