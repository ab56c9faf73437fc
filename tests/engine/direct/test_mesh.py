"""Meshes as obstacles, still and moving: which voxels they enclose, how fast they are, and the files they come from."""

import numpy as np
import pytest

from smokelift.direct.continuation import Continuation, continue_sequence
from smokelift.direct.mesh import HEADER, Mesh
from smokelift.direct.simulation import Physics
from smokelift.direct.surroundings import Surroundings, require_place
from smokelift.output.index import SequenceError
from smokelift.output.sequence import Sequence
from smokelift.transport import divergence
from smokelift.transport.pressure import faces_between
from tests.engine.direct.rising import (
    DOMAIN,
    DT,
    at_rest,
    blob,
    course,
    cube,
    free,
    in_box,
    octahedron,
    write_stl,
)

H = DOMAIN.voxel_size


def test_a_cube_is_the_box_of_its_corners():
    for low, high in (((-0.5, -0.3, 0.4), (0.7, 0.4, 2.1)), ((-0.4375, -0.5625, 0.5625), (0.4375, 0.5625, 1.4375))):
        inside, wanted = Mesh(cube(low, high)).voxels(DOMAIN), in_box(low, high)
        at_faces = in_box([v + 0.01 for v in low], [v - 0.01 for v in high])
        assert (inside <= wanted).all() and (inside >= at_faces).all()


@pytest.mark.parametrize("turned", [False, True])
def test_voxels_are_inside_whichever_way_the_triangles_turn(turned):
    center = (0.11, -0.06, 1.42)
    triangles = octahedron(center, 0.6)
    inside = Mesh(triangles[:, ::-1] if turned else triangles).voxels(DOMAIN)
    np.testing.assert_array_equal(inside, sum(map(np.abs, DOMAIN.offsets(center))) < 0.6)


def test_parts_of_a_mesh_may_overlap_and_leave_the_box():
    triangles = np.concatenate([cube((-0.5, -0.5, -1), (0.3, 0.5, 1)), cube((-0.1, -0.3, 0.5), (5, 0.3, 2))])
    inside = Mesh(triangles).voxels(DOMAIN)
    one, other = in_box((-0.5, -0.5, -1), (0.3, 0.5, 1)), in_box((-0.1, -0.3, 0.5), (5, 0.3, 2))
    np.testing.assert_array_equal(inside, one | other)


def test_a_mesh_with_a_hole_works_and_a_plane_is_refused():
    triangles = cube((-0.5, -0.3, 0.4), (0.7, 0.4, 2.1))
    np.testing.assert_array_equal(Mesh(triangles[1:]).voxels(DOMAIN), Mesh(triangles).voxels(DOMAIN))
    with pytest.raises(ValueError):
        Mesh(triangles[:1]).voxels(DOMAIN)


def test_an_stl_file_is_read_as_it_was_written(tmp_path):
    triangles = cube((-0.5, -0.3, 0.4), (0.7, 0.4, 2.1))
    path = tmp_path / "cube.stl"
    write_stl(path, np.full((1, 3, 3), np.nan))
    not_a_number = path.read_bytes()
    write_stl(path, triangles)
    np.testing.assert_array_equal(Mesh.read(path).places, triangles[None])
    whole = path.read_bytes()
    wrong = (b"", b"solid cube\nendsolid", whole[:-1], whole + b"x", whole[:HEADER], bytes(HEADER), not_a_number)
    for content in wrong:
        path.write_bytes(content)
        with pytest.raises(ValueError):
            Mesh.read(path)
    for missing in (tmp_path, tmp_path / "none.stl"):
        with pytest.raises(ValueError):
            Mesh.read(missing)


def along_x(triangles: np.ndarray, speed: float, frames: int) -> Mesh:
    """A mesh that goes along x."""
    way = speed * DT * np.arange(frames + 1)
    return Mesh(np.stack([triangles + np.array([x, 0, 0]) for x in way]).astype(np.float32))


