"""The differentiable renderer: a density and a scene in, an image out, and the exact derivative back.

``optics`` turns a scene into what light meets on its way: the domain, the medium and finitely many lights.
``setup`` puts camera rays (``rays``) and lights (``lights``) into the grid, ``device`` chooses between ``cpu`` and
``gpu``, which find how much light reaches every voxel and sum it up along the rays, ``renderer`` makes colours of it.
"""

from smokelift.footage.background import background_picture as scene_background
from smokelift.render.device import DeviceError, start
from smokelift.render.image import render, render_gradient
from smokelift.render.optics import Optics, scene_lights, scene_optics, scene_renderer
from smokelift.render.renderer import Image, Renderer, Volume

__all__ = [
    "DeviceError",
    "Image",
    "Optics",
    "Renderer",
    "Volume",
    "render",
    "render_gradient",
    "scene_background",
    "scene_lights",
    "scene_optics",
    "scene_renderer",
    "start",
]
