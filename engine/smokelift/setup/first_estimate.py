"""What a clip shows before camera, box, medium and light are known: its background, its smoke and its fire."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from smokelift.checks import Remark
from smokelift.checks.array_types import Doubles
from smokelift.footage.backdrop import Backdrop, find_backdrop
from smokelift.footage.clip import Clip
from smokelift.footage.fire import fire_colour, fire_share, firelight, without_fire
from smokelift.footage.steady import steady
from smokelift.footage.turning import Turns
from smokelift.scene import Background, Camera
from smokelift.scene.checks import Vector
from smokelift.setup.backdrop_remarks import backdrop_remarks, doubts, exposure_remarks
from smokelift.setup.smoke import SmokeSamples, sample_smoke


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
        What stands behind the smoke, and how the camera turns before it.
    samples
        Its smoke.
    fire
        None where none burns.
    remarks
        What was assumed or noticed, and why the result may be nothing, or wrong.
    """

    clip: Clip
    found: Backdrop
    samples: SmokeSamples
    fire: Fire | None
    remarks: tuple[Remark, ...]

    @property
    def turns(self) -> Turns | None:
        """How the camera turned, if it was found to."""
        return None if self.found.steadied is None else self.found.steadied[0].turns


def first_estimate(
    clip: Clip, camera: Camera | None, background: Background | None, lenses: Sequence[Doubles]
) -> FirstEstimate:
    """Estimate what a clip shows; the parameters and errors are those of `find_backdrop`."""
    found = find_backdrop(clip, camera, background, lenses)
    corner = (0, 0) if found.steadied is None else found.steadied[0].corner
    samples = sample_smoke(*found.still(found.clip), corner)
    exposed = steady(found.clip, found.plates, samples.gains)
    fire, share = None, fire_share(samples.colours, samples.behind)
    if share:
        doused = without_fire(exposed, found.plates)
        light = firelight(exposed, doused)
        fire, exposed = Fire(share, light, fire_colour(exposed, light)), doused
        samples = replace(sample_smoke(*found.still(doused), corner), gains=samples.gains)
    unused = found.source == "alpha" and background is not None
    remarks = (
        *backdrop_remarks(found),
        *((Remark("background unused"),) if unused else ()),
        *doubts(found, samples, background is not None),
        *exposure_remarks(samples.exposure),
    )
    return FirstEstimate(exposed, found, samples, fire, remarks)
