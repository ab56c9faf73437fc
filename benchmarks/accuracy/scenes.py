"""The scenes that reconstructions are scored on: a clip, and what is known that the reconstruction does not see."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from benchmarks.baked import FRONT, Baked, camera_of
from smokelift import Camera, Clip, Scene
from smokelift.evaluation.truth import Truth
from smokelift.footage.images import area_average
from smokelift.render import Image
from smokelift.scene.camera import project_points, ray_through_pixels

REAL_SIZE = (270, 480)
"""Columns and rows at which pictures of the ScalarFlow capture are compared."""

REAL_FRAMES = range(10, 111, 10)
"""Frames of the ScalarFlow capture that are scored."""

REGISTRATION = {"camera00": (-12, 18), "camera01": (52, 18), "camera03": (11, -12), "camera04": (11, -18)}
"""(Rows, columns) of 1920 x 1080 by which FluidNexus (2025) moves the recorded pictures of the ScalarFlow capture down
and to the right, because the published calibration is off by so much."""


@dataclass(frozen=True, eq=False)
class KnownScene:
    """A clip to reconstruct, and what its reconstructions are compared with.

    Attributes
    ----------
    name
        Of the scene.
    scene_path
        The scene file that a reconstruction may see.
    frames, scored
        The clip's frames that are reconstructed, and those of them that are scored; from 0.
    cameras
        By the name of the view; the first is the input's.
    seen
        Returns what a camera saw in a frame, linear (rows, columns, 3).
    billboard
        Returns the input picture of a frame as it is put into a view, on an upright plane in the middle of the box.
    truth
        Volumes and velocities, if they are known.
    """

    name: str
    scene_path: Path
    frames: range
    scored: range
    cameras: dict[str, Camera]
    seen: Callable[[str, int], Image]
    billboard: Callable[[str, int], Image]
    truth: Truth | None


def baked_scene(folder: Path, frames: int | None = None) -> KnownScene:
    """Return a scene of `benchmarks.truth.picture`, at most so many frames from its first."""
    truth, baked = Truth.load(folder / "truth.npz"), Baked.load(folder, frames)
    span = range(len(baked))

    def seen(view: str, frame: int) -> Image:
        return np.repeat(baked.views[view].radiance[frame][..., None], 3, axis=-1)

    return KnownScene(
        folder.name, folder / "scene.toml", span, span, baked.cameras, seen, lambda _, frame: seen(FRONT, frame), truth
    )


def captured_scene(folder: Path, *, registered: bool = False) -> KnownScene:
    """Return the ScalarFlow capture: its input is scene.toml, and it is scored on every cameraNN.toml beside it.

    Parameters
    ----------
    folder
        Of the scene files.
    registered
        Whether the recorded pictures are moved by `REGISTRATION`. Only cameras that it names are scored then.
    """
    paths = {"input": folder / "scene.toml"}
    for path in sorted(folder.glob("camera[0-9][0-9].toml")):
        if path.stem in REGISTRATION or not registered:
            paths[path.stem] = path
    described = {view: Scene.load(path) for view, path in paths.items()}
    domain = described["input"].domain
    if domain is None:
        raise ValueError(f"{paths['input']}: has no [domain].")
    cameras = {view: camera_of(path).resized(*REAL_SIZE) for view, path in paths.items()}
    clips = {view: Clip.open(scene.clip) for view, scene in described.items() if scene.clip is not None}
    center = np.array(domain.centre)

    def seen(view: str, frame: int) -> Image:
        picture = clips[view].frame(frame)
        if registered and view in REGISTRATION:
            rows, columns = REGISTRATION[view]
            picture = moved(picture, round(rows * len(picture) / 1920), round(columns * len(picture) / 1920))
        return area_average(picture, *REAL_SIZE)

    def billboard(view: str, frame: int) -> Image:
        return picture_on_plane(seen("input", frame), cameras["input"], cameras[view], center)

    name = f"{folder.name}, {'registered' if registered else 'as calibrated'}"
    frames = range(REAL_FRAMES[-1] + 1)
    return KnownScene(name, folder / "scene.toml", frames, REAL_FRAMES, cameras, seen, billboard, None)


def moved(picture: Image, down: int, right: int) -> Image:
    """Return a picture (rows, columns, 3) moved by whole pixels; what comes in is black."""
    return np.asarray(ndimage.shift(picture, (down, right, 0), order=0))


def picture_on_plane(picture: Image, source: Camera, view: Camera, center: npt.NDArray[np.float64]) -> Image:
    """Return a picture as another camera sees it on an upright plane that turns to face whoever looks.

    Parameters
    ----------
    picture : (rows, columns, 3)
        What the source camera saw.
    source, view
        The camera of the picture, and the one that looks at the plane.
    center : (3,)
        The middle of the plane (m).
    """

    def across(camera: Camera) -> npt.NDArray[np.float64]:
        right = np.array(camera.matrix)[:2, 0]
        return np.array([*right / np.linalg.norm(right), 0.0])

    origin, direction = ray_through_pixels(view)
    facing = np.cross(across(view), [0.0, 0.0, 1.0])
    points = origin + direction * (((center - origin) @ facing) / (direction @ facing))[..., None]
    lateral, height = (points - center) @ across(view), points[..., 2] - center[2]
    places = center + lateral[..., None] * across(source) + height[..., None] * [0.0, 0.0, 1.0]
    pixels, _ = project_points(source, places)
    columns, rows = (np.rint(pixels[..., axis] - 0.5).astype(int) for axis in (0, 1))
    inside = (rows >= 0) & (rows < picture.shape[0]) & (columns >= 0) & (columns < picture.shape[1])
    shown = np.zeros((*inside.shape, 3), np.float32)
    shown[inside] = picture[rows[inside], columns[inside]]
    return shown
