"""A sequence of a few voxels, made up of noise."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from smokelift import Sequence, Velocity
from smokelift.output import vdb
from smokelift.output.writer import SequenceWriter
from smokelift.scene import Camera, ClipSource, DirectionalLight, Domain, Scene, completed

SCENE = completed(
    Scene(
        clip=ClipSource(Path("/footage/smoke.mp4"), 24.0),
        camera=Camera.look_at((0, -7, 1.5), (0, 0, 1.5), fov_y_degrees=30, size=(32, 48)),
        domain=Domain((-1, -1, 0), (1, 1, 3), (8, 8, 12)),
        lights=(DirectionalLight((0, 0, -1), (1, 1, 1)),),
        scattering="unshadowed",
    )
)
BURNING = replace(SCENE, medium=replace(SCENE.medium, flame_color=(1.0, 0.4, 0.1)))
SETTINGS = {"quality": "draft", "density": {"iterations": 12}}


def frame(number: int) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Density and velocity of a frame."""
    random = np.random.default_rng(number)
    rho = random.random((8, 8, 12)).astype(np.float32)
    shapes = ((9, 8, 12), (8, 9, 12), (8, 8, 13))
    x, y, z = (random.normal(size=shape).astype(np.float32) for shape in shapes)
    return rho, (x, y, z)


def write(
    directory: Path, numbers: Iterable[int], scene: Scene = SCENE, flame: np.ndarray | None = None, **options: Any
) -> Sequence:
    """Write frames, the first perhaps with a flame, and complete the sequence."""
    with SequenceWriter(directory, scene, SETTINGS, **{"npz": True, **options}) as writer:
        for number in numbers:
            writer.write(number, *frame(number), {"loss": 1.0 / number}, flame=flame)
            flame = None
    return Sequence.open(directory)


def at_rest(scene: Scene, densities: Iterable[np.ndarray], directory: Path) -> Sequence:
    """Volumes without motion as a finished sequence."""
    rest = Velocity.zero(scene.domain.resolution, scene.domain.voxel_size).faces
    with SequenceWriter(directory, completed(scene), {}, npz=True) as writer:
        for number, density in enumerate(densities, 1):
            writer.write(number, density, rest)
    return Sequence.open(directory)


def names(directory: Path) -> list[str]:
    """What is in a directory."""
    return sorted(file.name for file in directory.iterdir())


def has_vdb() -> bool:
    """Whether there is an OpenVDB module."""
    try:
        vdb.vdb_module()
    except vdb.VdbUnavailable:
        return False
    return True


needs_vdb = pytest.mark.skipif(not has_vdb(), reason="needs an OpenVDB module")
