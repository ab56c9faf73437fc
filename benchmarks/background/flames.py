"""Reconstruct fire in baked smoke whose emission is known.

    python -m benchmarks.background.flames SCENES/plume-1 SCENES/two-1 ... [--clips FOLDER]

A scene is a folder that `benchmarks.truth.bake` and `benchmarks.truth.picture` filled. The fire is what Mantaflow makes
of a reactant: it enters with the smoke, goes where the true velocity carries it, is burnt up after `BURNING` seconds,
and shines as its square root. It burns in the baked smoke, or beneath it: with less smoke the more of the reactant is
left.
One frame before black, at eight bits, with the camera and the box given. Pictures are integrated at half-voxel steps,
without the renderer that is measured: smoke of one source radiance, and the fire's light behind it.
With FOLDER nothing is reconstructed: the clips of that fire are written for `benchmarks.blender.beside_the_clip`.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from unittest import mock

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from benchmarks.background.clips import exposed, filmed
from smokelift.evaluation.truth import Truth
from smokelift.footage.clip import Clip
from smokelift.output.images import write_image
from smokelift.pipeline import Frame, reconstruct
from smokelift.render import scene_optics
from smokelift.render.emission import emitted
from smokelift.scene import ClipSource, CompleteScene, Scene, completed, orbit
from smokelift.scene.projection import ray_through_pixels
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot
from smokelift.transport import at_centres
from smokelift.velocity.pyramid import coarsen

Array = npt.NDArray[np.float32]

FRAME = 32
BURNING = 0.4
"""Seconds until the reactant is burnt up."""

SOURCE = 0.06
"""Radiance of the thickest smoke: it is dark."""

COLOUR = np.array((1.0, 0.4, 0.08), np.float32)
HOT, COOL = np.array((1.0, 0.6, 0.25), np.float32), np.array((1.0, 0.25, 0.03), np.float32)
"""Colours of reactant that has just entered, and that is nearly burnt up, in a flame of two colours."""

RESOLUTION, THIRD = (32, 32, 48), 16
"""Voxels, and those along z that are the box's lowest third."""


@dataclass(frozen=True)
class Case:
    """What is filmed, and what is given.

    Attributes
    ----------
    level
        Red that the fire adds to the picture, at most; above 1 it is clipped.
    beneath
        Whether it burns beneath the smoke.
    coloured
        Whether it has two colours.
    given
        Whether the smoke's depth is given.
    smoke
        Whether fire is taken for smoke, as it is without being looked for.
    """

    level: float = 0.9
    beneath: bool = False
    coloured: bool = False
    given: bool = False
    smoke: bool = False


CASES = {
    f"{name}, {where}": replace(case, beneath=beneath)
    for where, beneath in (("in smoke", False), ("beneath smoke", True))
    for name, case in {
        "no fire": Case(0.0),
        "read as smoke": Case(smoke=True),
        "fire": Case(),
        "clipped": Case(2.5),
        "two colours": Case(coloured=True),
        "depth given": Case(given=True),
    }.items()
}


@dataclass(frozen=True, eq=False)
class Fire:
    """Fire and smoke on the scene's grid, and their pictures (rows, columns)."""

    density: Array
    emission: Array
    light: Array
    young: Array
    transmittance: Array

    @staticmethod
    def of(truth: Truth, scene: CompleteScene, beneath: bool) -> Fire:
        """Return the fire of a scene."""
        left = next(itertools.islice(reactants(truth), FRAME, None))
        density = truth.densities[FRAME].astype(np.float32) * (1 - left * beneath)
        emission = np.sqrt(left)
        pictures = [integrated(each, density, scene) for each in (emission, emission * left)]
        return Fire(density, emission, pictures[0][0], pictures[1][0], pictures[0][1])

    def picture(self, case: Case) -> tuple[Array, Array]:
        """The picture, and what the fire adds to it (rows, columns, 3)."""
        gain = case.level / self.light.max()
        hot, cool = (HOT, COOL) if case.coloured else (COLOUR, COLOUR)
        added = gain * (self.young[..., None] * hot + (self.light - self.young)[..., None] * cool)
        return SOURCE * (1 - self.transmittance)[..., None] + added, added


