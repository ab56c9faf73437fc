"""Cameras: what one is, how to point it or carry it around, and where points of the world lie in its picture."""

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from smokelift.checks import Doubles, shown
from smokelift.scene.checks import SceneError, Vector, integer, items, number, positive, set_fields, unexpected, vector
from smokelift.scene.domain import Box, Domain

Matrix = tuple[tuple[float, float, float, float], ...]
"""4x4, row-major."""

LARGEST_PICTURE = 2**15
"""Pixels along a side of a picture, at most."""


@dataclass(frozen=True)
class Camera:
    """A pinhole or an orthographic camera.

    Attributes
    ----------
    type
        ``"perspective"`` or ``"orthographic"``.
    matrix
        4x4 camera to world, row-major, rigid (rotation and translation).
    size
        Picture width and height in pixels.
    fx, fy
        Perspective: focal lengths in pixels. Orthographic: pixels per meter.
    cx, cy
        Where the optical axis meets the picture, in pixels.
    matrices
        Matrices of a camera that moves, one for every frame of the clip that is used; ``matrix`` is the first of them.
        Empty for a camera that stands still.

    Raises
    ------
    SceneError
        If a matrix is not rigid, or a size or focal length is not positive.
    """

    type: Literal["perspective", "orthographic"]
    matrix: Matrix
    size: tuple[int, int]
    fx: float
    fy: float
    cx: float
    cy: float
    matrices: tuple[Matrix, ...] = ()

    def __post_init__(self) -> None:
        if self.type not in ("perspective", "orthographic"):
            raise unexpected(self.type, "type", '"perspective" or "orthographic"')
        set_fields(self, matrices=tuple(_rigid(matrix, "matrices") for matrix in self.matrices))
        set_fields(self, matrix=_rigid(self.matrix), size=picture_size(self.size))
        if self.matrices and self.matrix != self.matrices[0]:
            raise SceneError("matrix must be the first of matrices; give matrices alone", key="matrices")
        for key in ("fx", "fy"):
            set_fields(self, **{key: positive(getattr(self, key), key)})
        set_fields(self, cx=number(self.cx, "cx"), cy=number(self.cy, "cy"))

    @classmethod
    def look_at(
        cls,
        position: Vector,
        target: Vector,
        up: Vector = (0.0, 0.0, 1.0),
        *,
        fov_y_degrees: float,
        size: tuple[int, int],
    ) -> "Camera":
        """Return a perspective camera that looks from one point at another.

        Parameters
        ----------
        position, target
            Points in meters.
        up
            A direction that is up in the picture.
        fov_y_degrees
            Angle between the lower and the upper edge of the picture.
        size
            Width and height in pixels.

        Raises
        ------
        SceneError
            If the points coincide, or ``up`` is parallel to the line of sight.

        Examples
        --------
        >>> from smokelift import Camera
        >>> camera = Camera.look_at((0, -7, 1.5), (0, 0, 1.5), fov_y_degrees=30, size=(256, 384))
        >>> camera.position
        (0.0, -7.0, 1.5)
        """
        width, height = picture_size(size)
        focal = focal_length(fov_y_degrees, height)
        matrix = look_at_matrix(position, target, up)
        return cls("perspective", matrix, (width, height), focal, focal, width / 2, height / 2)

    @property
    def position(self) -> Vector:
        """Where the camera is, in meters."""
        return self.matrix[0][3], self.matrix[1][3], self.matrix[2][3]

    @property
    def moves(self) -> bool:
        """Whether it has a matrix for every frame."""
        return bool(self.matrices)

    def require_outside(self, domain: Box) -> None:
        """Refuse a perspective camera that stands inside a box in any frame: nothing bounds the smoke around it.

        Raises
        ------
        SceneError
            With the position.
        """
        for matrix in self.matrices or (self.matrix,):
            x, y, z = (row[3] for row in matrix[:3])
            if self.type == "perspective" and domain.contains((x, y, z)):
                raise SceneError(
                    f"The camera at {shown([x, y, z])} stands inside the domain; move it out, or make the domain "
                    "smaller.",
                    table="camera",
                )

    def at(self, frame: int) -> "Camera":
        """Return the camera as it stands in a frame, counted from 0 at the first that is used.

        Raises
        ------
        SceneError
            If it moves, and has no matrix for that frame.
        """
        if not self.moves:
            return self
        if not 0 <= frame < len(self.matrices):
            raise SceneError(
                f"matrices are given for frames 0 to {len(self.matrices) - 1}, not for {frame}; give one per frame"
            )
        return replace(self, matrix=self.matrices[frame], matrices=())

    def resized(self, width: int, height: int) -> "Camera":
        """Return the same camera with another number of pixels over the same field of view."""
        across, down = width / self.size[0], height / self.size[1]
        return replace(
            self,
            size=(width, height),
            fx=self.fx * across,
            fy=self.fy * down,
            cx=self.cx * across,
            cy=self.cy * down,
        )

    def cropped(self, x0: int, y0: int, width: int, height: int) -> "Camera":
        """Return the camera of a part of the picture whose top left pixel is (x0, y0)."""
        return replace(self, size=(width, height), cx=self.cx - x0, cy=self.cy - y0)


