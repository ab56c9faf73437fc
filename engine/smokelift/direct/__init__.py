"""Smoke after its clip: continued, retimed, looped, and made to react to wind, fans and obstacles."""

from smokelift.direct.continuation import Simulation, learnt_simulation
from smokelift.direct.continuing import Continuation, continue_sequence
from smokelift.direct.moment import Moment, completed, read_moment
from smokelift.direct.surroundings import Ball, Box, Fan
from smokelift.direct.writing import open_source

__all__ = [
    "Ball",
    "Box",
    "Continuation",
    "Fan",
    "Moment",
    "Simulation",
    "completed",
    "continue_sequence",
    "learnt_simulation",
    "open_source",
    "read_moment",
]
