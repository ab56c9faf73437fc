"""The loop over frames that couples density and velocity (algorithms 1 and 4), and the parts it is composed of."""

from smokelift.pipeline.loop import Frame, reconstruct
from smokelift.pipeline.method import Method, compose

__all__ = ["Frame", "Method", "compose", "reconstruct"]
