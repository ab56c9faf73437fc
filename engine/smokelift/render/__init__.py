"""The differentiable renderer: a density and a scene in, an image out, and the exact derivative back.

    Scene -> Optics     domain, medium, lights, scattering           image
      lights            all as directional and point lights          environment
    Optics -> Renderer  one camera before one background             renderer
      RenderPlan        rays and light sweeps in voxel coordinates   plan
      Backend           light to every voxel, then along the rays    cpu_backend (cpp/) or gpu_backend, by device

`render` and `render_gradient` go all the way from a density and a scene (``image``).
"""

from smokelift.render.device import DeviceError
from smokelift.render.image import render, render_gradient, scene_optics, scene_renderer
from smokelift.render.renderer import Image, Optics, Renderer, Volume

__all__ = [
    "DeviceError",
    "Image",
    "Optics",
    "Renderer",
    "Volume",
    "render",
    "render_gradient",
    "scene_optics",
    "scene_renderer",
]
