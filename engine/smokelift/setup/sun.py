"""Where a sun stands that no scene gives, where cameras all around the smoke tell it.

Several cameras see from which side smoke is lit, and between them they see where it is. So a density is fitted to their
pictures in light from everywhere, and is lit from directions all around: the sun stands where it explains best what the
smoke adds to all the pictures, together with light from everywhere. The density is then fitted again in that light, a
few times in turn. Figures: docs/experiments/light-direction.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from smokelift.density import DensitySettings, FittedDensity, Observation, reconstruct_density
from smokelift.footage.matte import matte
from smokelift.footage.working_picture import CameraError, working_picture
from smokelift.render import Image, Optics
from smokelift.scene import CompleteScene, DirectionalLight, Light
from smokelift.scene.projection import voxel_width
from smokelift.setup.choice import UNDETERMINED, Choice
from smokelift.setup.coarse import coarse_domain
from smokelift.setup.shot import ShotView
from smokelift.setup.sphere import spread
from smokelift.setup.sun_and_rest import explained
from smokelift.setup.surroundings import light_around

CAMERAS, APART = 4, 120.0
"""Cameras at least, and degrees at least between two of them. Fewer leave the direction wrong by more than 20 degrees
in a third of the clips in which the sun makes most of the light, as do four that stand close together
(docs/experiments/light-direction.md)."""

MOST_AMBIENT = 0.35
"""Share of light from everywhere at most beside a sun whose direction is told. Light from everywhere alone is found to
have one of 0.4 and more (docs/experiments/light-direction.md)."""

LEAST_SHADING = 0.14
"""Error at least that light from everywhere alone leaves of what the smoke adds, as a share of it: thin smoke hardly
shades itself (docs/experiments/light-direction.md)."""

COARSE = 24
"""Voxels along the longest side at most: shadows of that size tell a side."""

DIRECTIONS = 48
"""Directions that are tried first, spread evenly: neighbours are about 30 degrees apart."""

NARROWER = (14.0, 7.0)
"""Degrees from the best one of the six directions that are tried next, and from the best of those."""

ROUNDS = 3
"""Fits of the density, each in the light that the one before led to."""

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Sun:
    """The light that explains the pictures best: of a sun, and from everywhere.

    Attributes
    ----------
    towards : (3,)
        Direction to the sun, of length 1.
    strength, ambient
        Irradiance of the sun, and that of all light from everywhere together; of the mean of the channels.
    shading
        Error that light from everywhere alone leaves of what the smoke adds, as a share of it.
    """

    towards: Array
    strength: float
    ambient: float
    shading: float

    @property
    def told(self) -> bool:
        """Whether it is used: of 50 such directions 44 were right to 20 degrees, all to 30."""
        return self.ambient_share <= MOST_AMBIENT and self.shading >= LEAST_SHADING

    @property
    def ambient_share(self) -> float:
        """Of all the light."""
        return self.ambient / max(self.strength + self.ambient, 1e-30)

    def lights(self, colour: Array) -> tuple[Light, ...]:
        """The two, of a colour (3,) whose mean is 1."""
        lights: tuple[Light, ...] = ()
        if self.strength > 0:
            (x, y, z), (red, green, blue) = -self.towards, self.strength * colour
            sun = DirectionalLight((float(x), float(y), float(z)), (float(red), float(green), float(blue)))
            lights = (sun,)
        return (*lights, *light_around(self.ambient * colour / (4 * np.pi))) if self.ambient > 0 else lights


@dataclass(frozen=True, eq=False)
class FoundSun:
    """What cameras all around tell of a sun.

    Attributes
    ----------
    lights
        Of the scene with it; None where its direction is not told.
    choice
        With the figure that decided it.
    """

    lights: tuple[Light, ...] | None
    choice: Choice[str]


def find_sun(
    views: Sequence[ShotView], scene: CompleteScene, numbers: Sequence[int], settings: DensitySettings
) -> FoundSun | None:
    """Find where a sun stands.

    Parameters
    ----------
    views
        The cameras, none of which moves, at one exposure.
    scene
        With a light from everywhere for want of a known one.
    numbers
        Of frames with smoke.
    settings
        How to fit.

    Returns
    -------
    FoundSun or None
        None where too few cameras show any smoke, or nothing is scattered.
    """
    if not _around(views, scene) or scene.scattering == "absorption":
        return None
    scene, moments = _moments(views, scene, numbers)
    if not moments:
        return None
    colour = np.sum([light.irradiance for light in scene.lights if isinstance(light, DirectionalLight)], 0)
    colour = colour / colour.mean()
    lit = scene
    for _ in range(ROUNDS):
        densities = [moment.fitted(lit, settings) for moment in moments]
        sun = _Lit(scene, moments, densities).sun()
        lit = replace(scene, lights=sun.lights(colour), scattering="single")
        if not lit.lights:
            return None
    measured = {"ambient_share": sun.ambient_share, "shading": sun.shading}
    if not sun.told:
        reason = (
            "Light direction: undetermined, and so are the colour of a sun and the share of light from everywhere; the "
            f"{len(views)} views are explained best with {sun.ambient_share:.0%} of the light from everywhere "
            f"({MOST_AMBIENT:.0%} at most would do), and shading is {sun.shading:.0%} of the smoke's light "
            f"({LEAST_SHADING:.0%} at least would do). Give [[lights]] if you know them."
        )
        return FoundSun(None, Choice("light direction", UNDETERMINED, reason, measured, MOST_AMBIENT))
    told = ", ".join(f"{value:.2f}" for value in -sun.towards)
    reason = (
        f"Light direction: {told}, give or take 20 degrees, as the {len(views)} views tell together; "
        f"{sun.ambient_share:.0%} of the light comes from everywhere."
    )
    return FoundSun(lit.lights, Choice("light direction", told, reason, measured, MOST_AMBIENT))


@dataclass(frozen=True, eq=False)
class _Moment:
    """What the cameras saw of one moment, and which pixels of each show smoke."""

    views: Sequence[Observation]
    smoke: Sequence[NDArray[np.bool_]]

    def fitted(self, scene: CompleteScene, settings: DensitySettings) -> FittedDensity:
        """The density that the pictures show in the light of a scene."""
        first, *others = self.views
        return reconstruct_density(first.image, scene, settings=settings, plate=first.plate, views=others)

    def pixels(self, pictures: Iterable[Image]) -> Array:
        """Those with smoke (n,) of pictures of all cameras, mean of the channels."""
        shown = [np.mean(picture, -1)[smoke] for picture, smoke in zip(pictures, self.smoke, strict=True)]
        return np.asarray(np.concatenate(shown), np.float64)


@dataclass(frozen=True, eq=False)
class _Lit:
    """Densities of some moments, and what the cameras' pictures of them show of their light.

    Attributes
    ----------
    scene
        With the coarse domain.
    moments
        What the cameras saw.
    densities
        One of each moment.
    """

    scene: CompleteScene
    moments: Sequence[_Moment]
    densities: Sequence[FittedDensity]

    def sun(self) -> Sun:
        """The sun, with light from everywhere, that leaves least of what the smoke adds to all pictures."""
        added = self._added()
        towards = spread(DIRECTIONS)
        lit = self._pictures(towards)
        everywhere = lit.mean(0)
        best, left, strengths = _best(towards, lit, everywhere, added)
        for angle in NARROWER:
            ring = _ring(best, angle)
            other, other_left, other_strengths = _best(ring, self._pictures(ring), everywhere, added)
            if other_left < left:
                best, left, strengths = other, other_left, other_strengths
        ambient = max(float(everywhere @ added), 0.0) / max(float(everywhere @ everywhere), 1e-30)
        shading = np.linalg.norm(added - ambient * everywhere) / max(float(np.linalg.norm(added)), 1e-30)
        return Sun(best, *strengths, float(shading))

    def _added(self) -> Array:
        """What the smoke adds to the pixels (n,) that show it."""
        optics = Optics(self.scene.domain, self.scene.medium, (), "absorption")

        def added(view: Observation, fitted: FittedDensity) -> Image:
            renderer = optics.renderer(view.camera, view.plate.image, fitted.hull)
            return view.image - renderer.image(fitted.density)

        return self._pixels(added)

    def _pictures(self, towards: Array) -> Array:
        """The same pixels (directions, n) in light from each direction alone, of irradiance 1."""
        return np.array([self._lit_from(way) for way in towards])

    def _lit_from(self, towards: Array) -> Array:
        x, y, z = (-float(value) for value in towards)
        sun = DirectionalLight((x, y, z), (1.0, 1.0, 1.0))
        optics = Optics(self.scene.domain, self.scene.medium, (sun,), "single")

        def shown(view: Observation, fitted: FittedDensity) -> Image:
            return optics.renderer(view.camera, np.zeros(3, np.float32), fitted.hull).image(fitted.density)

        return self._pixels(shown)

    def _pixels(self, picture: Callable[[Observation, FittedDensity], Image]) -> Array:
        """A picture of every view of every moment, its pixels that show smoke."""
        return np.concatenate(
            [
                moment.pixels(picture(view, density) for view in moment.views)
                for moment, density in zip(self.moments, self.densities, strict=True)
            ]
        )


def _around(views: Sequence[ShotView], scene: CompleteScene) -> bool:
    """Whether there are cameras enough, and two of them see the smoke from sides that differ."""
    ways = np.array([view.camera.position for view in views]) - scene.domain.centre
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    return len(views) >= CAMERAS and bool((ways @ ways.T).min() <= np.cos(np.radians(APART)))


def _moments(
    views: Sequence[ShotView], scene: CompleteScene, numbers: Sequence[int]
) -> tuple[CompleteScene, list[_Moment]]:
    """The scene with a coarse domain, and what the cameras that see it show of each frame that has smoke."""
    domain = coarse_domain(scene.domain, voxel_width(views[0].camera, scene.domain), COARSE)
    try:
        small = [working_picture(view.camera, domain) for view in views]
    except CameraError:
        return scene, []
    moments = []
    for number in numbers:
        seen = [
            Observation(
                working.camera,
                working.of(view.clip, number),
                view.plates.at(number).through(working.cut, working.pixels),
            )
            for view, working in zip(views, small, strict=True)
        ]
        smoke = [matte(view.image, view.plate).mask for view in seen]
        if all(mask.any() for mask in smoke):
            moments.append(_Moment(seen, smoke))
    return replace(scene, camera=small[0].camera, domain=domain), moments


def _best(towards: Array, lit: Array, everywhere: Array, added: Array) -> tuple[Array, float, tuple[float, float]]:
    """The direction that leaves least, what it leaves, and how strong the sun and the light from everywhere are."""
    found = explained(lit, everywhere, added)
    best = int(np.argmin(found.left))
    return towards[best], float(found.left[best]), (float(found.sun[best]), float(found.rest[best]))


def _ring(about: Array, degrees: float) -> Array:
    """Six directions (6, 3) so far from another."""
    across = np.cross(about, np.eye(3)[np.argmin(np.abs(about))])
    across /= np.linalg.norm(across)
    angles, away = np.arange(6)[:, None] * np.pi / 3, np.radians(degrees)
    around = np.cos(angles) * across + np.sin(angles) * np.cross(about, across)
    return np.asarray(np.cos(away) * about + np.sin(away) * around)
