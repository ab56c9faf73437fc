"""Baked smoke with what is known of it, and the same smoke with a column that never leaves its pixels."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.accuracy.scenes import BakedViews
from benchmarks.background.clips import Smoke
from smokelift import Camera, Domain, Scene
from smokelift.evaluation.truth import Truth
from smokelift.footage.images import Picture
from smokelift.render import scene_renderer
from smokelift.scene import completed
from smokelift.transport import Array

GRID = (24, 24, 36)
"""Voxels of the reconstructions."""

SIZE = (96, 144)
"""Columns and rows of the pictures that are compared."""

FRONT = "0"
"""The view of the clip."""

SCORED = range(4, 40, 5)
"""Frames that are scored."""

COLUMN_AT, COLUMN_RADIUS = 0.45, 0.22
"""Where a column stands beside the middle of the box, and how thick it is (m)."""

COLUMN_DEPTH = 1.5
"""Optical depth through its middle, on average."""


@dataclass(frozen=True, eq=False)
class Baked:
    """Smoke with all that is known of it.

    Attributes
    ----------
    name
        Of the scene.
    scene
        Camera, box with the voxels of the reconstructions, medium and light; no clip and no background.
    front
        The pictures of the clip, all frames.
    cameras
        By the keys of `benchmarks.accuracy.scenes.VIEWS`, with pictures of `SIZE`.
    radiance, transmittance
        What each of them sees of the smoke alone in the scored frames, linear and grey, (frames, rows, columns).
    densities : (frames, x, y, z)
        All, on the grid of the simulation.
    """

    name: str
    scene: Scene
    front: Smoke
    cameras: dict[str, Camera]
    radiance: dict[str, Picture]
    transmittance: dict[str, Picture]
    densities: Array

    @staticmethod
    def load(folder: Path) -> Baked:
        """Read what `benchmarks.truth.picture` wrote."""
        scene = Scene.load(folder / "scene.toml")
        if scene.domain is None:
            raise ValueError(f"{folder}: the scene has no [domain].")
        views = BakedViews.load(folder)
        radiance, transmittance = views.averaged(SIZE, SCORED)
        return Baked(
            name=folder.name,
            scene=replace(scene, clip=None, background=None, domain=Domain(scene.domain.min, scene.domain.max, GRID)),
            front=Smoke.load(folder),
            cameras={view: camera.resized(*SIZE) for view, camera in views.cameras.items()},
            radiance=radiance,
            transmittance=transmittance,
            densities=Truth.load(folder / "truth.npz").densities.astype(np.float32),
        )

    def mass(self) -> float:
        """Extinction times volume of the smoke (m2), all scored frames together."""
        return optical_mass(self.scene, self.densities[SCORED.start : SCORED.stop : SCORED.step])

    def standing(self) -> Baked:
        """Return it with a wavering column beside its middle from the floor to the top that never goes away.

        Smokelift's own renderer pictures both, so that they shade each other.
        """
        scene = completed(replace(self.scene, scattering="single"))
        x, y, z = self.densities.shape[1:]
        low, high = np.array(scene.domain.min), np.array(scene.domain.max)
        centres = [a + (np.arange(n) + 0.5) * (b - a) / n for a, b, n in zip(low, high, (x, y, z), strict=True)]
        across, depth, up = np.meshgrid(*centres, indexing="ij", sparse=True)
        round_column = np.clip(1.5 - np.hypot(across - COLUMN_AT, depth) / COLUMN_RADIUS, 0, 1)
        density = COLUMN_DEPTH / (2 * COLUMN_RADIUS * scene.medium.extinction) * round_column
        times = np.arange(len(self.densities))[:, None, None, None]
        waver = np.sin(5 * up + 4 * across - 0.9 * times) + np.sin(2.2 * up - 3 * depth - 0.47 * times + 1)
        densities = self.densities + (density * (1 + 0.24 * waver)).astype(np.float32)
        fine = replace(scene, domain=replace(scene.domain, resolution=(x, y, z)))
        front = scene_renderer(fine, scene.camera, np.zeros(3, np.float32))
        clip = [(front.image(each)[..., 0], front.transmittance) for each in densities]
        radiance, transmittance = {}, {}
        for view, camera in self.cameras.items():
            renderer = scene_renderer(fine, camera, np.zeros(3, np.float32))
            seen = [(renderer.image(densities[n])[..., 0], renderer.transmittance) for n in SCORED]
            radiance[view], transmittance[view] = (np.stack(pictures) for pictures in zip(*seen, strict=True))
        return replace(
            self,
            front=Smoke(*(np.stack(pictures) for pictures in zip(*clip, strict=True))),
            radiance=radiance,
            transmittance=transmittance,
            densities=densities,
        )

    def darkened(self, share: float = 0.1) -> Baked:
        """Return smoke that scatters a share of the light."""
        assert self.scene.medium is not None
        dark = replace(self.scene.medium, albedo=share * self.scene.medium.albedo)
        return replace(
            self,
            scene=replace(self.scene, medium=dark),
            front=Smoke(share * self.front.radiance, self.front.transmittance),
            radiance={view: share * pictures for view, pictures in self.radiance.items()},
        )


def optical_mass(scene: Scene, densities: npt.NDArray[np.floating[Any]]) -> float:
    """Extinction times volume (m2) of densities (frames, x, y, z) that fill the box of a scene."""
    complete = completed(scene)
    sides = np.array(complete.domain.max) - complete.domain.min
    voxel = float(np.prod(sides / densities.shape[1:]))
    return complete.medium.extinction * voxel * float(densities.sum(dtype=np.float64))
