"""What the renderer has to know about a shot: cameras, domain, medium, lights, background.

Conventions: right-handed world, Z up, metres. Cameras look along their local -Z with +Y up, as Blender's do.
Image coordinates are in pixels, x to the right and y down from the top left corner, pixel centres at half
integers. Directions of lights are directions of travel.

Every class checks its values where it is made, so a scene built in Python and one read from a file are
refused for the same reasons; :mod:`smokelift.scene.file` adds the file and the line to the message.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
import numpy.typing as npt

Vector = tuple[float, float, float]
Side = Literal["x-", "x+", "y-", "y+", "z-", "z+"]
Scattering = Literal["single", "unshadowed", "absorption"]
SCATTERINGS: tuple[Scattering, ...] = ("single", "unshadowed", "absorption")
SIDES: tuple[Side, ...] = ("x-", "x+", "y-", "y+", "z-", "z+")
Matrix = tuple[tuple[float, float, float, float], ...]


class SceneError(ValueError):
    """A scene that cannot be used: what was expected, and what was found.

    Attributes
    ----------
    table, key
        Where in a scene file the value would stand; empty when unknown.
    """

    def __init__(self, message: str, *, key: str = "", table: str = "") -> None:
        super().__init__(message)
        self.key = key
        self.table = table


def shown(value: object) -> str:
    """Return a value as a scene file would have it, cut to a readable length."""
    if isinstance(value, bool):
        return str(value).lower()
    text = f'"{value}"' if isinstance(value, str) else repr(value).replace("(", "[").replace(")", "]")
    return text if len(text) <= 60 else text[:57] + "..."


def number(value: Any, key: str, expected: str = "a number") -> float:
    """Return ``value`` as a finite float, or raise a SceneError that names ``key``."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.number):
        raise SceneError(f"{key} must be {expected}, not {shown(value)}", key=key)
    result = float(value)
    if not math.isfinite(result):
        raise SceneError(f"{key} must be {expected}, not {shown(value)}", key=key)
    return result


def integer(value: Any, key: str, expected: str = "a whole number") -> int:
    """Return ``value`` as an int, or raise a SceneError that names ``key``."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | np.integer):
        raise SceneError(f"{key} must be {expected}, not {shown(value)}", key=key)
    return int(value)


def items(value: Any, count: int, key: str, expected: str) -> list[Any]:
    """Return ``value`` as a list of ``count`` items, or raise a SceneError that names ``key``."""
    listed = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(listed, list | tuple) or len(listed) != count:
        raise SceneError(f"{key} must be {expected}, not {shown(listed)}", key=key)
    return list(listed)


def vector(value: Any, key: str, expected: str = "three numbers [x, y, z]") -> Vector:
    """Return ``value`` as three finite floats, or raise a SceneError that names ``key``."""
    x, y, z = (number(v, key, expected) for v in items(value, 3, key, expected))
    return x, y, z


def _colour(value: Any, key: str) -> Vector:
    expected = "three numbers [r, g, b], none below 0"
    rgb = vector(value, key, expected)
    if min(rgb) < 0.0:
        raise SceneError(f"{key} must be {expected}, not {shown(list(rgb))}", key=key)
    return rgb


def _set(instance: object, **values: object) -> None:
    for name, value in values.items():
        object.__setattr__(instance, name, value)


def _path(value: Any, key: str) -> Path:
    if not isinstance(value, str | Path) or not str(value):
        raise SceneError(f"{key} must be the path of a file, not {shown(value)}", key=key)
    return Path(value)


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
        Perspective: focal lengths in pixels. Orthographic: pixels per metre.
    cx, cy
        Where the optical axis meets the picture, in pixels.
    matrices
        Of a camera that moves: its matrix in every frame of the clip that is used, ``matrix`` the first of them.
        Empty for one that stands still.

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
        """Check every value and store plain tuples."""
        if self.type not in ("perspective", "orthographic"):
            raise SceneError(f'type must be "perspective" or "orthographic", not {shown(self.type)}', key="type")
        _set(self, matrices=tuple(_rigid(matrix, "matrices") for matrix in self.matrices))
        _set(self, matrix=_rigid(self.matrix), size=picture_size(self.size))
        if self.matrices and self.matrix != self.matrices[0]:
            raise SceneError("matrix must be the first of matrices", key="matrices")
        for key in ("fx", "fy"):
            value = number(getattr(self, key), key, "a number above 0")
            if value <= 0.0:
                raise SceneError(f"{key} must be a number above 0, not {shown(value)}", key=key)
            _set(self, **{key: value})
        _set(self, cx=number(self.cx, "cx"), cy=number(self.cy, "cy"))

    @classmethod
    def look_at(
        cls,
        position: Vector,
        target: Vector,
        up: Vector = (0.0, 0.0, 1.0),
        *,
        fov_y_degrees: float,
        size: tuple[int, int],
    ) -> Camera:
        """Return a perspective camera that looks from one point at another.

        Parameters
        ----------
        position, target
            Points in metres.
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
        """
        width, height = picture_size(size)
        focal = focal_length(fov_y_degrees, height)
        matrix = look_at_matrix(position, target, up)
        return cls("perspective", matrix, (width, height), focal, focal, width / 2, height / 2)

    @property
    def position(self) -> Vector:
        """Where the camera is, in metres."""
        return self.matrix[0][3], self.matrix[1][3], self.matrix[2][3]

    @property
    def moves(self) -> bool:
        """Whether it has a matrix for every frame."""
        return bool(self.matrices)

    def at(self, frame: int) -> Camera:
        """Return the camera as it stands in a frame, counted from 0 at the first that is used.

        Raises
        ------
        SceneError
            If it moves, and has no matrix for that frame.
        """
        if not self.moves:
            return self
        if not 0 <= frame < len(self.matrices):
            raise SceneError(f"matrices are given for frames 0 to {len(self.matrices) - 1}, not for {frame}")
        return replace(self, matrix=self.matrices[frame], matrices=())

    def resized(self, width: int, height: int) -> Camera:
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

    def cropped(self, x0: int, y0: int, width: int, height: int) -> Camera:
        """Return the camera of a part of the picture whose top left pixel is (x0, y0)."""
        return replace(self, size=(width, height), cx=self.cx - x0, cy=self.cy - y0)


def picture_size(value: Any) -> tuple[int, int]:
    """Return a picture's width and height in pixels, checked."""
    expected = "[width, height] in pixels, both at least 1"
    width, height = (integer(v, "size", expected) for v in items(value, 2, "size", expected))
    if min(width, height) < 1:
        raise SceneError(f"size must be {expected}, not {shown([width, height])}", key="size")
    return width, height


