"""Pictures of which a part is unknown: continued from what is known around it, and how wrong that is."""

from collections.abc import Iterator

import numpy as np
from scipy import ndimage

from smokelift.checks import Mask
from smokelift.footage.images import Picture, area_average, linear_to_srgb, srgb_to_linear

DETAIL = 4.0
"""Standard deviation, in pixels, of the Gaussian that keeps smoke and removes the finer detail of a background."""

ISLAND = 0.01
"""Fraction of the picture up to which a clear patch is taken for an accident."""

RELAXATIONS = 4
"""Times that unknown pixels become the mean of their neighbors at each level: behind smoke before a sky it is off by
.0015, without any by .0032, with 32 by .0011 (docs/experiments/hidden-plate.md)."""

NEIGHBORS = np.array([0.25, 0, 0.25], np.float32)
"""Weights of a pixel's neighbors along an axis in the mean over all four (by definition)."""

SPECK = 7
"""Pixels along the square whose majority decides for its middle pixel."""

SHIFTS = (-1 / 2, -1 / 3, -1 / 6, 1 / 6, 1 / 3, 1 / 2)
"""Shifts to the right, in picture widths, that lay the outline of the unknown on the known."""


def push_pull(image: Picture, confidence: Picture) -> Picture:
    """Blend pixels of low confidence with the smooth continuation of their surroundings.

    The push-pull algorithm (Gortler et al., "The lumigraph", 1996) averages over ever larger blocks, weighted by
    confidence; each level keeps what it knows and takes the rest from the next coarser one, relaxed towards the means
    of its neighbors as a membrane is (Laplace's equation).
    """
    height, width = confidence.shape
    weight: Picture = confidence[..., None]
    if max(height, width) == 1 or float(confidence.min()) >= 1.0:
        return image
    small_size = ((width + 1) // 2, (height + 1) // 2)
    total = area_average(weight, *small_size)
    mean = area_average(image * weight, *small_size) / np.maximum(total, 1e-6)
    # a block counts as known if a quarter of it is: its mean is good enough
    coarse = push_pull(mean, np.minimum(4.0 * total[..., 0], 1.0))
    known, unknown = image * weight, np.float32(1.0) - weight
    blend: Picture = known + area_average(coarse, width, height) * unknown
    for _ in range(RELAXATIONS):
        around = ndimage.correlate1d(blend, NEIGHBORS, 0, mode="nearest")
        around += ndimage.correlate1d(blend, NEIGHBORS, 1, mode="nearest")
        blend = known + around * unknown
    return blend


def continuation_errors(image: Picture, known: Mask) -> Picture:
    """Return the covariance (3, 3) of the colors' errors where a linear picture is continued from what is known.

    They are measured on known pixels, which the shifted outline of the unknown leaves out. The mean error is not
    subtracted: it says nothing of that behind the smoke (docs/experiments/background.md). Zero if nothing is
    unknown, or too much to leave anything out.
    """
    total, count = np.zeros((3, 3)), 0
    for continued, left_out in left_out_parts(linear_to_srgb(image), known):
        error = (srgb_to_linear(continued) - image)[left_out].astype(np.float64)
        total += error.T @ error
        count += len(error)
    return (total / max(count, 1)).astype(np.float32)


def left_out_parts(image: Picture, known: Mask) -> Iterator[tuple[Picture, Mask]]:
    """Yield a picture continued where the shifted outline of the unknown lies on the known, and that part of it."""
    width, reach = known.shape[1], (known.shape[1] + 1) // 2
    unknown = np.pad(~known, ((0, 0), (reach, reach)))
    for shift in SHIFTS if unknown.any() else ():
        first = reach - round(shift * width)
        left_out = known & unknown[:, first : first + width]
        if left_out.mean() >= ISLAND:
            yield push_pull(image, (known & ~left_out).astype(np.float32)), left_out


def in_one_piece(known: Mask) -> Mask:
    """Remove specks, known ones and unknown ones: they are accidents of the samples."""
    down = ndimage.correlate1d(known.astype(np.uint8), np.ones(SPECK), 0)
    smooth = ndimage.correlate1d(down, np.ones(SPECK), 1) > SPECK**2 // 2
    islands, count = ndimage.label(smooth)
    large = np.bincount(islands.ravel(), minlength=count + 1) > ISLAND * known.size
    large[0] = False
    return np.asarray(large[islands])


def mostly_beside(grown: Mask, known: Mask) -> Mask:
    """Remove the patches that ``grown`` adds to what is known if more of their border is unknown than known."""
    patches, count = ndimage.label(grown & ~known, structure=np.ones((3, 3)))
    beside = np.zeros(count + 1)
    for along, across in ((patches, grown), (patches.T, grown.T)):
        for one, other in ((np.s_[:-1], np.s_[1:]), (np.s_[1:], np.s_[:-1])):
            border = (along[one] > 0) & (along[other] == 0)
            sides = np.where(across[other][border], 1, -1)
            beside += np.bincount(along[one][border], sides, count + 1)
    return np.asarray(grown & (beside >= 0)[patches])
