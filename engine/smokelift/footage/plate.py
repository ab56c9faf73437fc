"""The background behind the smoke: a clean plate from the clip alone, and where a frame differs from it.

Assumed: the camera and the background stand still, and a pixel is seen clear in some share of the frames. A
clear pixel then keeps returning to one value within the noise, while smoke moves and scatters its values
widely. So the plate is, pixel by pixel, the value with the most samples around it, in a window as wide as
the noise. Where smoke only ever brightens what is behind it (white smoke before a darker wall, found by
looking at the clip), the darkest well-supported value is taken instead, and the brightest where it only
darkens: smoke that hangs about for long makes a second, sometimes larger, heap on the known side.

Pixels that are never clear (over the source, as a rule) cannot be known. Their confidence is near 0 and they
are filled smoothly from their neighbours. What never moves, a nozzle or a perfectly steady jet, is
background.

Noise is judged in sRGB values, where that of cameras and codecs is about the same at all brightnesses.

A camera that moves shows another part of the background in every frame, so a pixel has no value of its own: the
background has to be of one colour, or known frame by frame.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.footage.clip import Clip, is_video
from smokelift.footage.images import Picture, area_average, linear_to_srgb, srgb_to_linear
from smokelift.scene import CompleteScene, Scene

CODE = np.float32(1 / 255)
"""One step of 8 bit video: no noise is taken to be smaller."""

_WINDOW = 6.0  # width of the window around a value, in noise: plus and minus three sigma
_ONE_SIDED = 0.9  # share of the deviations to one side from which on smoke is said to only brighten (or darken)
_WELL_SUPPORTED = 0.35  # of the samples that the best-supported value has
_CLEAR = (
    2,
    6,
)  # samples in a row at the chosen value: never clear up to the first, surely from the second on
_FIXED_POINT = 8192  # samples are kept as 16 bit fixed point numbers: sRGB values up to 8
_STORE_BYTES = 512 * 2**20
_NOISE_STEP = 3  # every third pixel of every third row is enough to know the noise
_SMOOTH = 1.5  # pixels
_FAINT, _SURE = 4.0, 8.0  # noise; thresholds of the mask
_LEAST_SURE = 1e-4  # share of the picture that must be surely smoke in a patch of the mask
_MOST_NOISE = np.float32(6 / 255)  # a pixel that varies more while the camera moves sees more than one colour
_SWAMPED = 3.0  # times what pixels beside the smoke say, from which noise over time is taken to be smoke's
_WORST_FRAME = 2.0  # how many times more than the clip a frame may be taken to deviate as a whole


@dataclass(frozen=True)
class Plate:
    """What the camera sees without smoke.

    Attributes
    ----------
    image
        Linear, shape (height, width, 3).
    confidence
        0 (filled from neighbours) to 1 (seen clear in many frames), shape (height, width).
    noise
        Standard deviation of a static pixel, sensor and compression together, per channel, in linear light,
        at the plate's median brightness; at least one step of 8 bit video.
    """

    image: Picture
    confidence: Picture
    noise: Picture

    def through(self, cut: Callable[[Picture], Picture]) -> Plate:
        """The plate of a part of the picture, or of a smaller one, as a function cuts it from (height, width, ...)."""
        return Plate(cut(self.image), cut(self.confidence), self.noise)


@dataclass(frozen=True)
class Matte:
    """Where a frame shows smoke.

    Attributes
    ----------
    evidence
        Deviation from the plate in units of noise, smoothed over two pixels, shape (height, width). About 1
        or less without smoke; at least 8 where the plate is less than half certain, since such a pixel was
        never seen without smoke.
    mask
        Patches of evidence above 4 in which 0.01 % of the picture exceeds 8, shape (height, width).
    """

    evidence: Picture
    mask: npt.NDArray[np.bool_]


def estimate_plate(clip: Clip, sample_count: int = 32) -> Plate:
    """Estimate the background of a clip from its frames; the module says how, and what is assumed.

    Parameters
    ----------
    clip
        Camera and background stand still.
    sample_count
        Frames looked at, spread evenly; fewer of very large pictures, to stay below half a gigabyte.

    Raises
    ------
    ClipError
        If a frame cannot be read.
    """
    samples = _samples(clip, sample_count)
    sigma = _temporal_noise(samples[:, ::_NOISE_STEP, ::_NOISE_STEP])
    grey_sigma = float(np.sqrt((sigma**2).mean()))
    side = _side(samples[:, ::4, ::4], grey_sigma)
    height, width = samples.shape[1:3]
    image = np.empty((height, width, 3), np.float32)
    run = np.empty((height, width), np.int16)
    for row in range(0, height, 64):  # in bands, for the sake of memory
        band = slice(row, row + 64)
        image[band], run[band] = _clear_value(samples[:, band], grey_sigma, side)
    low, high = (min(bound, share * len(samples)) for bound, share in zip(_CLEAR, (0.3, 0.6), strict=True))
    # A clear speck amid smoke is an accident of the samples.
    run = np.minimum(run, ndimage.median_filter(run, 7))
    confidence = np.clip((run - low) / (high - low), 0.0, 1.0)
    # What is less than half certain is filled as a whole: a part of it would spread its smoke.
    return _plate(_filled(image, np.clip(2.0 * confidence - 1.0, 0.0, 1.0)), confidence.astype(np.float32), sigma)


def known_plate(background: npt.ArrayLike, clip: Clip, sample_count: int = 32) -> Plate:
    """Return the plate of a background that is known, with the clip's noise.

    Parameters
    ----------
    background
        A linear colour, shape (3,), or a picture, shape (height, width, 3), resized to the clip if need be.
    clip
        For its size and its noise.
    sample_count
        Frames looked at.

    Raises
    ------
    ClipError
        If a frame cannot be read.
    ValueError
        If the background is neither, or not finite.
    """
    width, height = clip.size
    linear = np.asarray(background, np.float32)
    if linear.shape == (3,):
        linear = np.broadcast_to(linear, (height, width, 3))
    if linear.ndim != 3 or linear.shape[2] != 3 or not np.isfinite(linear).all():
        raise ValueError(f"a background must be a finite colour or RGB picture, not of shape {linear.shape}")
    encoded = linear_to_srgb(area_average(linear, width, height))
    samples = _decoded(_samples(clip, sample_count, _NOISE_STEP))
    over_time, beside = _noise_of(samples), _noise_beside(samples, encoded[::_NOISE_STEP, ::_NOISE_STEP])
    # where smoke passes over most of the picture, what changes over time is smoke
    sigma = np.where(over_time > _SWAMPED * beside, beside, over_time)
    return _plate(encoded, np.ones((height, width), np.float32), sigma)


def open_plates(scene: Scene | CompleteScene) -> Clip | None:
    """Open a scene's clean plate as a clip if it changes from frame to frame, and return None if it does not.

    Its frames are counted as those of the clip's file. A numbered picture stands for itself before a still camera, and
    for the sequence that it begins before one that moves.

    Raises
    ------
    ClipError
        If it cannot be read.
    """
    image = scene.background.image if scene.background is not None else None
    moves = scene.camera is not None and scene.camera.moves
    if image is None or not (moves or "#" in image.name or is_video(image)):
        return None
    return Clip.open(image)


def changing_plate(plates: Clip, clip: Clip, sample_count: int = 32) -> Callable[[int], Plate]:
    """Return what gives the plate of each of the clip's frames, for a background that is known frame by frame.

    Parameters
    ----------
    plates
        With a frame for every one of the clip's file, resized to the clip if need be.
    clip
        Its noise is what differs from the plates.
    sample_count
        Frames looked at.

    Raises
    ------
    ValueError
        If there are too few plates.
    ClipError
        If a frame cannot be read.
    """
    first, last = clip.first, clip.first + len(clip) - 1
    if last >= len(plates):
        raise ValueError(
            f"{plates.path}: has {len(plates)} of the frames 0 to {last} that are needed; give a clean plate with a "
            "picture for every frame of the clip, or a color, in [background]."
        )
    width, height = clip.size

    def encoded(frame: int) -> Picture:
        return linear_to_srgb(area_average(plates.frame(first + frame), width, height))

    numbers = clip.spread(sample_count)
    skip = slice(None, None, _NOISE_STEP)
    apart = [(linear_to_srgb(clip.frame(n)) - encoded(n))[skip, skip] for n in numbers]
    sigma = _noise_of(np.stack(apart))
    sure = np.ones((height, width), np.float32)
    return lambda frame: _plate(encoded(frame), sure, sigma)


def one_colour(plate: Plate) -> tuple[float, float, float] | None:
    """Return the linear colour of a plate that was estimated from a moving camera, or None if it has more than one."""
    known = plate.confidence > 0.5
    if known.mean() < 0.5 or encoded_noise(plate).max() > _MOST_NOISE:
        return None
    red, green, blue = (float(v) for v in np.median(plate.image[known], axis=0))
    colour = np.broadcast_to(np.array([red, green, blue], np.float32), plate.image.shape)
    differs = matte(plate.image, Plate(colour, np.ones_like(plate.confidence), plate.noise)).mask
    return None if (differs & known).any() else (red, green, blue)


def matte(frame: npt.ArrayLike, plate: Plate) -> Matte:
    """Find the smoke in a frame.

    Parameters
    ----------
    frame
        Linear, shape (height, width, 3).
    plate
        The background of the same size.

    Raises
    ------
    ValueError
        If the sizes differ or the frame is not finite.
    """
    linear = np.asarray(frame, np.float32)
    if linear.shape != plate.image.shape:
        raise ValueError(f"the frame {linear.shape} and the plate {plate.image.shape} must have one shape")
    if not np.isfinite(linear).all():
        raise ValueError("the frame must be finite")
    deviation = (linear_to_srgb(linear) - linear_to_srgb(plate.image)) / encoded_noise(plate)
    smooth = ndimage.gaussian_filter(deviation, (_SMOOTH, _SMOOTH, 0.0))
    evidence = np.sqrt((smooth**2).mean(axis=2))
    # Exposure and codec drift: a frame that deviates everywhere is judged more mildly, up to a limit, since
    # smoke may also fill the picture.
    evidence /= np.clip(np.median(evidence), 1.0, _WORST_FRAME)
    # A pixel that was never seen clear has smoke in every frame.
    evidence = np.maximum(evidence, np.float32(2.0 * _SURE) * (1.0 - plate.confidence))
    patches, count = ndimage.label(evidence > _FAINT, structure=np.ones((3, 3)))
    certain = np.bincount(patches[evidence > _SURE], minlength=count + 1)
    smoke = certain > _LEAST_SURE * patches.size
    return Matte(evidence, smoke[patches])


def noise_at(picture: npt.ArrayLike, plate: Plate) -> Picture:
    """Return the clip's noise, linear, shape (height, width, 3), at a picture's own brightness.

    Noise is even in sRGB values (see the module), so in linear light it grows with brightness.

    Parameters
    ----------
    picture
        Linear, shape (height, width, 3).
    plate
        For its noise, which is that at its median brightness.
    """
    return encoded_noise(plate) * _slope(linear_to_srgb(np.asarray(picture, np.float32)))


def encoded_noise(plate: Plate) -> Picture:
    """Return the noise of a plate in sRGB values, where it is the same at every brightness, per channel."""
    return plate.noise / _slope(np.median(linear_to_srgb(plate.image), axis=(0, 1)))


def _samples(clip: Clip, count: int, step: int = 1) -> npt.NDArray[np.uint16]:
    """Return frames spread evenly over the clip as fixed point sRGB, shape (count, height, width, 3).

    Of each frame every ``step``-th row and column is taken.
    """
    width, height = clip.size
    most = max(3, step**2 * _STORE_BYTES // (width * height * 6))
    numbers = clip.spread(min(count, most))
    rows, columns = len(range(0, height, step)), len(range(0, width, step))
    samples = np.empty((len(numbers), rows, columns, 3), np.uint16)
    for sample, number in zip(samples, numbers, strict=True):
        encoded = linear_to_srgb(clip.frame(number)[::step, ::step])
        sample[...] = np.clip(encoded * _FIXED_POINT + 0.5, 0, 65535)
    return samples


def _decoded(samples: npt.NDArray[np.uint16]) -> Picture:
    return samples.astype(np.float32) / np.float32(_FIXED_POINT)


def _temporal_noise(samples: npt.NDArray[np.uint16]) -> Picture:
    """Return the noise of static pixels per channel, in sRGB values.

    It is the median over pixels of the deviation over time, which smoke over less than half of the picture
    does not disturb. (Differences of frames in a row would miss that codecs let static blocks stand, then
    jump.)
    """
    return _noise_of(_decoded(samples))


def _noise_of(frames: Picture) -> Picture:
    spread = frames.std(axis=0).reshape(-1, 3)
    noise: Picture = np.maximum(np.median(spread, axis=0), CODE).astype(np.float32)
    return noise


def _noise_beside(frames: Picture, plate: Picture) -> Picture:
    """Return the noise per channel of the tenth of the pixels that stay nearest to a known plate, in sRGB values.

    Smoke may pass over nine tenths of the picture.
    """
    apart = np.sqrt(np.mean((frames - plate) ** 2, axis=0)).reshape(-1, 3)
    noise: Picture = np.maximum(np.quantile(apart, 0.1, axis=0), CODE).astype(np.float32)
    return noise


def _slope(encoded: Picture) -> Picture:
    """Return how much linear light one unit of sRGB is, at sRGB values."""
    step = CODE / 2
    return (srgb_to_linear(encoded + step) - srgb_to_linear(encoded - step)) / CODE


def _plate(encoded: Picture, confidence: Picture, sigma: Picture) -> Plate:
    noise = sigma * _slope(np.median(encoded, axis=(0, 1)))
    return Plate(srgb_to_linear(encoded), confidence, noise.astype(np.float32))


def _supports(ordered: Picture, width: float) -> npt.NDArray[np.int16]:
    """Return how many samples lie from each one up to ``width`` above it; ordered along the first axis."""
    counts = np.ones(ordered.shape, np.int16)
    for lag in range(1, len(ordered)):
        counts[:-lag] += ordered[lag:] - ordered[:-lag] <= width
    return counts


def _side(samples: npt.NDArray[np.uint16], sigma: float) -> int:
    """Return 1 if smoke only brightens the background, -1 if it only darkens it, else 0."""
    grey = _decoded(samples).mean(axis=-1)
    ordered = np.sort(grey, axis=0)
    counts = _supports(ordered, _WINDOW * sigma)
    best = counts.argmax(axis=0)[None]
    mode = np.take_along_axis(ordered, best, axis=0) + 0.5 * _WINDOW * sigma
    # Where most samples agree, the mode is the background for certain; small deviations may be drift.
    deviation = np.where(counts.max(axis=0) > 0.6 * len(grey), grey - mode, 0.0)
    brighter, darker = (int((sign * deviation > 2.0 * _WINDOW * sigma).sum()) for sign in (1, -1))
    if brighter > _ONE_SIDED * (brighter + darker):
        return 1
    return -1 if darker > _ONE_SIDED * (brighter + darker) else 0


def _clear_value(samples: npt.NDArray[np.uint16], sigma: float, side: int) -> tuple[Picture, npt.NDArray[np.int16]]:
    """Return the background value of each pixel, in sRGB, and how many samples in a row have it at most."""
    colours = _decoded(samples)
    grey = colours.mean(axis=-1)
    ordered = np.sort(grey, axis=0)
    counts = _supports(ordered, _WINDOW * sigma)
    good = counts >= _WELL_SUPPORTED * counts.max(axis=0)
    if side > 0:
        chosen = good.argmax(axis=0)
    elif side < 0:
        chosen = len(good) - 1 - good[::-1].argmax(axis=0)
    else:
        chosen = counts.argmax(axis=0)
    centre = np.take_along_axis(ordered, chosen[None], axis=0) + 0.5 * _WINDOW * sigma
    for _ in range(3):  # the window starts at a sample; let it settle around the mean of its samples
        inside = np.abs(grey - centre) <= 0.5 * _WINDOW * sigma * 1.001
        number = np.maximum(inside.sum(axis=0), 1)
        centre = (grey * inside).sum(axis=0, keepdims=True) / number
    value = np.einsum("tyxc,tyx->yxc", colours, inside.astype(np.float32)) / number[..., None]
    run = longest = np.zeros(grey.shape[1:], np.int16)
    for hit in inside:
        run = (run + 1) * hit
        longest = np.maximum(longest, run)
    return value.astype(np.float32), longest


def _filled(image: Picture, confidence: Picture) -> Picture:
    """Blend pixels of low confidence with the smooth continuation of their surroundings.

    Averages weighted by confidence over ever larger blocks: each level leaves what it knows and takes the
    rest from the next coarser one.
    """
    height, width = confidence.shape
    weight: Picture = confidence[..., None]
    if min(height, width) == 1 or float(confidence.min()) >= 1.0:
        return image
    small = ((width + 1) // 2, (height + 1) // 2)
    total = area_average(weight, *small)
    mean = area_average(image * weight, *small) / np.maximum(total, 1e-6)
    # A block of which a quarter is known is known: its mean is as good as any.
    coarse = _filled(mean, np.minimum(4.0 * total[..., 0], 1.0))
    blend: Picture = image * weight + area_average(coarse, width, height) * (np.float32(1.0) - weight)
    return blend
