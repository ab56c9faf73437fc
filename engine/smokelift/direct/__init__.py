"""Smoke after its clip: continued, retimed, looped, and made to react to wind, turbulence, fans and obstacles."""

from smokelift.direct.continuation import Simulation, learnt_simulation
from smokelift.direct.continuing import Continuation, continue_sequence
from smokelift.direct.looping import loop_length, loop_sequence, usual_overlap
from smokelift.direct.mesh import Mesh
from smokelift.direct.moment import Moment, completed, read_moment
from smokelift.direct.moving_mesh import MovingMesh
from smokelift.direct.obstacles import Ball, Box
from smokelift.direct.retiming import paced, retime_sequence
from smokelift.direct.surroundings import Fan
from smokelift.direct.turbulence import Turbulence
from smokelift.direct.writing import open_source

__all__ = [
    "Ball",
    "Box",
    "Continuation",
    "Fan",
    "Mesh",
    "Moment",
    "MovingMesh",
    "Simulation",
    "Turbulence",
    "completed",
    "continue_sequence",
    "learnt_simulation",
    "loop_length",
    "loop_sequence",
    "open_source",
    "paced",
    "read_moment",
    "retime_sequence",
    "usual_overlap",
]
