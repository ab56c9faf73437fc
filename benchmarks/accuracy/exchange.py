"""Calibrations of which a part is given: single estimates of an uncalibrated clip in the place of what is known."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from smokelift import Camera, Domain
from smokelift.scene import CompleteScene, as_matrix
from smokelift.scene.projection import project

Matrix = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Given:
    """Which parts of a calibration are given; the others are as they were found.

    Attributes
    ----------
    focal
        The focal length.
    tilt
        How the camera is turned against the vertical; found, it is level.
    box
        Where from the camera the middle of the box is, and how large the box is.
    """

    focal: bool
    tilt: bool
    box: bool


def partly(given: CompleteScene, found: CompleteScene, parts: Given) -> tuple[Camera, Domain]:
    """The camera and the box of a scene of which some parts are given.

    A pixel of the picture is as large at the middle of the box, in voxels, as in the scene that is given.

    Parameters
    ----------
    given, found
        The same clip with a calibration, and without.
    """
    camera = found.camera
    if parts.focal:
        camera = replace(camera, fx=given.camera.fx, fy=given.camera.fy)
    if parts.tilt:
        camera = _turned(camera, _facing(np.array(given.camera.matrix)[:3, :3]))
    longer = camera.fx / given.camera.fx
    if parts.box:
        # in the given camera's coordinates; a longer lens stands farther away
        middle = np.linalg.inv(np.array(given.camera.matrix)) @ np.append(given.domain.centre, 1)
        centre = (np.array(camera.matrix) @ (middle * (1, 1, longer, 1)))[:3]
        size = np.array(given.domain.max) - np.array(given.domain.min)
        return camera, _box(centre, size, given.domain.resolution)
    away = camera.fx / found.camera.fx
    low, high, depth = _shown(found, camera, away)
    voxel = _voxel_pixels(given) * _distance(camera, (low + high) / 2) / camera.fx
    size = np.array([high[0] - low[0], depth, high[2] - low[2]])
    counts = 4 * np.ceil(size / voxel / 4 - 1e-6)
    # what is higher has its lower end where it was
    centre = (low + high) / 2
    centre[2] = low[2] + counts[2] * voxel / 2
    return camera, _box(centre, counts * voxel, tuple(counts.astype(int).tolist()))


def _facing(turn: Matrix) -> Matrix:
    """The same turn (3, 3) of a camera, but about the vertical: so that it looks along +Y."""
    return np.asarray(Rotation.from_euler("z", np.arctan2(-turn[0, 2], -turn[1, 2])).as_matrix() @ turn)


def _turned(camera: Camera, turn: Matrix) -> Camera:
    matrix = np.array(camera.matrix)
    matrix[:3, :3] = turn
    return replace(camera, matrix=as_matrix(matrix))


def _box(centre: Matrix, size: Matrix, counts: tuple[int, int, int]) -> Domain:
    low, high = centre - size / 2, centre + size / 2
    return Domain(tuple(low.tolist()), tuple(high.tolist()), counts)


def _shown(found: CompleteScene, camera: Camera, away: float) -> tuple[Matrix, Matrix, float]:
    """Lower left and upper right end, and depth, of what shows in a picture where a box was found.

    It stands upright ``away`` times as far from a camera as the middle of the box from the one that it was found with.
    """
    low, high = np.array(found.domain.min), np.array(found.domain.max)
    low[1] = high[1] = found.domain.centre[1]
    corners = np.array([[x, low[1], z] for x in (low[0], high[0]) for z in (low[2], high[2])])
    pixels = project(found.camera, corners)[0]
    rays = np.column_stack([(pixels - (camera.cx, camera.cy)) * (1, -1) / camera.fx, -np.ones(4)])
    matrix = np.array(camera.matrix)
    directions = rays @ matrix[:3, :3].T
    start = matrix[:3, 3]
    plane = away * (found.domain.centre[1] - start[1])
    places = start + directions * (plane / directions[:, 1])[:, None]
    depth = found.domain.max[1] - found.domain.min[1]
    return places.min(0), places.max(0), depth * np.ptp(places[:, 0]) / (high[0] - low[0])


def _distance(camera: Camera, place: Matrix) -> float:
    """How far away from a camera a place is, along the way that it looks."""
    matrix = np.array(camera.matrix)
    return float((matrix[:3, 3] - place) @ matrix[:3, 2])


def _voxel_pixels(scene: CompleteScene) -> float:
    """Pixels of a voxel in the middle of the box."""
    return scene.domain.voxel_size * scene.camera.fx / _distance(scene.camera, np.array(scene.domain.centre))
