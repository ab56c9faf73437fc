"""Meshes as obstacles: which voxels they enclose, and the files they come from."""

import numpy as np
import pytest

from smokelift.direct import Ball, BoxObstacle, Mesh
from smokelift.direct.mesh import HEADER, RECORD
from tests.engine.direct.rising import DOMAIN

CUBE = [(0, 1, 3), (0, 3, 2), (4, 7, 5), (4, 6, 7), (0, 5, 1), (0, 4, 5), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4)]
CUBE += [(1, 5, 7), (1, 7, 3)]


def cube(low, high) -> np.ndarray:
    """Twelve triangles whose normals point outwards."""
    corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    return (np.array(low) + corners * (np.array(high) - low))[np.array(CUBE)].astype(np.float32)


def ball(centre, radius, parts: int = 24) -> np.ndarray:
    """A round mesh of triangles in rings."""
    polar, around = np.linspace(0, np.pi, parts + 1), np.linspace(0, 2 * np.pi, 2 * parts + 1)
    place = np.stack(
        [
            np.outer(np.sin(polar), np.cos(around)),
            np.outer(np.sin(polar), np.sin(around)),
            np.cos(polar)[:, None] + 0 * around,
        ],
        axis=-1,
    )
    place[:, -1] = place[:, 0]  # closed to the bit
    place[0], place[-1] = (0, 0, 1), (0, 0, -1)
    a, b, c, d = place[:-1, :-1], place[1:, :-1], place[1:, 1:], place[:-1, 1:]
    triangles = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3, 3)
    return (np.array(centre) + radius * triangles).astype(np.float32)


def written(path, triangles) -> None:
    records = np.zeros(len(triangles), RECORD)
    records["corners"] = triangles
    path.write_bytes(bytes(80) + len(triangles).to_bytes(4, "little") + records.tobytes())


def test_a_cube_is_the_box_of_its_corners():
    for low, high in (((-0.5, -0.3, 0.4), (0.7, 0.4, 2.1)), ((-0.4375, -0.5625, 0.5625), (0.4375, 0.5625, 1.4375))):
        inside, wanted = Mesh(cube(low, high)).voxels(DOMAIN), BoxObstacle(low, high).voxels(DOMAIN)
        at_faces = BoxObstacle([v + 0.01 for v in low], [v - 0.01 for v in high]).voxels(DOMAIN)
        assert (inside <= wanted).all()
        assert (inside >= at_faces).all()


@pytest.mark.parametrize("turned", [False, True])
def test_a_round_mesh_is_a_ball(turned):
    triangles = ball((0.1, -0.05, 1.4), 0.6)
    inside = Mesh(triangles[:, ::-1] if turned else triangles).voxels(DOMAIN)
    wanted = Ball((0.1, -0.05, 1.4), 0.6).voxels(DOMAIN)
    assert (inside ^ wanted).sum() < 0.02 * wanted.sum()


def test_parts_of_a_mesh_may_overlap_and_leave_the_box():
    triangles = np.concatenate([cube((-0.5, -0.5, -1), (0.3, 0.5, 1)), cube((-0.1, -0.3, 0.5), (5, 0.3, 2))])
    inside = Mesh(triangles).voxels(DOMAIN)
    one, other = BoxObstacle((-0.5, -0.5, -1), (0.3, 0.5, 1)), BoxObstacle((-0.1, -0.3, 0.5), (5, 0.3, 2))
    np.testing.assert_array_equal(inside, one.voxels(DOMAIN) | other.voxels(DOMAIN))


def test_a_mesh_with_a_hole_works_and_a_plane_is_refused():
    triangles = ball((0, 0, 1.5), 0.6)
    holed = Mesh(np.delete(triangles, slice(300, 306), axis=0)).voxels(DOMAIN)
    assert (holed ^ Mesh(triangles).voxels(DOMAIN)).sum() < 0.02 * holed.sum()
    plane = np.array([[(-0.9, -0.9, 1), (0.9, -0.9, 1.2), (0.9, 0.9, 1)]], np.float32)
    with pytest.raises(ValueError):
        Mesh(plane).voxels(DOMAIN)


def test_an_stl_file_is_read_as_it_was_written(tmp_path):
    triangles = cube((-0.5, -0.3, 0.4), (0.7, 0.4, 2.1))
    path = tmp_path / "cube.stl"
    written(path, triangles)
    np.testing.assert_array_equal(Mesh.read(path).places, triangles[None])
    whole = path.read_bytes()
    for content in (b"", b"solid cube\nendsolid", whole[:-1], whole + b"x", whole[:HEADER], bytes(HEADER)):
        path.write_bytes(content)
        with pytest.raises(ValueError):
            Mesh.read(path)
    written(path, np.full((1, 3, 3), np.nan))
    with pytest.raises(ValueError):
        Mesh.read(path)
    for missing in (tmp_path, tmp_path / "none.stl"):
        with pytest.raises(ValueError):
            Mesh.read(missing)
