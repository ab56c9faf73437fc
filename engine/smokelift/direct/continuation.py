"""Continues a sequence on disk: its frames up to one, and then those of a simulation that starts from it."""

import math
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from smokelift.direct.fitting import BUOYANCY_FRAMES, coarsen_state, fit_simulation, spin_up
from smokelift.direct.growth import Growth, camera_and_lamp_places, dissolve, in_larger_box, moves
from smokelift.direct.mesh import Mesh
from smokelift.direct.state import (
    MIN_FRAMES,
    SmokeState,
    Written,
    directed_writer,
    read_state,
    write_copy,
    write_simulated,
)
from smokelift.direct.surroundings import Fan, Obstacle, Surroundings, Turbulence, require_place
from smokelift.output.archive import ResumeState
from smokelift.output.sequence import Sequence
from smokelift.output.writer import SequenceWriter
from smokelift.scene import SIDES, Box, Domain, Side
from smokelift.scene.checks import Vector
from smokelift.transport import Velocity

FITTED_FRAMES = 12
"""Last frames of the clip, at most, that inflow, fire and dissipation are fitted to. In half a second the source of a
clip is steady, and the replay of so much is not noticed."""

UNFADED = ("unfaded", "unfaded_flame")
"""Names of the density and the emission before the fading in the resume state: the simulation goes on from those."""

DISSOLVED = "dissolved"
"""Figure of a simulated frame: the fraction of its smoke that has dissolved before sides that cannot move."""

CONTRADICTED = "contradicted_buoyancy"
"""Figure of a simulated frame: the buoyancy in m/s2 that was fitted and not taken, 0 if it was."""

MIN_EDDY_VOXELS = 3
"""Voxels across an eddy, at least: fewer do not show that it turns."""

ROOM = 8.0
"""Usual room for the smoke, in the clip's boxes: two seconds of wind, of a fan and around a ball fill 4 to 6
(docs/directing.md)."""


