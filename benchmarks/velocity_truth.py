"""Velocity estimates against known velocities: error inside the smoke, and time in units of a Poisson solve.

    python benchmarks/velocity_truth.py plume/truth.npz puff/truth.npz

A truth file holds ``density`` [frame, x, y, z], ``velocity_x/y/z`` in m/s on faces (that of frame f carries
density f to f + 1), ``inflow_packed`` (np.packbits of the cells where smoke enters), ``voxel_size`` and ``fps``.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
import scipy.fft

from smokelift.velocity import Velocity, VelocitySettings, estimate_velocity, predict_velocity

FIRST, LAST, STEP = 10, 35, 5


class Truth:
    """Densities, velocities and inlet of one scene."""

    def __init__(self, path: Path) -> None:
        with np.load(path) as file:
            self.density = file["density"]
            self.faces = [file[f"velocity_{axis}"] for axis in "xyz"]
            self.inflow_packed = file["inflow_packed"]
            self.voxel_size = float(file["voxel_size"])
            self.dt = 1 / float(file["fps"])

    def inflow(self, frame: int) -> np.ndarray:
        shape = self.density.shape[1:]
        return np.unpackbits(self.inflow_packed[frame])[: np.prod(shape)].reshape(shape).astype(bool)

    def estimate(
        self,
        frame: int,
        settings: VelocitySettings,
        inlet_known: bool = True,
        prediction: Velocity | None = None,
    ) -> Velocity:
        before, after = self.density[frame : frame + 2].astype(np.float32)
        return estimate_velocity(
            before,
            after,
            self.dt,
            self.voxel_size,
            settings,
            inflow=self.inflow(frame) if inlet_known else None,
            prediction=prediction,
        )

    def error(self, velocity: Velocity, frame: int) -> float:
        """Relative L2 error where there is smoke, without the inlet."""
        x, y, z = (component[frame].astype(np.float32) for component in self.faces)
        truth = Velocity((x, y, z), self.voxel_size).centres()
        after = self.density[frame + 1]
        smoke = (after > 0.01 * after.max()) & ~self.inflow(frame)
        return float(np.linalg.norm((velocity.centres() - truth)[smoke]) / np.linalg.norm(truth[smoke]))


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
        truth = Truth(Path(path))
        for name, (settings, inlet_known) in cases.items():
            errors, seconds = [], []
            for frame in range(FIRST, LAST + 1, STEP):
                start = time.perf_counter()
                velocity = truth.estimate(frame, settings, inlet_known)
                seconds.append(time.perf_counter() - start)
                errors.append(truth.error(velocity, frame))
            unit = poisson_seconds(truth.density.shape[1:])
            typical = float(np.median(seconds))
            print(f"{path}: {name}: error {np.mean(errors):.3f}, {typical:.3f} s = {typical / unit:.0f} Poisson solves")
        for inlet_known in (True, False):
            errors, prediction = [], None
            for frame in range(FIRST, FIRST + 10):
                velocity = truth.estimate(frame, VelocitySettings(), inlet_known, prediction)
                errors.append(truth.error(velocity, frame))
                prediction = predict_velocity(velocity, truth.dt)
            known = "known" if inlet_known else "unknown"
            print(f"{path}: ten frames with prediction, inlet {known}: {' '.join(f'{e:.3f}' for e in errors)}")


if __name__ == "__main__":
    main(sys.argv[1:])
