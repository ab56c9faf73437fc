"""Smokelift: one ordinary video of smoke in, a 3D, moving, relightable volume out.

The data flows footage -> extraction -> setup -> density (render) <-> velocity (transport) -> output; `pipeline` has the
loop.
"""

from smokelift.density import reconstruct_density
from smokelift.evaluation import metrics
from smokelift.extraction.element import Element
from smokelift.footage.clip import Clip
from smokelift.output.sequence import Sequence
from smokelift.pipeline import Extraction, Frame, Reconstruction, extract, reconstruct
from smokelift.render import render, render_gradient
from smokelift.scene import (
    Background,
    Camera,
    ClipSource,
    DirectionalLight,
    Domain,
    EnvironmentLight,
    Medium,
    PointLight,
    Scene,
)
from smokelift.setup.prepare import prepare_shot
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot
from smokelift.transport import Velocity, advect, project
from smokelift.velocity import estimate_velocity

__version__ = "1.0.0"

__all__ = [
    "Background",
    "Camera",
    "Clip",
    "ClipSource",
    "DirectionalLight",
    "Domain",
    "Element",
    "EnvironmentLight",
    "Extraction",
    "Frame",
    "Medium",
    "PointLight",
    "Reconstruction",
    "Scene",
    "Sequence",
    "Settings",
    "Shot",
    "Velocity",
    "advect",
    "estimate_velocity",
    "extract",
    "metrics",
    "prepare_shot",
    "project",
    "reconstruct",
    "reconstruct_density",
    "render",
    "render_gradient",
]
