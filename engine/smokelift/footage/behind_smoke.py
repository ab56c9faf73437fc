"""What is behind smoke that never clears: continued from what is known around it.

It follows smoothly from its neighbours. Its detail is that of its samples, with the contrast that the smoke takes from
it given back. How wrong the continuation is, is measured where the background is known.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.footage.images import Picture, area_average, blurred, linear_to_srgb, reduced_size, srgb_to_linear

DRIFT = 8 / 255
"""Change in sRGB values by a codec or by the light, at most. The matte takes as much for smoke."""

ISLAND = 0.01
"""Share of the picture up to which what seems clear is taken for an accident."""

SPECK = 7
"""Pixels along the square whose median a pixel is taken to be."""

DETAIL = 4.0
"""Standard deviation in pixels of the Gaussian above which a background's detail is finer than that of smoke."""

DETAIL_QUANTILE = 0.95
"""Quantile of the known background's detail that bounds that of the unknown; what is beyond it is smoke's."""

MIN_TRANSMITTANCE = 0.2
"""Light let through by the smoke from which the detail behind it can be distinguished from noise."""

RIM = 14
"""Pixels from what is unknown within which smoke may be so thin that it passes for clear
(docs/experiments/background.md)."""

RIM_MEAN = 8.0
"""Standard deviation in pixels of the Gaussian over which that is judged, lest single bricks pass for smoke."""

NEIGHBOURHOOD = 17
"""Pixels along the square around a pixel in which smoke is looked for: a macroblock of H.264 and one more."""

NEAR_SMOKE = 0.1
"""Share of it that is not clear, whenever the pixel itself seems to be, from which it is amid smoke."""

SHIFTS = (-1 / 2, -1 / 3, -1 / 6, 1 / 6, 1 / 3, 1 / 2)
"""Where the outline of the unknown is laid on what is known, to the right, in widths of the picture."""

MAX_ERROR_SIDE = 480
"""Pixels along the longer side at most of the picture that errors are measured on; larger ones are reduced to it."""


def completed(
    image: Picture,
    known: npt.NDArray[np.bool_],
    sure: npt.NDArray[np.bool_],
    mean: Picture,
    brightness: float,
    brightens: npt.NDArray[np.bool_],
    finer_than: float,
) -> tuple[Picture, Picture]:
    """Return a linear plate with what is unknown filled in, and the ``contrast`` of `ClearPicture`.

    ``mean`` is that of the samples in sRGB values. What is unknown is continued from what is sure: other pixels are
    known only because they look like their surroundings, and a few of them, at the rim of smoke that hardly changes,
    would spread over all that is behind it.

    Smoke of transmittance T and brightness J shows J + T (B - J) of a background B. The mean over time has T from its
    coarse part and that of the surroundings, and so what of its detail is the background's.
    """
    if known.all():
        return image, np.ones(known.shape, np.float32)
    smooth = push_pull(linear_to_srgb(image), sure.astype(np.float32))
    coarse = blurred(mean, finer_than)
    contrast = smooth.mean(-1) - brightness
    seen = (coarse.mean(-1) - brightness) / np.where(np.abs(contrast) > 0.02, contrast, np.inf)
    detail = mean - coarse
    most = np.quantile(np.abs(detail[sure]), DETAIL_QUANTILE, axis=0) if sure.any() else np.zeros(3, np.float32)
    passed = np.clip(seen, MIN_TRANSMITTANCE, 1)
    detail = np.clip(detail / passed[..., None], -most, most)
    filled = smooth + np.where(seen > MIN_TRANSMITTANCE, 1, 0)[..., None] * detail
    # smoke has drawn the pixel towards its own brightness, never away from it
    beyond = filled.mean(-1) - linear_to_srgb(image).mean(-1)
    beyond -= np.clip(beyond, -DRIFT, DRIFT)
    filled -= np.where(brightens, np.maximum(beyond, 0), np.minimum(beyond, 0))[..., None]
    filled = srgb_to_linear(np.maximum(filled, 0))
    contrast = np.where(known, 1, np.where(seen > MIN_TRANSMITTANCE, 1 / passed, 0)).astype(np.float32)
    return np.where(known[..., None], image, filled), contrast


def unlike(image: Picture, known: npt.NDArray[np.bool_]) -> Picture:
    """Return by how much a linear picture differs from what is known around, in grey sRGB values (rows, columns)."""
    encoded = linear_to_srgb(image)
    return np.asarray(np.abs((encoded - push_pull(encoded, known.astype(np.float32))).mean(-1)))


