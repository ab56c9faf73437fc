"""A simulation fitted to a clip's last frames: its inlets, its forces, and a velocity that these forces explain.

An estimated velocity is smooth and slow: it explains how the smoke moved, but lacks the eddies that draw it out next. A
simulation that starts from it makes threads. So the simulation runs along the clip first. It takes the velocity from
the first frame alone, and at each frame the clip's density (direct insertion: Charney, Halem and Jastrow, "Use of
incomplete historical data to infer the present state of the atmosphere", 1969). The density's detail turns the air
around it, so that eddies come in on every scale that the clip shows. Small ones that are still missing are made up
(`smokelift.direct.simulation.with_small_eddies`).

The buoyancy is the one whose velocity moves the smoke up as the clip does: each frame is carried on for a step, and
compared with the next one in the picture. What rises there is the pattern of the smoke, not its center of mass, which
sinks where a head dissolves while the base is fed. A velocity's change from one frame to the next does not show the
buoyancy, since estimates err by more than that (docs/experiments/continuation.md).

Where a velocity is wrong, the change that it leaves unexplained has both signs side by side, because smoke is moved and
not made. Where smoke enters, the change is positive all over. So an inlet shows in the mean of the residual over a few
voxels, beside the mean of its magnitude: their ratio, the coherence, is near one in an inlet and near zero elsewhere.
An inlet also stands out from what is left unexplained in the rest of the smoke, and from other inlets. The front of
smoke that is faster than the velocity looks like a wide, weak one.
"""

import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy import ndimage

import smokelift._core as _core
from smokelift.checks import Mask
from smokelift.direct.simulation import Combustion, Inflow, Physics, Simulation, small_eddy_speed, with_small_eddies
from smokelift.direct.state import SmokeState
from smokelift.direct.surroundings import Surroundings
from smokelift.transport import Array, Velocity, advect, at_centres, project
from smokelift.velocity.linearization import SMOKE_THRESHOLD
from smokelift.velocity.pyramid import coarsen_density, coarsen_velocity

COARSE_SIDE_VOXELS = 64
"""Voxels along the longest side, at most, of the grid that the buoyancy is fitted on: a mean motion needs no more."""

MIN_BUOYANCY_FRAMES = 8
"""Frames that show a buoyancy, at least: over fewer one of 1 m/s2 moves the smoke by less than a tenth of a voxel,
which is within its error (docs/experiments/continuation.md)."""

MAX_SPEED_RATIO = 2.0
"""Times the median speed above which a state's velocity is taken to be wrong."""

BUOYANCY_FRAMES = 24
"""Last frames, at most, that show the buoyancy: half of them are needed to forget that an estimated velocity is too
slow (docs/experiments/continuation.md)."""

BLUR = 1.5
"""Standard deviation in coarse voxels of the blur before pictures are compared: finer detail is of interpolation."""

BORDER_LAYERS = 2
"""Layers of coarse voxels at the lower and the upper side whose smoke may have come in or gone out."""

INLET_MARGIN = 1
"""Coarse voxels around an inlet that are not compared: inlets are found roughly, and what enters there stands still."""

BRIGHTNESS_RIDGE = 0.1
"""Weight, in units of the brightness itself, against a brightness that changes with height: without texture nothing
else tells such a change from a rise."""

MAX_SECANT_STEPS = 6
"""Steps of the secant method at most: the rise is nearly linear in the buoyancy."""

RISE_ROUNDING = 1e-9
"""Voxels per frame of difference in rise, at most, that are rounding."""

PRECISION = 0.01
"""Relative change of the buoyancy below which it is found."""

BLUR_VOXELS = 2.0
"""Standard deviation, in voxels, of the Gaussian that takes the means. Wider ones miss small inlets
(docs/experiments/velocity-solver.md)."""

COHERENCE = (0.4, 0.6)
"""Mean residual over mean magnitude: nothing is an inlet below the first, everything that stands out is one above the
second."""

STRENGTH = (3.0, 6.0)
"""Mean residual in medians of its magnitude over the smoke, likewise."""

PROMINENCE = (0.1, 0.2)
"""Mean residual over that of the strongest inlet, likewise: inlets of one scene are of one kind
(docs/experiments/velocity-solver.md)."""

MIN_SCORE = 0.5
"""Score above which a voxel is in an inlet."""

MIN_LASTING_FRACTION = 0.25
"""Smoke that lasts in an inlet over that of the strongest, at least, where the weaker half of the frames counts: what a
wrong velocity leaves is scattered and moves on."""

