"""The kinds of light. A new one has a module of its own, with its class, and an entry in `LIGHT_TYPES`."""

from __future__ import annotations

from typing import Any

from smokelift.scene.environment_light import EnvironmentLight
from smokelift.scene.finite_lights import DirectionalLight, PointLight, SampledLight

Light = SampledLight | EnvironmentLight
"""An environment is no `SampledLight`: how many lights it needs depends on the camera and the medium."""

LIGHT_TYPES: dict[str, type[Any]] = {
    "directional": DirectionalLight,
    "point": PointLight,
    "environment": EnvironmentLight,
}
"""The frozen dataclass of each ``type`` that [[lights]] may have; its fields are the keys of the table."""
