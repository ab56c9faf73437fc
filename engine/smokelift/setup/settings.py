"""Everything that decides a result besides the clip and the scene."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

from smokelift.density import DensitySettings
from smokelift.velocity import VelocitySettings

Method = Literal["default", "paper"]
Quality = Literal["draft", "balanced", "fine"]

METHODS: tuple[Method, ...] = ("default", "paper")
QUALITIES: tuple[Quality, ...] = ("draft", "balanced", "fine")

LONGEST_SIDE: Mapping[Quality, int] = {"draft": 64, "balanced": 96, "fine": 144}
"""Voxels along the domain's longest side where the scene gives no resolution; 96 is the paper's smallest grid."""


@dataclass(frozen=True)
class Settings:
    """How a clip is reconstructed.

    Attributes
    ----------
    method
        ``"default"``, or ``"paper"``: the paper's loop as it is, for comparison.
    quality
        ``"draft"``, ``"balanced"`` or ``"fine"``: resolution (unless given) and iterations.
    resolution
        Voxels along x, y, z; None takes the scene's. ``"auto"``, and None where the scene gives none, take as many as
        the detail of the clip's smoke asks for, at most those of the quality.
    transport
        Largest share (0 to 1) of the density carried along from the frame before in the first guess of the next; the
        rest is the single picture's. Every frame takes over as much as proves right (see `smokelift.density.initial`),
        with 0 nothing. New views do not change by it, flicker falls by a fifth; with more than a half the velocity's
        errors smear the depth from frame to frame. The paper's method takes all of it, whatever is said here.
    axis_depth
        How far behind the domain's centre (metres, away from the camera) the middle of the smoke stands; None estimates
        it from where the smoke meets the floor and from the light of coloured lamps, else takes the domain's centre.
        Further views tell it better than either.
    density, velocity
        Settings of the two parts.
    """

    method: Method = "default"
    quality: Quality = "balanced"
    resolution: tuple[int, int, int] | Literal["auto"] | None = None
    transport: float = 0.25
    axis_depth: float | None = None
    density: DensitySettings = field(default_factory=DensitySettings)
    velocity: VelocitySettings = field(default_factory=VelocitySettings)

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise ValueError(f"method must be one of {', '.join(METHODS)}, not {self.method!r}.")
        if self.quality not in QUALITIES:
            raise ValueError(f"quality must be one of {', '.join(QUALITIES)}, not {self.quality!r}.")
        if not 0 <= self.transport <= 1:
            raise ValueError(f"transport must be a number from 0 to 1, not {self.transport}.")
        if self.axis_depth is not None and not math.isfinite(self.axis_depth):
            raise ValueError(f"axis_depth must be a finite number of metres, not {self.axis_depth}.")
        counts = None if self.resolution == "auto" else self.resolution
        if counts is not None and (len(counts) != 3 or min(counts) < 8):
            raise ValueError(f"resolution must be three numbers of at least 8 voxels, not {self.resolution}.")

    @classmethod
    def preset(
        cls,
        quality: Quality = "balanced",
        method: Method = "default",
        resolution: tuple[int, int, int] | Literal["auto"] | None = None,
    ) -> Settings:
        """The settings of a quality and a method."""
        base = cls(method=method, quality=quality, resolution=resolution)
        if method == "paper":
            # the paper's loop: nothing but the transported density as first guess, and many small steps
            return replace(
                base,
                transport=1.0,
                density=DensitySettings(method="paper", descent_iterations=60),
            )
        fit, descent = {"draft": (4, 6), "balanced": (6, 12), "fine": (8, 30)}[quality]
        return replace(base, density=DensitySettings(fit_iterations=fit, descent_iterations=descent))

    def as_dict(self) -> dict[str, Any]:
        """The settings as plain nested values."""
        return asdict(self)
