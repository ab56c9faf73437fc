"""What one camera saw of the smoke at one moment."""

from __future__ import annotations

from dataclasses import dataclass

from smokelift.footage.plate import Plate
from smokelift.render.renderer import Image
from smokelift.scene import Camera


@dataclass(frozen=True, eq=False)
class Observation:
    """A picture of the smoke.

    Attributes
    ----------
    camera
        That stands still.
    image : (rows, columns, 3)
        Linear radiance, of the camera's size.
    plate
        Background with its noise, of the same size; None stands for the scene's background (before another camera than
        the scene's own a picture is replaced by its mean colour) and the noise of 8 bits.
    """

    camera: Camera
    image: Image
    plate: Plate | None = None