def main() -> None:
    """Print what is found, a scene and a case a row."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--clips", type=Path)
    options = parser.parse_args()
    if options.clips is None:
        print("| scene | case | colour | front | amount | side | density: lowest third / above / largest | side |")
    for folder in options.scenes:
        scene = completed(Scene.load(folder / "scene.toml"))
        width, height = scene.camera.size
        scene = replace(scene, camera=scene.camera.resized(width // 2, height // 2))
        truth = Truth.load(folder / "truth.npz")
        fires = {beneath: Fire.of(truth, scene, beneath) for beneath in (False, True)}
        if options.clips is not None:
            for beneath, fire in fires.items():
                _write_clip(options.clips / f"{folder.name}-{'beneath' if beneath else 'in'}", fire, scene)
            continue
        for name, case in CASES.items():
            print(f"| {folder.name} | {name} | {' | '.join(_measured(fires[case.beneath], case, scene))} |", flush=True)


def _measured(fire: Fire, case: Case, scene: CompleteScene) -> Iterator[str]:
    """The fire's colour, error in front, amount and side; sums of the density and its largest, and its side."""
    picture, added = fire.picture(case)
    clip = filmed(np.clip(exposed(picture[None], np.ones(1)), 0, 1), "fire")
    density = coarsen(fire.density)
    places = scene.domain.min[1] + (np.arange(RESOLUTION[1]) + 0.5) * 2 / RESOLUTION[1]
    depth = float(np.average(places, weights=density.sum((0, 2)))) if case.given else None
    with mock.patch("smokelift.setup.fire.fire_share", lambda *_: 0.0) if case.smoke else mock.MagicMock():
        shot, frame = _reconstructed(clip, scene, depth)
    sides = [orbit(scene.camera, scene.domain, 90).resized(32, 48)]
    optics, clear = scene_optics(shot.scene), np.zeros(RESOLUTION, np.float32)
    if frame.flame is None or shot.fire is None:
        yield from ("-", "-", "-", "-")
    else:
        colour = np.array(shot.scene.medium.flame_color, np.float32)
        yield ", ".join(f"{c:.2f}" for c in colour)
        camera = shot.fire.working.camera
        seen = emitted(frame.flame, frame.density, camera, optics)[..., None] * colour
        true = shot.fire.working.cut(np.clip(added, 0, 1))
        yield f"{np.abs(np.clip(seen, 0, 1) - true).sum() / true.sum():.1%}"
        emission = coarsen(fire.emission) * case.level / fire.light.max()
        yield f"{frame.flame.sum() / emission.sum():.2f}"
        yield _alike(*(emitted(each, clear, sides[0], optics) for each in (emission, frame.flame)))
    depth_of = frame.density * shot.scene.medium.extinction
    yield f"{depth_of[..., :THIRD].sum():.0f} / {depth_of[..., THIRD:].sum():.0f} / {depth_of.max():.1f}"
    yield _alike(*(emitted(each, clear, sides[0], optics) for each in (density, frame.density)))


def _write_clip(folder: Path, fire: Fire, scene: CompleteScene) -> None:
    """Two pictures of the moment with what is given of them, and where they show smoke and fire."""
    folder.mkdir(parents=True, exist_ok=True)
    picture, added = fire.picture(Case())
    for number in (1, 2):
        write_image(folder / f"front_{number:04d}.png", np.clip(picture, 0, 1))
    clip = ClipSource(folder / "front_####.png", 24.0)
    Scene(clip=clip, camera=scene.camera, domain=scene.domain, background=scene.background).save(folder / "scene.toml")
    np.savez(folder / "front.npz", transmittance=np.stack([fire.transmittance] * 2), fire=np.stack([added] * 2))


def _alike(true: Array, found: Array) -> str:
    return f"{np.corrcoef(true.ravel(), found.ravel())[0, 1]:.2f}"


def _reconstructed(clip: Clip, scene: CompleteScene, depth: float | None) -> tuple[Shot, Frame]:
    known = Scene(
        camera=scene.camera,
        domain=replace(scene.domain, resolution=RESOLUTION),
        background=scene.background,
    )
    distance = None if depth is None else depth - scene.camera.position[1]
    settings = replace(Settings.preset("draft"), detail=0.0, distance=distance)
    reconstruction = reconstruct(clip, known, settings)
    (frame,) = reconstruction
    return reconstruction.shot, frame


def reactants(truth: Truth) -> Iterator[Array]:
    """Yield what is left of the reactant in every frame, 0 to 1 (nx, ny, nz)."""
    shape = truth.densities.shape[1:]
    left, places = np.zeros(shape, np.float32), np.indices(shape, np.float32)
    for number in range(truth.frames):
        yield left
        entering = np.unpackbits(truth.inflow_packed[number], count=left.size).reshape(shape).astype(bool)
        left = np.where(entering, np.float32(1), left)
        x, y, z = (component[number].astype(np.float32) for component in truth.faces)
        velocity = np.stack(at_centres((x, y, z)))
        came_from = places - velocity / np.float32(truth.fps * truth.voxel_size)
        left = ndimage.map_coordinates(left, came_from, order=1, mode="constant")
        left = np.maximum(left - np.float32(1 / (BURNING * truth.fps)), 0)


def integrated(emission: Array, density: Array, scene: CompleteScene) -> tuple[Array, Array]:
    """The fire's light and the smoke's transmittance (rows, columns), by the midpoint rule at half-voxel steps."""
    low, high = np.array(scene.domain.min), np.array(scene.domain.max)
    voxel = scene.domain.voxel_size
    origin, direction = ray_through_pixels(scene.camera)
    with np.errstate(divide="ignore", invalid="ignore"):
        sides = np.stack([(low - origin) / direction, (high - origin) / direction])
    near, far = sides.min(0).max(-1), sides.max(0).min(-1)
    hit = far > near
    light, clear = np.zeros(near.shape, np.float32), np.ones(near.shape, np.float32)
    for distance in np.arange(near[hit].min(), far[hit].max(), voxel / 2):
        place = np.moveaxis((origin + (distance + voxel / 4) * direction - low) / voxel - 0.5, -1, 0)
        here = [ndimage.map_coordinates(each, place, order=1, mode="constant") for each in (emission, density)]
        passed = np.exp(-scene.medium.extinction * here[1] * voxel / 2)
        light += clear * np.sqrt(passed) * here[0] * voxel / 2
        clear *= passed
    return light, clear


if __name__ == "__main__":
    main()
