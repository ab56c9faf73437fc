"""Smoke whose flow and whose pictures from four sides are known, on a small grid, so that many runs take minutes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.accuracy.scenes import BakedViews
from smokelift import Camera, Medium, Scene
from smokelift.evaluation.truth import Truth, resampled
from smokelift.footage.images import Picture
from smokelift.render import Renderer
from smokelift.scene import DirectionalLight, Domain
from smokelift.transport import Array

GRID = (24, 24, 36)
"""Voxels of the reconstructions."""

SIZE = (96, 144)
"""Columns and rows of the pictures."""

FRONT = "0"
"""The only view that a reconstruction sees."""

BLACK = np.zeros(3, np.float32)


@dataclass(frozen=True, eq=False)
class Known:
    """Some moments of smoke with all that is known of them.

    Attributes
    ----------
    name
        Of the scene.
    scene
        Its description, without a clip: camera, domain on the small grid, medium, lights.
    cameras
        By the keys of `benchmarks.accuracy.scenes.VIEWS`.
    radiance, transmittance
        What each of them sees of the smoke alone, linear and grey, (moments, rows, columns).
    densities : (moments, x, y, z)
        On the grid of the simulation.
    velocities : (moments, nx, ny, nz, 3)
        Of what arrives at each moment, at the centres of the small grid's voxels (m/s). NaN where unknown.
    inlets : (moments, nx, ny, nz)
        Voxels where smoke enters, which no motion explains.
    fps
        Moments a second.
    """

    name: str
    scene: Scene
    cameras: dict[str, Camera]
    radiance: dict[str, Picture]
    transmittance: dict[str, Picture]
    densities: Array
    velocities: Array
    inlets: npt.NDArray[np.bool_]
    fps: float

    @staticmethod
    def load(folder: Path, moments: int) -> Known:
        """Read the first moments of a scene that `benchmarks.truth.picture` filled."""
        truth, described = Truth.load(folder / "truth.npz"), Scene.load(folder / "scene.toml")
        if described.domain is None:
            raise ValueError(f"{folder}: the scene has no [domain].")
        views = BakedViews.load(folder)
        cameras = {view: camera.resized(*SIZE) for view, camera in views.cameras.items()}
        radiance, transmittance = views.averaged(SIZE, range(min(moments, truth.frames)))
        before = [max(moment - 1, 0) for moment in range(moments)]
        return Known(
            name=folder.name,
            scene=replace(
                described,
                clip=None,
                camera=cameras[FRONT],
                domain=Domain(described.domain.min, described.domain.max, GRID),
            ),
            cameras=cameras,
            radiance=radiance,
            transmittance=transmittance,
            densities=truth.densities[:moments].astype(np.float32),
            velocities=np.stack([resampled(truth.velocity(moment).centres(), GRID) for moment in before]),
            inlets=np.stack([resampled(truth.inflow(moment).astype(np.float32), GRID) > 0 for moment in before]),
            fps=truth.fps,
        )

    def __len__(self) -> int:
        return len(self.densities)

    def at(self, moments: Sequence[int]) -> Known:
        """Return some of its moments, in any order and as often as wanted."""
        chosen = list(moments)
        return replace(
            self,
            radiance={view: pictures[chosen] for view, pictures in self.radiance.items()},
            transmittance={view: pictures[chosen] for view, pictures in self.transmittance.items()},
            densities=self.densities[chosen],
            velocities=self.velocities[chosen],
            inlets=self.inlets[chosen],
        )

    def density(self, moment: int) -> Array:
        """Return the density of a moment on the small grid."""
        return resampled(self.densities[moment], GRID)

    @property
    def domain(self) -> Domain:
        """The box with the voxels of the reconstructions."""
        assert isinstance(self.scene.domain, Domain)
        return self.scene.domain

    @property
    def medium(self) -> Medium:
        """What the smoke does to light."""
        assert self.scene.medium is not None
        return self.scene.medium

    @property
    def light(self) -> DirectionalLight:
        """The one light."""
        (light,) = self.scene.lights
        assert isinstance(light, DirectionalLight)
        return light

    def pictured(self) -> Known:
        """Return the same with new pictures, by Smokelift's own renderer on the grid of the simulation."""
        x, y, z = self.densities.shape[1:]
        fine = replace(self.domain, resolution=(x, y, z))
        radiance, transmittance = {}, {}
        for view, camera in self.cameras.items():
            renderer = Renderer(camera, fine, self.medium, [self.light], BLACK)
            seen = [(renderer.image(density)[..., 0], renderer.transmittance) for density in self.densities]
            radiance[view], transmittance[view] = (np.stack(pictures) for pictures in zip(*seen, strict=True))
        return replace(self, radiance=radiance, transmittance=transmittance)


@dataclass(frozen=True, eq=False)
class Take:
    """What a method is given, and what it is compared with.

    Attributes
    ----------
    known
        The moment that each frame shows, with all that is known of it.
    given
        The description that the method gets; its camera's pictures are the clip's.
    pictures : (frames, rows, columns, 3)
        The clip in sRGB, 0 to 1.
    gain
        Exposure of the clip beside that of the known pictures.
    behind
        Linear grey radiance behind the smoke in the pictures that are compared.
    scored
        The first frame that counts.
    """

    known: Known
    given: Scene
    pictures: Picture
    gain: float = 1.0
    behind: float = 0.0
    scored: int = 0
