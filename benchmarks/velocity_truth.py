"""Velocity estimates against known velocities: error inside the smoke, and time in units of a Poisson solve.

    python benchmarks/velocity_truth.py plume/truth.npz puff/truth.npz

benchmarks/truth bakes such files and says what is in them.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
import scipy.fft

from smokelift.truth import Truth
from smokelift.velocity import Velocity, VelocitySettings, estimate_velocity, predict_velocity

FIRST, LAST, STEP = 10, 35, 5


def estimate(
    truth: Truth,
    frame: int,
    settings: VelocitySettings,
    inlet_known: bool = True,
    prediction: Velocity | None = None,
) -> Velocity:
    """Velocity found from the densities of a frame and the next."""
    return estimate_velocity(
        truth.density(frame),
        truth.density(frame + 1),
        truth.dt,
        truth.voxel_size,
        settings,
        inflow=truth.inflow(frame) if inlet_known else None,
        prediction=prediction,
    )


def error(truth: Truth, velocity: Velocity, frame: int) -> float:
    """Relative L2 error where there is smoke, without the inlet."""
    wanted, after = truth.velocity(frame).centres(), truth.density(frame + 1)
    smoke = (after > 0.01 * after.max()) & ~truth.inflow(frame)
    return float(np.linalg.norm((velocity.centres() - wanted)[smoke]) / np.linalg.norm(wanted[smoke]))


def poisson_seconds(shape: tuple[int, ...]) -> float:
    """One cosine transform there and back on two threads, the median of eleven."""
    field = np.random.default_rng(0).standard_normal(shape).astype(np.float32)
    seconds = []
    for _ in range(11):
        start = time.perf_counter()
        scipy.fft.idctn(scipy.fft.dctn(field, workers=2), workers=2)
        seconds.append(time.perf_counter() - start)
    return float(np.median(seconds))


def main(paths: list[str]) -> None:
    cases = {
        "default, inlet known": (VelocitySettings(), True),
        "default, inlet unknown": (VelocitySettings(), False),
        "paper, inlet known": (VelocitySettings(method="paper"), True),
    }
    for path in paths:
        truth = Truth.load(Path(path))
        for name, (settings, inlet_known) in cases.items():
            errors, seconds = [], []
            for frame in range(FIRST, LAST + 1, STEP):
                start = time.perf_counter()
                velocity = estimate(truth, frame, settings, inlet_known)
                seconds.append(time.perf_counter() - start)
                errors.append(error(truth, velocity, frame))
            unit = poisson_seconds(truth.shape)
            typical = float(np.median(seconds))
            print(f"{path}: {name}: error {np.mean(errors):.3f}, {typical:.3f} s = {typical / unit:.0f} Poisson solves")
        for inlet_known in (True, False):
            errors, prediction = [], None
            for frame in range(FIRST, FIRST + 10):
                velocity = estimate(truth, frame, VelocitySettings(), inlet_known, prediction)
                errors.append(error(truth, velocity, frame))
                prediction = predict_velocity(velocity, truth.dt)
            known = "known" if inlet_known else "unknown"
            print(f"{path}: ten frames with prediction, inlet {known}: {' '.join(f'{e:.3f}' for e in errors)}")


if __name__ == "__main__":
    main(sys.argv[1:])