def focal_length(fov_y_degrees: Any, height: int) -> float:
    """Return the focal length in pixels of a picture ``height`` pixels high."""
    expected = "a number between 0 and 180"
    degrees = number(fov_y_degrees, "fov_y_degrees", expected)
    if not 0.0 < degrees < 180.0:
        raise SceneError(f"fov_y_degrees must be {expected}, not {shown(degrees)}", key="fov_y_degrees")
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
    return cast(Matrix, tuple(tuple(row) for row in [*rows.tolist(), [0.0, 0.0, 0.0, 1.0]]))


def _rigid(value: Any, key: str = "matrix") -> Matrix:
    """Check a camera to world matrix. A few rounded digits in a file (1e-3) are forgiven."""
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
        raise SceneError(f"{name} must be rigid: its upper left 3x3 part mirrors", key=key)
    return cast(Matrix, tuple(tuple(row) for row in rows))


@dataclass(frozen=True)
class Domain:
    """The box that holds the smoke; voxels are cubes.

    Attributes
    ----------
    min, max
        Corners in metres.
    resolution
        Voxels along x, y, z.

    Raises
    ------
    SceneError
        If the box is empty, or its voxels are not cubes to 0.1 %.
    """

    min: Vector
    max: Vector
    resolution: tuple[int, int, int]

    def __post_init__(self) -> None:
        """Check every value and store plain tuples."""
        _set(self, min=vector(self.min, "min"), max=vector(self.max, "max"))
        expected = "three whole numbers [nx, ny, nz], all at least 1"
        counts = tuple(integer(v, "resolution", expected) for v in items(self.resolution, 3, "resolution", expected))
        if min(counts) < 1:
            raise SceneError(f"resolution must be {expected}, not {shown(list(counts))}", key="resolution")
        _set(self, resolution=counts)
        for axis, low, high in zip("xyz", self.min, self.max, strict=True):
            if not low < high:
                raise SceneError(
                    f"max must be above min on every axis; along {axis} min is {low:g} and max {high:g}",
                    key="max",
                )
        edges = [(high - low) / n for low, high, n in zip(self.min, self.max, counts, strict=True)]
        if max(edges) > 1.001 * min(edges):
            raise SceneError(
                "resolution must make cubic voxels; they would be "
                + " x ".join(f"{edge:.6g}" for edge in edges)
                + " m",
                key="resolution",
            )

    @property
    def voxel_size(self) -> float:
        """Voxel edge in metres."""
        return (self.max[0] - self.min[0]) / self.resolution[0]

    @property
    def centre(self) -> Vector:
        """Middle of the box in metres."""
        x, y, z = ((low + high) / 2 for low, high in zip(self.min, self.max, strict=True))
        return x, y, z

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of an array of voxels, the same as ``resolution``."""
        return self.resolution

    def contains(self, point: Vector) -> bool:
        """Return whether a point lies inside the box or on its surface."""
        return all(low <= p <= high for low, p, high in zip(self.min, point, self.max, strict=True))

    def corners(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Return the eight corners in metres, shape (8, 3)."""
        axes = np.meshgrid(*zip(self.min, self.max, strict=True), indexing="ij")
        corners: np.ndarray[Any, np.dtype[np.float64]] = np.stack(axes, axis=-1).reshape(8, 3)
        return corners


