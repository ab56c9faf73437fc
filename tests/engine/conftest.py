"""One tiny plume for the tests of everything that needs footage: known volumes, and the pictures of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from smokelift import Background, Camera, ClipSource, DirectionalLight, Domain, Medium, Scene, Settings
from smokelift.output.images import write_image
from smokelift.render import device, render
from smokelift.scene import CompleteScene, View, completed, look_at_matrix, orbit


@pytest.fixture(scope="session", autouse=True)
def on_the_processor() -> None:
    """One device for all tests of a process, whatever their order and whatever GPU is there."""
    device.start("cpu")


FRAMES = 5
FIRST_HEIGHT = 0.45
RISE = 0.075
"""Meters a frame: one and a half voxels."""


@dataclass(frozen=True)
class Plume:
    """A blob of smoke that rises before black.

    Attributes
    ----------
    scene
        Complete; its clip is the rising blob.
    densities
        The true volumes, a frame each.
    """

    scene: Scene
    densities: tuple[np.ndarray, ...]

    @staticmethod
    def blob(scene: Scene, height: float) -> np.ndarray:
        """The volume of a structured blob whose center is so many meters high; exactly 0 outside."""
        domain = scene.domain
        axes = [
            low + (np.arange(n) + 0.5) * domain.voxel_size for low, n in zip(domain.min, domain.resolution, strict=True)
        ]
        x, y, z = np.meshgrid(*axes, indexing="ij")
        z = z - height
        ball = np.exp(-((x / 0.17) ** 2 + (y / 0.17) ** 2 + (z / 0.2) ** 2))
        structure = 1 + 0.5 * np.sin(19 * x) * np.cos(17 * y) * np.sin(15 * z)
        return np.maximum(ball * structure - 0.04, 0).astype(np.float32)

    def write(
        self, folder: Path, densities: Sequence[np.ndarray], scene: Scene | None = None, suffix: str = ".png"
    ) -> Scene:
        """Render volumes into a picture sequence; the scene with that clip."""
        scene = scene or self.scene
        folder.mkdir(parents=True, exist_ok=True)
        for number, density in enumerate(densities):
            write_image(folder / f"frame_{number:04d}{suffix}", render(density, scene, scene.camera.at(number)))
        return replace(scene, clip=ClipSource(folder / f"frame_####{suffix}", fps=24.0))


@pytest.fixture(scope="session")
def plume(tmp_path_factory) -> Plume:
    """The rising blob with its clip."""
    scene = Scene(
        camera=Camera.look_at((0, -4, 0.8), (0, 0, 0.8), fov_y_degrees=27, size=(40, 56)),
        domain=Domain((-0.6, -0.6, 0), (0.6, 0.6, 1.6), (24, 24, 32)),
        medium=Medium(extinction=8.0, albedo=0.9),
        lights=(DirectionalLight((0.3, 0.5, -0.8), (12.0, 11.0, 10.0)),),
        background=Background(color=(0.0, 0.0, 0.0)),
    )
    densities = tuple(Plume.blob(scene, FIRST_HEIGHT + RISE * n) for n in range(FRAMES))
    empty = Plume(scene, densities)
    return replace(empty, scene=empty.write(tmp_path_factory.mktemp("plume"), densities))


@pytest.fixture(scope="session")
def complete(plume) -> CompleteScene:
    """Its scene with all that it leaves out."""
    return completed(plume.scene)


@pytest.fixture(scope="session")
def small(plume) -> Scene:
    """Its scene without a clip, with a picture as fine as the grid."""
    return replace(plume.scene, camera=plume.scene.camera.resized(30, 42), clip=None)


@pytest.fixture(scope="session")
def tracked(plume, tmp_path_factory) -> Scene:
    """The same blob from a camera that goes by, closer, upward and rolling a little."""
    camera = plume.scene.camera
    poses = [
        look_at_matrix((x, -4 + x, 0.8 + x / 2), (0.8 * x, 0, 0.8), (x / 4, 0, 1))
        for x in np.linspace(-0.25, 0.25, FRAMES)
    ]
    scene = replace(plume.scene, camera=replace(camera, matrix=poses[0], matrices=tuple(poses)))
    return plume.write(tmp_path_factory.mktemp("tracked"), plume.densities, scene)


@pytest.fixture(scope="session")
def two_views(plume, tmp_path_factory) -> Scene:
    """The blob behind the middle of the box, from the front and from the side, whose clip began a frame earlier."""
    truth = [np.roll(density, 5, axis=1) for density in plume.densities]
    folder = tmp_path_factory.mktemp("two_views")
    front = plume.write(folder / "front", truth)
    camera = orbit(front.camera, front.domain, 90)
    side = plume.write(folder / "side", [np.zeros_like(truth[0]), *truth], replace(front, camera=camera)).clip
    return replace(front, views=(View(camera, replace(side, frames=(1, FRAMES))),))


@pytest.fixture(scope="session")
def draft() -> Settings:
    """Settings that are quick."""
    return Settings.preset("draft")


@pytest.fixture(scope="session")
def smooth(draft) -> Settings:
    """Settings that are quicker, for what does not ask for detail: making it up takes as long as ten frames."""
    return replace(draft, detail=0.0)
