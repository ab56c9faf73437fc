"""What a camera, a codec, an editor and a wrong description do to a take, by a strength."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from benchmarks.background.clips import backdrop, compressed, noisy
from benchmarks.disturbances.known import FRONT, SIZE, Known, Take
from smokelift import Background, Scene
from smokelift.footage.images import Picture, linear_to_srgb
from smokelift.scene import Domain, Medium

FIRST, LENGTH = 14, 6
"""The moments of a clip that nothing disturbs: its first, and how many."""

MOMENTS = FIRST + LENGTH
"""Moments of a scene that the disturbances choose from."""

GREY = 0.18
"""Linear radiance of a grey background: a photographer's grey card."""

SMOKE = 0.05
"""Share of the brightest radiance from which a pixel is smoke."""

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


def plain(known: Known) -> Take:
    """The take that nothing disturbs, of all moments of what is given, before black."""
    return before(known, backdrop(SIZE[::-1], 0))


def before(known: Known, plate: Picture, gains: npt.ArrayLike = 1.0) -> Take:
    """A take before a linear plate (rows, columns, 3), which is given; each frame with a gain of its own, or one."""
    seen = known.radiance[FRONT][..., None] + known.transmittance[FRONT][..., None] * plate
    linear = seen * np.asarray(gains, np.float32).reshape(-1, 1, 1, 1)
    return Take(known, known.scene, np.clip(linear_to_srgb(linear), 0, 1))


def before_grey(known: Known, radiance: float, gains: npt.ArrayLike = 1.0) -> Take:
    """A take before a linear grey that is given."""
    take = before(known, backdrop(SIZE[::-1], radiance), gains)
    return replace(take, given=replace(take.given, background=Background(color=(radiance,) * 3)))


def usual(known: Known) -> Known:
    """The moments of a clip that nothing disturbs."""
    return known.at(range(FIRST, FIRST + LENGTH))


def noise(known: Known, share: float) -> Take:
    """White noise, independent in every pixel and channel, of a share of the 8-bit range."""
    take = plain(usual(known))
    return replace(take, pictures=np.clip(noisy(take.pictures, share), 0, 1))


def compression(known: Known, crf: float) -> Take:
    """H.264 at a constant rate factor; none below 0."""
    take = plain(usual(known))
    return take if crf < 0 else replace(take, pictures=compressed(take.pictures, int(crf)))


def flicker(known: Known, share: float) -> Take:
    """Exposure that goes up and down by a share from frame to frame, before black."""
    return before(usual(known), backdrop(SIZE[::-1], 0), _flickering(share))


def flicker_before_grey(known: Known, share: float) -> Take:
    """A take that flickers before a grey background, which shows the exposure."""
    return before_grey(usual(known), GREY, _flickering(share))


def blur(known: Known, voxels: float) -> Take:
    """Pictures out of focus: a Gaussian with a standard deviation in voxels of the small grid."""
    take = plain(usual(known))
    sigma = voxels * _pixels_a_voxel(known)
    linear = ndimage.gaussian_filter(known.radiance[FRONT][FIRST : FIRST + LENGTH], (0, sigma, sigma))
    return replace(take, pictures=np.clip(linear_to_srgb(np.repeat(linear[..., None], 3, -1)), 0, 1))


def saturation(known: Known, share: float) -> Take:
    """An exposure at which a share of the smoke's pixels is white; the light is given as strong as it seems."""
    part = usual(known)
    seen = part.radiance[FRONT]
    gain = 1 / float(np.quantile(seen[seen > SMOKE * seen.max()], 1 - share)) if share else 1.0
    return replace(before(part, backdrop(SIZE[::-1], 0), gain), given=_lit(part, gain), gain=gain)


def crushing(known: Known, level: float) -> Take:
    """Black that is lifted by an editor: sRGB values below a level become 0, the rest is stretched."""
    take = plain(usual(known))
    return replace(take, pictures=np.clip((take.pictures - level) / (1 - level), 0, 1))


def bright_background(known: Known, share: float) -> Take:
    """A grey background with a share of the radiance of the smoke's brightest pixels; its colour is given."""
    part = usual(known)
    seen = part.radiance[FRONT]
    grey = share * float(np.quantile(seen[seen > SMOKE * seen.max()], 0.95))
    return before_grey(part, grey)


def grid(known: Known, number: float) -> Take:
    """A description with the box and the voxels that `GRIDS` has under a number."""
    take = plain(usual(known))
    coarser, shape = list(GRIDS.values())[int(number)]
    half = np.array(shape) * coarser * known.domain.voxel_size / 2
    middle = np.array(known.domain.centre)
    box = Domain(tuple(middle - half), tuple(middle + half), shape)
    return replace(take, given=replace(take.given, domain=box))


def missing(known: Known, share: float) -> Take:
    """Every n-th frame is missing, and nothing says so."""
    frames = range(FIRST, FIRST + LENGTH)
    return plain(known.at([frame for k, frame in enumerate(frames, 1) if not share or k % round(1 / share)]))


def doubled(known: Known, share: float) -> Take:
    """Every n-th frame is there twice, and nothing says so."""
    frames = range(FIRST, FIRST + LENGTH)
    twice = [1 + (bool(share) and k % round(1 / share) == 0) for k in range(1, LENGTH + 1)]
    return plain(known.at(np.repeat(frames, twice).tolist()))


def cut(known: Known, frames: float) -> Take:
    """Half of the clip shows the smoke so many frames earlier; only what follows the cut counts."""
    half = LENGTH // 2
    earlier = [FIRST - int(frames) + k for k in range(half)]
    return replace(plain(known.at([*earlier, *range(FIRST + half, FIRST + LENGTH)])), scored=half)


def clip_length(known: Known, frames: float) -> Take:
    """A clip of so many frames; only its last counts, which is the same for all lengths."""
    last = FIRST + LENGTH
    return replace(plain(known.at(range(last - int(frames), last))), scored=int(frames) - 1)


def wrong_light(known: Known, degrees: float) -> Take:
    """A description whose light is turned about the vertical."""
    take = plain(usual(known))
    x, y, z = known.light.direction
    turn = np.radians(degrees)
    turned = (x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn), z)
    return replace(take, given=replace(take.given, lights=(replace(known.light, direction=turned),)))


def wrong_extinction(known: Known, factor: float) -> Take:
    """A description with another extinction."""
    return _told_medium(known, replace(known.medium, extinction=factor * known.medium.extinction))


def wrong_albedo(known: Known, factor: float) -> Take:
    """A description with another albedo, 1 at most."""
    return _told_medium(known, replace(known.medium, albedo=min(factor * known.medium.albedo, 1.0)))


def wrong_anisotropy(known: Known, anisotropy: float) -> Take:
    """A description with another anisotropy; the smoke's is 0."""
    return _told_medium(known, replace(known.medium, anisotropy=anisotropy))


def _told_medium(known: Known, medium: Medium) -> Take:
    take = plain(usual(known))
    return replace(take, given=replace(take.given, medium=medium))


def _lit(known: Known, gain: float) -> Scene:
    return replace(known.scene, lights=(known.light.scaled(gain),))


def _flickering(share: float) -> npt.NDArray[np.float64]:
    return 1 + share * (-1.0) ** np.arange(LENGTH)


def _pixels_a_voxel(known: Known) -> float:
    """How wide a voxel is in the middle of the picture."""
    camera, domain = known.cameras[FRONT], known.domain
    away = np.linalg.norm(np.array(camera.matrix)[:3, 3] - domain.centre)
    return float(camera.fx * domain.voxel_size / away)
