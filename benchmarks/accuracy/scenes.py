"""The scenes that reconstructions are scored on: a clip, and what is known that the reconstruction does not see."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from smokelift import Camera, Clip, Scene
from smokelift.evaluation.truth import Truth
from smokelift.footage.images import area_average
from smokelift.render import Image
from smokelift.scene.projection import project, ray_through_pixels

VIEWS = {"0": "front", "20": "nov20", "45": "nov45", "90": "side"}
"""Cameras of a baked scene by their angle about the vertical (degrees), and the names of their files."""

REAL_SIZE = (270, 480)
"""Columns and rows at which pictures of the ScalarFlow capture are compared."""

REAL_FRAMES = range(10, 111, 10)
"""Frames of the ScalarFlow capture that are scored."""


@dataclass(frozen=True, eq=False)
class BakedViews:
    """What the cameras of a baked scene see of its smoke alone: the files of `benchmarks.truth.picture`.

    Attributes
    ----------
    cameras
        By the keys of `VIEWS`.
    pictures
        Linear grey radiance before black, float16 [frame, row, column].
    """

    cameras: dict[str, Camera]
    pictures: dict[str, npt.NDArray[np.float16]]

    @staticmethod
    def load(folder: Path) -> BakedViews:
        """Read all cameras and their pictures."""
        pictures = {}
        for view, name in VIEWS.items():
            with np.load(folder / f"{name}.npz") as file:
                pictures[view] = file["image"]
        return BakedViews({view: camera_of(folder / f"{name}.toml") for view, name in VIEWS.items()}, pictures)

    def seen(self, view: str, frame: int) -> Image:
        """Return the picture of a camera in a frame, linear (rows, columns, 3)."""
        return np.repeat(self.pictures[view][frame][..., None].astype(np.float32), 3, axis=-1)


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
        Returns the input picture of a frame as it is put into a view.
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


def baked_scene(folder: Path, frames: int) -> KnownScene:
    """Return a scene of `benchmarks.truth.picture`, at most so many frames from its first."""
    truth, views = Truth.load(folder / "truth.npz"), BakedViews.load(folder)
    span = range(min(frames, truth.frames))

    def billboard(_: str, frame: int) -> Image:
        return views.seen("0", frame)

    return KnownScene(folder.name, folder / "scene.toml", span, span, views.cameras, views.seen, billboard, truth)


def captured_scene(folder: Path) -> KnownScene:
    """Return the ScalarFlow capture: its input is camera 02; it is scored on camera 00, which is not reconstructed."""
    names = {"input": "scene", "camera00": "camera00"}
    described = {view: Scene.load(folder / f"{name}.toml") for view, name in names.items()}
    cameras = {view: camera_of(folder / f"{name}.toml").resized(*REAL_SIZE) for view, name in names.items()}
    clips = {view: Clip.open(scene.clip) for view, scene in described.items() if scene.clip is not None}
    domain = described["input"].domain
    if domain is None:
        raise ValueError(f"{folder / 'scene.toml'}: has no [domain].")
    centre = np.array(domain.centre)

    def seen(view: str, frame: int) -> Image:
        return area_average(clips[view].frame(frame), *REAL_SIZE)

    def billboard(view: str, frame: int) -> Image:
        return picture_on_screen(seen("input", frame), cameras["input"], cameras[view], centre)

    frames = range(REAL_FRAMES[-1] + 1)
    return KnownScene(folder.name, folder / "scene.toml", frames, REAL_FRAMES, cameras, seen, billboard, None)


def camera_of(path: Path) -> Camera:
    """Return the camera of a scene file."""
    camera = Scene.load(path).camera
    if camera is None:
        raise ValueError(f"{path}: has no [camera].")
    return camera


def picture_on_screen(picture: Image, source: Camera, view: Camera, centre: npt.NDArray[np.float64]) -> Image:
    """Return a picture as another camera sees it on an upright screen that turns to face whoever looks.

    Parameters
    ----------
    picture : (rows, columns, 3)
        What the source camera saw.
    source, view
        The camera of the picture, and the one that looks at the screen.
    centre : (3,)
        The middle of the screen (m).
    """

    def across(camera: Camera) -> npt.NDArray[np.float64]:
        right = np.array(camera.matrix)[:2, 0]
        return np.array([*right / np.linalg.norm(right), 0.0])

    origin, direction = ray_through_pixels(view)
    facing = np.cross(across(view), [0.0, 0.0, 1.0])
    points = origin + direction * (((centre - origin) @ facing) / (direction @ facing))[..., None]
    lateral, height = (points - centre) @ across(view), points[..., 2] - centre[2]
    pixels, _ = project(source, centre + lateral[..., None] * across(source) + height[..., None] * [0.0, 0.0, 1.0])
    columns, rows = (np.rint(pixels[..., axis] - 0.5).astype(int) for axis in (0, 1))
    inside = (rows >= 0) & (rows < picture.shape[0]) & (columns >= 0) & (columns < picture.shape[1])
    shown = np.zeros((*inside.shape, 3), np.float32)
    shown[inside] = picture[rows[inside], columns[inside]]
    return shown
