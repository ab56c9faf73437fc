"""The clips of the table, each with the clean one that it is compared with."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import numpy.typing as npt

from benchmarks.background.clips import (
    BRIGHT,
    Smoke,
    backdrop,
    compressed,
    exposed,
    flash,
    noisy,
    sky,
    steps,
    wall,
)
from benchmarks.clean_clip.smoke import Baked
from smokelift.footage.images import Picture

GREY = (1.0, 1.0, 1.0)
ORANGE = (1.0, 0.5, 0.1)

Spoil = Callable[[Picture], Picture]


@dataclass(frozen=True, eq=False)
class Film:
    """A clip with what is given of it.

    Attributes
    ----------
    smoke
        What it shows.
    pictures : (frames, rows, columns, 3)
        As they are filmed: linear in HLG, else sRGB values.
    plate : (rows, columns, 3), optional
        The background, linear, if it is given.
    behind
        Linear grey behind the smoke in the views that are compared.
    colour
        Of the smoke.
    medium
        Whether medium and colour are given.
    hlg
        Whether the file has ten bits of hybrid log-gamma in place of eight of sRGB.
    """

    smoke: Baked
    pictures: Picture
    plate: Picture | None = None
    behind: float = 0.0
    colour: tuple[float, float, float] = GREY
    medium: bool = True
    hlg: bool = False


@dataclass(frozen=True)
class Row:
    """A clip by the name of the clean one that it is compared with."""

    clean: str
    film: Callable[[], Film]


class Clips:
    """The clips of a scene by their names."""

    def __init__(self, smoke: Baked) -> None:
        self.smoke = smoke
        self.shape = (smoke.front.radiance.shape[1], smoke.front.radiance.shape[2])
        self.count = len(smoke.front.radiance)

    @cached_property
    def standing(self) -> Baked:
        """The smoke with a column."""
        return self.smoke.standing()

    def rows(self) -> dict[str, Row]:
        """All of them, each after the clean one that it is compared with."""
        painted, black, clouds = wall(self.shape), backdrop(self.shape, 0), sky(self.shape)
        noises = {share: (lambda x, s=share: noisy(x, s)) for share in (0.02, 0.05, 0.1)}
        rates = {crf: (lambda x, c=crf: compressed(x, c)) for crf in (20, 32, 45)}
        dark = self.smoke.darkened()
        films: dict[str, dict[str, Callable[[], Film]]] = {
            "wall, given": {
                "wall, given": lambda: self._film(painted, painted),
                "wall": lambda: self._film(painted),
                "wall, flash": lambda: self._film(painted, gains=flash(self.count)),
                "wall, exposure steps": lambda: self._film(painted, gains=steps(self.count)),
                **{f"wall, noise {n:.0%}": partial(self._film, painted, spoil=s) for n, s in noises.items()},
                **{f"wall, crf {n}": partial(self._film, painted, spoil=s) for n, s in rates.items()},
                "wall, 10 bit HLG": lambda: self._film(painted, hlg=True),
                **{
                    f"wall, given, noise {n:.0%}": partial(self._film, painted, painted, spoil=s)
                    for n, s in noises.items()
                },
                **{f"wall, given, crf {n}": partial(self._film, painted, painted, spoil=s) for n, s in rates.items()},
            },
            "wall, column, given": {
                "wall, column, given": lambda: self._film(painted, painted, of=self.standing),
                "wall, column": lambda: self._film(painted, of=self.standing),
            },
            "black, given": {
                "black, given": lambda: self._film(black, black),
                "black": lambda: self._film(black),
                "black, noise 10%": lambda: self._film(black, spoil=noises[0.1]),
                "black, crf 45": lambda: self._film(black, spoil=rates[45]),
            },
            "black, column, given": {
                "black, column, given": lambda: self._film(black, black, of=self.standing),
                "black, column": lambda: self._film(black, of=self.standing),
            },
            "sky, dark, given": {
                "sky, dark, given": lambda: self._film(clouds, clouds, of=dark, behind=BRIGHT),
                "sky, dark": lambda: self._film(clouds, of=dark, behind=BRIGHT),
            },
            "black, medium unknown": {
                "black, medium unknown": lambda: self._film(black, medium=False),
                "black, medium unknown, coloured": lambda: self._film(black, medium=False, colour=ORANGE),
            },
        }
        return {name: Row(clean, film) for clean, each in films.items() for name, film in each.items()}

    def _film(
        self,
        plate: Picture,
        given: Picture | None = None,
        *,
        of: Baked | None = None,
        gains: npt.ArrayLike = 1.0,
        spoil: Spoil | None = None,
        behind: float = 0.0,
        colour: tuple[float, float, float] = GREY,
        medium: bool = True,
        hlg: bool = False,
    ) -> Film:
        smoke = of or self.smoke
        linear = _before(smoke.front, plate, colour)
        if hlg:
            return Film(smoke, linear, given, behind, colour, medium, hlg)
        encoded = np.clip(exposed(linear, np.broadcast_to(np.asarray(gains), len(linear))), 0, 1)
        return Film(smoke, encoded if spoil is None else spoil(encoded), given, behind, colour, medium)


def _before(smoke: Smoke, plate: Picture, colour: tuple[float, float, float]) -> Picture:
    """Linear pictures (frames, rows, columns, 3) of smoke of a colour before a plate."""
    scattered = smoke.radiance[..., None] * np.asarray(colour, np.float32)
    return scattered + smoke.transmittance[..., None] * plate