MIN_RESIDUAL_FRACTION = np.float32(1e-4)
"""Fraction of the largest density below which a residual means nothing."""

MARGIN_VOXELS = 1
"""Voxels around an inlet that belong to it: its smoke is taken from the clip until it is outside."""


def fit_simulation(
    states: Sequence[SmokeState],
    dt: float,
    marked: Mask | None = None,
    surroundings: Surroundings | None = None,
    *,
    earlier: Sequence[SmokeState] = (),
    depth_axis: int = 1,
    buoyancy: float | None = None,
    dissipation: float | None = None,
) -> Simulation:
    """Fit forces, inlets and fire to frames of a clip, for a simulation that goes on from them.

    The states are consecutive, two at least, `dt` seconds apart; those of the frames ``earlier``, from
    `coarsen_state`, show the buoyancy as well. Where smoke enters is ``marked`` (nx, ny, nz), if that is known, and
    what the artist has placed is in the surroundings. Motion is compared in the picture: ``depth_axis``, 0 or 1, is
    the axis, x or y, that is nearest to the camera's line of sight. Buoyancy and dissipation are those of
    `Physics`, if they are known; None fits them.
    """
    inflow = find_inflow(states, dt, marked)
    if dissipation is None:
        dissipation = _dissipation(states, dt, inflow.voxels)
    if buoyancy is None:
        fitted, rise = _buoyancy([*earlier, *map(coarsen_state, states)], dt, inflow.voxels, depth_axis)
        contradicted = fitted * rise < 0
        physics = Physics(0.0 if contradicted else fitted, dissipation, fitted if contradicted else 0.0)
    else:
        physics = Physics(buoyancy, dissipation)
    around = surroundings or Surroundings()
    return Simulation(physics, inflow.cropped(), around, dt, fit_fire(states, dt), small_eddy_speed(states))


def fit_fire(states: Sequence[SmokeState], dt: float) -> Combustion | None:
    """Fit the fire of consecutive states of a clip, `dt` seconds apart; None where they show none.

    Where they have less fire on the mean than was carried there nothing feeds it, and what they have of it is left in a
    step. What the rest has more than that is the feed. Figures: docs/experiments/fire.md.
    """
    burning = [(state.flame, state.velocity) for state in states if state.flame is not None]
    if len(burning) < len(states):
        return None
    advected = np.zeros(states[0].density.shape, np.float32)
    found = advected.copy()
    for (flame, _), (following, velocity) in pairwise(burning):
        advected += advect(flame, velocity, dt, conserve=True)
        found += following
    unfed = found < advected
    remaining = 1.0
    if unfed.any():
        remaining = float(found[unfed].sum(dtype=np.float64) / advected[unfed].sum(dtype=np.float64))
    feed = np.maximum(found - np.float32(remaining) * advected, 0)
    # The feed is clipped at zero. Scaled to the sum before the clipping it does not make the fire grow.
    net = found.sum(dtype=np.float64) - remaining * advected.sum(dtype=np.float64)
    scale = net / max(feed.sum(dtype=np.float64), 1e-30)
    return Combustion(remaining, feed * np.float32(scale / (len(states) - 1)))


def coarsen_state(state: SmokeState) -> SmokeState:
    """The state on the grid that the buoyancy is fitted on, without fire."""
    while max(state.density.shape) > COARSE_SIDE_VOXELS:
        state = SmokeState(coarsen_density(state.density), coarsen_velocity(state.velocity))
    return SmokeState(state.density, state.velocity)


def spin_up(simulation: Simulation, states: Sequence[SmokeState]) -> SmokeState:
    """The last of some consecutive states, with the velocity that the forces have made since the first, and its eddies.

    The simulation is fitted to them; what is placed around the smoke does not act yet.
    """
    ((_, velocity),) = deque(_replayed(simulation, states), maxlen=1)  # all of them are large
    with_eddies = with_small_eddies(velocity, states[-1].density, simulation.eddy_speed)
    return replace(states[-1], velocity=project(with_eddies))


