"""Clips of baked smoke before known backgrounds, as a camera would spoil them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy import ndimage

from benchmarks.baked import WHITE, Baked, Seen
from benchmarks.filming import compressed, drift, exposed, filmed, flash, noisy, steps
from benchmarks.plates import PAINTED
from smokelift import Clip
from smokelift.checks import Doubles
from smokelift.footage.images import Picture
from smokelift.scene import completed

DARK = 0.1
"""Fraction of the light that dark smoke scatters."""

THIN = 0.15
"""Fraction of a column's opacity that mist has."""

COLUMN = 0.12
"""Width of a column that is painted, as a fraction of the picture's."""

COLUMN_AT, COLUMN_RADIUS = 0.45, 0.22
"""Where a column stands beside the middle of the box, and how thick it is (m)."""

COLUMN_DEPTH = 1.5
"""Optical depth through its middle, on average."""


@dataclass(frozen=True)
class Case:
    """A clip.

    Attributes
    ----------
    plate
        Key of `PAINTED`, or "halves": nearly black on the left, bright on the right.
    smoke
        Key of `SMOKES`.
    given
        Whether the background is given.
    spoil
        What becomes of its sRGB pictures.
    gains
        Returns the exposure of so many frames.
    frames
        Its part of the scene: the first, and the first after it.
    color
        The smoke's.
    medium
        Whether the medium is given.
    """

    plate: str
    smoke: str = "baked"
    given: bool = False
    spoil: Callable[[Picture], Picture] = lambda encoded: encoded
    gains: Callable[[int], Doubles] = np.ones
    frames: tuple[int, int | None] = (0, None)
    color: tuple[float, float, float] = WHITE
    medium: bool = True

    def background(self, seen: Seen) -> Picture:
        """Return what stands behind the smoke, linear (rows, columns, 3)."""
        rows, columns = seen.shape
        if self.plate == "halves":
            return np.where(np.arange(columns)[:, None] < columns // 2, 0.02, 0.8) * np.ones((rows, columns, 3))
        return PAINTED[self.plate](rows, columns)

    def clean(self, seen: Seen) -> Picture:
        """Return the true pictures, linear (frames, rows, columns, 3)."""
        return seen.before(self.background(seen), self.color)[slice(*self.frames)]

    def clip(self, seen: Seen) -> Clip:
        """Return what is filmed of smoke."""
        encoded = exposed(self.clean(seen), self.gains(len(seen.radiance))[slice(*self.frames)])
        return filmed(self.spoil(np.clip(encoded, 0, 1)))

    @property
    def undisturbed(self) -> "Case":
        """The clean clip that it is compared with: all frames, its background given unless the medium is not."""
        return Case(self.plate, self.smoke, given=self.medium, medium=self.medium)


def painted_column(seen: Seen) -> Seen:
    """Return the smoke with a column from the floor to the top that wavers and never goes away.

    It is as bright as the smoke's brightest and lets a tenth to a half of the light through.
    """
    frames, rows, columns = seen.radiance.shape
    across = (np.arange(columns) - columns / 2) / (0.5 * COLUMN * columns)
    shape = np.clip(1.5 - np.abs(across), 0, 1)
    y = np.arange(rows)[:, None] / rows
    times = np.arange(frames)[:, None, None]
    waver = np.sin(25 * y + 3 * across - 0.9 * times) + np.sin(11 * y - 2 * across - 0.47 * times + 1)
    column = np.exp(-shape * (1.25 + 0.3 * waver)).astype(np.float32)
    return _veiled(seen, column)


def misty(seen: Seen) -> Seen:
    """Return the smoke with mist over two thirds of the picture that hardly moves and never goes away.

    It is as bright as the smoke's brightest, lets a half of the light through at least, and drifts by the picture's
    width in 600 frames.
    """
    frames, rows, columns = seen.radiance.shape
    noise = np.random.default_rng(7).standard_normal((rows, columns))
    billows = np.zeros((rows, columns))
    for part in (8, 16, 32):  # parts of the width along a billow
        field = ndimage.gaussian_filter(noise, columns / part, mode="wrap")
        billows += field / field.std() / part
    billows /= billows.std()
    height = 1 - np.arange(rows)[:, None] / rows
    depth = np.clip(1 - height / 0.67, 0, 1) ** 2 * (3 - 2 * np.clip(1 - height / 0.67, 0, 1))
    moved = columns / 600 * np.arange(frames)
    opacity = np.stack([depth * np.clip(0.35 + 0.07 * np.roll(billows, round(x), 1), 0, 0.5) for x in moved])
    return _veiled(seen, (1 - opacity).astype(np.float32))


def thin_column(seen: Seen) -> Seen:
    """Return a column and its smoke as a mist."""
    column = painted_column(seen)
    return Seen(THIN * column.radiance, 1 - THIN * (1 - column.transmittance))


SMOKES: Mapping[str, Callable[[Seen], Seen]] = {
    "baked": lambda seen: seen,
    "column": painted_column,
    "dark": lambda seen: seen.scattering(DARK),
    "dark with column": lambda seen: painted_column(seen.scattering(DARK)),
    "dark column": lambda seen: painted_column(seen).scattering(DARK),
    "thin column": thin_column,
    "mist": misty,
}
"""What the camera sees of the smoke alone, made from the baked one."""


def with_column(baked: Baked) -> Baked:
    """Return smoke with a wavering column of density beside its middle that never goes away.

    Smokelift's own renderer pictures both, so that they shade each other.
    """
    scene = completed(replace(baked.scene, scattering="single"))
    low, high = np.array(scene.domain.min), np.array(scene.domain.max)
    shape = baked.densities.shape[1:]
    centers = [a + (np.arange(n) + 0.5) * (b - a) / n for a, b, n in zip(low, high, shape, strict=True)]
    across, depth, up = np.meshgrid(*centers, indexing="ij", sparse=True)
    column = np.clip(1.5 - np.hypot(across - COLUMN_AT, depth) / COLUMN_RADIUS, 0, 1)
    density = COLUMN_DEPTH / (2 * COLUMN_RADIUS * scene.medium.extinction) * column
    times = np.arange(len(baked))[:, None, None, None]
    waver = np.sin(5 * up + 4 * across - 0.9 * times) + np.sin(2.2 * up - 3 * depth - 0.47 * times + 1)
    densities = baked.densities.astype(np.float32) + (density * (1 + 0.24 * waver)).astype(np.float32)
    return replace(baked, densities=densities).pictured()


def darkened(baked: Baked) -> Baked:
    """Return smoke that scatters a fraction of the light."""
    assert baked.scene.medium is not None
    medium = replace(baked.scene.medium, albedo=DARK * baked.scene.medium.albedo)
    views = {view: seen.scattering(DARK) for view, seen in baked.views.items()}
    return replace(baked, scene=replace(baked.scene, medium=medium), views=views)


VOLUMES: Mapping[str, Callable[[Baked], Baked]] = {
    "baked": lambda baked: baked, "column": with_column, "dark": darkened,
}  # fmt: skip
"""Smoke of `SMOKES` whose volume is known."""


def _veiled(seen: Seen, clear: Picture) -> Seen:
    """Return smoke behind a veil as bright as its brightest, of a transmittance (frames, rows, columns)."""
    bright = np.float32(np.quantile(seen.radiance[seen.transmittance < 0.9], 0.95))
    return Seen(seen.radiance * clear + bright * (1 - clear), seen.transmittance * clear)


SPOILED: Mapping[str, Callable[[Picture], Picture]] = {
    **{f"noise {fraction:.0%}": partial(noisy, deviation=fraction) for fraction in (0.02, 0.05, 0.1)},
    **{f"crf {crf}": partial(compressed, crf=crf) for crf in (20, 32, 45)},
}
"""What becomes of sRGB pictures, by the words for it."""

TWELVE = (14, 26)

CASES: Mapping[str, Case] = {
    "wall, given": Case("wall", given=True),
    "wall": Case("wall"),
    "wall, 12 frames": Case("wall", frames=TWELVE),
    "wall, column, given": Case("wall", "column", given=True),
    "wall, column": Case("wall", "column"),
    "wall, flash": Case("wall", gains=flash),
    "wall, flash, given": Case("wall", gains=flash, given=True),
    "wall, steps": Case("wall", gains=steps),
    "wall, steps, given": Case("wall", gains=steps, given=True),
    "wall, drift": Case("wall", gains=drift),
    **{f"wall, {name}": Case("wall", spoil=spoil) for name, spoil in SPOILED.items()},
    **{f"wall, {name}, given": Case("wall", spoil=spoil, given=True) for name, spoil in SPOILED.items()},
    "black, given": Case("black", given=True),
    "black": Case("black"),
    "black, 12 frames": Case("black", frames=TWELVE),
    "black, column, given": Case("black", "column", given=True),
    "black, column": Case("black", "column"),
    "black, mist": Case("black", "thin column"),
    "black, mist everywhere": Case("black", "mist"),
    "black, flash": Case("black", gains=flash),
    **{f"black, {name}": Case("black", spoil=SPOILED[name]) for name in ("noise 2%", "noise 10%", "crf 45")},
    "black, medium unknown": Case("black", medium=False),
    "black, medium unknown, colored": Case("black", medium=False, color=(1.0, 0.5, 0.1)),
    "gray, column": Case("gray", "column"),
    "green, column": Case("green", "column"),
    "sky, dark, given": Case("clouds", "dark", given=True),
    "sky, dark": Case("clouds", "dark"),
    "sky, dark column": Case("clouds", "dark with column"),
    "white, dark column": Case("white", "dark column"),
    "both ways": Case("halves"),
}
"""All clips by their names."""
