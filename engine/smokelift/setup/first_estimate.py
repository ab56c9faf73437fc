"""What a clip shows before camera, box, medium and light are known: its background, its smoke and its fire."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from smokelift.extraction.element import shows_transmittance
from smokelift.extraction.find_background import FoundBackground, find_background
from smokelift.extraction.given_background import single_color
from smokelift.extraction.hidden_plate import plate_and_source
from smokelift.extraction.matte import HotPixels, fire_color, firelight, hot_pixels, matte, without_fire
from smokelift.extraction.plate import Plate, cleared
from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture, area_average, reduced_size
from smokelift.scene import Background, Camera, Medium
from smokelift.scene.checks import Vector

SAMPLE_FRAMES, SAMPLE_SIDE = 16, 320
"""Frames that are examined, so that smoke in a sixteenth of the clip is seen; and pixels along their longer side, five
to a voxel of a draft."""

UNKNOWN = 0.5
"""Confidence of a plate below which a background is unknown: it is as likely smoke as not."""

MAX_CLEAR_FRACTION = 0.5
"""Area of smoke before a known background in a frame, over the median of all examined ones, below which the frame has
much less smoke than most. Before an unknown background a frame without smoke differs from the plate."""


@dataclass(frozen=True, eq=False)
class SmokeSamples:
    """Where and how bright smoke is in some frames, at reduced size."""

    scale: float
    """Full pixels along a reduced one."""
    covered: NDArray[np.bool_]
    unknown: NDArray[np.bool_]
    """(rows, columns) bool: pixels with smoke, and pixels with an unknown background, in at least one sample."""
    colors: NDArray[np.float32]
    behind: NDArray[np.float32]
    """(n, 3): radiance of all smoke pixels, and of their background."""
    smoky: tuple[int, ...]
    """Numbers of the frames with smoke, those with the most first."""
    counts: tuple[int, ...] = ()
    """Numbers of smoke pixels of the samples with smoke, in the order of ``colors``."""
    over_known: Mapping[int, int] = field(default_factory=dict)
    """Numbers of smoke pixels before a known background in each sample, by frame number."""
    exposure: float = 0.0
    """Largest fraction by which the exposure of a sample was changed."""

    @property
    def typical(self) -> tuple[int, ...]:
        """Numbers of the frames that models are tried on: those with the most smoke and with the median amount."""
        return tuple(dict.fromkeys((*self.smoky[:1], *self.smoky[len(self.smoky) // 2 :][:1])))

    @property
    def clearest(self) -> int | None:
        """Number of the frame with the least smoke before a known background; None if none is much clearer."""
        if not self.over_known:
            return None
        number, least = min(self.over_known.items(), key=lambda pair: pair[1])
        return number if least < MAX_CLEAR_FRACTION * np.median(list(self.over_known.values())) else None

    @property
    def brightens(self) -> bool:
        """Whether smoke adds more light to what is behind it than it takes away."""
        change = np.sum(self.colors - self.behind, -1)
        return bool(np.sum(np.maximum(change, 0)) >= np.sum(np.maximum(-change, 0)))


@dataclass(frozen=True, eq=False)
class Fire:
    """What shines by itself.

    ``light`` is a clip of the added light in the place of smoke; ``color`` is its color in the clip.
    """

    light: Clip
    color: Vector


@dataclass(frozen=True, eq=False)
class FirstEstimate:
    """What a clip shows: its background, its smoke, and its fire if any burns.

    ``plate`` is ``found.plate``, refined where smoke hides it; ``clip`` is ``found.clip`` without fire. ``hot`` are the
    pixels that are fire, or may be. ``source`` (3,) is the usual source radiance of the smoke before a picture; None
    before one that does not show its transmittance (`with_source`), and without smoke.
    """

    clip: Clip
    found: FoundBackground
    plate: Plate
    samples: SmokeSamples
    fire: Fire | None
    hot: HotPixels
    source: Picture | None


def first_estimate(
    clip: Clip, camera: Camera | None, background: Background | None, medium: Medium | None = None
) -> FirstEstimate:
    """Estimate what a clip shows; other parameters and errors as of `find_background`.

    Where the ``medium`` that is given has a color of its flame there is fire, however little of it is certain.
    """
    flame_color = None if medium is None else medium.flame_color
    found = find_background(clip, camera, background)
    clip, plate = found.clip, found.plate
    samples = sample_smoke(clip, plate)
    fire, hot = None, hot_pixels(samples.colors, samples.behind)
    given = flame_color is not None and hot.fraction > 0
    if not given:
        # what shines through smoke and is part of the plate does not burn
        plate, source, samples = with_source(found, clip, samples)
    burning = hot_pixels(samples.colors, samples.behind)
    if given or burning.burn:
        doused = without_fire(clip, plate)
        light = firelight(clip, doused)
        fire, hot, clip = Fire(light, flame_color or fire_color(clip, light)), burning, doused
        plate, source, samples = with_source(found, clip, sample_smoke(clip, found.plate))
    if plate is not found.plate:
        clip = cleared(clip, plate)  # what a mask hides showed the plate as it was, and would be smoke before this one
    return FirstEstimate(clip, found, plate, samples, fire, hot, source)


def with_source(
    found: FoundBackground, clip: Clip, samples: SmokeSamples
) -> tuple[Plate, Picture | None, SmokeSamples]:
    """Return the plate of a clip, found in turn with its smoke, the usual source radiance (3,) of that, and samples.

    There is none before what does not show T: black, one color, or a given picture as good as one; and without smoke.
    ``samples`` are those before the plate as it was found.
    """
    if not samples.smoky:
        return found.plate, None, samples
    # a wall that was found is no even color, however little its light changes
    shown = visible_plate(found.plate, clip, samples.smoky[0])
    if found.source != "picture" and single_color(shown) is not None:
        return found.plate, None, samples
    plate, source = plate_and_source(clip, found.uncut_clip(clip), found.plate, samples.smoky)
    if not shows_transmittance(visible_plate(plate, clip, samples.smoky[0]), source):
        return found.plate, None, samples
    if plate is not found.plate:
        # what no frame shows clear is unknown, although turns say what is behind it
        found_again = sample_smoke(cleared(clip, plate), plate)
        samples = replace(found_again, unknown=samples.unknown, over_known=samples.over_known)
    return plate, source, samples


def visible_plate(plate: Plate, clip: Clip, frame: int) -> Picture:
    """Return the plate (rows, columns, 3) of a frame; where a mask hides it, and no smoke is, the mean of the rest."""
    image, seen = plate.at(frame).image, clip.seen(frame, *clip.size)
    return image if seen is None else np.where(seen[..., None], image, image[seen].mean(0))


def unknown_part(plate: Plate, clip: Clip, number: int) -> NDArray[np.bool_]:
    """Return the pixels (rows, columns) whose background is unknown in a frame and not hidden by a mask."""
    unknown = plate.at(number).confidence < UNKNOWN
    seen = clip.seen(number, *unknown.shape[::-1])
    return unknown if seen is None else unknown & seen


def sample_smoke(clip: Clip, plate: Plate) -> SmokeSamples:
    """Find the smoke in frames spread over a clip at its plate's exposure."""
    width, height = clip.size
    scale = max(1.0, max(width, height) / SAMPLE_SIDE)
    columns, rows = reduced_size(width, height, SAMPLE_SIDE)
    covered, unknown = np.zeros((2, rows, columns), np.bool_)
    colors, behind = [], []
    over_known: dict[int, int] = {}
    counts: dict[int, int] = {}
    exposure = 0.0
    reduced = plate.through(lambda whole: area_average(whole, columns, rows), scale**2)
    for number in clip.spread(SAMPLE_FRAMES):
        picture, clear = clip.stored(number).averaged(columns, rows), reduced.at(number)
        exposure = max(exposure, float(np.expm1(np.abs(np.log(clip.gain(number))).max())))
        mask = matte(picture, clear).mask
        covered |= mask
        hidden = unknown_part(reduced, clip, number)
        unknown |= hidden
        over_known[number] = int((mask & ~hidden).sum())
        colors.append(picture[mask])
        behind.append(clear.image[mask])
        if mask.any():
            counts[number] = int(mask.sum())
    smoky = tuple(sorted(counts, key=lambda number: -counts[number]))
    radiance = np.concatenate(colors), np.concatenate(behind)
    return SmokeSamples(scale, covered, unknown, *radiance, smoky, tuple(counts.values()), over_known, exposure)
