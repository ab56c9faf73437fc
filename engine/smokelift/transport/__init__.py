"""Staggered grids and what is carried on them: advection and pressure projection."""

from smokelift.checks import Array
from smokelift.transport.advection import advect
from smokelift.transport.grid import (
    Faces,
    StaggeredGrid,
    Velocity,
    VoxelBox,
    at_centres,
    block_means,
    face_shapes,
    faces_in,
    halved,
    on_faces,
    part_of,
    require_positive,
    require_same_shape,
)
from smokelift.transport.pressure import divergence, outflow, project, without_divergence

__all__ = [
    "Array",
    "Faces",
    "StaggeredGrid",
    "Velocity",
    "VoxelBox",
    "advect",
    "at_centres",
    "block_means",
    "divergence",
    "face_shapes",
    "faces_in",
    "halved",
    "on_faces",
    "outflow",
    "part_of",
    "project",
    "require_positive",
    "require_same_shape",
    "without_divergence",
]
