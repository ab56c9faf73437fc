"""A light where a scene gives none, and the richest model of scattering that the known light allows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from smokelift.footage.noise import Noise
from smokelift.render import scene_optics
from smokelift.scene import (
    SHADOWED,
    Background,
    Camera,
    CompleteScene,
    DirectionalLight,
    Domain,
    EnvironmentLight,
    Light,
    Medium,
    Scattering,
)
from smokelift.setup.choice import UNDETERMINED, Choice
from smokelift.setup.smoke import SmokeSamples
from smokelift.setup.smoke_colour import FAINTEST, line_of_colours
from smokelift.setup.sun import FoundSun
from smokelift.setup.thickness import Thickness, smoke_thickness

BEYOND = 0.1
"""Share by which the source radiance exceeds the 99th percentile of the smoke's. That smoke then has an optical depth
of about 2.4, not an infinite one."""

DOUBTFUL = 0.12
"""Error of held-out pixels, as a share of the smoke's contrast, from which the light that is taken before one colour is
likely wrong: from there on the mass was off by 1.5 and more in 38 of 42 clips, below in 34 of 86
(docs/experiments/surroundings.md)."""

EVEN = 0.1
"""Spread of a background of one colour at most, as a share of its mean."""

QUIET = 2 / 255
"""Noise up to which what is left is not the noise's."""

FEW = 8
"""Directions of an environment whose colour alone is asked for."""


@dataclass(frozen=True, eq=False)
class FoundLight:
    """The light of a shot, before models of scattering are tried.

    Attributes
    ----------
    lights
        Those that the scene gives, or one from everywhere.
    scattering
        The richest model that they allow, or the one that is asked for.
    thickness
        What the clip tells of the strength of a light that is not given; None if it is given or nothing is scattered.
    direction
        From where it comes, where several cameras tell; None where nothing was asked of them.
    """

    lights: tuple[Light, ...]
    scattering: Scattering
    thickness: Thickness | None = None
    direction: Choice[str] | None = None

    @property
    def guessed(self) -> bool:
        """Whether nothing tells the light, not even its strength."""
        return self.thickness is not None and self.thickness.source is None and not self.sunny

    @property
    def sunny(self) -> bool:
        """Whether the lights are those of a sun that was found."""
        return self.direction is not None and self.direction.chosen != UNDETERMINED

    def seen_by(self, sun: FoundSun | None) -> FoundLight:
        """The light with what several cameras tell of a sun, if they were asked."""
        if sun is None:
            return self
        if sun.lights is None:
            return replace(self, direction=sun.choice)
        return replace(self, lights=sun.lights, scattering="single", direction=sun.choice)

    def choices(self, scene: CompleteScene) -> tuple[Choice[Any], ...]:
        """What was measured of it, if the scene's model of scattering asks for light."""
        if self.thickness is None or scene.scattering == "absorption":
            return ()
        if self.direction is not None and self.sunny:
            return (self.direction,)
        return self.thickness.choice, self.direction or unknown_direction()

    def notes(
        self, scene: CompleteScene, choices: Sequence[Choice[Any]], samples: SmokeSamples, noise: Noise
    ) -> tuple[str, ...]:
        """What is to be said of it with the model that was chosen: see `light_note` and `light_doubts`."""
        if self.thickness is None or self.sunny:
            return ()
        note = light_note(scene, not self.guessed, bool(samples.smoky))
        scattered = next((choice for choice in choices if choice.what == "scattering"), None)
        return (note,) if scattered is None else (note, *light_doubts(scattered, samples, noise))


def find_light(given: tuple[Light, ...], asked: Scattering | None, medium: Medium, samples: SmokeSamples) -> FoundLight:
    """Complete the light.

    Parameters
    ----------
    given, asked, medium, samples
        As in `richest_scattering` and `ambient_sun`, which say what is refused.
    """
    richest = richest_scattering(asked, given, medium)
    if given or richest == "absorption":
        return FoundLight(given, richest)
    thickness = smoke_thickness(samples.textures)
    return FoundLight((ambient_sun(samples, medium, thickness.source),), richest, thickness)


def richest_scattering(asked: Scattering | None, lights: tuple[Light, ...], medium: Medium) -> Scattering:
    """The richest model of scattering that may be used: the one that is asked for, or what the known light allows.

    Raises
    ------
    ValueError
        If shadows are asked for without a light to cast them.
    """
    if asked in SHADOWED and not lights:
        raise ValueError(
            f'Scattering "{asked}" needs a light that casts the shadows; give one in [[lights]], or leave it to "auto".'
        )
    if asked is not None:
        return asked
    if medium.albedo == 0:
        return "absorption"
    return "single" if lights else "unshadowed"


