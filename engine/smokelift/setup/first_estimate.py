"""What a clip shows before camera, box, medium and light are known: its background, its smoke and its fire."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from smokelift.footage.backdrop import Backdrop, find_backdrop
from smokelift.footage.clip import Clip
from smokelift.footage.exposure import small
from smokelift.footage.fire import fire_colour, fire_share, firelight, without_fire
from smokelift.footage.images import area_average
from smokelift.footage.matte import matte
from smokelift.footage.plate import Plates, evened, exposures
from smokelift.scene import Background, Camera
from smokelift.scene.checks import Vector
from smokelift.setup.thickness import seen_texture

SAMPLE_FRAMES, SAMPLE_SIDE = 16, 320
"""Frames that are examined, so that smoke of a sixteenth of the clip is seen, and pixels along their longer side: five
to a voxel of a draft."""

UNKNOWN = 0.5
"""Confidence of a plate below which what is behind the smoke is unknown there: it is as likely smoke as not."""


@dataclass(frozen=True, eq=False)
class SmokeSamples:
    """Where and how bright smoke is in some frames, at reduced size.

    Attributes
    ----------
    scale
        Full pixels to a reduced one.
    covered : (rows, columns) bool
        Pixels with smoke in at least one sample.
    unknown : (rows, columns) bool
        Pixels whose background is unknown, likewise.
    colours : (n, 3)
        Radiance of all smoke pixels.
    behind : (n, 3)
        Background radiance at the same pixels.
    smoky
        Numbers of the frames with smoke, those with the most first.
    gains
        By how much each sample is brighter than its background, (3,), by the number of its frame; they are evened out.
    textures
        What the samples with smoke show of the texture behind it.
    amounts
        Numbers of smoke pixels of the samples that have any, in their order in ``colours``.
    """

    scale: float
    covered: NDArray[np.bool_]
    unknown: NDArray[np.bool_]
    colours: NDArray[np.float32]
    behind: NDArray[np.float32]
    smoky: tuple[int, ...]
    gains: Mapping[int, NDArray[np.float32]]
    textures: tuple[NDArray[np.float64], ...] = ()
    amounts: tuple[int, ...] = ()

    @property
    def typical(self) -> tuple[int, ...]:
        """Frames that models are tried on: the one with the most smoke, and one with a middling amount."""
        return tuple(dict.fromkeys((*self.smoky[:1], *self.smoky[len(self.smoky) // 2 :][:1])))

    @property
    def exposure(self) -> float:
        """Share by which the exposure of a sample differs from its background's at most."""
        return float(np.expm1(np.abs(np.log(list(self.gains.values()))).max()))

    @property
    def brightens(self) -> bool:
        """Whether smoke adds more light to what is behind it than it takes away."""
        change = np.sum(self.colours - self.behind, -1)
        return bool(np.sum(np.maximum(change, 0)) >= np.sum(np.maximum(-change, 0)))


@dataclass(frozen=True, eq=False)
class Fire:
    """What shines by itself.

    Attributes
    ----------
    share
        Of the smoke's pixels that do.
    light
        The clip of the light that it adds, in the place of smoke.
    color
        Of that light, as the clip shows it.
    """

    share: float
    light: Clip
    color: Vector


@dataclass(frozen=True, eq=False)
class FirstEstimate:
    """What a clip shows.

    Attributes
    ----------
    clip
        The footage at its background's exposure, without fire and without the brightness that noise adds.
    found
        What stands behind the smoke.
    samples
        Its smoke.
    fire
        None where none burns.
    """

    clip: Clip
    found: Backdrop
    samples: SmokeSamples
    fire: Fire | None


def first_estimate(clip: Clip, camera: Camera | None, background: Background | None) -> FirstEstimate:
    """Estimate what a clip shows; the parameters and errors are those of `find_backdrop`."""
    found = find_backdrop(clip, camera, background)
    samples = sample_smoke(found.clip, found.plates)
    exposed = evened(found.clip, found.plates, samples.gains)
    fire, share = None, fire_share(samples.colours, samples.behind)
    if share:
        doused = without_fire(exposed, found.plates)
        light = firelight(exposed, doused)
        fire, exposed = Fire(share, light, fire_colour(exposed, light)), doused
        samples = replace(sample_smoke(doused, found.plates), gains=samples.gains)
    return FirstEstimate(exposed, found, samples, fire)


def unknown_part(plates: Plates, clip: Clip, number: int) -> NDArray[np.bool_]:
    """Return where the background of a frame is unknown (rows, columns), and no mask hides it."""
    unknown = plates.at(number).confidence < UNKNOWN
    seen = clip.seen(number, *unknown.shape[::-1])
    return unknown if seen is None else unknown & seen


def sample_smoke(clip: Clip, plates: Plates) -> SmokeSamples:
    """Find the smoke in frames spread over a clip, whose exposure may change."""
    width, height = clip.size
    scale = max(1.0, max(width, height) / SAMPLE_SIDE)
    columns, rows = (max(1, round(side / scale)) for side in (width, height))
    covered, unknown = np.zeros((2, rows, columns), np.bool_)
    colours, behind, textures = [], [], []
    gains: dict[int, NDArray[np.float32]] = {}
    amounts: dict[int, int] = {}
    reduced = plates.through(lambda whole: area_average(whole, columns, rows), scale**2)
    gains_of = exposures(reduced)
    for number in clip.spread(SAMPLE_FRAMES):
        plate = reduced.at(number)
        seen = clip.stored(number).averaged(columns, rows)
        gains[number] = gains_of(number, small(seen))
        picture = seen / gains[number]
        mask = matte(picture, plate).mask
        covered |= mask
        unknown |= unknown_part(reduced, clip, number)
        colours.append(picture[mask])
        behind.append(plate.image[mask])
        if mask.any():
            amounts[number] = int(mask.sum())
            textures.append(seen_texture(picture, plate, mask))
    smoky = tuple(sorted(amounts, key=lambda number: -amounts[number]))
    radiance = np.concatenate(colours), np.concatenate(behind)
    found = tuple(textures), tuple(amounts.values())
    return SmokeSamples(scale, covered, unknown, *radiance, smoky, gains, *found)