@dataclass(frozen=True)
class Inlet:
    """A place where smoke enters: a ball.

    Attributes
    ----------
    centre
        In metres.
    radius
        In metres, above 0.
    """

    centre: Vector
    radius: float

    def __post_init__(self) -> None:
        """Check the values."""
        expected = "a number of metres above 0"
        radius = number(self.radius, "radius", expected)
        if radius <= 0.0:
            raise SceneError(f"radius must be {expected}, not {shown(radius)}", key="radius")
        _set(self, centre=vector(self.centre, "centre"), radius=radius)

    def reaches(self, domain: Domain) -> bool:
        """Return whether any of it lies in a box."""
        nearest = np.clip(self.centre, domain.min, domain.max)
        return math.dist(self.centre, nearest) <= self.radius

    def voxels(self, domain: Domain) -> npt.NDArray[np.bool_]:
        """Return where it is, shape (nx, ny, nz): voxels whose centres lie in it, or the nearest if none does."""
        places = zip(domain.min, self.centre, domain.resolution, strict=True)
        x, y, z = np.ix_(*(low + (np.arange(n) + 0.5) * domain.voxel_size - centre for low, centre, n in places))
        squares = x**2 + y**2 + z**2
        inside: npt.NDArray[np.bool_] = squares <= max(self.radius**2, squares.min())
        return inside


@dataclass(frozen=True)
class Medium:
    """Optical properties of the smoke.

    Attributes
    ----------
    extinction
        Extinction cross-section, 1/m per unit density.
    albedo
        Single-scattering albedo, 0 to 1.
    anisotropy
        Henyey-Greenstein g, -1 < g < 1.
    """

    extinction: float = 5.0
    albedo: float = 0.9
    anisotropy: float = 0.0

    def __post_init__(self) -> None:
        """Check every value."""
        extinction = number(self.extinction, "extinction", "a number above 0")
        albedo = number(self.albedo, "albedo", "a number from 0 to 1")
        anisotropy = number(self.anisotropy, "anisotropy", "a number between -1 and 1")
        for key, value, good, expected in (
            ("extinction", extinction, extinction > 0.0, "a number above 0"),
            ("albedo", albedo, 0.0 <= albedo <= 1.0, "a number from 0 to 1"),
            ("anisotropy", anisotropy, -1.0 < anisotropy < 1.0, "a number between -1 and 1"),
        ):
            if not good:
                raise SceneError(f"{key} must be {expected}, not {shown(value)}", key=key)
        _set(self, extinction=extinction, albedo=albedo, anisotropy=anisotropy)


@dataclass(frozen=True)
class DirectionalLight:
    """Parallel light; ``direction`` is the direction of travel, ``irradiance`` in W/m^2 per channel."""

    direction: Vector
    irradiance: Vector

    def __post_init__(self) -> None:
        """Check the values and make the direction a unit vector."""
        direction = vector(self.direction, "direction")
        length = math.hypot(*direction)
        if length == 0.0:
            raise SceneError("direction must not be [0, 0, 0]", key="direction")
        # What is a unit vector already stays as it is: a saved scene must come back the same.
        if abs(length - 1.0) > 1e-12:
            x, y, z = direction
            direction = (x / length, y / length, z / length)
        _set(self, direction=direction, irradiance=_colour(self.irradiance, "irradiance"))


@dataclass(frozen=True)
class PointLight:
    """Light from a point; ``intensity`` in W/sr per channel."""

    position: Vector
    intensity: Vector

    def __post_init__(self) -> None:
        """Check the values."""
        _set(self, position=vector(self.position, "position"), intensity=_colour(self.intensity, "intensity"))


