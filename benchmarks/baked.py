"""Scenes that `benchmarks.truth` baked and pictured: their smoke, and what four cameras see of it alone."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from smokelift import Camera, Scene
from smokelift.evaluation.truth import on_grid
from smokelift.footage.images import Picture, area_average
from smokelift.render import scene_renderer
from smokelift.scene import completed

VIEWS = {"0": "front", "20": "nov20", "45": "nov45", "90": "side"}
"""Cameras of a baked scene by their angle about the vertical (degrees), and the names of their files."""

FRONT = "0"
"""The view of the clip."""

BLACK = np.zeros(3, np.float32)
WHITE = (1.0, 1.0, 1.0)

Volumes = npt.NDArray[np.floating[Any]]
"""Densities of all frames, [frame, x, y, z]."""


@dataclass(frozen=True, eq=False)
class Seen:
    """What a camera sees of smoke alone.

    Attributes
    ----------
    radiance, transmittance : (frames, rows, columns) float32
        Linear and gray, and the fraction of the light behind the smoke that passes.
    """

    radiance: Picture
    transmittance: Picture

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        _, rows, columns = self.radiance.shape
        return rows, columns

    def at(self, frames: Sequence[int] | slice) -> "Seen":
        """Return some of its frames."""
        return Seen(self.radiance[frames], self.transmittance[frames])

    def sized(self, size: tuple[int, int]) -> "Seen":
        """Return it at another size (columns, rows)."""
        both = (self.radiance, self.transmittance)
        return Seen(*(np.stack([area_average(picture, *size) for picture in pictures]) for pictures in both))

    def scattering(self, fraction: float) -> "Seen":
        """Return smoke that sends this fraction of the light that it sends."""
        return Seen(np.float32(fraction) * self.radiance, self.transmittance)

    def before(self, plate: npt.ArrayLike, color: tuple[float, float, float] = WHITE) -> Picture:
        """Return linear pictures (frames, rows, columns, 3) before a plate (rows, columns, 3), the smoke colored."""
        behind = self.transmittance[..., None] * np.asarray(plate, np.float32)
        return self.radiance[..., None] * np.asarray(color, np.float32) + behind


@dataclass(frozen=True, eq=False)
class Baked:
    """Smoke with what is known of it.

    Attributes
    ----------
    name
        The scene's.
    scene
        Camera, box, medium and lights; no clip and no background.
    cameras, views
        By the keys of `VIEWS`.
    densities
        In the scene's box, on the grid of the simulation.
    """

    name: str
    scene: Scene
    cameras: dict[str, Camera]
    views: dict[str, Seen]
    densities: Volumes

    @staticmethod
    def load(folder: Path, frames: int | None = None, views: Iterable[str] = VIEWS) -> "Baked":
        """Read a scene's first frames, or all, and some of its views.

        Where a view's transmittance is not stored, Smokelift's renderer computes it from the densities.
        """
        scene = replace(Scene.load(folder / "scene.toml"), clip=None, background=None)
        with np.load(folder / "truth.npz") as file:
            densities = file["density"][:frames]
        cameras = {view: camera_of(folder / f"{VIEWS[view]}.toml") for view in views}
        seen = {}
        for view, camera in cameras.items():
            with np.load(folder / f"{VIEWS[view]}.npz") as file:
                radiance = file["image"][:frames].astype(np.float32)
                if "transmittance" in file:
                    clear = file["transmittance"][:frames].astype(np.float32)
                else:
                    clear = rendered(scene, camera, densities).transmittance
            seen[view] = Seen(radiance, clear)
        return Baked(folder.name, scene, cameras, seen, densities)

    @property
    def front(self) -> Seen:
        """What the clip's camera sees."""
        return self.views[FRONT]

    def __len__(self) -> int:
        return len(self.densities)

    def at(self, frames: Sequence[int]) -> Self:
        """Return some of its frames, in any order and as often as wanted."""
        chosen = list(frames)
        views = {view: seen.at(chosen) for view, seen in self.views.items()}
        return replace(self, views=views, densities=self.densities[chosen])

    def sized(self, size: tuple[int, int]) -> Self:
        """Return it with pictures of another size (columns, rows)."""
        cameras = {view: camera.resized(*size) for view, camera in self.cameras.items()}
        views = {view: seen.sized(size) for view, seen in self.views.items()}
        return replace(self, scene=replace(self.scene, camera=cameras[FRONT]), cameras=cameras, views=views)

    def pictured(self) -> Self:
        """Return it with new pictures, single scattering by Smokelift's renderer on the grid of the simulation."""
        views = {view: rendered(self.scene, camera, self.densities) for view, camera in self.cameras.items()}
        return replace(self, views=views)


def rendered(scene: Scene, camera: Camera, densities: Volumes) -> Seen:
    """Return what a camera sees of densities that fill a scene's box, by Smokelift's renderer, single scattering."""
    x, y, z = densities.shape[1:]
    fine = on_grid(completed(replace(scene, scattering="single")), (x, y, z))
    renderer = scene_renderer(fine, camera, BLACK)
    seen = [(renderer.image(np.asarray(each, np.float32))[..., 0], renderer.transmittance) for each in densities]
    return Seen(*(np.stack(pictures) for pictures in zip(*seen, strict=True)))


def camera_of(path: Path) -> Camera:
    """Return the camera of a scene file."""
    camera = Scene.load(path).camera
    if camera is None:
        raise ValueError(f"{path}: has no [camera].")
    return camera
