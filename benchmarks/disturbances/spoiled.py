"""What a camera, a codec, an editor and a wrong description do to a take, by a strength."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from benchmarks.baked import BLACK, FRONT, Seen
from benchmarks.disturbances.known import Known, Take
from benchmarks.filming import compressed, crushed, exposed, flickering, noisy
from smokelift import Background
from smokelift.footage.images import Picture
from smokelift.scene import Domain

FIRST, LENGTH = 14, 6
"""The moments of a clip that nothing disturbs: its first, and how many."""

MOMENTS = FIRST + LENGTH
"""Moments of a scene that the disturbances choose from."""

GRAY = 0.18
"""Linear radiance of a gray background: a photographer's gray card."""

SMOKE = 0.05
"""Fraction of the brightest radiance from which a pixel is smoke."""

GRIDS: dict[str, tuple[float, tuple[int, int, int]]] = {
    "one voxel": (36, (1, 1, 1)),
    "2 high": (18, (2, 2, 2)),
    "3 high": (12, (2, 2, 3)),
    "9 high": (4, (6, 6, 9)),
    "36 high": (1, (24, 24, 36)),
    "one deep": (1, (24, 1, 36)),
    "3 deep": (1, (24, 3, 36)),
    "very tall": (1, (24, 24, 144)),
    "very wide": (1, (120, 24, 36)),
}
"""Boxes about the middle of the scene's: voxels of so many of its own, and how many along x, y, z."""


def taken(
    known: Known,
    gray: float = 0.0,
    gains: npt.ArrayLike = 1.0,
    spoil: Callable[[Picture], Picture] = lambda encoded: encoded,
    **given: Any,
) -> Take:
    """Film all moments before a linear gray, which is given.

    Parameters
    ----------
    known, gray
        What is filmed, and what stands behind it.
    gains
        Exposure: one gain, or one per frame.
    spoil
        What becomes of the sRGB pictures.
    **given
        Fields in which the description differs from what is known.
    """
    pictures = np.clip(exposed(known.front.before(np.full(3, gray)), gains), 0, 1)
    scene = replace(known.scene, **{"background": Background(color=(gray,) * 3), **given})
    return Take(known, scene, np.clip(spoil(pictures), 0, 1))


def usual(known: Known) -> Known:
    """Return the moments of a clip that nothing disturbs."""
    return known.at(range(FIRST, FIRST + LENGTH))


def noise(known: Known, deviation: float) -> Take:
    """White noise, independent in every pixel and channel; white is 1."""
    return taken(usual(known), spoil=lambda encoded: noisy(encoded, deviation))


def compression(known: Known, crf: float) -> Take:
    """H.264 at a constant rate factor; none below 0."""
    return taken(usual(known), spoil=lambda encoded: encoded if crf < 0 else compressed(encoded, int(crf)))


def flicker(known: Known, fraction: float) -> Take:
    """Exposure that goes up and down by a fraction from frame to frame, before black."""
    return taken(usual(known), gains=flickering(LENGTH, fraction))


def flicker_before_gray(known: Known, fraction: float) -> Take:
    """A take that flickers before a gray background, which shows the exposure."""
    return taken(usual(known), GRAY, flickering(LENGTH, fraction))


def blur(known: Known, voxels: float) -> Take:
    """Pictures out of focus: a Gaussian with a standard deviation in voxels of the small grid."""
    part = usual(known)
    camera = known.cameras[FRONT]
    distance = float(np.linalg.norm(np.array(camera.matrix)[:3, 3] - known.domain.centre))
    sigma = voxels * camera.fx * known.domain.voxel_size / distance
    seen = Seen(ndimage.gaussian_filter(part.front.radiance, (0, sigma, sigma)), part.front.transmittance)
    return replace(taken(part), pictures=np.clip(exposed(seen.before(BLACK)), 0, 1))


def saturation(known: Known, fraction: float) -> Take:
    """An exposure at which a fraction of the smoke's pixels is white; the light is given as strong as it seems."""
    part = usual(known)
    gain = 1 / _brightness(part, 1 - fraction) if fraction else 1.0
    return replace(taken(part, gains=gain, lights=(known.brighter_light(gain),)), gain=gain)


def crushing(known: Known, level: float) -> Take:
    """Black that an editor crushes: sRGB values below a level become 0, the rest is stretched."""
    return taken(usual(known), spoil=lambda encoded: crushed(encoded, level))


def bright_background(known: Known, fraction: float) -> Take:
    """A gray background with a fraction of the radiance of the smoke's brightest pixels; its color is given."""
    part = usual(known)
    return taken(part, fraction * _brightness(part, 0.95))


def grid(known: Known, number: float) -> Take:
    """A description with the box and the voxels that `GRIDS` has under a number."""
    coarser, shape = list(GRIDS.values())[int(number)]
    half = np.array(shape) * coarser * known.domain.voxel_size / 2
    middle = np.array(known.domain.centre)
    return taken(usual(known), domain=Domain(tuple(middle - half), tuple(middle + half), shape))


def missing(known: Known, fraction: float) -> Take:
    """Every n-th frame is missing, and nothing says so."""
    frames = range(FIRST, FIRST + LENGTH)
    return taken(known.at([frame for k, frame in enumerate(frames, 1) if not fraction or k % round(1 / fraction)]))


def doubled(known: Known, fraction: float) -> Take:
    """Every n-th frame is there twice, and nothing says so."""
    frames = range(FIRST, FIRST + LENGTH)
    twice = [1 + (bool(fraction) and k % round(1 / fraction) == 0) for k in range(1, LENGTH + 1)]
    return taken(known.at(np.repeat(frames, twice).tolist()))


def cut(known: Known, frames: float) -> Take:
    """Half of the clip shows the smoke so many frames earlier; only what follows the cut counts."""
    half = LENGTH // 2
    earlier = [FIRST - int(frames) + k for k in range(half)]
    return replace(taken(known.at([*earlier, *range(FIRST + half, FIRST + LENGTH)])), scored=half)


def clip_length(known: Known, frames: float) -> Take:
    """A clip of so many frames; only its last counts, which is the same for all lengths."""
    last = FIRST + LENGTH
    return replace(taken(known.at(range(last - int(frames), last))), scored=int(frames) - 1)


def wrong_light(known: Known, degrees: float) -> Take:
    """A description whose light is turned about the vertical."""
    x, y, z = known.light.direction
    turn = np.radians(degrees)
    turned = (x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn), z)
    return taken(usual(known), lights=(replace(known.light, direction=turned),))


def wrong_extinction(known: Known, factor: float) -> Take:
    """A description with another extinction."""
    return taken(usual(known), medium=replace(known.medium, extinction=factor * known.medium.extinction))


def wrong_albedo(known: Known, factor: float) -> Take:
    """A description with another albedo, 1 at most."""
    return taken(usual(known), medium=replace(known.medium, albedo=min(factor * known.medium.albedo, 1.0)))


def wrong_anisotropy(known: Known, anisotropy: float) -> Take:
    """A description with another anisotropy; the smoke's is 0."""
    return taken(usual(known), medium=replace(known.medium, anisotropy=anisotropy))


def _brightness(known: Known, quantile: float) -> float:
    """Return a quantile of the radiance of the smoke's pixels in front."""
    seen = known.front.radiance
    return float(np.quantile(seen[seen > SMOKE * seen.max()], quantile))
