"""What is in front of the lens: camera, domain, medium, lights, background; and its file.

``description`` holds `Scene`, what a user gives, and `CompleteScene`, the same with nothing left open.
"""

from smokelift.scene.camera import LARGEST_PICTURE, Camera, as_matrix, look_at_matrix, orbit, shared_part
from smokelift.scene.checks import SceneError
from smokelift.scene.description import CompleteScene, Scene, completed, require_scene, scene_from_dict
from smokelift.scene.domain import SIDES, Box, Domain, Inlet, Side
from smokelift.scene.lights import (
    SCATTERINGS,
    SHADOWED,
    DirectionalLight,
    EnvironmentLight,
    FiniteLight,
    Light,
    Medium,
    PointLight,
    Scattering,
)
from smokelift.scene.scene_file import scene_to_dict
from smokelift.scene.view import Background, ClipSource, View

__all__ = [
    "LARGEST_PICTURE",
    "SCATTERINGS",
    "SHADOWED",
    "SIDES",
    "Background",
    "Box",
    "Camera",
    "ClipSource",
    "CompleteScene",
    "DirectionalLight",
    "Domain",
    "EnvironmentLight",
    "FiniteLight",
    "Inlet",
    "Light",
    "Medium",
    "PointLight",
    "Scattering",
    "Scene",
    "SceneError",
    "Side",
    "View",
    "as_matrix",
    "completed",
    "look_at_matrix",
    "orbit",
    "require_scene",
    "scene_from_dict",
    "scene_to_dict",
    "shared_part",
]
