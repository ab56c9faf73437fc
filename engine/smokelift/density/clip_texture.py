"""What a clip shows of its smoke's texture: along which axis it travels, and how its patches are distributed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.density.exemplar import SIZE, Exemplar, Picture
from smokelift.density.observation import ObservedClip, View
from smokelift.density.turntable import Turntable
from smokelift.scene import Domain

FRAMES = 12
"""Frames at most, spread over the clip, whose patches are taken: a thousand each are enough of a scale."""

SMOOTHING = 1.5
"""Standard deviation (voxels) of the blur before the drift is measured, which a difference quotient asks for."""

ACROSS = 6.0
"""Standard deviations of a row's smoke that make its whole width."""


@dataclass(frozen=True, eq=False)
class ClipTexture:
    """The texture of a clip's smoke.

    Attributes
    ----------
    turntable
        Before the input's camera; it turns about the smoke's own axis: what is seen on the way about it looks alike.
    exemplars
        Of the scales, the coarsest first. Its patches are as wide as the smoke.
    width
        Standard deviation of the smoke across the axis, in voxels.
    drift
        Mean motion of the pictures along the axis, in voxels a frame.
    """

    turntable: Turntable
    exemplars: tuple[Exemplar, ...]
    width: float
    drift: float

    @staticmethod
    def of(clip: ObservedClip) -> ClipTexture | None:
        """Look at frames of a clip; None if none shows smoke."""
        frames = clip.spread(FRAMES)
        front = next((found[0].turntable for number in frames if (found := _pictures(clip, number))), None)
        if front is None:
            return None
        motion = _motion(clip)
        axis = front.axis
        if abs(motion[0]) > abs(motion[1]):
            axis = int(np.argmax(np.abs(front.lateral)))
            motion = motion[::-1]
        shown = [each for number in frames for each in _pictures(clip, number, axis)]
        pictures = [each.picture for each in shown]
        width = float(np.mean([_width(picture) for picture in pictures]))
        scales = [1]
        while SIZE * scales[0] < ACROSS * width:
            scales.insert(0, 2 * scales[0])
        exemplars = tuple(Exemplar.of(pictures, scale) for scale in scales)
        return ClipTexture(shown[0].turntable, exemplars, width, abs(float(motion[1])))

    def halved(self, domain: Domain) -> ClipTexture:
        """The texture on a domain with voxels twice as wide, without the scale that these do not hold."""
        exemplars = tuple(replace(each, scale=each.scale // 2) for each in self.exemplars if each.scale > 1)
        return ClipTexture(replace(self.turntable, domain=domain), exemplars, self.width / 2, self.drift / 2)


class _Shown(NamedTuple):
    """What a camera saw, on the screen of the turntable before it."""

    turntable: Turntable
    picture: Picture


def _pictures(clip: ObservedClip, number: int, axis: int | None = None) -> list[_Shown]:
    """What the cameras saw in a frame, the input's first; only pictures that show smoke."""
    found = []
    for observation in clip.observe(number):
        view = View.of(observation, clip.optics)
        if view.optical_depth.any():
            turntable = Turntable.before(view.camera, clip.optics.domain, axis)
            picture = turntable.screen(view.optical_depth, view.camera)
            if picture.any():
                found.append(_Shown(turntable, picture))
    return found


def _motion(clip: ObservedClip) -> NDArray[np.float64]:
    """Mean motion across and along the axis, in voxels a frame, that explains most of the change between frames.

    It is the least squares solution of p' - p + u . grad p = 0 over pairs of frames that follow each other.
    """
    normal, change = np.zeros((2, 2)), np.zeros(2)
    for before, after in _pairs(clip):
        slopes = np.array(np.gradient((before + after) / 2))
        normal += np.einsum("iab,jab->ij", slopes, slopes)
        change += np.einsum("iab,ab->i", slopes, before - after)
    return np.asarray(np.linalg.lstsq(normal, change, rcond=None)[0])


def _pairs(clip: ObservedClip) -> Iterator[tuple[Picture, Picture]]:
    """The input's pictures in frames that follow each other, spread over the clip, compressed and smoothed."""
    for number in clip.spread(FRAMES):
        if number + 1 < clip.length:
            seen = [_pictures(clip, each) for each in (number, number + 1)]
            if all(seen):
                before, after = (ndimage.gaussian_filter(np.log1p(pictures[0].picture), SMOOTHING) for pictures in seen)
                yield before, after


def _width(picture: Picture) -> float:
    """Standard deviation (columns) of a picture's smoke in its rows, which count by their smoke."""
    columns, amounts = np.arange(len(picture)), np.maximum(picture.sum(0), 1e-30)
    middles = columns @ picture / amounts
    return float(np.sqrt(np.sum(picture * (columns[:, None] - middles) ** 2) / picture.sum()))
