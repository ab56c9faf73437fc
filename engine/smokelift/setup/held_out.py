"""The one judge of a light and of a model of scattering: densities of one half of the pixels, beside the other half.

A wrong light can still reproduce its own picture: before black, unshadowed smoke fits any picture by being too thin in
shadow. So densities are fitted to one colour of a chequerboard of the clip's pixels. What they let through of the
background is taken away from the other half, and the rest is light that the smoke scatters. That is linear in the
lights: each adds its own picture of the same densities. How strong all together have to be is the least-squares
factor, zero at least.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from smokelift.checks.array_types import Doubles
from smokelift.density import DensitySettings, FittedDensity, Observation, reconstruct_density
from smokelift.density.hull import project_voxels, reached
from smokelift.render import Image, Optics, scene_optics
from smokelift.scene import FiniteLight, Scattering
from smokelift.setup.coarse import CoarseFrame, CoarseView

MIN_CHANNEL_POWER = 1e-3
"""Power of a channel's light over that of the brightest one, below which the channel has no strength of its own."""

BLACK = np.zeros(3, np.float32)


@dataclass(frozen=True)
class HeldOut:
    """What a judge shows of densities, beside the other half of the pixels.

    Attributes
    ----------
    error
        Root mean square of the difference, in shares of what the smoke changes there; of several cameras the root mean
        square of theirs.
    light
        Strength of the light, in multiples of the scene's, that brings the same densities nearest: more than 1 where
        they are too dark. 1 without scattered light.
    colours : (cameras, 3)
        The same for each camera and channel alone.
    """

    error: float
    light: float = 1.0
    colours: Doubles = field(default_factory=lambda: np.ones((1, 3)))


@dataclass(frozen=True, eq=False)
class HalfFit:
    """Densities that were fitted to one half of the pixels.

    Attributes
    ----------
    frames
        What the cameras saw.
    densities
        One of each frame.
    """

    frames: Sequence[CoarseFrame]
    densities: Sequence[FittedDensity]

    def lit(self, lights: tuple[FiniteLight, ...], scattering: Scattering) -> list[Doubles]:
        """Light (n, 3) that the densities scatter to the pixels that they reach, of each camera."""

        def shown(frame: CoarseFrame, view: CoarseView, fitted: FittedDensity) -> Image:
            optics = Optics(frame.scene.domain, frame.scene.medium, lights, scattering)
            return optics.renderer(view.camera, BLACK, fitted.hull).image(fitted.density)

        return self._pixels(shown)

    @cached_property
    def added(self) -> list[Doubles]:
        """Light (n, 3) of each camera's held-out pixels beside the background that the smoke lets through."""

        def rest(frame: CoarseFrame, view: CoarseView, fitted: FittedDensity) -> Image:
            optics = Optics(frame.scene.domain, frame.scene.medium, (), "absorption")
            behind = optics.renderer(view.camera, view.plate.image, fitted.hull).image(fitted.density)
            return view.held_out - behind

        return self._pixels(rest)

    @cached_property
    def contrast(self) -> list[float]:
        """Sum of squares of what the smoke changes in the held-out pixels, of each camera."""
        changed = self._pixels(lambda _, view, __: view.held_out - view.plate.image)
        return [max(float(np.sum(np.square(pixels))), 1e-30) for pixels in changed]

    def beside(self, scattering: Scattering) -> HeldOut:
        """What the densities show in the light of their scenes, beside the held-out pixels."""
        own = self.lit(scene_optics(self.frames[0].scene).lights, scattering)
        wrong = [float(np.sum(np.square(shown - seen))) for shown, seen in zip(own, self.added, strict=True)]
        error = float(np.sqrt(np.mean(np.divide(wrong, self.contrast))))
        power = np.array([np.sum(np.square(shown), 0) for shown in own])
        product = np.array([np.sum(shown * seen, 0) for shown, seen in zip(own, self.added, strict=True)])
        if not power.sum() > 0:
            return HeldOut(error, 1.0, np.ones_like(power))
        whole = np.maximum(product.sum(1, keepdims=True) / np.maximum(power.sum(1, keepdims=True), 1e-30), 0)
        lit = power > MIN_CHANNEL_POWER * power.max(1, keepdims=True)
        colours = np.where(lit, np.maximum(product, 0) / np.maximum(power, 1e-30), whole)
        return HeldOut(error, float(product.sum() / power.sum()), colours)

    def _pixels(self, picture: Callable[[CoarseFrame, CoarseView, FittedDensity], Image]) -> list[Doubles]:
        """Pixels (n, 3) of pictures that the smoke's voxels can change, of each camera, all moments in a row."""
        return [
            np.concatenate(
                [
                    picture(frame, frame.views[camera], fitted)[reach[camera]].astype(np.float64)
                    for frame, fitted, reach in zip(self.frames, self.densities, self._reach, strict=True)
                ]
            )
            for camera in range(len(self.frames[0].views))
        ]

    @cached_property
    def _reach(self) -> list[list[NDArray[np.bool_]]]:
        return [
            [reached(view.smoke, project_voxels(view.camera, frame.scene.domain)) for view in frame.views]
            for frame in self.frames
        ]


def fit_half(frames: Sequence[CoarseFrame], settings: DensitySettings) -> HalfFit:
    """Fit densities to one half of the pixels of all cameras, in the light and by the model of each frame's scene."""

    def fitted(frame: CoarseFrame) -> FittedDensity:
        own, *others = (Observation(view.camera, view.fitted, view.plate) for view in frame.views)
        return reconstruct_density(own.image, frame.scene, settings=settings, plate=own.plate, views=others)

    return HalfFit(frames, [fitted(frame) for frame in frames])


def held_out(frames: Sequence[CoarseFrame], model: Scattering, judge: Scattering, settings: DensitySettings) -> HeldOut:
    """Fit a model's densities to one half of the pixels, and let the judge show them to the other half."""
    return fit_half([frame.scattered_by(model) for frame in frames], settings).beside(judge)
