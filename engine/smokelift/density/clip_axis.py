"""Where the smoke of a whole clip stands in depth, from some of its frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from smokelift.density.axis import AxisEstimate
from smokelift.density.axis_from_light import coarse_domain, refine_axis
from smokelift.density.axis_from_picture import estimate_axis
from smokelift.density.observation import Observation, ObservedClip, apparent_optical_depth
from smokelift.density.screen import seen_at
from smokelift.footage.matte import matte
from smokelift.render import Optics
from smokelift.scene import SHADOWED
from smokelift.scene.projection import ray_through_pixels

AXIS_FRAMES = 16
"""Frames of a clip from which the axis is estimated."""

LIGHT_FRAMES = 4
"""Frames of these whose light is fitted as well: each costs 200 pictures on a coarse grid."""

LONGEST = 512
"""Voxels along the longest side at most: finer grids show the place no better."""


def clip_axis(clip: ObservedClip) -> AxisEstimate | None:
    """The axis of a clip's smoke; None where there is none, where a camera travels, or where there are several.

    Inlets that are marked come first, then the contact with the floor, shifted by what the colours of lamps tell to a
    camera that stands still. What one that turns in its place sees is put into its middle picture.
    """
    moments = [observations for frame in clip.spread(AXIS_FRAMES) if (observations := clip.observe(frame))]
    if not moments or len(moments[0]) > 1:
        return None
    seen = [observations[0] for observations in moments]
    centres = np.array([observation.camera.matrix for observation in seen])[:, :3, 3]
    if not np.allclose(centres, centres[0]):
        return None
    camera = seen[len(seen) // 2].camera
    optics = replace(clip.optics, domain=coarse_domain(clip.optics.domain, LONGEST))
    amounts = [_optical_depth(observation, optics) for observation in seen]
    if not np.any([amount.any() for amount in amounts]):
        return None
    if clip.moves:
        origin, direction = ray_through_pixels(camera)
        there = zip(amounts, seen, strict=True)
        amounts = [seen_at(origin + direction, amount, each.camera).astype(np.float32) for amount, each in there]
    estimate = estimate_axis(amounts, camera, optics.domain, clip.inlets)
    if clip.moves or clip.inlets or optics.scattering not in SHADOWED:
        return estimate
    return refine_axis(estimate, seen[:: AXIS_FRAMES // LIGHT_FRAMES], optics)


def _optical_depth(observation: Observation, optics: Optics) -> NDArray[np.float32]:
    """Optical depth (rows, columns) that an observation shows."""
    image, plate = observation.image, observation.plate
    return apparent_optical_depth(image, plate, matte(image, plate).mask, optics)
