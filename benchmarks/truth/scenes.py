"""The scenes that are baked: a kind and a seed give everything. Runs inside Blender as well; needs only numpy.

Lengths are meters, times seconds, in a box of 2 x 2 x 3 m from (-1, -1, 0) with z up.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

BOX_MIN = (-1.0, -1.0, 0.0)
BOX_SIZE = (2.0, 2.0, 3.0)
FPS = 24
FRAMES = 40

SEEDS = {"choose": (1, 2), "report": (3, 4)}
"""Seeds whose scenes may decide a default, and seeds whose scenes only ever report what the defaults do."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Inlet:
    """A short cylinder that blows warm smoke along its axis.

    Attributes
    ----------
    position
        Center.
    radius
        Radius.
    velocity
        Mean velocity of what comes out; it gives the cylinder's axis as well.
    half_length
        Half of the cylinder's length.
    """

    position: Vector
    radius: float
    velocity: Vector
    half_length: float = 0.06


@dataclass(frozen=True)
class Scene:
    """One scene.

    Attributes
    ----------
    name
        Kind and seed, "plume-1".
    seed
        Of the noise in inlets and air.
    inlets
        Where smoke comes from.
    buoyancy
        Acceleration of the hottest air (m/s2).
    warm_up
        Seconds with smoke before the first frame that is kept.
    blowing
        Seconds until the inlets close; infinite for a steady source.
    wind
        Velocity of the air at the start, and of that which comes in at the sides.
    gust
        Standard deviation of the velocity across an inlet, relative to its mean.
    dissipation
        Rate at which smoke dissolves (1/s).
    """

    name: str
    seed: int
    inlets: tuple[Inlet, ...]
    buoyancy: float
    warm_up: float
    blowing: float = np.inf
    wind: Vector = (0.0, 0.0, 0.0)
    gust: float = 0.2
    dissipation: float = 0.0


def plume(rng: np.random.Generator, seed: int) -> Scene:
    """A column of warm smoke from the floor; the example clip is of this kind."""
    tempo = draw_tempo(rng)
    inlet = Inlet((*rng.uniform(-0.3, 0.3, 2), 0.07), rng.uniform(0.16, 0.24), (0.0, 0.0, tempo * 1.1))
    buoyancy, gust = tempo**2 * rng.uniform(5.0, 7.5), rng.uniform(0.1, 0.25)
    return Scene(f"plume-{seed}", seed, (inlet,), buoyancy, 2.2 / tempo, gust=gust)


def jet(rng: np.random.Generator, seed: int) -> Scene:
    """Smoke blown in from the left or the right, up to 35 degrees towards or away from the front camera."""
    tempo, side, turn = draw_tempo(rng), rng.choice([-1.0, 1.0]), np.radians(rng.uniform(-35, 35))
    speed = tempo * rng.uniform(1.9, 2.3)
    velocity = (-side * speed * np.cos(turn), speed * np.sin(turn), tempo * rng.uniform(0.1, 0.5))
    # starts on the other side of the middle from where it goes, so that it crosses the box
    position = (0.8 * side, -0.5 * np.sin(turn) + rng.uniform(-0.15, 0.15), rng.uniform(0.6, 1.1))
    inlet = Inlet(position, rng.uniform(0.13, 0.18), velocity)
    buoyancy, gust = tempo**2 * rng.uniform(1.0, 2.5), rng.uniform(0.1, 0.2)
    return Scene(f"jet-{seed}", seed, (inlet,), buoyancy, 1.7 / tempo, gust=gust)


