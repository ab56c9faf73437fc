"""All that a picture depends on besides the density, the camera and what stands behind: one value to hand around."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smokelift.render.lights import FiniteLight
from smokelift.render.renderer import Image, Renderer
from smokelift.scene import Camera, Domain, Medium, Scattering


@dataclass(frozen=True)
class Optics:
    """How light travels through the smoke of a domain.

    Attributes
    ----------
    domain, medium
        Where the smoke is, and what it does to light.
    lights
        Each of which one sweep can do; an environment has become many of them.
    scattering
        ``"single"`` with self-shadowing, ``"unshadowed"`` or ``"absorption"``.
    """

    domain: Domain
    medium: Medium
    lights: tuple[FiniteLight, ...]
    scattering: Scattering

    def renderer(self, camera: Camera, background: Image, support: NDArray[np.bool_] | None = None) -> Renderer:
        """The renderer of a camera before a background; see `Renderer` for the parameters."""
        return Renderer(camera, self.domain, self.medium, self.lights, background, self.scattering, support)
