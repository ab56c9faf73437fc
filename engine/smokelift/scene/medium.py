"""What the smoke does to light: how much of it is removed, and how it is scattered."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from smokelift.scene.checks import number, one_of, positive, set_fields, unexpected

Scattering = Literal["multiple", "single", "unshadowed", "absorption"]
"""How light is scattered: any number of times, once and with self-shadowing, once without, or not at all."""

SCATTERINGS: tuple[Scattering, ...] = ("multiple", "single", "unshadowed", "absorption")

SHADOWED: tuple[Scattering, ...] = ("multiple", "single")
"""Those in which smoke casts shadows on itself."""


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
    """

    extinction: float = 5.0
    albedo: float = 0.9
    anisotropy: float = 0.0

    def __post_init__(self) -> None:
        """Check every value."""
        set_fields(
            self,
            extinction=positive(self.extinction, "extinction"),
            albedo=number(self.albedo, "albedo", "a number from 0 to 1", lambda v: 0.0 <= v <= 1.0),
            anisotropy=number(self.anisotropy, "anisotropy", "a number between -1 and 1", lambda v: -1.0 < v < 1.0),
        )


def checked_scattering(value: Any) -> Scattering | None:
    """Return how light is scattered, or None where that is open; raise a SceneError if there is no such way."""
    if value is None:
        return None
    for name in SCATTERINGS:
        if value == name:
            return name
    raise unexpected(value, "scattering", f"one of {one_of(SCATTERINGS)}", "medium")