@dataclass(frozen=True)
class EnvironmentLight:
    """Light from an equirectangular picture (.exr, .hdr), turned about Z, scaled by ``strength``.

    ``directions`` is the number of parallel lights that stand for it; None takes as many as the smoke needs.
    """

    image: Path
    rotation_degrees: float = 0.0
    strength: float = 1.0
    directions: int | None = None

    def __post_init__(self) -> None:
        """Check the values."""
        image = _path(self.image, "image")
        if image.suffix.lower() not in (".exr", ".hdr"):
            raise SceneError(f"image must be an .exr or .hdr file, not {shown(str(image))}", key="image")
        strength = number(self.strength, "strength", "a number not below 0")
        if strength < 0.0:
            raise SceneError(f"strength must be a number not below 0, not {shown(strength)}", key="strength")
        rotation = number(self.rotation_degrees, "rotation_degrees")
        _set(self, image=image, rotation_degrees=rotation, strength=strength)
        if self.directions is not None:
            expected = "a whole number from 1"
            directions = integer(self.directions, "directions", expected)
            if directions < 1:
                raise SceneError(f"directions must be {expected}, not {shown(directions)}", key="directions")
            _set(self, directions=directions)


Light = DirectionalLight | PointLight | EnvironmentLight


@dataclass(frozen=True)
class Background:
    """What the camera sees behind the smoke: one linear colour, or a picture (a clean plate).

    A video, or pictures written ``plate_####.png``, is a plate that changes: its frame n is behind the clip's frame
    n. With neither, the background is estimated from the clip.
    """

    color: Vector | None = None
    image: Path | None = None

    def __post_init__(self) -> None:
        """Check the values."""
        if self.color is not None and self.image is not None:
            raise SceneError("takes color or image, not both", key="image")
        if self.color is not None:
            _set(self, color=_colour(self.color, "color"))
        if self.image is not None:
            _set(self, image=_path(self.image, "image"))


@dataclass(frozen=True)
class ClipSource:
    """Where a clip lies and how to read it.

    Attributes
    ----------
    path
        A video, or an image sequence written ``frame_####.png``.
    fps
        Frames a second of the captured motion; None takes it from the file.
    frames
        First and last frame, both included, counted from 0; None takes all.
    transfer
        ``"srgb"`` or ``"linear"``; None takes srgb for 8 to 16 bit integers and linear for EXR.
    """

    path: Path
    fps: float | None = None
    frames: tuple[int, int] | None = None
    transfer: Literal["srgb", "linear"] | None = None

    def __post_init__(self) -> None:
        """Check the values."""
        _set(self, path=_path(self.path, "path"))
        if self.fps is not None:
            fps = number(self.fps, "fps", "a number above 0")
            if fps <= 0.0:
                raise SceneError(f"fps must be a number above 0, not {shown(fps)}", key="fps")
            _set(self, fps=fps)
        if self.frames is not None:
            expected = "[first, last], whole numbers from 0, first not after last"
            first, last = (integer(v, "frames", expected) for v in items(self.frames, 2, "frames", expected))
            if not 0 <= first <= last:
                raise SceneError(f"frames must be {expected}, not {shown([first, last])}", key="frames")
            _set(self, frames=(first, last))
        if self.transfer not in (None, "srgb", "linear"):
            raise SceneError(f'transfer must be "srgb" or "linear", not {shown(self.transfer)}', key="transfer")

    @property
    def first(self) -> int:
        """First frame, counted from 0."""
        return 0 if self.frames is None else self.frames[0]


@dataclass(frozen=True)
class View:
    """A further calibrated camera with its own clip.

    Attributes
    ----------
    camera
        One that stands still.
    clip
        Its ``frames`` are those at the moments of the scene's; None takes the same numbers.
    background
        What it sees behind the smoke; None takes the scene's if that is one colour, and else estimates it.
    """

    camera: Camera
    clip: ClipSource
    background: Background | None = None