def _replayed(simulation: Simulation, states: Sequence[SmokeState]) -> Iterator[tuple[int, Velocity]]:
    """The velocities that the forces make along the states, each with the number of the state that it leads to.

    The first velocity that is as fast as usual is the start: a wrong one would go on through all others. What entered
    in the clip enters.
    """
    speeds = [sum(float(np.vdot(component, component)) for component in m.velocity.faces) ** 0.5 for m in states]
    usual = MAX_SPEED_RATIO * float(np.median(speeds))
    first = next((number for number in range(len(states) // 2) if speeds[number] <= usual), 0)
    inflow = replace(simulation.inflow, states=simulation.inflow.states[::-1])
    along, velocity = Simulation(simulation.physics, inflow, Surroundings(), simulation.dt), states[first].velocity
    for number, state in enumerate(states[first:-1], first + 1):
        velocity = along.velocity(replace(state, velocity=velocity), number)
        yield number, velocity


def _buoyancy(states: Sequence[SmokeState], dt: float, inlets: Mask, depth_axis: int) -> tuple[float, float]:
    """The buoyancy whose velocity moves the smoke up as the clip does, and how fast the clip says that it rises (m/s).

    The velocity spins up along all states, with their densities; the second half of them is compared. The inlets are
    marked on the states' grid, or on one that it was halved from.
    """
    while inlets.shape != states[0].density.shape:
        inlets = coarsen_density(inlets.astype(np.float32)) > 0
    states = states[-BUOYANCY_FRAMES:]
    if len(states) < MIN_BUOYANCY_FRAMES or not all(state.density.any() for state in states):
        return 0.0, 0.0
    half = len(states) // 2
    unforced = Simulation(Physics(0.0, 0.0), Inflow(inlets, states).cropped(), Surroundings(), dt)
    compared = (~ndimage.binary_dilation(inlets, iterations=INLET_MARGIN)).astype(np.float32)
    compared[:, :, :BORDER_LAYERS] = compared[:, :, -BORDER_LAYERS:] = 0

    def picture(density: Array) -> Array:
        return np.asarray(ndimage.gaussian_filter((density * compared).sum(depth_axis), BLUR))

    found = [picture(state.density) for state in states]
    rise = float(np.mean([_rise(state, compared) for state in states]))

    def excess_rise(buoyancy: float) -> float:
        """Voxels per frame by which the carried smoke rises more than the clip's."""
        forced = replace(unforced, physics=Physics(buoyancy, 0.0))
        carried = [
            picture(advect(states[number - 1].density, velocity, dt, conserve=True))
            for number, velocity in _replayed(forced, states)
            if number >= half
        ]
        return _vertical_shift(carried, found[half:], rise)

    density = states[half].density
    typical = float(np.vdot(density, density) / density.sum(dtype=np.float64))
    by_a_voxel = states[0].velocity.voxel_size / (typical * (half * dt) ** 2)
    return _root(excess_rise, by_a_voxel), rise


def _vertical_shift(carried: Sequence[Array], found: Sequence[Array], rise: float) -> float:
    """Voxels by which carried pictures (n, nz) are higher than those that are found.

    It is the optical flow of Lucas and Kanade, common to all pixels, beside the brightness of each picture and one that
    changes linearly with height. Smoke may dissolve on its way, which a known rise gives, but none appears there: a
    change the other way is motion.
    """
    products, sums = np.zeros((2, 2)), np.zeros(2)
    for one, other in zip(carried, found, strict=True):
        height = np.linspace(-1, 1, other.shape[1], dtype=np.float32)
        changes = np.stack([np.gradient(other, axis=1).ravel(), (other * height).ravel()])
        brightness = other.ravel() / max(float(np.linalg.norm(other)), 1e-30)
        changes -= np.outer(changes @ brightness, brightness)
        products += changes @ changes.T
        sums -= changes @ one.ravel()
    products[1, 1] *= 1 + BRIGHTNESS_RIDGE
    if not products[0, 0] > 0:
        return 0.0
    higher, brighter = np.linalg.lstsq(products, sums, rcond=None)[0]
    return float(higher if brighter * rise < 0 else sums[0] / products[0, 0])


def _rise(state: SmokeState, compared: Array) -> float:
    """Upward velocity (m/s) of the smoke that is compared, by its own velocity."""
    density = state.density * compared
    upwards = at_centres(state.velocity.faces)[2]
    return float(np.vdot(density, upwards)) / max(float(density.sum(dtype=np.float64)), 1e-30)


def _root(function: Callable[[float], float], start: float) -> float:
    """The root of a function that is nearly linear, by the secant method from 0; 0 where the function does not change.

    Of the package's libraries `scipy.optimize` alone is not in the extension.
    """
    before, at_before, now = 0.0, function(0.0), start
    for _ in range(MAX_SECANT_STEPS):
        at_now = function(now)
        if abs(at_now - at_before) <= RISE_ROUNDING:
            return 0.0
        before, now, at_before = now, now - at_now * (now - before) / (at_now - at_before), at_now
        if abs(now - before) <= PRECISION * abs(now):
            break
    return now


def _dissipation(states: Sequence[SmokeState], dt: float, inlets: Mask) -> float:
    """The rate that brings the mass outside the inlets from that of the carried smoke to that found; at least 0."""
    carried_mass = found_mass = 0.0
    for before, after in pairwise(states):
        carried = advect(before.density, after.velocity, dt, conserve=True)
        carried_mass += float(carried.sum(dtype=np.float64, where=~inlets))
        found_mass += float(after.density.sum(dtype=np.float64, where=~inlets))
    lost = math.log(carried_mass / found_mass) / dt if carried_mass > 0 and found_mass > 0 else 0.0
    return max(0.0, lost)


def find_inflow(states: Sequence[SmokeState], dt: float, marked: Mask | None = None) -> Inflow:
    """Find the inlets of a clip from the states of its last frames, two at least, `dt` seconds apart.

    Inlets that are known are marked (nx, ny, nz); otherwise they are found from what the velocities do not explain.
    """
    voxels = _detect_inlets(states, dt) if marked is None else marked
    return Inflow(ndimage.binary_dilation(voxels, np.ones((3, 3, 3)), MARGIN_VOXELS), states)


def _detect_inlets(states: Sequence[SmokeState], dt: float) -> Mask:
    """The voxels of inlets by the mean over all frames, for inlets stand still and errors do not."""
    changes = []
    for before, after in pairwise(states):
        carried = advect(before.density, after.velocity, dt)
        largest = np.maximum(after.density, carried)
        changes.append((after.density - carried) / max(largest.max(), np.float32(1e-30)))
    entering = inlet_score(changes, largest > SMOKE_THRESHOLD * largest.max()) > MIN_SCORE
    middle = len(states) // 2
    lasting = np.minimum.reduce([_blurred_mean(part) for part in (changes[:middle], changes[middle:]) if part])
    outflow = sum(map(_outflow, states[1:]), _outflow(states[0]))
    return _strongest_inlets(entering, _blurred_mean(changes), lasting, outflow)


def inlet_score(changes: Sequence[Array], smoke: Mask) -> Array:
    """Return how surely smoke enters in each voxel (nx, ny, nz), from 0 to 1.

    The changes, one at least, are what the velocity leaves unexplained of each step, in units of the largest density.
    """
    mean, magnitude = _blurred_mean(changes), _blurred_mean([np.abs(change) for change in changes])
    typical = float(np.median(np.abs(mean[smoke]))) if smoke.any() else 0.0
    if typical == 0.0:
        return np.zeros(mean.shape, np.float32)
    coherent = _ramp(mean / (magnitude + MIN_RESIDUAL_FRACTION), COHERENCE)
    strong = _ramp(mean / np.float32(typical), STRENGTH)
    prominent = _ramp(mean / max(np.max(coherent * mean), MIN_RESIDUAL_FRACTION), PROMINENCE)
    return np.asarray(coherent * strong * prominent)


def _blurred_mean(changes: Sequence[Array]) -> Array:
    """The mean over steps and over a few voxels."""
    return _core.blur(sum(changes[1:], changes[0]) / np.float32(len(changes)), BLUR_VOXELS, 3.0)


def _ramp(values: Array, ends: tuple[float, float]) -> Array:
    low, high = ends
    return np.clip((values - np.float32(low)) / np.float32(high - low), 0, 1)


def _outflow(state: SmokeState) -> Array:
    """Smoke that flows from each voxel into others of the box, less what flows from there into it, times m/s."""
    outflow = np.zeros_like(state.density)
    for axis, component in enumerate(state.velocity.faces):
        density, flow = np.moveaxis(state.density, axis, 0), np.moveaxis(component, axis, 0)[1:-1]
        through = 0.5 * flow * (density[1:] + density[:-1])
        along = np.moveaxis(outflow, axis, 0)
        along[:-1] += through
        along[1:] -= through
    return outflow


def _strongest_inlets(entering: Mask, strength: Array, lasting: Array, outflow: Array) -> Mask:
    """The connected components of voxels (nx, ny, nz) in which most smoke enters all the time, and goes into the box.

    Where smoke gathers before it leaves the box, more appears than velocities explain as well; it flows in from there.
    """
    labels, count = ndimage.label(entering)
    if count == 0:
        return entering
    numbers = np.arange(1, count + 1)
    entered, lasted, left = (ndimage.sum_labels(each, labels, numbers) for each in (strength, lasting, outflow))
    entered = np.where(left > 0, entered, 0)
    return np.asarray(np.isin(labels, numbers[(entered > 0) & (lasted >= MIN_LASTING_FRACTION * entered.max())]))
