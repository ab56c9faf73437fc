"""Mantaflow inside Blender 3.4: its module, and its grids as arrays."""

import ctypes
import tempfile
from typing import Any

import bpy
import numpy as np


def boot() -> Any:
    """Return the `manta` module with a complete class table.

    Mantaflow misses inherited methods until its second start under Python 3.11; baking a throw-away domain
    forces the first one, and that bake may fail.
    """
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    bpy.ops.mesh.primitive_cube_add(size=2)
    domain = bpy.context.object
    modifier = domain.modifiers.new("Fluid", "FLUID")
    modifier.fluid_type = "DOMAIN"
    settings = modifier.domain_settings
    settings.domain_type, settings.resolution_max, settings.cache_type = "GAS", 8, "ALL"
    bpy.context.view_layer.objects.active = domain
    with tempfile.TemporaryDirectory() as folder:
        settings.cache_directory, settings.cache_frame_start, settings.cache_frame_end = folder, 1, 1
        try:
            bpy.ops.fluid.bake_all()
        except RuntimeError as error:
            print("first bake, which may fail:", error)
    import manta

    return manta


def view(grid: Any, shape: tuple[int, ...], components: int = 1) -> np.ndarray:
    """Return a writable view [x, y, z(, component)] of a Mantaflow grid, valid until its next advection."""
    count = int(np.prod(shape)) * components
    buffer = (ctypes.c_float * count).from_address(int(grid.getDataPointer(), 16))
    data = np.frombuffer(buffer, np.float32)
    if components == 1:
        return data.reshape(shape[::-1]).transpose(2, 1, 0)
    return data.reshape(*shape[::-1], components).transpose(2, 1, 0, 3)