@dataclass(frozen=True)
class Scene:
    """One shot. Whatever is None (or, for lights, empty) is estimated or defaulted before a run, and said.

    Attributes
    ----------
    closed
        Sides of the domain that are walls, given or estimated: smoke and air go freely through the others. A floor is
        ``("z-",)``.
    inlets
        All the places where smoke enters. Where none is marked they are looked for.
    scattering
        How light is scattered: ``"single"`` with self-shadowing, ``"unshadowed"`` or ``"absorption"``.

    Raises
    ------
    SceneError
        If a camera can see the domain in no frame, a point light stands inside it, an inlet lies outside, or a side
        or the kind of scattering is unknown.
    """

    clip: ClipSource | None = None
    camera: Camera | None = None
    domain: Domain | None = None
    medium: Medium | None = None
    lights: tuple[Light, ...] = ()
    background: Background | None = None
    views: tuple[View, ...] = field(default=())
    closed: tuple[Side, ...] = ()
    inlets: tuple[Inlet, ...] = ()
    scattering: Scattering | None = None

    def __post_init__(self) -> None:
        """Check what no table can check alone."""
        _set(self, lights=tuple(self.lights), views=tuple(self.views), inlets=tuple(self.inlets))
        _set(self, closed=_sides(self.closed))
        if self.scattering not in (None, *SCATTERINGS):
            known = ", ".join(f'"{name}"' for name in SCATTERINGS)
            raise SceneError(
                f"scattering must be one of {known}, not {shown(self.scattering)}", key="scattering", table="medium"
            )
        if self.domain is None:
            return
        for index, inlet in enumerate(self.inlets):
            if not inlet.reaches(self.domain):
                raise SceneError(
                    f"is outside the domain: nothing within {inlet.radius:g} m of centre {shown(list(inlet.centre))} "
                    "is in the box; move it in",
                    key="centre",
                    table=f"inlet.{index}",
                )
        for index, light in enumerate(self.lights):
            if isinstance(light, PointLight) and self.domain.contains(light.position):
                raise SceneError(
                    f"position {shown(list(light.position))} is inside the domain; it must be outside",
                    key="position",
                    table=f"lights.{index}",
                )
        cameras: Iterable[tuple[str, Camera | None]] = [
            ("camera", self.camera),
            *((f"views.{index}.camera", view.camera) for index, view in enumerate(self.views)),
        ]
        for table, camera in cameras:
            if camera is None:
                continue
            frames = range(len(camera.matrices) or 1)
            if not any(sees(camera.at(frame), self.domain) for frame in frames):
                raise SceneError("does not see the domain: no part of the box is in its picture", table=table)

    def with_frames(self, first: int, last: int) -> Scene:
        """Return the scene with another range of its clip's frames; the further views keep step with it.

        Raises
        ------
        SceneError
            If the scene has no clip, or a range is none.
        """
        if self.clip is None:
            raise SceneError("a scene without a clip has no frames", table="clip")
        skipped = first - self.clip.first
        views = []
        for index, view in enumerate(self.views):
            if view.clip.frames is not None:
                start = view.clip.first + skipped
                if start < 0:
                    raise SceneError(
                        f"its clip begins {-start} frames after frame {first} of the input; begin later",
                        key="frames",
                        table=f"views.{index}.clip",
                    )
                view = replace(view, clip=replace(view.clip, frames=(start, start + last - first)))
            views.append(view)
        return replace(self, clip=replace(self.clip, frames=(first, last)), views=tuple(views))

    def inflow(self) -> npt.NDArray[np.bool_] | None:
        """Return the voxels of the domain where smoke enters, shape (nx, ny, nz); None if no inlet is marked."""
        if self.domain is None or not self.inlets:
            return None
        inflow = np.zeros(self.domain.shape, np.bool_)
        for inlet in self.inlets:
            inflow |= inlet.voxels(self.domain)
        return inflow

    @classmethod
    def load(cls, path: str | Path) -> Scene:
        """Read a scene file.

        Relative paths in it are relative to the file; the returned ones are absolute.

        Raises
        ------
        SceneError
            With the file, the line, the key, what was expected and what was found.
        """
        from smokelift.scene.file import load_scene

        return load_scene(Path(path))

    def save(self, path: str | Path) -> None:
        """Write a scene file that :meth:`load` reads back as an equal scene.

        Paths below the file's folder are written relative to it, all others absolute.
        """
        from smokelift.scene.file import save_scene

        save_scene(self, Path(path))


def _sides(value: Any) -> tuple[Side, ...]:
    """Check the names of walls and put them in order."""
    given = list(value) if isinstance(value, tuple) else value
    if not isinstance(given, list) or any(name not in SIDES for name in given):
        known = ", ".join(f'"{side}"' for side in SIDES)
        raise SceneError(
            f"closed must be a list of sides of the box, of {known}, not {shown(given)}", key="closed", table="domain"
        )
    return tuple(side for side in SIDES if side in given)


def sees(camera: Camera, domain: Domain) -> bool:
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
