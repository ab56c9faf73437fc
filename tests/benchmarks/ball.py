"""The scene of the benchmarks' tests: a box of smoke in the sun, and cameras in front of it and at its right."""

import numpy as np

from benchmarks.baked import FRONT
from smokelift import Camera, DirectionalLight, Domain, Medium, Scene, Velocity
from smokelift.evaluation.truth import Truth


def cameras(size: tuple[int, int]) -> dict[str, Camera]:
    """Return both cameras by the keys of `VIEWS`."""
    places = {FRONT: (0.0, -7.0, 1.5), "90": (7.0, 0.0, 1.5)}
    return {view: Camera.look_at(at, (0, 0, 1.5), fov_y_degrees=30, size=size) for view, at in places.items()}


def scene(grid: tuple[int, int, int], size: tuple[int, int], extinction: float) -> Scene:
    """Return what a reconstruction of it is given."""
    return Scene(
        camera=cameras(size)[FRONT],
        domain=Domain((-1, -1, 0), (1, 1, 3), grid),
        medium=Medium(extinction, 0.8),
        lights=(DirectionalLight((-0.4, 0.5, -0.8), (8, 8, 8)),),
        scattering="single",
    )


def truth(densities: np.ndarray, voxel_size: float, speed: float = 0.0) -> Truth:
    """Return the truth of densities [frame, x, y, z] that rise at a speed (m/s)."""
    faces = Velocity.zero(densities.shape[1:], voxel_size).faces
    faces[2][:] = speed
    count = len(densities)
    return Truth(
        densities=densities.astype(np.float16),
        faces=tuple(np.stack([face] * count).astype(np.float16) for face in faces),
        inflow_packed=np.zeros((count, densities[0].size // 8), np.uint8),
        voxel_size=voxel_size,
        fps=24.0,
        closed=(),
    )
