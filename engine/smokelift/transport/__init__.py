"""Staggered grids and what is carried on them: advection and pressure projection."""

from smokelift.transport.advection import advect, advect_cells
from smokelift.transport.grid import (
    Array,
    Faces,
    ResidualMeans,
    StaggeredGrid,
    Velocity,
    at_centres,
    face_shapes,
    faces_in,
    on_faces,
    require_positive,
    require_same_shape,
)
from smokelift.transport.projection import divergence, outflow, project, without_divergence

__all__ = [
    "Array",
    "Faces",
    "ResidualMeans",
    "StaggeredGrid",
    "Velocity",
    "advect",
    "advect_cells",
    "at_centres",
    "divergence",
    "face_shapes",
    "faces_in",
    "on_faces",
    "outflow",
    "project",
    "require_positive",
    "require_same_shape",
    "without_divergence",
]