def thin_rim(
    image: Picture, known: npt.NDArray[np.bool_], brightens: npt.NDArray[np.bool_], clear: npt.NDArray[np.bool_]
) -> npt.NDArray[np.bool_]:
    """Return what is known beside the unknown, but most likely is smoke that hardly changes.

    It is drawn towards the smoke's brightness by more than drift, compared with what is continued from further away,
    and smoke is near whenever it seems to be clear. A coarse codec keeps thin smoke as still as a background.

    ``brightens`` is where smoke brightens, ``clear`` (frames, rows, columns) where each sample seems to be clear, or
    does not show the pixel.
    """
    beyond = ndimage.distance_transform_edt(known) > RIM
    if known.all() or not beyond.any():
        return np.zeros_like(known)
    encoded = linear_to_srgb(image)
    towards = (encoded - push_pull(encoded, beyond.astype(np.float32))).mean(-1) * np.where(brightens, 1, -1)
    share = np.maximum(blurred(known.astype(np.float32), RIM_MEAN), 1e-3)
    drawn = blurred(np.where(known, towards, 0).astype(np.float32), RIM_MEAN) > DRIFT * share
    rim = np.asarray(known & ~beyond & drawn)
    if rim.any():
        for seems in clear:
            smoky = ndimage.uniform_filter((~seems).astype(np.float32), NEIGHBOURHOOD)
            rim &= ~seems | (smoky > NEAR_SMOKE)
    return rim


def push_pull(image: Picture, confidence: Picture) -> Picture:
    """Blend pixels of low confidence with the smooth continuation of their surroundings.

    The push-pull algorithm (Gortler et al., "The lumigraph", 1996): averages weighted by confidence over ever larger
    blocks; each level keeps what it knows and takes the rest from the next coarser one.
    """
    height, width = confidence.shape
    weight: Picture = confidence[..., None]
    if max(height, width) == 1 or float(confidence.min()) >= 1.0:
        return image
    small_size = ((width + 1) // 2, (height + 1) // 2)
    total = area_average(weight, *small_size)
    mean = area_average(image * weight, *small_size) / np.maximum(total, 1e-6)
    # A block of which a quarter is known is known: its mean is as good as any.
    coarse = push_pull(mean, np.minimum(4.0 * total[..., 0], 1.0))
    blend: Picture = image * weight + area_average(coarse, width, height) * (np.float32(1.0) - weight)
    return blend


def continuation_errors(image: Picture, known: npt.NDArray[np.bool_]) -> Picture:
    """Return the covariance (3, 3) of the colours' errors where a linear picture is continued from what is known.

    The outline of the unknown is laid on what is known, which is continued there as if it were unknown. The mean error
    is not taken off: it says nothing of that behind the smoke (docs/experiments/disturbed-clips.md). 0 where nothing is
    unknown, or so much that nothing can be left out.
    """
    if known.all():
        return np.zeros((3, 3), np.float32)
    width, height = reduced_size(known.shape[1], known.shape[0], MAX_ERROR_SIDE)
    if known.shape != (height, width):
        image, known = area_average(image, width, height), area_average(known.astype(np.float32), width, height) > 0.999
    encoded = linear_to_srgb(image)
    total, count = np.zeros((3, 3)), 0
    for shift in SHIFTS:
        left_out = known & _moved(~known, round(shift * width))
        if left_out.mean() < ISLAND:
            continue
        continued = srgb_to_linear(push_pull(encoded, (known & ~left_out).astype(np.float32)))
        error = np.where(left_out[..., None], continued - image, 0)
        share = blurred(left_out.astype(np.float32), DETAIL)[left_out]
        coarse = blurred(error, DETAIL)[left_out] / share[:, None]
        total += coarse.T.astype(np.float64) @ coarse
        count += len(coarse)
    return (total / max(count, 1)).astype(np.float32)


def in_one_piece(known: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Without specks: a clear island amid smoke, or an unknown one amid the clear, is an accident of the samples."""
    # the median of a square: what most of its pixels are
    down = ndimage.correlate1d(known.astype(np.uint8), np.ones(SPECK), 0)
    smooth = ndimage.correlate1d(down, np.ones(SPECK), 1) > SPECK**2 // 2
    islands, count = ndimage.label(smooth)
    large = np.bincount(islands.ravel(), minlength=count + 1) > ISLAND * known.size
    large[0] = False
    kept: npt.NDArray[np.bool_] = large[islands]
    return kept


def mostly_beside(grown: npt.NDArray[np.bool_], known: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Without patches that were added to what is known but border on less of it than of what stays unknown."""
    patches, count = ndimage.label(grown & ~known, structure=np.ones((3, 3)))
    beside = np.zeros(count + 1)
    for along, across in ((patches, grown), (patches.T, grown.T)):
        for one, other in ((np.s_[:-1], np.s_[1:]), (np.s_[1:], np.s_[:-1])):
            border = (along[one] > 0) & (along[other] == 0)
            sides = np.where(across[other][border], 1, -1)
            beside += np.bincount(along[one][border], sides, count + 1)
    kept: npt.NDArray[np.bool_] = grown & (beside >= 0)[patches]
    return kept


def _moved(mask: npt.NDArray[np.bool_], right: int) -> npt.NDArray[np.bool_]:
    """A mask (rows, columns) moved to the right, with nothing where it comes from."""
    moved = np.zeros_like(mask)
    if right >= 0:
        moved[:, right:] = mask[:, : mask.shape[1] - right]
    else:
        moved[:, :right] = mask[:, -right:]
    return moved
