"""Where points of the world lie in a camera's picture, and the rays through its pixels."""

import numpy as np

from smokelift.checks import Doubles
from smokelift.scene.camera import Camera
from smokelift.scene.domain import Box, Domain


def world_to_pixel(camera: Camera) -> Doubles:
    """Homogeneous 3x4 map from world points (m) to (x depth, y depth, depth) in pixels."""
    matrix = np.array(camera.matrix, np.float64)
    rotation, eye = matrix[:3, :3], matrix[:3, 3]
    to_camera = np.hstack([rotation.T, -rotation.T @ eye[:, None]])
    if camera.type == "perspective":
        intrinsics = np.array([[camera.fx, 0, -camera.cx], [0, -camera.fy, -camera.cy], [0, 0, -1.0]])
        return np.asarray(intrinsics @ to_camera)
    rows = np.array([[camera.fx, 0, 0], [0, -camera.fy, 0], [0, 0, 0]]) @ to_camera
    rows[:, 3] += (camera.cx, camera.cy, 1.0)
    return np.asarray(rows)


def project_points(camera: Camera, points: Doubles) -> tuple[Doubles, Doubles]:
    """Project world points (..., 3) to pixels, x and y (..., 2), and depths (...).

    The depth is the distance along the optical axis for a perspective camera (negative: behind it), 1 for an
    orthographic one.
    """
    matrix = world_to_pixel(camera)
    homogeneous = points @ matrix[:, :3].T + matrix[:, 3]
    depth = homogeneous[..., 2]
    safe = np.where(np.abs(depth) < 1e-12, 1e-12, depth)
    return homogeneous[..., :2] / safe[..., None], depth


def ray_through_pixels(camera: Camera) -> tuple[Doubles, Doubles]:
    """Origins and unit directions, each (rows, columns, 3), in world space, of the rays through pixel centers."""
    width, height = camera.size
    x = (np.arange(width) + 0.5 - camera.cx) / camera.fx
    y = -(np.arange(height) + 0.5 - camera.cy) / camera.fy
    grid_x, grid_y = np.meshgrid(x, y)
    matrix = np.array(camera.matrix, np.float64)
    rotation, eye = matrix[:3, :3], matrix[:3, 3]
    if camera.type == "perspective":
        local = np.stack([grid_x, grid_y, np.full_like(grid_x, -1.0)], -1)
        direction = local @ rotation.T
        direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
        return np.broadcast_to(eye, direction.shape), direction
    local = np.stack([grid_x, grid_y, np.zeros_like(grid_x)], -1)
    origin = local @ rotation.T + eye
    return origin, np.broadcast_to(-rotation[:, 2], origin.shape)


def voxel_width(camera: Camera, domain: Domain) -> float:
    """Return the width in pixels of a voxel at the domain's center."""
    _, depth = project_points(camera, np.array(domain.centre))
    near = domain.voxel_size if camera.type == "perspective" else 1.0
    return max(camera.fx, camera.fy) * domain.voxel_size / max(float(depth), near)


def sees(camera: Camera, domain: Box) -> bool:
    """Return False if all of the box lies outside one side of what a still camera sees.

    That test is exact for every box except one that passes by a corner of the picture, which counts as seen.
    """
    to_world = np.array(camera.matrix)
    x, y, z = ((domain.corners() - to_world[:3, 3]) @ to_world[:3, :3]).T
    depth = -z
    scale = depth if camera.type == "perspective" else np.ones_like(depth)
    column = camera.fx * x + camera.cx * scale  # times depth: no division, so points behind do no harm
    row = -camera.fy * y + camera.cy * scale
    width, height = camera.size
    outside = (depth <= 0.0, column < 0.0, column > width * scale, row < 0.0, row > height * scale)
    return not any(bool(side.all()) for side in outside)
