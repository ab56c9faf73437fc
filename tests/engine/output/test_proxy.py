"""The coarse copies for viewports: where their smoke is, which runs write them, and that they can be made later."""

import numpy as np
import pytest
from small_sequence import BURNING, SCENE, SETTINGS, frame, names, needs_vdb, write

from smokelift.output import vdb, writer
from smokelift.output.export import write_proxies
from smokelift.output.writer import SequenceWriter
from smokelift.scene import Domain
from smokelift.transport import block_means


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