@dataclass(frozen=True)
class Continuation:
    """How a sequence goes on."""

    frames: int
    """Frames after `start`."""
    start: int | None = None
    """The last frame that stays as it is; None takes the last there is."""
    fade: int = 0
    """Frames at the end in which the smoke fades to nothing."""
    wind: Vector = (0.0, 0.0, 0.0)
    """Velocity in m/s that all air gains after `start`."""
    turbulences: tuple[Turbulence, ...] = ()
    """Eddies that all air gains after `start`."""
    fans: tuple[Fan, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
    """What stands there after `start`, in the clip's box or where it can grow to."""
    closed: tuple[Side, ...] = ()
    """Sides that are walls after `start`, besides those of the scene."""
    room: float = ROOM
    """How many times as many voxels as the clip's the box may have that grows with the smoke, 1 at least. Before a side
    that cannot move any more the smoke dissolves."""
    buoyancy: float | None = None
    dissipation: float | None = None
    """As in `smokelift.direct.simulation.Physics`; None takes those of the clip."""


def continue_sequence(
    sequence: Sequence, out: str | Path, continuation: Continuation, *, npz: bool = False, resume: bool = False
) -> Iterator[Written]:
    """Write a sequence up to a frame, and then what a simulation makes of it.

    Arguments and what it yields are those of `smokelift.direct.state.directed_writer`. It is a ValueError if
    there is no such frame to start from, or too few before it, a fan or an obstacle is not in the box, eddies are
    too small for the voxels, or a file cannot be read or written.
    """
    start = sequence.frames[-1] if continuation.start is None else continuation.start
    copied = tuple(number for number in sequence.frames if number <= start)
    if start not in sequence.frames or len(copied) < MIN_FRAMES:
        raise ValueError(
            f"{sequence.directory}: cannot go on from frame {start}; choose one from "
            f"{sequence.frames[MIN_FRAMES - 1]} to {sequence.frames[-1]}."
        )
    scene = sequence.scene
    closed = tuple(side for side in SIDES if side in (*scene.closed, *continuation.closed))
    voxels = int(continuation.room * math.prod(scene.domain.resolution))
    growth = Growth(scene.domain, closed, voxels, camera_and_lamp_places(scene))
    box = _start_box(continuation, growth)
    for obstacle in continuation.obstacles:
        require_place("obstacle", obstacle, box, growth.reach())
    for fan in continuation.fans:
        require_place("fan", fan.place, box, box)
    for turbulence in continuation.turbulences:
        if turbulence.size < MIN_EDDY_VOXELS * box.voxel_size:
            raise ValueError(
                f"turbulence of {turbulence.size:g} m is too small for voxels of {box.voxel_size:.3g} m; make it "
                f"{MIN_EDDY_VOXELS * box.voxel_size:.3g} m at least."
            )
    # refuses what fills the box before anything is written
    _surroundings(continuation, box, growth.clip).solid(1, 1 / sequence.fps)
    last = start + continuation.frames
    settings = {
        **vars(continuation),
        "start": start,
        "turbulences": [asdict(turbulence) for turbulence in continuation.turbulences],
        "fans": [vars(fan.place) | {"velocity": fan.velocity} for fan in continuation.fans],
        "obstacles": [each.fingerprint() if isinstance(each, Mesh) else vars(each) for each in continuation.obstacles],
    }
    given = [name for name in ("buoyancy", "dissipation") if settings[name] is not None]
    found = [name for name in ("buoyancy", "dissipation") if name not in given]
    how = (
        f"Frames {start + 1} to {last} are a simulation that starts from frame {start}, with the "
        f"{', '.join([*found, 'inflow'])} and fire of the clip, as far as it shows them"
        + (f", and a given {' and '.join(given)}." if given else ".")
    )
    camera_frames = [float(number) for number in range(copied[0], last + 1)]
    with directed_writer(sequence, out, "continue", settings, how, camera_frames, npz=npz, resume=resume) as writer:
        if writer.state is None and writer.finished:
            return
        for number in copied:
            if number not in writer.finished:
                yield write_copy(sequence, number, writer, number, {})
        yield from _simulated(sequence, copied, continuation, growth, writer)


def _simulated(
    sequence: Sequence, copied: tuple[int, ...], continuation: Continuation, growth: Growth, writer: SequenceWriter
) -> Iterator[Written]:
    start, dt, clip = copied[-1], 1 / sequence.fps, growth.clip
    # the first frame has no velocity of its own
    numbers = copied[1:]
    earlier = numbers[-BUOYANCY_FRAMES:-FITTED_FRAMES] if continuation.buoyancy is None else ()
    states = [read_state(sequence, number) for number in numbers[-FITTED_FRAMES:]]
    line_of_sight = [abs(row[2]) for row in sequence.scene.camera.matrix[:2]]
    simulation = fit_simulation(
        states,
        dt,
        sequence.scene.inflow(),
        _surroundings(continuation, clip, clip),
        earlier=[coarsen_state(read_state(sequence, number)) for number in earlier],
        depth_axis=int(np.argmax(line_of_sight)),
        buoyancy=continuation.buoyancy,
        dissipation=continuation.dissipation,
    )
    saved = writer.state
    if saved is not None and saved.number > start:
        box = writer.box(saved.number)
        volumes = [np.asarray(saved.extra[name], np.float32) for name in UNFADED if name in saved.extra]
        state = SmokeState(volumes[0], Velocity(saved.velocity, box.voxel_size, growth.closed), *volumes[1:])
        larger = growth.after(box, state, dt)
        simulation = simulation.in_larger_box(moves(clip, box), _surroundings(continuation, box, clip))
    else:
        box, larger = clip, _start_box(continuation, growth)
        state = spin_up(simulation, states)
        state = replace(state, velocity=replace(state.velocity, closed=growth.closed))
    del states  # they are large
    for step in range(1, continuation.frames + 1):
        number = start + step
        if number in writer.finished:
            continue
        started = time.perf_counter()
        if larger != box:
            ends, before = moves(box, larger), simulation.surroundings
            simulation = simulation.in_larger_box(ends, _surroundings(continuation, larger, clip))
            state = in_larger_box(state, ends, before, simulation.surroundings, (step - 1) * dt)
            box = larger
        state = simulation.next(state, step)
        mass = float(state.density.sum(dtype=np.float64))
        state = dissolve(state, growth.stopped(box), dt, box.first_in(clip))
        gone = 1 - float(state.density.sum(dtype=np.float64)) / mass if mass > 0 else 0.0
        shown = min(1.0, (continuation.frames - step) / continuation.fade) if continuation.fade else 1.0
        faded = state.scaled(np.float32(shown))
        solid = simulation.surroundings.solid(step, dt)
        obstacles = None if solid is None else solid.voxels
        further = {**vars(simulation.physics), DISSOLVED: gone}
        volumes = [values for values in (state.density, state.flame) if values is not None]
        unfaded = dict(zip(UNFADED, volumes, strict=False))
        saved = ResumeState(number, faded.density, state.velocity.faces, unfaded)
        yield write_simulated(
            writer, number, faded, "simulated", further, started=started, solid=obstacles, box=box, state=saved
        )
        larger = growth.after(box, state, dt)


def _start_box(continuation: Continuation, growth: Growth) -> Domain:
    """The box in which the simulation begins: the clip's, and the fans."""
    box = growth.clip
    for fan in continuation.fans:
        box = growth.around(box, Box(*fan.place.bounds()))
    return box


def _surroundings(continuation: Continuation, domain: Domain, clip: Domain) -> Surroundings:
    """What is placed in a box that the clip's has grown to."""
    placed = continuation.wind, continuation.turbulences, continuation.fans, continuation.obstacles
    return Surroundings(domain, *placed, domain.first_in(clip))
