"""Figures of a plate and of the mattes before it."""

import numpy as np

from benchmarks.background.clips import Case
from smokelift.footage.images import linear_to_srgb
from smokelift.footage.matte import matte
from smokelift.footage.plate import Plates, evened

VISIBLE, CLEAR = 6.0, 0.5
"""8 bit codes of contrast from which smoke should be found, and up to which a pixel is clear."""

LOOKED_AT = 8
"""Frames of a clip."""


def score(case: Case, plates: Plates) -> dict[str, float]:
    """Judge the plates that were found for a clip.

    Returns
    -------
    ``plate``: 95th percentile of the error where smoke passes (8 bit codes); ``lost``: share of the smoke's light that
    the plate holds; ``missed``: visible smoke outside the matte; ``false``: clear pixels inside it; ``unknown``: share
    of the picture.
    """
    clip = evened(case.clip, plates)
    missed, false, errors, lost, smoke = [], [], [], 0.0, 0.0
    touched = np.zeros(case.clean.shape[1:3], np.bool_)
    unknown = 0.0
    for number in clip.spread(LOOKED_AT):
        plate = plates.at(number)
        clean, behind = case.clean[number], case.plate
        truth = linear_to_srgb(behind)
        contrast = np.abs(linear_to_srgb(clean) - truth).max(-1) * 255
        found = matte(clip.frame(number), plate).mask
        visible = contrast > VISIBLE
        touched |= visible
        if visible.any():
            missed.append(float((visible & ~found).sum() / visible.sum()))
        false.append(float(found[contrast < CLEAR].mean()) if (contrast < CLEAR).any() else 0.0)
        lost += float(np.abs(plate.image - behind)[visible].sum())
        smoke += float(np.abs(clean - behind)[visible].sum())
        errors.append(np.abs(linear_to_srgb(plate.image) - truth).max(-1) * 255)
        unknown = float((plate.confidence < 0.5).mean())
    return {
        "plate": float(np.percentile(np.stack(errors)[:, touched], 95)),
        "lost": lost / smoke,
        "missed": float(np.mean(missed)),
        "false": float(np.mean(false)),
        "unknown": unknown,
    }
