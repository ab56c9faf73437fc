"""What a clip shows before camera, box, medium and light are known: its background, its smoke and its fire."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from smokelift.footage.alignment import Lens
from smokelift.footage.clip import Clip
from smokelift.footage.flicker import evened, flicker_gains
from smokelift.footage.plate import Plate, Plates
from smokelift.footage.steady import steady
from smokelift.render import Image
from smokelift.scene import Background, Camera
from smokelift.setup.background import FoundPlates, between_bars, cut_notes, exposure_notes, find_plates, smoke_in_plate
from smokelift.setup.fire import Fire, find_fire
from smokelift.setup.no_smoke import nothing_seen
from smokelift.setup.smoke import SmokeSamples, sample_smoke
from smokelift.setup.source import several_colours


@dataclass(frozen=True, eq=False)
class FirstLook:
    """What a clip shows.

    Attributes
    ----------
    clip
        The footage at its background's exposure, or at that of the frames around each where only the smoke shows it;
        without fire and without the brightness that noise adds.
    found
        What stands behind the smoke, and how the camera turns before it.
    samples
        Its smoke.
    fire
        None where none burns.
    doubts
        Why the result may be nothing, or wrong, a sentence each.
    flickers
        Whether the smoke alone shows how the exposure changes.
    """

    clip: Clip
    found: FoundPlates
    samples: SmokeSamples
    fire: Fire | None
    doubts: tuple[str, ...]
    flickers: bool

    @property
    def plates(self) -> Plates:
        """Of the full pictures."""
        return self.found.plates

    @property
    def picture(self) -> Image | None:
        """The background, if it was estimated as one picture: linear, (rows, columns, 3)."""
        if self.found.background is None and isinstance(self.plates, Plate):
            return self.plates.image
        return None

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed or estimated, a sentence each; the doubts are among them."""
        return (*self.found.notes, *self.doubts, *exposure_notes(self.samples.exposure, self.flickers))


def first_look(clip: Clip, camera: Camera | None, background: Background | None, lens: Lens | None) -> FirstLook:
    """Look at a clip; the parameters and errors are those of `find_plates`."""
    found = find_plates(clip, camera, background, lens)
    samples = sample_smoke(found.clip, found.plates, found.turns)
    cuts = cut_notes(found.clip, samples.small) if found.turns is None else ()
    clip = steady(found.clip, found.plates, samples.gains)
    fire = find_fire(clip, found.plates, samples)
    flickers = False
    if fire is not None:
        clip = fire.doused
        samples = replace(sample_smoke(clip, found.plates, found.turns), gains=samples.gains)
    # flames flicker by themselves
    elif samples.smoky and (gains := flicker_gains(found.clip, found.plates, samples.smoky[0])) is not None:
        clip = evened(clip, gains)
        flickers, known = True, {number: np.full(3, gains[number], np.float32) for number in samples.gains}
        samples = replace(sample_smoke(clip, found.plates, found.turns), gains=known)
    nothing = nothing_seen(clip, found.plates, samples, background is not None, cuts)
    bars = between_bars(samples) if background is None else ()
    doubts = (*(nothing or cuts), *found.doubts, *smoke_in_plate(samples), *bars, *several_colours(samples))
    return FirstLook(clip, found, samples, fire, doubts, flickers)
