"""The loop over frames that couples density and velocity (algorithms 1 and 4), and the parts it is composed of."""

from smokelift.pipeline.extraction import Extraction, extract
from smokelift.pipeline.loop import Frame, Method, compose
from smokelift.pipeline.reconstruction import Reconstruction, reconstruct

__all__ = ["Extraction", "Frame", "Method", "Reconstruction", "compose", "extract", "reconstruct"]