def two(rng: np.random.Generator, seed: int) -> Scene:
    """Two columns, one from the floor and one from above it, that lean towards each other and merge."""
    tempo, azimuth = draw_tempo(rng), rng.uniform(0, np.pi)
    across = np.array([np.cos(azimuth), np.sin(azimuth)])
    inlets = []
    for sign, height in ((1, 0.07), (-1, rng.uniform(0.25, 0.6))):
        at, lean = sign * rng.uniform(0.35, 0.5) * across, -sign * tempo * rng.uniform(0.15, 0.4) * across
        velocity = (*lean, tempo * rng.uniform(0.7, 1.0))
        inlets.append(Inlet((*at, height), rng.uniform(0.13, 0.18), velocity))
    buoyancy, gust = tempo**2 * rng.uniform(5.0, 7.0), rng.uniform(0.1, 0.25)
    return Scene(f"two-{seed}", seed, tuple(inlets), buoyancy, 2.2 / tempo, gust=gust)


def puff(rng: np.random.Generator, seed: int) -> Scene:
    """A burst that has ended before the first frame; it drifts, swells and dissolves."""
    tempo, azimuth = draw_tempo(rng), rng.uniform(0, 2 * np.pi)
    drift = np.array([np.cos(azimuth), np.sin(azimuth)])
    velocity = (*(tempo * rng.uniform(0.25, 0.45) * drift), tempo * rng.uniform(0.7, 1.0))
    inlet = Inlet((*(-0.3 * drift), rng.uniform(0.3, 0.45)), rng.uniform(0.28, 0.34), velocity, half_length=0.15)
    blowing, buoyancy = 0.4 / tempo, tempo**2 * rng.uniform(2.5, 4.0)
    return Scene(
        f"puff-{seed}",
        seed,
        (inlet,),
        buoyancy,
        warm_up=blowing + 0.1,
        blowing=blowing,
        gust=rng.uniform(0.15, 0.3),
        dissipation=rng.uniform(0.2, 0.6),
    )


def crossing(rng: np.random.Generator, seed: int) -> Scene:
    """A column that a side wind bends, from upwind in the box."""
    tempo, azimuth = draw_tempo(rng), rng.uniform(0, 2 * np.pi)
    downwind = np.array([np.cos(azimuth), np.sin(azimuth)])
    inlet = Inlet((*(-0.5 * downwind), 0.07), rng.uniform(0.16, 0.22), (0.0, 0.0, tempo * 1.2))
    buoyancy, wind = tempo**2 * rng.uniform(5.0, 7.0), tempo * rng.uniform(0.25, 0.45) * downwind
    gust = rng.uniform(0.1, 0.25)
    return Scene(f"crossing-{seed}", seed, (inlet,), buoyancy, 2.2 / tempo, wind=(*wind, 0.0), gust=gust)


KINDS: dict[str, Callable[[np.random.Generator, int], Scene]] = {
    "plume": plume,
    "jet": jet,
    "two": two,
    "puff": puff,
    "crossing": crossing,
}


def draw_tempo(rng: np.random.Generator) -> float:
    """A factor on all speeds, 0.65 to 1.5, mostly low: real shots are, and a few should be hard.

    At 1 the fastest smoke goes about 4 voxels per frame on a grid 64 across. Forces go with the square, so that the
    shape of the flow stays and only its pace changes.
    """
    return float(0.65 * 2.3 ** (rng.uniform() ** 2))


EXAMPLE = Scene("example", 1, (Inlet((-0.14, 0.10, 0.14), 0.21, (0.0, 0.0, 1.1)),), 6.5, warm_up=1.0, gust=0.3)
"""The plume of the example clip; its inlet is in the bowl that its background shows."""


def scene(name: str) -> Scene:
    """The scene of a name, "plume-1" or "example"; ValueError if there is none."""
    if name == EXAMPLE.name:
        return EXAMPLE
    kind, _, seed = name.partition("-")
    if kind not in KINDS or not seed.isdigit():
        raise ValueError(f"no scene is called {name!r}: say a kind ({', '.join(KINDS)}), a hyphen and a seed.")
    return KINDS[kind](np.random.default_rng([int(seed), list(KINDS).index(kind)]), int(seed))


def names(use: str) -> list[str]:
    """Names of the scenes for a use, "choose" or "report": the first seed of every kind, then the second."""
    return [f"{kind}-{seed}" for seed in SEEDS[use] for kind in KINDS]
