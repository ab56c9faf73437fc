"""Frames with boxes of their own: one sequence, in the box around all of them."""

import numpy as np
import pytest
from small_sequence import SCENE, needs_vdb

from smokelift import Domain, Sequence
from smokelift.output import vdb
from smokelift.output.archive import ResumeState
from smokelift.output.export import ExportSettings, export_sequence, write_proxies
from smokelift.output.writer import SequenceWriter
from smokelift.transport import face_shapes

DOMAIN = SCENE.domain
GROWN = DOMAIN.grown((8, 0, 0), (4, 8, 0))
WHOLE = GROWN.grown((0, 8, 0), (0, 0, 4))


def frame(domain: Domain) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """Smoke on both ends of a box, at places that differ, and a velocity of 1, 2 and 3 m/s."""
    density = np.zeros(domain.shape, np.float32)
    density[0, 0, 0], density[-1, -2, -3] = 1.0, 2.0
    faces = tuple(np.full(n, axis + 1, np.float32) for axis, n in enumerate(face_shapes(domain.shape)))
    return density, faces


def written(directory, boxes, npz=False) -> Sequence:
    with SequenceWriter(directory, SCENE, {}, npz=npz) as writer:
        for number, box in enumerate(boxes, 1):
            writer.write(number, *frame(box), {"mass": 1.0}, box=box)
    return Sequence.open(directory)


@pytest.mark.parametrize("npz", [True, pytest.param(False, marks=needs_vdb)])
def test_every_frame_is_where_it_was(tmp_path, npz):
    made = written(tmp_path / "out", [DOMAIN, GROWN, WHOLE], npz)
    assert [made.box(number) for number in (1, 2, 3)] == [DOMAIN, GROWN, WHOLE]
    assert made.scene.domain == WHOLE
    assert "box" not in made.figures(1)
    for number, box in ((1, DOMAIN), (2, GROWN), (3, WHOLE)):
        part = box.slices_in(WHOLE)
        density = made.density(number)
        assert density.shape == WHOLE.shape
        np.testing.assert_array_equal(density[part], frame(box)[0])
        assert density.sum() == 3.0
        velocity = made.velocity(number)
        assert velocity.shape == WHOLE.shape
        inner = made.within(DOMAIN).density(number)
        np.testing.assert_array_equal(inner, density[DOMAIN.slices_in(WHOLE)])
        assert made.within(DOMAIN).velocity(number).shape == DOMAIN.shape
        np.testing.assert_allclose(velocity.centres()[part][0, 0, 0], (1, 2, 3), atol=1.6)
    assert made.velocity_at_centres(2)[GROWN.slices_in(WHOLE)][0, 0, 0].tolist() == [1, 2, 3]


@needs_vdb
def test_files_share_one_transform_and_proxies_and_exports_one_box(tmp_path):
    made = written(tmp_path / "out", [DOMAIN, GROWN])
    grids = [vdb.vdb_module().read(str(tmp_path / "out" / f"smoke_000{n}.vdb"), "density") for n in (1, 2)]
    assert grids[0].transform == grids[1].transform
    assert grids[1].evalActiveVoxelBoundingBox()[0] == (-8, 0, 0)
    assert list(write_proxies(made)) == [1, 2]
    coarse = [vdb.vdb_module().read(str(tmp_path / "out" / f"proxy_000{n}.vdb"), "density") for n in (1, 2)]
    assert coarse[0].transform == coarse[1].transform
    assert coarse[0].evalActiveVoxelBoundingBox()[0] == (8 // vdb.PROXY_TIMES, 0, 0)
    list(export_sequence(made, tmp_path / "export", ExportSettings()))
    rho = vdb.read_grid(tmp_path / "export" / "smoke_0001.vdb", "density", GROWN)
    np.testing.assert_array_equal(rho[DOMAIN.slices_in(GROWN)], frame(DOMAIN)[0])


def test_a_run_goes_on_from_a_state_in_its_own_box(tmp_path):
    with pytest.raises(KeyboardInterrupt), SequenceWriter(tmp_path / "out", SCENE, {}, npz=True) as writer:
        density, faces = frame(GROWN)
        writer.write(1, *frame(DOMAIN))
        writer.write(2, density, faces, box=GROWN, state=ResumeState(2, density, faces))
        raise KeyboardInterrupt
    with SequenceWriter(tmp_path / "out", SCENE, {}, npz=True, resume=True) as writer:
        assert writer.box(writer.state.number) == GROWN
        np.testing.assert_array_equal(writer.state.density, density)
