"""Where a sun stands that no scene gives, and how much light comes from everywhere beside it.

Densities of all cameras' pictures are lit from directions all around, one at a time. What the smoke adds to the
held-out pixels is the picture of a sun and that of light from everywhere, each times its strength: least squares
without negative parts for each direction, the best of which is the sun's. How far it turns when one camera after the
other is left out says how well it is known. The densities are then fitted again in that light, a few times in turn.

One camera cannot be left out, and tells no direction: the error of the assumed depth looks like light.
Figures: docs/experiments/light-direction.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from smokelift.checks.array_types import Doubles
from smokelift.density import DensitySettings
from smokelift.scene import CompleteScene, DirectionalLight, Light
from smokelift.setup.coarse import CoarseFrame
from smokelift.setup.held_out import HalfFit, fit_half

DIRECTIONS = 48
"""Directions that are tried first, spread evenly: neighbours are about 30 degrees apart."""

REFINING_DEGREES = (14.0, 7.0)
"""Degrees from the best one of the six directions that are tried next, and from the best of those."""

ROUNDS = 3
"""Fits of the densities, each in the light that the one before led to."""

AXES = ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0))
"""Directions of travel that stand for all: 14 find no other density (docs/experiments/surroundings.md)."""


AMBIENT = 0.35
"""Share of light from everywhere at most beside a sun that is used. Light from everywhere alone is found to have one of
0.4 and more (docs/experiments/light-direction.md)."""

SHADING = 0.14
"""Error at least that light from everywhere alone leaves of what the smoke adds, as a share of it: thin smoke hardly
shades itself (docs/experiments/light-direction.md)."""

EXPLAINED = 0.1
"""Share at least of what light from everywhere leaves, in squares, that the sun explains: where the densities are wrong
hardly any of it is light, and any direction will do (docs/experiments/light-direction.md)."""

SPREAD = 20.0
"""Standard deviation of the direction at most, in degrees (docs/experiments/light-direction.md)."""


@dataclass(frozen=True, eq=False)
class Sky:
    """Light of a sun and from everywhere.

    Attributes
    ----------
    towards : (3,)
        Direction to the sun, of length 1.
    sun, ambient
        Irradiance of the sun, and that of all light from everywhere together; of the mean of the channels.
    colour : (3,)
        Of both, with the mean 1.
    spread
        Standard deviation of the direction in degrees, by leaving one camera out after the other.
    shading
        Error that light from everywhere alone leaves of what the smoke adds, as a share of it.
    explained
        Share of that, in squares, that the sun explains.
    """

    towards: Doubles
    sun: float
    ambient: float
    colour: Doubles
    spread: float
    shading: float
    explained: float

    @property
    def ambient_share(self) -> float:
        """Share of the light from everywhere in all of the light."""
        return self.ambient / max(self.sun + self.ambient, 1e-30)

    @property
    def determined(self) -> bool:
        """Whether the clip shows where the sun stands."""
        shows = self.ambient_share <= AMBIENT and self.shading >= SHADING
        return shows and self.explained >= EXPLAINED and self.spread <= SPREAD

    def lights(self) -> tuple[Light, ...]:
        """The two."""
        sun = directional(self.towards, self.sun * self.colour)
        ambient = light_around(self.ambient * self.colour / (4 * np.pi))
        return (*((sun,) if self.sun > 0 else ()), *(ambient if self.ambient > 0 else ()))


def directional(towards: Doubles, irradiance: Doubles) -> DirectionalLight:
    """Light of an irradiance (3,) from a direction (3,)."""
    (x, y, z), (red, green, blue) = (-towards).tolist(), irradiance.tolist()
    return DirectionalLight((x, y, z), (red, green, blue))


def light_around(radiance: Doubles) -> tuple[DirectionalLight, ...]:
    """Light from everywhere of a radiance (3,), in W/m^2/sr."""
    return tuple(directional(-np.array(side), 4 * np.pi * radiance / len(AXES)) for side in AXES)


def find_sky(frames: Sequence[CoarseFrame], scene: CompleteScene, settings: DensitySettings) -> Sky | None:
    """Find from where light comes.

    Parameters
    ----------
    frames
        What two cameras and more saw, which do not move and are exposed alike; one at least.
    scene
        With a light from everywhere for want of a known one, and a model that scatters light.
    settings
        How to fit.

    Returns
    -------
    Sky or None
        None where the smoke adds no light.
    """
    irradiance = np.sum([light.irradiance for light in scene.lights if isinstance(light, DirectionalLight)], 0)
    colour = irradiance / irradiance.mean()
    lit = [frame.lit_by(scene.lights).scattered_by(scene.scattering) for frame in frames]
    sky = None
    for _ in range(ROUNDS):
        sky = _explained(fit_half(lit, settings), colour)
        if not sky.sun + sky.ambient > 0:
            return None
        lit = [frame.lit_by(sky.lights()).scattered_by("single") for frame in frames]
    return sky


def sphere(count: int) -> Doubles:
    """Return unit vectors (count, 3), spread evenly over the sphere along a spiral that turns by the golden angle.

    Examples
    --------
    >>> bool(np.abs(sphere(48).mean(0)).max() < 0.01)
    True
    """
    step = np.arange(count)
    z = 1 - 2 * (step + 0.5) / count
    angle, radius = np.pi * (3 - 5**0.5) * step, np.sqrt(1 - z * z)
    return np.stack((radius * np.cos(angle), radius * np.sin(angle), z), -1)


def strengths(sums: Doubles, rest: Doubles) -> tuple[Doubles, Doubles, Doubles]:
    """How strong a sun from each direction and light from everywhere are: least squares without negative parts.

    Two unknowns need no solver: both, or one alone where the other would take light away (Lawson and Hanson, "Solving
    Least Squares Problems", 1974).

    Parameters
    ----------
    sums : (3, directions)
        Products of each direction's picture with itself, with that of light from everywhere, and with what is seen.
    rest : (2,)
        Products of the picture of light from everywhere with itself and with what is seen.

    Returns
    -------
    sun, ambient, explained : (directions,)
        Strengths, and how much of the squares of what is seen they explain.
    """
    (own, both, of_sun), (around, of_around) = np.maximum(sums, 0), np.maximum(rest, 1e-30)
    determinant = np.maximum(own * around - both**2, 1e-12 * own * around) + 1e-300
    sun, ambient = (of_sun * around - of_around * both) / determinant, (of_around * own - of_sun * both) / determinant
    mixed = (sun >= 0) & (ambient >= 0)
    sun_alone, ambient_alone = of_sun / np.maximum(own, 1e-30), of_around / around
    sunny = ~mixed & (sun_alone * of_sun > ambient_alone * of_around)
    sun = np.where(mixed, sun, np.where(sunny, sun_alone, 0.0))
    ambient = np.where(mixed, ambient, np.where(sunny, 0.0, ambient_alone))
    return sun, ambient, sun * of_sun + ambient * of_around


def _explained(fit: HalfFit, colour: Doubles) -> Sky:
    """The sky that explains best what the densities add to the held-out pixels."""
    added = [pixels.mean(-1) for pixels in fit.added]
    cameras = range(len(added))

    def pictures(towards: Doubles) -> list[Doubles]:
        """Pixels (directions, n) of each camera in light from each direction alone, of irradiance 1."""
        lit = [fit.lit((directional(each, colour),), "single") for each in towards]
        return [np.array([picture[camera].mean(-1) for picture in lit]) for camera in cameras]

    def sums_of(suns: list[Doubles]) -> Doubles:
        """Sums as in `strengths`, of each camera: (3, cameras, directions)."""
        parts = zip(suns, everywhere, added, strict=True)
        return np.stack([(np.sum(lit**2, 1), lit @ around, lit @ seen) for lit, around, seen in parts], 1)

    def best_of(kept: list[int]) -> tuple[int, float, float, float]:
        """The direction that explains most to some cameras, with what `strengths` says of it."""
        sun, ambient, explained = strengths(sums[:, kept].sum(1), rest[:, kept].sum(1))
        best = int(np.argmax(explained))
        return best, float(sun[best]), float(ambient[best]), float(explained[best])

    tried, suns = sphere(DIRECTIONS), pictures(sphere(DIRECTIONS))
    everywhere = [lit.mean(0) for lit in suns]
    sums = sums_of(suns)
    rest = np.array([(around @ around, around @ seen) for around, seen in zip(everywhere, added, strict=True)]).T
    for angle in REFINING_DEGREES:
        ring = _ring(tried[best_of([*cameras])[0]], angle)
        tried, sums = np.concatenate([tried, ring]), np.concatenate([sums, sums_of(pictures(ring))], -1)
    best, sun, ambient, explained = best_of([*cameras])
    others = [tried[best_of([n for n in cameras if n != left_out])[0]] for left_out in cameras]
    turned = np.degrees(np.arccos(np.clip(np.array(others) @ tried[best], -1, 1)))
    spread = float(np.sqrt((1 - 1 / len(others)) * np.sum(turned**2)))
    whole = max(sum(float(seen @ seen) for seen in added), 1e-30)
    around, of_around = rest.sum(1)
    alone = max(whole - max(of_around, 0) ** 2 / max(around, 1e-30), 1e-30)
    return Sky(
        tried[best], sun, ambient, colour, spread, float(np.sqrt(alone / whole)), 1 - (whole - explained) / alone
    )


def _ring(about: Doubles, degrees: float) -> Doubles:
    """Six directions (6, 3) so far from another."""
    across = np.cross(about, np.eye(3)[np.argmin(np.abs(about))])
    across /= np.linalg.norm(across)
    angles, away = np.arange(6)[:, None] * np.pi / 3, np.radians(degrees)
    around = np.cos(angles) * across + np.sin(angles) * np.cross(about, across)
    return np.asarray(np.cos(away) * about + np.sin(away) * around)
