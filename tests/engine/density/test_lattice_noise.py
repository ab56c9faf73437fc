"""Noise on lattices: its strength and its blur along one, two and three axes, and the same by compiled code."""

import numpy as np
import pytest

import smokelift._core as _core
from smokelift.density.lattice_noise import NODE_BLUR, NODES, lattices


@pytest.mark.parametrize("axes", [1, 2, 3])
def test_noise_has_unit_variance_between_nodes(axes) -> None:
    """Over all of a lattice, whatever its axes; the mean is that of the nodes, and neither has a seam."""
    random = np.random.default_rng(5)
    places = random.uniform(-NODES, 2 * NODES, (axes, 20000))
    found = [lattice.read(places) for lattice in lattices(1, 24, axes)]
    assert np.mean([values.var() for values in found]) == pytest.approx(1, rel=0.1)
    np.testing.assert_allclose(lattices(1, 1, axes)[0].read(places + NODES), found[0], atol=1e-6)


def test_a_node_adds_what_a_blur_does_without_a_crease() -> None:
    places = np.linspace(-NODES / 2, NODES / 2, 6401)[None]
    (lattice,) = lattices(0, 1, 1)
    one = lattice._replace(values=np.eye(1, NODES, dtype=np.float32)[0], corner=np.zeros(1))
    added = one.read(places)
    assert np.sqrt(np.average(places[0] ** 2, weights=added)) == pytest.approx(NODE_BLUR, rel=1e-3)
    slopes = np.gradient(added, places[0])
    assert np.abs(np.diff(slopes)).max() < 0.05 * np.abs(slopes).max()


def test_compiled_code_reads_what_python_does() -> None:
    random = np.random.default_rng(0)
    lattice = lattices(3, 1, 3)[0]
    small = lattice._replace(values=np.ascontiguousarray(lattice.values[:5, :6, :7]))
    marked = random.random((12, 13, 14)) > 0.5
    index = np.array(np.nonzero(marked))
    motion = random.uniform(-40, 40, index.shape).astype(np.float32)
    motion[:, :200] = np.round(motion[:, :200])
    shift = np.array((-3.0, 4.5, 50.0))
    expected = small.read(0.5 * index + shift[:, None] + 0.25 * motion)
    where = _core.MarkedVoxels(marked)
    found = where.read_lattice(small.values, 0.5, (shift + small.corner).tolist(), motion, 0.25)
    np.testing.assert_allclose(found, expected, atol=2e-4)