def test_the_surface_has_the_speed_of_its_corners():
    start = cube((-0.5, -0.3, 0.6), (0.5, 0.3, 1.4)).astype(float)
    turn = 0.02
    matrix = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    voxels, (x, y, z) = Mesh(np.stack([start, start @ matrix.T])).solid(DOMAIN, 1, DT)
    outer = faces_between(voxels)
    rate = turn / DT
    across = np.arange(16) * H + H / 2 - 1
    np.testing.assert_allclose(x[outer[0]], np.broadcast_to(-rate * across[:, None], x.shape)[outer[0]], atol=0.01)
    np.testing.assert_allclose(y[outer[1]], np.broadcast_to(rate * across[:, None, None], y.shape)[outer[1]], atol=0.01)
    assert not z[outer[2]].any()
    for step, speed in ((2, 0.7), (4, 0.0)):  # in the end it has come to rest
        _, (x, y, z) = along_x(start, 0.7, 3).solid(DOMAIN, step, DT)
        np.testing.assert_allclose(x, speed, rtol=1e-4)
        assert not y.any() and not z.any()


def test_an_obstacle_pushes_still_smoke_before_it():
    """Nothing goes through its faces but with it, smoke vanishes only where it is put; the air has no divergence."""
    moving = along_x(octahedron((-0.55, 0.0, 1.5), 0.4), 0.8, 12)
    around = Surroundings(DOMAIN, obstacles=(moving,))
    start = at_rest(blob((0.0, 0.0, 1.5), 0.2))
    states = course(free(Physics(0.0, 0.0), around), start, 12)
    for step, state in enumerate(states[1:], 1):
        solid = around.solid(step, DT)
        for mask, component, wanted in zip(
            faces_between(solid.voxels), state.velocity.faces, solid.velocity, strict=True
        ):
            np.testing.assert_array_equal(component[mask], wanted[mask])
        assert not state.density[solid.voxels].any()
        assert np.abs(divergence(state.velocity))[~solid.voxels].max() * H < 0.02 * 0.8
    before, after = states[0].density, states[-1].density
    outside = before[~around.solid(1, DT).voxels].sum()
    assert outside < 0.98 * before.sum()
    assert after.sum() == pytest.approx(outside, rel=0.02)
    places = np.arange(16) * H + H / 2 - 1
    assert abs(np.average(places, weights=before.sum(axis=(1, 2)))) < 0.01
    assert np.average(places, weights=after.sum(axis=(1, 2))) > 0.06


def test_numbered_files_are_one_obstacle(source, tmp_path):
    """A run that goes on has to have the same; what does not belong together is refused in one sentence."""
    moving = along_x(cube((-0.9, -0.3, 1.2), (-0.4, 0.3, 1.7)), 2.0, 3)
    pattern = tmp_path / "crate_####.stl"
    with pytest.raises(ValueError):
        Mesh.read(pattern)
    for number, place in enumerate(moving.places, 9):
        write_stl(tmp_path / f"crate_{number:04d}.stl", place)
    read = Mesh.read(pattern)
    np.testing.assert_array_equal(read.places, moving.places)
    out = tmp_path / "out"
    for number, figures in continue_sequence(source, out, Continuation(3, obstacles=(read,)), npz=True):
        assert number <= 10 or figures["divergence"] < 0.02
        if number == 12:
            break
    still = Continuation(3, obstacles=(Mesh(moving.places[:1]),))
    with pytest.raises(SequenceError):
        next(continue_sequence(source, out, still, npz=True, resume=True))
    assert len(list(continue_sequence(source, out, Continuation(3, obstacles=(read,)), npz=True, resume=True))) == 1
    made = Sequence.open(out)
    for step in (1, 2, 3):
        assert not made.density(10 + step)[moving.voxels(made.scene.domain, step)].any()
    (tmp_path / "crate_0010.stl").unlink()
    with pytest.raises(ValueError):
        Mesh.read(pattern)
    write_stl(tmp_path / "crate_0010.stl", moving.places[1, :-1])
    with pytest.raises(ValueError):
        Mesh.read(pattern)


def test_a_mesh_that_never_reaches_the_box_is_refused():
    far = cube((5.0, -0.3, 1.2), (5.5, 0.3, 1.7))
    with pytest.raises(ValueError):
        require_place("obstacle", along_x(far, 0.1, 5), DOMAIN, DOMAIN)
    require_place("obstacle", along_x(far, 0.1, 5), DOMAIN, DOMAIN.grown((0, 0, 0), (40, 0, 0)))
    assert Surroundings(DOMAIN, obstacles=(along_x(far, -24.0, 5),)).solid(1, DT) is None