def light_colour(lights: tuple[Light, ...], camera: Camera, domain: Domain, medium: Medium) -> NDArray[np.float64]:
    """Colour (3,) of the light in the middle of a box, the largest 1; ones where no light is known."""
    few = tuple(replace(light, directions=FEW) if isinstance(light, EnvironmentLight) else light for light in lights)
    grey = replace(medium, color=(1.0, 1.0, 1.0))
    scene = CompleteScene(camera, domain, grey, few, Background(), "single")
    source = scene_optics(scene).unshadowed_source()
    return source / source.max() if source.max() > 0 else np.ones(3)


def unknown_direction() -> Choice[str]:
    """Say that a light that is not given stands nowhere: one view does not tell a sun reliably.

    Source: docs/experiments/light-direction.md.
    """
    return Choice(
        "light direction",
        UNDETERMINED,
        "Light direction: undetermined, and so are the colour of a sun and the share of light from everywhere; suns "
        "from many sides explain one view alike. Give [[lights]] if you know them.",
    )


def ambient_sun(samples: SmokeSamples, medium: Medium, told: NDArray[np.float64] | None = None) -> DirectionalLight:
    """Uniform light whose source radiance is the one told, or about the radiance of the clip's thickest smoke.

    Thick smoke shows its source radiance J. It is the brightest smoke where smoke brightens its background, and the
    darkest where it darkens it.

    Parameters
    ----------
    samples
        Smoke pixels of the clip and what is behind them.
    medium
        Of the smoke.
    told : (3,), optional
        Source radiance, if the clip tells its mean (`thickness`). Smoke that is brighter than that mean, or
        darker where it darkens, is still met.
    """
    if samples.colours.shape[0] == 0:
        source = np.ones(3)
    else:
        brightens = samples.brightens
        if told is not None:
            change = np.sum(samples.colours - samples.behind, -1)
            bound = np.percentile(samples.colours[(change >= 0) == brightens], 99 if brightens else 1, axis=0)
            source = np.maximum(told, bound) if brightens else np.minimum(told, bound)
        elif brightens:
            source = _brightest(samples)
        else:
            source = (1 - BEYOND) * np.percentile(samples.colours, 1, axis=0)
    scattered = np.array(medium.albedos) / (4 * np.pi)
    irradiance = np.divide(source, scattered, out=np.zeros(3), where=scattered > 0)
    return DirectionalLight((0.0, 0.0, -1.0), (float(irradiance[0]), float(irradiance[1]), float(irradiance[2])))


def _brightest(samples: SmokeSamples) -> NDArray[np.float64]:
    """Source radiance (3,) beyond the thickest of smoke that brightens its background.

    It lies on the line on which the smoke lies. The brightest of each channel may be smoke of different colours, or
    what is behind it, and together a colour that no pixel shows.
    """
    colours, behind = samples.colours.astype(np.float64), samples.behind.astype(np.float64)
    axis, start = line_of_colours(colours, behind), behind.mean(0)
    farthest = start + (np.percentile(colours @ axis, 99) - start @ axis) * axis
    return np.asarray(np.maximum(farthest + BEYOND * np.linalg.norm(farthest) * axis, 0))


def light_note(scene: CompleteScene, told: bool, seen: bool) -> str:
    """Say what light is taken for a scene that gives none.

    Parameters
    ----------
    scene
        With the light and the model of scattering that were chosen.
    told
        Whether the clip tells how much light the smoke scatters (`thickness`).
    seen
        Whether any smoke is seen.
    """
    shadows = scene.scattering in SHADOWED
    if shadows:
        amount = "comes from behind the smoke"
    elif told:
        amount = "the smoke adds for what it hides"
    else:
        amount = "the thickest smoke shows" if seen else "makes thick smoke white"
    irradiance = np.sum([light.irradiance for light in scene.lights if isinstance(light, DirectionalLight)], 0)
    return (
        f"Light not given: as much from everywhere as {amount}, "
        f"irradiance {', '.join(f'{v:.2f}' for v in irradiance)}, {'with' if shadows else 'without'} shadows."
    )


def light_doubts(scattered: Choice[str], samples: SmokeSamples, noise: Noise) -> tuple[str, ...]:
    """Say that a light which is not given is likely wrong, where nothing else explains what it leaves.

    Before one colour, and not black, what moves is smoke, and its brightness says something of its light.

    Parameters
    ----------
    scattered
        How light is scattered, with the errors of held-out pixels.
    samples
        Smoke pixels of the clip and what is behind them.
    noise
        Of the clip.
    """
    error = scattered.measured.get(f"error_{scattered.chosen}", 0.0)
    if error < DOUBTFUL or not len(samples.behind) or noise.total.max() > QUIET:
        return ()
    low, high = np.percentile(samples.behind.max(-1), (5, 95))
    if high < FAINTEST or high - low > EVEN * high:
        return ()
    return (
        "The light that is taken is likely wrong, and the smoke too thick or too thin by half and more: it leaves "
        f"{error:.0%} of what the smoke changes unexplained. Give [[lights]] in a scene file.",
    )
