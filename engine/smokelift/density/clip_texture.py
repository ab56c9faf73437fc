"""The texture of a clip's smoke: along which axis it travels, and how its patches are distributed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.density.exemplar import SIZE, Exemplar, Picture
from smokelift.density.observation import ObservedClip, ObservedView
from smokelift.density.stretched_noise import roughness
from smokelift.density.turntable import Turntable
from smokelift.scene import Camera, Domain

FRAMES = 12
"""Frames at most, spread over the clip, whose patches are taken: a thousand of each are enough for a scale."""

SMOOTHING = 1.5
"""Standard deviation (voxels) of the blur before the drift is measured: a difference quotient needs it."""

ACROSS = 6.0
"""Width of a row's smoke in its standard deviations: three to either side hold all but 0.3 % of a Gaussian profile."""

VOXEL = 12**-0.5
"""Standard deviation (voxels) of smoke that fills one voxel: the smallest, even for a thread of single pixels."""


@dataclass(frozen=True, eq=False)
class ClipTexture:
    """The texture of a clip's smoke.

    The `turntable` is before the input's camera. It turns about the smoke's own axis: what is seen on the way about it
    looks alike. There is one of the `exemplars` a scale, the coarsest first: its patches are as wide as the smoke.
    `width` is the standard deviation of the smoke across the axis, in voxels. `drift` is the mean motion of the
    pictures along it, in voxels a frame, and `roughness` the strength of each octave of `StretchedNoise`.
    """

    turntable: Turntable
    exemplars: tuple[Exemplar, ...]
    width: float
    drift: float
    roughness: tuple[float, ...]

    @staticmethod
    def of(clip: ObservedClip) -> ClipTexture | None:
        """Measure the texture of some frames of a clip; None if none shows smoke."""
        frames, domain = clip.spread(FRAMES), clip.optics.domain
        # each frame is read once, the ones that follow for the motion alone
        needed = sorted({number + ahead for number in frames for ahead in (0, 1) if number + ahead < clip.length})
        seen = {number: _seen(clip, number) for number in needed}
        upright = {number: _on_screens(views, domain) for number, views in seen.items()}
        front = next((upright[number][0].turntable for number in frames if upright[number]), None)
        if front is None:
            return None
        motion = _motion([(upright[number], upright.get(number + 1, [])) for number in frames])
        axis = front.axis
        if abs(motion[0]) > abs(motion[1]):
            axis = int(np.argmax(np.abs(front.lateral)))
            motion = motion[::-1]
        shown = [each for number in frames for each in _on_screens(seen[number], domain, axis)]
        pictures = [each.picture for each in shown]
        width = max(VOXEL, float(np.mean([_width(picture) for picture in pictures])))
        scales = [1]
        while SIZE * scales[0] < ACROSS * width:
            scales.insert(0, 2 * scales[0])
        exemplars = tuple(Exemplar.of(pictures, scale) for scale in scales)
        drift = abs(float(motion[1]))
        return ClipTexture(shown[0].turntable, exemplars, width, drift, roughness(pictures, width))

    def halved(self, domain: Domain) -> ClipTexture:
        """The texture on a domain with voxels twice as wide, without the scale that these do not hold."""
        exemplars = tuple(replace(each, scale=each.scale // 2) for each in self.exemplars if each.scale > 1)
        turntable = replace(self.turntable, domain=domain)
        return ClipTexture(turntable, exemplars, self.width / 2, self.drift / 2, self.roughness)


class _Shown(NamedTuple):
    """What a camera saw, on the screen of the turntable before it."""

    turntable: Turntable
    picture: Picture


def _seen(clip: ObservedClip, number: int) -> list[tuple[Camera, NDArray[np.float32]]]:
    """Cameras of a frame, the input's first, and the optical depths (rows, columns) that they saw."""
    views = [ObservedView.of(observation, clip.optics) for observation in clip.observe(number)]
    return [(view.camera, view.optical_depth) for view in views]


def _on_screens(
    seen: Sequence[tuple[Camera, NDArray[np.float32]]], domain: Domain, axis: int | None = None
) -> list[_Shown]:
    """Pictures that show smoke, on screens of an axis of the grid or of their own height."""
    found = []
    for camera, optical_depth in seen:
        if optical_depth.any():
            turntable = Turntable.before(camera, domain, axis)
            picture = turntable.screen(optical_depth, camera)
            if picture.any():
                found.append(_Shown(turntable, picture))
    return found


def _motion(pairs: Sequence[tuple[Sequence[_Shown], Sequence[_Shown]]]) -> NDArray[np.float64]:
    """Mean motion across and along the axis, in voxels a frame, that explains most of the change between frames.

    It is the least squares solution of p' - p + u . grad p = 0 over pairs of successive pictures of the input,
    compressed and smoothed.
    """
    normal, change = np.zeros((2, 2)), np.zeros(2)
    for pair in pairs:
        if all(pair):
            before, after = (ndimage.gaussian_filter(np.log1p(shown[0].picture), SMOOTHING) for shown in pair)
            slopes = np.array(np.gradient((before + after) / 2))
            normal += np.einsum("iab,jab->ij", slopes, slopes)
            change += np.einsum("iab,ab->i", slopes, before - after)
    return np.asarray(np.linalg.lstsq(normal, change, rcond=None)[0])


def _width(picture: Picture) -> float:
    """Standard deviation (columns) of a picture's smoke about the middle of its row."""
    columns, amounts = np.arange(len(picture)), np.maximum(picture.sum(0), 1e-30)
    middles = columns @ picture / amounts
    return float(np.sqrt(np.sum(picture * (columns[:, None] - middles) ** 2) / picture.sum()))
