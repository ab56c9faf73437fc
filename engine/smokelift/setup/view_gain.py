"""How bright a further camera shows the smoke: cameras have exposures and white balances of their own.

Two pictures of one smoke bind each other: every slice across both cameras holds as much smoke in one as in the other.
So a density is fitted to both, on coarse frames and for several gains of the further one; the gain with which both are
met best is the camera's. Figures: docs/experiments/view-gain.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from smokelift.density import DensitySettings, Observation, reconstruct_density
from smokelift.density.hull import project_voxels, reached
from smokelift.footage.matte import matte
from smokelift.footage.working_picture import CameraError, working_picture
from smokelift.render import Image, scene_optics
from smokelift.scene import CompleteScene
from smokelift.setup.choice import Choice
from smokelift.setup.coarse import CoarseFrame, coarse_frame
from smokelift.setup.shot import ShotView

STEP = 1.2
"""Ratio of one gain to the next that is tried; between them it is where a parabola has its lowest point."""

MOST = 8.0
"""Largest gain that is tried, and the inverse of the smallest: three stops."""

LEAST, LEAST_UNLIT = 1.2, 1.35
"""Ratio of brightness from which on it is the cameras', where light is known and where it is taken to come from
everywhere. Cameras that are exposed alike are found to differ by up to 1.15 and 1.30 (docs/experiments/view-gain.md):
coarse voxels cast other shadows, and light from one side is brighter there."""

LEAST_COLOUR = 1.05
"""Ratio of two colours from which on it is the cameras'; light and shadow do not change it."""

FAINTEST = 1e-3
"""Power of a channel's smoke over that of the brightest one, below which the channel has no gain of its own."""

Gain = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class _Moment:
    """What two cameras saw at one moment, coarse."""

    input: CoarseFrame
    other: Observation

    def fitted(self, gain: Gain, settings: DensitySettings) -> tuple[float, Gain]:
        """Fit a density to both pictures, the other one over a gain (3,).

        Returns
        -------
        error
            Sum of the two pictures' squared differences, each over what the smoke changes in it, squared.
        ratio : (3,)
            Smoke in the other picture over that in the input, each over what the density shows of it.
        """
        scene, own = self.input.scene, Observation(self.input.scene.camera, self.input.picture, self.input.plate)
        plate = self.other.plate.through(lambda part: part / gain if part.ndim == 3 else part)
        views = (own, replace(self.other, image=self.other.image / gain, plate=plate))
        fitted = reconstruct_density(own.image, scene, settings=settings, plate=own.plate, views=views[1:])
        optics = scene_optics(scene)
        error, scales = 0.0, []
        for view in views:
            renderer = optics.renderer(view.camera, view.plate.image, fitted.hull)
            shown = renderer.image(fitted.density)
            seen = reached(matte(view.image, view.plate).mask, project_voxels(view.camera, scene.domain))
            change = float(np.sum(np.square(view.image - view.plate.image, dtype=np.float64)[seen]))
            error += float(np.sum(np.square(shown - view.image, dtype=np.float64)[seen])) / max(change, 1e-30)
            behind = renderer.transmittance[..., None] * view.plate.image
            scales.append(_scale((view.image - behind)[seen], (shown - behind)[seen]))
        return error, scales[1] / scales[0]


