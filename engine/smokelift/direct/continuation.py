"""Continues a sequence on disk: its frames up to one, and then a simulation, in a box that grows with the smoke.

All boxes have the voxels of the clip's. A side moves outwards by whole blocks before smoke arrives at it, so that
nothing is cut. A side that is a wall stays, and so does one beyond which the box would have too many voxels or hold a
camera or a lamp: before that the smoke dissolves.
"""

import math
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from smokelift.checks import Finding
from smokelift.direct.fitting import BUOYANCY_FRAMES, coarsen_state, fit_simulation, spin_up
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
from smokelift.direct.surroundings import Fan, Surroundings, Turbulence, require_place
from smokelift.output.archive import ResumeState
from smokelift.output.sequence import Sequence
from smokelift.output.writer import SequenceWriter
from smokelift.scene import SIDES, Box, CompleteScene, Domain, EnvironmentLight, PointLight, Side
from smokelift.scene.checks import Vector
from smokelift.scene.domain import MAX_SIDE_VOXELS, box_around, open_sides
from smokelift.transport import Array, Velocity, at_centres

BLOCK = 8
"""Voxels by which a side moves: few steps change the box, and counts with small factors transform fast."""

MARGIN_VOXELS = 4
"""Voxels of clear air between smoke and an open side. Pressure is zero there, which bends the flow nearby."""

MIN_DENSITY_FRACTION = np.float32(1e-3)
"""Fraction of the largest density above which smoke counts as there."""

FADE = 0.25
"""Fraction of the box's length over which smoke dissolves before a side that cannot move."""

FADE_EXPONENT = 2.0
"""Power of the distance to such a side that is left of the smoke: its value and its slope end at zero."""

BUMPS = 0.6
"""Fraction of that length by which the surface has bumps at which the smoke is gone."""

WAVES = ((0.3, 0.9, 0.0), (1.4, 1.3, 2.1), (2.5, 0.7, 4.0), (2.0, 2.1, 1.0))
"""Bumps of the end: direction in radians, number in a fade's length, and phase. No two agree, so no pattern is seen."""

Moves = tuple[tuple[int, int], tuple[int, int], tuple[int, int]]
"""Voxels by which the low and the high side move outwards, along x, y and z."""

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
class Growth:
    """How far a box may grow."""

    clip: Domain
    """The box of the clip."""
    closed: tuple[Side, ...]
    """Sides that are walls."""
    voxels: int
    """Of the largest box."""
    outside: tuple[Vector, ...] = ()
    """Points in meters that stay outside: cameras and lamps."""

    def after(self, box: Domain, state: SmokeState, dt: float) -> Domain:
        """The box for the step that follows a state, whose smoke may be near a side of its own."""
        smoke = box_around(state.density > MIN_DENSITY_FRACTION * state.density.max(), 0)
        grown = box
        for side, axis, is_high in open_sides(self.closed):
            if smoke[axis].stop == 0:
                break
            fastest = float(np.abs(state.velocity.faces[axis]).max()) * dt / box.voxel_size
            clear = box.resolution[axis] - smoke[axis].stop if is_high else smoke[axis].start
            blocks = math.ceil((MARGIN_VOXELS + fastest - clear) / BLOCK)
            if blocks > 0 and self._fits(larger := _moved(grown, side, blocks)):
                grown = larger
        return grown

    def around(self, box: Domain, thing: Box) -> Domain:
        """The box, grown until it holds another; as it is where that would be too large."""
        larger = box
        for side, axis, is_high in open_sides(self.closed):
            beyond = thing.max[axis] - box.max[axis] if is_high else box.min[axis] - thing.min[axis]
            blocks = math.ceil(beyond / (BLOCK * box.voxel_size))
            if blocks > 0:
                larger = _moved(larger, side, blocks)
        return larger if self._fits(larger) else box

    def stopped(self, box: Domain) -> tuple[Side, ...]:
        """The open sides that cannot move."""
        return tuple(side for side, _, _ in open_sides(self.closed) if not self._fits(_moved(box, side, 1)))

    def reach(self) -> Box:
        """The box that holds every box there can be."""
        times = self.voxels / math.prod(self.clip.resolution) - 1
        ends = np.array([self.clip.min, self.clip.max])
        for _, axis, is_high in open_sides(self.closed):
            ends[int(is_high), axis] += (1 if is_high else -1) * times * self.clip.size[axis]
        low, high = ends.tolist()
        return Box(tuple(low), tuple(high))

    def _fits(self, box: Domain) -> bool:
        small = math.prod(box.resolution) <= self.voxels and max(box.resolution) <= MAX_SIDE_VOXELS
        return small and not any(box.contains(point) for point in self.outside)


def camera_and_lamp_places(scene: CompleteScene) -> tuple[Vector, ...]:
    """The places in meters of a scene's cameras and lamps: a renderer needs them outside the box."""
    cameras = [scene.camera, *(view.camera for view in scene.views)]
    eyes = [camera for camera in cameras if camera.type == "perspective"]
    matrices = [matrix for camera in eyes for matrix in camera.matrices or (camera.matrix,)]
    lights = [light for light in scene.lights if not isinstance(light, EnvironmentLight)]
    lamps = [sample.position for light in lights for sample in light.samples() if isinstance(sample, PointLight)]
    return (*((x[3], y[3], z[3]) for x, y, z, *_ in matrices), *lamps)


