"""What a user may decide of a run besides the scene."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

from smokelift.density import DensitySettings
from smokelift.scene import SCATTERINGS, Scattering
from smokelift.scene.checks import SceneError, integer, items, number, positive
from smokelift.scene.domain import MAX_SIDE_VOXELS
from smokelift.velocity import VelocitySettings

MethodName = Literal["default", "paper"]
Quality = Literal["draft", "balanced", "fine", "final"]

METHODS: tuple[MethodName, ...] = ("default", "paper")
QUALITIES: tuple[Quality, ...] = ("draft", "balanced", "fine", "final")


@dataclass(frozen=True)
class GridLimit:
    """Voxels that a quality allows along the domain's longest side: a fraction of the clip's pixels, within bounds."""

    fraction: float
    least: int
    most: int

    def voxels(self, pixels: float) -> int:
        """Return how many are allowed for so many pixels: a multiple of four, as pyramids need."""
        return 4 * math.ceil(min(pixels, max(self.least, min(self.fraction * pixels, self.most))) / 4)


LIMITS: Mapping[Quality, GridLimit] = {
    "draft": GridLimit(0, 64, 64),
    "balanced": GridLimit(1 / 3, 96, 128),
    "fine": GridLimit(1 / 2, 144, 256),
    "final": GridLimit(1, 0, MAX_SIDE_VOXELS),
}
"""Voxels along the longest side that each quality allows: a fraction of the clip's pixels loses much the same whatever
the clip's size, and the bounds keep the time of a frame from growing with that size
(docs/experiments/clip-pixels.md)."""

LOST_DETAIL: Mapping[Quality, float] = {"draft": 0.02, "balanced": 0.01, "fine": 0.005, "final": 0.0025}
"""Fraction of the smoke's contrast that a grid may lose beside the finest of its quality, halved from each to the next
(docs/experiments/clip-pixels.md)."""

ITERATIONS: Mapping[Quality, tuple[int, int]] = {
    "draft": (4, 4), "balanced": (6, 14), "fine": (8, 14), "final": (8, 14)
}  # fmt: skip
"""Largest numbers of multiplicative iterations and of steps of descent (docs/experiments/density-descent.md)."""


@dataclass(frozen=True)
class Settings:
    """How a clip is reconstructed.

    Attributes
    ----------
    method
        ``"default"``, or ``"paper"``: the paper's loop as it is, for comparison.
    quality
        ``"draft"``, ``"balanced"``, ``"fine"`` or ``"final"`` (one voxel per pixel): how much of the clip's detail the
        grid shows (unless it is given), and iterations.
    resolution
        Voxels along x, y, z. ``"auto"`` takes as few as the detail of the clip's smoke allows, up to the quality's
        limit. None takes the scene's, or ``"auto"`` if it has none.
    scattering
        How light is scattered: ``"multiple"`` times, ``"single"`` (self-shadowed), ``"unshadowed"``,
        ``"absorption"``, or ``"auto"``: what the scene says, else the cheapest model that finds as good a density as
        the richest.
    measure
        Measure open choices but the resolution on the clip. Without it the richest model of scattering that the known
        light allows is taken.
    transport
        Fraction of what a frame's fit starts from that is the advected density of the frame before
        (`smokelift.density.temporal_prior`). Beyond a half the velocity's errors smear the depth
        (docs/experiments/temporal-prior.md). With ``detail`` it is a switch: made-up detail is carried on whatever the
        fraction, unless it is 0. The paper's method takes all.
    distance
        Level distance (meters) from the camera, straight ahead, to where the smoke stands: the lower end of it. Without
        a box it sets the scale of the scene. None takes marked inlets or the contact with the floor, else the middle of
        the box.
    detail
        How much of the fine structure along the rays, which no camera shows, is made up, from 0 to 1. At 0 the density
        is the smooth density, which is best for measuring; at 1 it is a plausible smoke, with the clip's texture from
        every side.
        The paper's method makes up none.
    seed
        Which of the plausible smokes, a whole number from 0. All show the same pictures; without `detail` there is one.
    density, velocity
        Settings of the two parts.

    Raises
    ------
    ValueError
        If a value is out of range.
    """

    method: MethodName = "default"
    quality: Quality = "balanced"
    resolution: tuple[int, int, int] | Literal["auto"] | None = None
    scattering: Scattering | Literal["auto"] = "auto"
    measure: bool = True
    transport: float = 0.25
    distance: float | None = None
    detail: float = 1.0
    seed: int = 0
    density: DensitySettings = field(default_factory=DensitySettings)
    velocity: VelocitySettings = field(default_factory=VelocitySettings)

    def __post_init__(self) -> None:
        for name, known in (("method", METHODS), ("quality", QUALITIES), ("scattering", ("auto", *SCATTERINGS))):
            if getattr(self, name) not in known:
                raise SceneError(f"{name} must be one of {', '.join(known)}, not {getattr(self, name)!r}.")
        for name in ("transport", "detail"):
            number(getattr(self, name), name, "a number from 0 to 1", lambda value: 0 <= value <= 1)
        if self.distance is not None:
            positive(self.distance, "distance", "a number of meters above 0")
        if self.method == "paper" and self.detail > 0:
            raise SceneError(f"The paper's method makes up no detail: detail must be 0 with it, not {self.detail}.")
        if not isinstance(self.seed, int) or self.seed < 0:
            raise SceneError(f"seed must be a whole number from 0, not {self.seed}.")
        if self.resolution not in (None, "auto"):
            expected = "three whole numbers of at least 8 voxels"
            for count in items(self.resolution, 3, "resolution", expected):
                integer(count, "resolution", expected, least=8)

    @classmethod
    def preset(
        cls,
        quality: Quality = "balanced",
        method: MethodName = "default",
        resolution: tuple[int, int, int] | Literal["auto"] | None = None,
    ) -> "Settings":
        """The settings of a quality and a method; SceneError if there is no such one."""
        if method == "paper":
            return cls(method=method, quality=quality, resolution=resolution, measure=False, detail=0.0)
        settings = cls(method=method, quality=quality, resolution=resolution)
        fit, descent = ITERATIONS[quality]
        return replace(settings, density=DensitySettings(fit_iterations=fit, descent_iterations=descent))

    def as_dict(self) -> dict[str, Any]:
        """The settings as plain nested values, the velocity solver with its name."""
        plain = asdict(self)
        plain["velocity"]["solver"]["name"] = type(self.velocity.solver).__name__
        return plain