def balanced(
    number: int,
    front: ShotView,
    view: ShotView,
    scene: CompleteScene,
    lit: bool,
    smoky: Sequence[int],
    settings: DensitySettings,
    tolerance: float,
) -> tuple[ShotView, tuple[Choice[str], ...]]:
    """Bring a further view to the exposure of the input.

    Parameters
    ----------
    number
        Of the view, from 1.
    front, view
        The input and the further view; neither moves.
    scene
        With its lights and its model of scattering.
    lit
        Whether its lights are given, and not estimated.
    smoky
        Frames that are compared.
    settings
        How to fit.
    tolerance
        Error, as a share of what the smoke changes in the pictures, that a gain has to take away.

    Returns
    -------
    view
        The same one where its gain is no better than none.
    choices
        One where it is, else none.
    """
    moments = [moment for moment in (_moment(front, view, scene, frame) for frame in smoky) if moment is not None]
    if not moments or scene.scattering == "absorption":
        return view, ()

    def tried(gain: Gain) -> tuple[float, Gain]:
        errors, ratios = zip(*(moment.fitted(gain, settings) for moment in moments), strict=True)
        return math.sqrt(sum(errors) / (2 * len(errors))), np.exp(np.mean(np.log(ratios), axis=0))

    as_it_is, _ = tried(np.ones(3, np.float32))
    scalar = _best(lambda factor: tried(np.full(3, factor, np.float32))[0], as_it_is)
    _, ratio = tried(np.full(3, scalar, np.float32))
    colour = ratio / np.exp(np.mean(np.log(ratio)))
    if max(scalar, 1 / scalar) < (LEAST if lit else LEAST_UNLIT):
        scalar = 1.0
    if colour.max() / colour.min() < LEAST_COLOUR:
        colour = np.ones(3)
    gain = (scalar * colour).astype(np.float32)
    if (gain == 1).all():
        return view, ()
    error, _ = tried(gain)
    if error >= as_it_is - tolerance:
        return view, ()
    named = ", ".join(f"{value:.2f}" for value in gain)
    reason = (
        f"View {number}: shows the smoke {named} times (red, green, blue) as bright as the input, which is evened out; "
        f"the pictures differ by {error:.1%} of the smoke's contrast instead of {as_it_is:.1%}. If the cameras are "
        "exposed alike, light is missing: give it in [[lights]]."
    )
    measured = {"error": error, "error_as_it_is": as_it_is}
    return _over(view, gain), (Choice(f"gain of view {number}", named, reason, measured, tolerance),)


def _moment(front: ShotView, view: ShotView, scene: CompleteScene, frame: int) -> _Moment | None:
    """A moment of two cameras; None if one of them shows nothing of the domain or no smoke."""
    own = coarse_frame(front.clip, frame, front.camera, scene, front.plates.at(frame))
    if own is None or not matte(own.picture, own.plate).mask.any():
        return None
    with suppress(CameraError):
        working = working_picture(view.camera, own.scene.domain)
        plate = view.plates.at(frame).through(working.cut, working.pixels)
        picture = working.of(view.clip, frame)
        if matte(picture, plate).mask.any():
            return _Moment(own, Observation(working.camera, picture, plate))
    return None


def _best(error_of: Callable[[float], float], at_one: float) -> float:
    """The gain of the least error, from 1 on downhill."""
    errors = {0: at_one}
    last = int(math.log(MOST) / math.log(STEP))

    def error(step: int) -> float:
        if step not in errors:
            errors[step] = error_of(STEP**step)
        return errors[step]

    best = 0
    way = -1 if error(-1) < error(1) else 1
    while abs(best) < last and error(best + way) < error(best):
        best += way
    below, lowest, above = (error(step) for step in (best - 1, best, best + 1))
    bend = below - 2 * lowest + above
    return float(STEP ** (best + (0.5 * (below - above) / bend if bend > 0 else 0.0)))


def _scale(seen: Image, shown: Image) -> Gain:
    """What rendered smoke (n, 3) has to be multiplied by to be what is seen, a channel at a time."""
    power = np.sum(np.square(shown, dtype=np.float64), 0)
    product = np.sum(np.multiply(seen, shown, dtype=np.float64), 0)
    whole = product.sum() / max(power.sum(), 1e-30)
    known = (power > FAINTEST * power.max()) & (product > 0)
    return np.where(known, product / np.maximum(power, 1e-30), max(whole, 1e-6)).astype(np.float32)


def _over(view: ShotView, gain: Gain) -> ShotView:
    """The view with its pictures and backgrounds over a gain."""
    clip = view.clip.changed(lambda _, picture: picture / gain)
    return replace(view, clip=clip, plates=view.plates.through(lambda part: part / gain if part.ndim == 3 else part))