def moves(box: Domain, larger: Domain) -> Moves:
    """How many voxels the low side and the high side of a box move outwards to those of a larger one, of each axis."""
    parts = box.slices_in(larger)
    x, y, z = ((part.start, count - part.stop) for part, count in zip(parts, larger.resolution, strict=True))
    return x, y, z


def in_larger_box(state: SmokeState, ends: Moves, before: Surroundings, after: Surroundings, time: float) -> SmokeState:
    """A state, at a time in seconds, in a box that is larger by some `moves`.

    The velocity of the air goes on as that of what is placed in the larger box; what the smoke has beside the air of
    its own box goes on as it is at the side.
    """
    velocity = state.velocity
    air = before.air(velocity, time)
    x, y, z = (np.pad(u - a, ends, mode="edge") for u, a in zip(velocity.faces, air, strict=True))
    flow = Velocity((x, y, z), velocity.voxel_size, velocity.closed)
    faces = (u + a for u, a in zip(flow.faces, after.air(flow, time), strict=True))
    flame = None if state.flame is None else np.pad(state.flame, ends)
    return SmokeState(np.pad(state.density, ends), flow.with_faces(faces), flame)


def dissolve(state: SmokeState, stopped: tuple[Side, ...], dt: float, first: tuple[int, ...] = (0, 0, 0)) -> SmokeState:
    """A state whose smoke has lost what it loses in a step on its way to sides that cannot move.

    What is left of it goes with the distance to the power `FADE_EXPONENT`, to a surface before the side that has bumps.
    So it is gone there however fast it arrives, what does not move towards it stays, and its end is not straight. The
    box begins at the voxel `first` of the clip's: the bumps stay where they are when the box grows.
    """
    left, shape = np.ones((), np.float32), state.density.shape
    for side in stopped:
        axis, is_high = divmod(SIDES.index(side), 2)
        count, band = shape[axis], np.float32(FADE * shape[axis])
        inside = np.arange(count, dtype=np.float32).reshape([-1 if d == axis else 1 for d in range(3)])
        distance = (count - 1 - inside if is_high else inside) - BUMPS * band * _bumps(shape, axis, float(band), first)
        voxels = np.float32((1 if is_high else -1) * dt / state.velocity.voxel_size)
        moved = np.maximum(voxels * at_centres(state.velocity.faces)[axis], 0)
        now = np.clip(distance, 0, band)
        before = np.minimum(now + moved, band)
        # a voxel's center is half a voxel from the surface at which smoke is gone, at least
        left = left * ((now + 0.5) / (before + 0.5)) ** np.float32(FADE_EXPONENT)
    return state.scaled(left)


def _bumps(shape: tuple[int, ...], axis: int, width: float, first: tuple[int, ...]) -> Array:
    """Bumps from 0 to 1 over a side across an axis: waves in several directions, a few of them about a width long."""
    total = np.zeros((), np.float32)
    places = np.ix_(*((1.0 + start + np.arange(n)) / width for n, start in zip(shape, first, strict=True)))
    one, other = (place for d, place in enumerate(places) if d != axis)
    for angle, pitch, phase in WAVES:
        wave = np.cos(2 * np.pi * pitch * (np.cos(angle) * one + np.sin(angle) * other) + phase + axis)
        total = total + wave.take([0], axis).astype(np.float32) / len(WAVES)
    return np.float32(0.5) + np.float32(0.5) * total


def _moved(box: Domain, side: Side, blocks: int) -> Domain:
    """A box one side of which has moved outwards by blocks, a high one less where that makes the count whole blocks."""
    axis, is_high = divmod(SIDES.index(side), 2)
    ends = [[0, 0, 0], [0, 0, 0]]
    ends[is_high][axis] = blocks * BLOCK + (-box.resolution[axis] % BLOCK if is_high else 0)
    return box.grown(tuple(ends[0]), tuple(ends[1]))


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
    obstacles: tuple[Mesh, ...] = ()
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
        require_place("fan", fan, box, box)
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
        "fans": [asdict(fan) for fan in continuation.fans],
        "obstacles": [obstacle.fingerprint() for obstacle in continuation.obstacles],
    }
    given = [name for name in ("buoyancy", "dissipation") if settings[name] is not None]
    made = Finding(
        "simulated frames with given values" if given else "simulated frames",
        {"frame": start, "first": start + 1, "last": last, "given": " and ".join(given)},
    )
    camera_frames = [float(number) for number in range(copied[0], last + 1)]
    with directed_writer(sequence, out, "continue", settings, made, camera_frames, npz=npz, resume=resume) as writer:
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
        box = growth.around(box, Box(*fan.bounds()))
    return box


def _surroundings(continuation: Continuation, domain: Domain, clip: Domain) -> Surroundings:
    """What is placed in a box that the clip's has grown to."""
    placed = continuation.wind, continuation.turbulences, continuation.fans, continuation.obstacles
    return Surroundings(domain, *placed, domain.first_in(clip))
