"""Smoke after its clip: continued, retimed, looped, and made to react to wind, turbulence, fans and obstacles."""

from smokelift.direct.continuation import CONTRADICTED, DISSOLVED, ROOM, Continuation, continue_sequence
from smokelift.direct.fitting import coarsen_state, fit_simulation, spin_up
from smokelift.direct.looping import default_overlap, loop_length, loop_sequence, steady_part
from smokelift.direct.mesh import Mesh
from smokelift.direct.new_sequence import open_source
from smokelift.direct.retiming import playback, retime_sequence
from smokelift.direct.simulation import Simulation
from smokelift.direct.state import SmokeState, complete_velocity, read_state
from smokelift.direct.surroundings import Ball, BoxObstacle, Fan
from smokelift.direct.turbulence import Turbulence

__all__ = [
    "CONTRADICTED",
    "DISSOLVED",
    "ROOM",
    "Ball",
    "BoxObstacle",
    "Continuation",
    "Fan",
    "Mesh",
    "Simulation",
    "SmokeState",
    "Turbulence",
    "coarsen_state",
    "complete_velocity",
    "continue_sequence",
    "default_overlap",
    "fit_simulation",
    "loop_length",
    "loop_sequence",
    "open_source",
    "playback",
    "read_state",
    "retime_sequence",
    "spin_up",
    "steady_part",
]
