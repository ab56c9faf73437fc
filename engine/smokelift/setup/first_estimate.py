"""What a clip shows before camera, box, medium and light are known: its background, its smoke and its fire."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from smokelift.extraction import plates_and_source, shows_transmittance
from smokelift.extraction.backdrop import Backdrop, find_backdrop
from smokelift.extraction.fire import HotPixels, fire_color, firelight, hot_pixels, without_fire
from smokelift.extraction.given_background import backdrop_color
from smokelift.extraction.matte import matte
from smokelift.extraction.plate import Plate, evened
from smokelift.footage.clip import Clip
from smokelift.footage.exposure import small
from smokelift.footage.images import Picture, area_average
from smokelift.scene import Background, Camera, Medium
from smokelift.scene.checks import Vector

SAMPLE_FRAMES, SAMPLE_SIDE = 16, 320
"""Frames that are examined, so that smoke in a sixteenth of the clip is seen; and pixels along their longer side, five
to a voxel of a draft."""

UNKNOWN = 0.5
"""Confidence of a plate below which a background is unknown: it is as likely smoke as not."""

MAX_CLEAR_FRACTION = 0.5
"""Area of smoke before a known background in a frame, over the median of all examined ones, below which the frame has
much less smoke than most: set by hand. Before an unknown background a frame without smoke differs from the plate, too.
"""


@dataclass(frozen=True, eq=False)
class SmokeSamples:
    """Where and how bright smoke is in some frames, at reduced size.

    Attributes
    ----------
    scale
        Full pixels along a reduced one.
    covered, unknown : (rows, columns) bool
        Pixels with smoke, and pixels with an unknown background, in at least one sample.
    colors, behind : (n, 3)
        Radiance of all smoke pixels, and of their background.
    smoky
        Numbers of the frames with smoke, those with the most first.
    gains
        Exposure (3,) of each sample over its background's, by frame number; the samples are divided by it.
    counts
        Numbers of smoke pixels of the samples with smoke, in the order of ``colors``.
    over_known
        Numbers of smoke pixels before a known background in each sample, in the order of ``gains``.
    """

    scale: float
    covered: NDArray[np.bool_]
    unknown: NDArray[np.bool_]
    colors: NDArray[np.float32]
    behind: NDArray[np.float32]
    smoky: tuple[int, ...]
    gains: Mapping[int, NDArray[np.float32]]
    counts: tuple[int, ...] = ()
    over_known: tuple[int, ...] = ()

    @property
    def typical(self) -> tuple[int, ...]:
        """Numbers of the frames that models are tried on: those with the most smoke and with the median amount."""
        return tuple(dict.fromkeys((*self.smoky[:1], *self.smoky[len(self.smoky) // 2 :][:1])))

    @property
    def clearest(self) -> int | None:
        """Number of the frame with the least smoke before a known background; None if none is much clearer."""
        if not self.over_known:
            return None
        number, least = min(zip(self.gains, self.over_known, strict=True), key=lambda pair: pair[1])
        return number if least < MAX_CLEAR_FRACTION * np.median(self.over_known) else None

    @property
    def exposure(self) -> float:
        """Largest fraction by which the exposure of a sample differs from its background's."""
        return float(np.expm1(np.abs(np.log(list(self.gains.values()))).max()))

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

    ``plates`` are those that were ``found``, and better known where smoke hides them. ``clip`` is the footage at its
    background's exposure, without fire and without the brightness that noise adds. ``hot`` are the pixels that may be
    fire. ``source`` (3,) is the usual source radiance of the smoke before a picture; None before one that does not show
    its transmittance (`with_source`), and without smoke.
    """

    clip: Clip
    found: Backdrop
    plates: Plate
    samples: SmokeSamples
    fire: Fire | None
    hot: HotPixels
    source: Picture | None


def first_estimate(
    clip: Clip, camera: Camera | None, background: Background | None, medium: Medium | None = None
) -> FirstEstimate:
    """Estimate what a clip shows; other parameters and errors as of `find_backdrop`.

    Where the ``medium`` that is given has a color of its flame there is fire, however little of it is certain.
    """
    flame_color = None if medium is None else medium.flame_color
    found = find_backdrop(clip, camera, background)
    samples = sample_smoke(found.clip, found.plates)
    exposed = evened(found.clip, found.plates, samples.gains)
    fire, hot = None, hot_pixels(samples.colors, samples.behind)
    if hot.burn or (flame_color is not None and hot.fraction):
        doused = without_fire(exposed, found.plates)
        light = firelight(exposed, doused)
        fire, exposed = Fire(light, flame_color or fire_color(exposed, light)), doused
        samples = replace(sample_smoke(doused, found.plates), gains=samples.gains)
    plates, source = with_source(found, exposed, samples.smoky)
    if plates is not found.plates:
        # what no frame shows clear is unknown, although turns say what is behind it
        again = sample_smoke(exposed, plates)
        samples = replace(again, gains=samples.gains, unknown=samples.unknown, over_known=samples.over_known)
    return FirstEstimate(exposed, found, plates, samples, fire, hot, source)


def with_source(found: Backdrop, clip: Clip, smoky: Sequence[int]) -> tuple[Plate, Picture | None]:
    """Return the plates of a clip, found in turn with its smoke, and the usual source radiance (3,) of that.

    There is none before what does not show T: black, one color, or a picture that is as good as one; and without
    ``smoky`` frames, those with the most smoke first.
    """
    if not smoky or backdrop_color(visible_plate(found.plates, clip, smoky[0])) is not None:
        return found.plates, None
    plates, source = plates_and_source(clip, found.shot_of(clip), found.plates, smoky)
    shown = visible_plate(plates, clip, smoky[0])
    return (plates, source) if shows_transmittance(shown, source) else (found.plates, None)


def visible_plate(plates: Plate, clip: Clip, frame: int) -> Picture:
    """Return the plate (rows, columns, 3) of a frame; where a mask hides it, and no smoke is, the mean of the rest."""
    plate, seen = plates.at(frame).image, clip.seen(frame, *clip.size)
    return plate if seen is None else np.where(seen[..., None], plate, plate[seen].mean(0))


def unknown_part(plates: Plate, clip: Clip, number: int) -> NDArray[np.bool_]:
    """Return the pixels (rows, columns) whose background is unknown in a frame and not hidden by a mask."""
    unknown = plates.at(number).confidence < UNKNOWN
    seen = clip.seen(number, *unknown.shape[::-1])
    return unknown if seen is None else unknown & seen


def sample_smoke(clip: Clip, plates: Plate) -> SmokeSamples:
    """Find the smoke in frames spread over a clip, whose exposure may change."""
    width, height = clip.size
    scale = max(1.0, max(width, height) / SAMPLE_SIDE)
    columns, rows = (max(1, round(side / scale)) for side in (width, height))
    covered, unknown = np.zeros((2, rows, columns), np.bool_)
    colors, behind, over_known = [], [], []
    gains: dict[int, NDArray[np.float32]] = {}
    counts: dict[int, int] = {}
    reduced = plates.through(lambda whole: area_average(whole, columns, rows), scale**2)
    for number in clip.spread(SAMPLE_FRAMES):
        plate = reduced.at(number)
        seen = clip.stored(number).averaged(columns, rows)
        gains[number] = reduced.gain(number, small(seen))
        picture = seen / gains[number]
        mask = matte(picture, plate).mask
        covered |= mask
        hidden = unknown_part(reduced, clip, number)
        unknown |= hidden
        over_known.append(int((mask & ~hidden).sum()))
        colors.append(picture[mask])
        behind.append(plate.image[mask])
        if mask.any():
            counts[number] = int(mask.sum())
    smoky = tuple(sorted(counts, key=lambda number: -counts[number]))
    radiance = np.concatenate(colors), np.concatenate(behind)
    return SmokeSamples(scale, covered, unknown, *radiance, smoky, gains, tuple(counts.values()), tuple(over_known))
