"""Staggered grids and what is carried on them: advection and pressure projection."""

from smokelift.transport.grid import (
    Array,
    Faces,
    Velocity,
    advect,
    at_centres,
    closed_flags,
    divergence,
    face_shapes,
    project,
    require_positive,
    require_same_shape,
)

__all__ = [
    "Array",
    "Faces",
    "Velocity",
    "advect",
    "at_centres",
    "closed_flags",
    "divergence",
    "face_shapes",
    "project",
    "require_positive",
    "require_same_shape",
]
