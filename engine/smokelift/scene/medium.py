"""What the smoke does to light: how much of it is removed, and how it is scattered."""

from dataclasses import dataclass
from typing import Any, Literal

from smokelift.scene.checks import Vector, check_given, number, positive, set_fields, unexpected, vector

Scattering = Literal["multiple", "single", "unshadowed", "absorption"]
"""How light is scattered: any number of times, once and with self-shadowing, once without, or not at all."""

SCATTERINGS: tuple[Scattering, ...] = ("multiple", "single", "unshadowed", "absorption")

SHADOWED: tuple[Scattering, ...] = ("multiple", "single")
"""Models of scattering in which smoke casts shadows on itself."""


@dataclass(frozen=True)
class Medium:
    """Optical properties of the smoke.

    Attributes
    ----------
    extinction
        Extinction cross-section, 1/m per unit density.
    albedo
        Single-scattering albedo, 0 to 1.
    anisotropy
        Henyey-Greenstein g, -1 < g < 1.
    color
        Color of the smoke itself, red, green and blue from 0 to 1. Each channel's albedo is ``albedo`` times this.
        Extinction is the same for all.
    flame_color
        Color of the light of fire in the smoke, red, green and blue from 0 to 1. Times the emission in the grid
        ``flame`` it is the radiance per meter. What may be fire is fire then. None takes what the clip shows.
    """

    extinction: float = 5.0
    albedo: float = 0.9
    anisotropy: float = 0.0
    color: Vector = (1.0, 1.0, 1.0)
    flame_color: Vector | None = None

    def __post_init__(self) -> None:
        set_fields(
            self,
            extinction=positive(self.extinction, "extinction"),
            albedo=number(self.albedo, "albedo", "a number from 0 to 1", lambda v: 0.0 <= v <= 1.0),
            anisotropy=number(self.anisotropy, "anisotropy", "a number between -1 and 1", lambda v: -1.0 < v < 1.0),
            color=_fractions(self.color, "color"),
        )
        check_given(self, flame_color=_fractions)

    @property
    def albedos(self) -> Vector:
        """Single-scattering albedo of red, green and blue."""
        red, green, blue = self.color
        return self.albedo * red, self.albedo * green, self.albedo * blue

    @property
    def is_gray(self) -> bool:
        """Whether the smoke scatters red, green and blue alike."""
        return min(self.color) == max(self.color)


def _fractions(value: Any, key: str) -> Vector:
    """Return ``value`` as fractions of red, green and blue, or raise a SceneError that names ``key``."""
    expected = "three numbers [r, g, b] from 0 to 1, one of them above 0"
    rgb = vector(value, key, expected)
    if min(rgb) < 0.0 or max(rgb) > 1.0 or max(rgb) == 0.0:
        raise unexpected(list(rgb), key, expected)
    return rgb