def picture_size(value: Any) -> tuple[int, int]:
    """Return a picture's width and height in pixels, checked."""
    expected = f"[width, height] in pixels, both at least 1 and at most {LARGEST_PICTURE}"
    width, height = (integer(v, "size", expected, 1, LARGEST_PICTURE) for v in items(value, 2, "size", expected))
    return width, height


def focal_length(fov_y_degrees: Any, height: int) -> float:
    """Return the focal length in pixels of a picture ``height`` pixels high."""
    degrees = number(
        fov_y_degrees, "fov_y_degrees", "a number between 0.001 and 179.99", lambda v: 0.001 <= v <= 179.99
    )
    return 0.5 * height / math.tan(math.radians(degrees) / 2)


def look_at_matrix(position: Any, target: Any, up: Any) -> Matrix:
    """Return the camera to world matrix of a camera at ``position`` that looks at ``target``."""
    eye = np.array(vector(position, "position"))
    back = eye - np.array(vector(target, "target"))
    distance = float(np.linalg.norm(back))
    if distance == 0.0:
        raise SceneError("target must differ from position", key="target")
    back /= distance
    right = np.cross(np.array(vector(up, "up")), back)
    sine = float(np.linalg.norm(right))
    if sine < 1e-6 * max(1.0, float(np.linalg.norm(up))):
        raise SceneError(f"up must not be zero or along the line of sight, not {shown(up)}", key="up")
    right /= sine
    rows = np.column_stack([right, np.cross(back, right), back, eye])
    return as_matrix(np.vstack([rows, [0.0, 0.0, 0.0, 1.0]]))


def _rigid(value: Any, key: str = "matrix") -> Matrix:
    """Check a camera to world matrix. The rounding of a few digits in a file (1e-3) is allowed."""
    name = key if key == "matrix" else f"every one of {key}"
    expected = "four rows of four numbers, camera to world"
    rows = [[number(v, key, expected) for v in items(row, 4, key, expected)] for row in items(value, 4, key, expected)]
    rotation = np.array(rows)[:3, :3]
    if rows[3] != [0.0, 0.0, 0.0, 1.0]:
        raise SceneError(f"{name} must end with the row [0, 0, 0, 1], not {shown(rows[3])}", key=key)
    if np.abs(rotation.T @ rotation - np.eye(3)).max() > 1e-3:
        raise SceneError(
            f"{name} must be rigid: its upper left 3x3 part must be a rotation without scale or shear", key=key
        )
    if np.linalg.det(rotation) < 0.0:
        raise SceneError(f"{name} must be rigid: its upper left 3x3 part mirrors; flip one of its axes", key=key)
    return as_matrix(np.array(rows))


def as_matrix(values: Doubles) -> Matrix:
    """Return a 4x4 array as the nested tuples that a frozen camera holds."""
    rows = [tuple(float(v) for v in row) for row in values]
    return tuple((r[0], r[1], r[2], r[3]) for r in rows)


def orbit(camera: Camera, domain: Box, yaw_degrees: float, pitch_degrees: float = 0.0) -> Camera:
    """Return the camera turned about the domain's center, which stays at the same distance and place of the picture.

    The yaw is about the world's Z, counter-clockwise seen from above: 90 looks from the right side. The pitch then
    raises the camera about its own horizontal axis; negative lowers it. A camera that moves is turned in every frame.
    """
    matrices = [_turned(np.array(matrix), domain, yaw_degrees, pitch_degrees) for matrix in camera.matrices]
    first = _turned(np.array(camera.matrix), domain, yaw_degrees, pitch_degrees)
    return replace(camera, matrix=first, matrices=tuple(matrices))


def shared_part(whole: Camera, camera: Camera) -> tuple[slice, slice] | None:
    """Return which rows and columns of a camera's picture another camera shows, to the nearest pixel.

    Neither moves. It is None if the second stands elsewhere, looks elsewhere or shows more than that picture.
    """
    if camera.type != whole.type or not np.allclose(camera.matrix, whole.matrix, rtol=0, atol=1e-9):
        return None
    across, down = whole.fx / camera.fx, whole.fy / camera.fy
    left, top = round(whole.cx - camera.cx * across), round(whole.cy - camera.cy * down)
    right, bottom = left + round(camera.size[0] * across), top + round(camera.size[1] * down)
    inside = left >= 0 and top >= 0 and right <= whole.size[0] and bottom <= whole.size[1]
    return np.s_[top:bottom, left:right] if inside and right > left and bottom > top else None


def _turned(matrix: Doubles, domain: Box, yaw_degrees: float, pitch_degrees: float) -> Matrix:
    """A camera's matrix after `orbit`."""
    center = np.array(domain.centre)
    right = matrix[:3, 0]
    turn = _rotation(np.array([0.0, 0.0, 1.0]), yaw_degrees) @ _rotation(right, -pitch_degrees)
    moved = matrix.copy()
    moved[:3, :3] = turn @ matrix[:3, :3]
    moved[:3, 3] = center + turn @ (matrix[:3, 3] - center)
    return as_matrix(moved)


def _rotation(axis: Doubles, degrees: float) -> Doubles:
    """Rotation matrix about a unit axis (Rodrigues)."""
    angle = np.radians(degrees)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


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
