"""What a clip shows before camera, box, medium and light are known: its background, its smoke and its fire."""

from __future__ import annotations

from dataclasses import dataclass, replace

from smokelift.checks import Doubt, Remark
from smokelift.footage.backdrop import Backdrop, find_backdrop
from smokelift.footage.clip import Clip
from smokelift.footage.plate import Plate, Plates
from smokelift.footage.steady import steady
from smokelift.render import Image
from smokelift.scene import Background, Camera
from smokelift.setup.backdrop_remarks import (
    backdrop_doubts,
    backdrop_remarks,
    between_bars,
    cut_doubts,
    exposure_remarks,
    nothing_seen,
    smoke_in_plate,
)
from smokelift.setup.fire_estimate import Fire, find_fire
from smokelift.setup.smoke import SmokeSamples, sample_smoke
from smokelift.setup.source import several_colours


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
    doubts
        Why the result may be nothing, or wrong.
    unused
        Whether a background is given that an alpha channel replaces.
    """

    clip: Clip
    found: Backdrop
    samples: SmokeSamples
    fire: Fire | None
    doubts: tuple[Doubt, ...]
    unused: bool

    @property
    def plates(self) -> Plates:
        """Plates of the full pictures."""
        return self.found.plates

    @property
    def picture(self) -> Image | None:
        """The background, if it was estimated as one picture: linear, (rows, columns, 3)."""
        if self.found.background is None and isinstance(self.plates, Plate):
            return self.plates.image
        return None

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """What was assumed or estimated; the doubts are among them."""
        unused = (Remark("background unused"),) if self.unused else ()
        return (*backdrop_remarks(self.found), *unused, *self.doubts, *exposure_remarks(self.samples.exposure))


def first_estimate(clip: Clip, camera: Camera | None, background: Background | None) -> FirstEstimate:
    """Estimate what a clip shows; the parameters and errors are those of `find_backdrop`."""
    found = find_backdrop(clip, camera, background)
    samples = sample_smoke(found.clip, found.plates)
    clip = steady(found.clip, found.plates, samples.gains)
    fire = find_fire(clip, found.plates, samples)
    if fire is not None:
        clip = fire.doused
        samples = replace(sample_smoke(clip, found.plates), gains=samples.gains)
    cuts = cut_doubts(found)
    nothing = nothing_seen(clip, found.plates, samples, background is not None, cuts)
    bars = between_bars(samples) if background is None else ()
    doubts = (
        *(nothing or cuts),
        *backdrop_doubts(found),
        *smoke_in_plate(samples),
        *bars,
        *several_colours(samples),
    )
    unused = found.source == "alpha" and background is not None
    return FirstEstimate(clip, found, samples, fire, doubts, unused)
