"""Smoke whose flow is known too, on a small grid, so that many runs take minutes; and takes of it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from benchmarks.baked import Baked
from smokelift import Medium, Scene
from smokelift.checks import Array, Mask
from smokelift.evaluation.truth import Truth, resampled
from smokelift.footage.images import Picture
from smokelift.scene import DirectionalLight, Domain

GRID = (24, 24, 36)
"""Voxels of the reconstructions."""

SIZE = (96, 144)
"""Columns and rows of the pictures."""


@dataclass(frozen=True, eq=False)
class Known(Baked):
    """Some moments of smoke with all that is known of them; the scene's box has the voxels of the reconstructions.

    Attributes
    ----------
    velocities : (moments, nx, ny, nz, 3)
        What arrives at each moment has, at the centers of the small grid's voxels (m/s). NaN where unknown.
    inlets : (moments, nx, ny, nz)
        Voxels where smoke enters, which no motion explains.
    fps
        Moments a second.
    """

    velocities: Array
    inlets: Mask
    fps: float

    @staticmethod
    def read(folder: Path, moments: int) -> "Known":
        """Read the first moments of a baked scene."""
        truth, baked = Truth.load(folder / "truth.npz"), Baked.load(folder, moments).sized(SIZE)
        assert baked.scene.domain is not None
        before = [max(moment - 1, 0) for moment in range(len(baked))]
        return Known(
            name=baked.name,
            scene=replace(baked.scene, domain=Domain(baked.scene.domain.min, baked.scene.domain.max, GRID)),
            cameras=baked.cameras,
            views=baked.views,
            densities=baked.densities.astype(np.float32),
            velocities=np.stack([resampled(truth.velocity(moment).centres(), GRID) for moment in before]),
            inlets=np.stack([resampled(truth.inflow(moment).astype(np.float32), GRID) > 0 for moment in before]),
            fps=truth.fps,
        )

    def at(self, frames: Sequence[int]) -> Self:
        """Return some of its moments, in any order and as often as wanted."""
        chosen = list(frames)
        return replace(super().at(chosen), velocities=self.velocities[chosen], inlets=self.inlets[chosen])

    def density(self, moment: int) -> Array:
        """Return the density of a moment on the small grid."""
        return resampled(np.asarray(self.densities[moment], np.float32), GRID)

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

    def with_medium(self, **changes: Any) -> Self:
        """Return it with another medium; its pictures stay."""
        return replace(self, scene=replace(self.scene, medium=replace(self.medium, **changes)))

    @property
    def light(self) -> DirectionalLight:
        """The one light."""
        (light,) = self.scene.lights
        assert isinstance(light, DirectionalLight)
        return light

    def brighter_light(self, gain: float) -> DirectionalLight:
        """Return the one light, so many times as strong."""
        red, green, blue = (gain * channel for channel in self.light.irradiance)
        return replace(self.light, irradiance=(red, green, blue))


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
        Linear gray radiance behind the smoke in the pictures that are compared.
    scored
        The first frame that counts.
    """

    known: Known
    given: Scene
    pictures: Picture
    gain: float = 1.0
    behind: float = 0.0
    scored: int = 0
