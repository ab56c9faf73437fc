"""Baked smoke before a plate: the clip that a camera would film, scene files that know more or less, and the truth."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.accuracy.scenes import VIEWS, camera_of
from benchmarks.background.clips import FPS, Smoke, drift, eight_bits, exposed, noisy
from benchmarks.extraction.plates import BLACK, plate, plate_name
from benchmarks.truth.clip import write_video
from smokelift import Background, Camera, ClipSource, Scene
from smokelift.evaluation.truth import Truth, on_grid
from smokelift.footage.images import Picture
from smokelift.output.images import write_image
from smokelift.render import scene_renderer
from smokelift.scene import completed

GIVEN, FRAME, UNKNOWN = KNOWN = ("given", "frame", "unknown")
"""What a scene file knows of the plate: the picture, a frame of the clip without smoke, or nothing."""

CRF = 18
"""Quality of H.264 at which a compressed clip is hard to tell from its original."""

Half = npt.NDArray[np.float16]

WITH_EMPTY_SET = "with_empty_set.mp4"
"""File of the clip that begins with one frame without smoke."""

TRUTH = "element.npz"
"""File of a composed scene with its true element."""


@dataclass(frozen=True, eq=False)
class BakedSmoke:
    """A scene of `benchmarks.truth.picture` or one that has the same files.

    Attributes
    ----------
    name
        Of the scene.
    scene
        Camera, box, medium and lights; no clip and no background.
    front
        What the clip's camera sees of the smoke alone.
    densities : (frames, x, y, z)
        In the scene's box.
    cameras, pictures
        Of the new views by the keys of `VIEWS`; linear grey radiance before black (frames, rows, columns).
    """

    name: str
    scene: Scene
    front: Smoke
    densities: Half
    cameras: dict[str, Camera]
    pictures: dict[str, Half]

    @staticmethod
    def load(folder: Path, frames: int) -> BakedSmoke:
        """Read a scene's first frames.

        Where the transmittance of the front is not stored, Smokelift's renderer computes it from the true densities.
        """
        densities = Truth.load(folder / "truth.npz").densities[:frames]
        scene = replace(Scene.load(folder / "scene.toml"), clip=None, background=None)
        (_, front_name), *others = VIEWS.items()
        with np.load(folder / f"{front_name}.npz") as file:
            radiance = file["image"][:frames].astype(np.float32)
            clear = file["transmittance"][:frames].astype(np.float32) if "transmittance" in file else None
        if clear is None:
            clear = _transmittance(scene, densities)
        pictures = {}
        for view, name in others:
            with np.load(folder / f"{name}.npz") as file:
                pictures[view] = file["image"][:frames]
        cameras = {view: camera_of(folder / f"{name}.toml") for view, name in others}
        return BakedSmoke(folder.name, scene, Smoke(radiance, clear), densities, cameras, pictures)


@dataclass(frozen=True)
class Filming:
    """What a camera does to the picture.

    Attributes
    ----------
    crf
        Of H.264; a larger number loses more.
    noise
        Standard deviation of white noise, a fraction of the range of sRGB values.
    drifts
        Whether exposure and white balance drift as `benchmarks.background.clips.drift` says.
    """

    crf: int = CRF
    noise: float = 0.0
    drifts: bool = False

    @property
    def name(self) -> str:
        """What tells a clip from the usual one: nothing, or "-crf30-noise2-drift" with 2 % of noise."""
        compressed = "" if self.crf == CRF else f"-crf{self.crf}"
        noised = f"-noise{100 * self.noise:.3g}" if self.noise else ""
        return compressed + noised + ("-drift" if self.drifts else "")

    def filmed(self, pictures: Picture) -> Picture:
        """Return linear pictures (frames, rows, columns, 3) as sRGB values with what the camera adds."""
        count = len(pictures)
        encoded = exposed(pictures, drift(count) if self.drifts else np.ones(count))
        return noisy(encoded, self.noise) if self.noise else encoded


@dataclass(frozen=True, eq=False)
class Composed:
    """The true element of a composed clip.

    Attributes
    ----------
    radiance, transmittance : (frames, rows, columns)
        Of the smoke alone; linear and grey, and the fraction of the plate's light that passes.
    plate : (rows, columns, 3)
        Linear.
    """

    radiance: Picture
    transmittance: Picture
    plate: Picture

    @staticmethod
    def load(folder: Path) -> Composed:
        """Read what `compose` wrote."""
        with np.load(folder / TRUTH) as file:
            return Composed(*(file[name].astype(np.float32) for name in ("radiance", "transmittance", "plate")))

    def save(self, folder: Path) -> None:
        """Write it; radiance and transmittance are rounded to half precision."""
        np.savez_compressed(
            folder / TRUTH,
            radiance=self.radiance.astype(np.float16),
            transmittance=self.transmittance.astype(np.float16),
            plate=self.plate,
        )

    def picture(self, frame: int) -> Picture:
        """Return what the camera sees in a frame, linear (rows, columns, 3), before it adds anything."""
        shown = Smoke(self.radiance[frame], self.transmittance[frame]).before(self.plate)
        return np.asarray(shown, np.float32)

    def frames(self, frames: Sequence[int]) -> Composed:
        """Return some frames of it."""
        numbers = list(frames)
        return replace(self, radiance=self.radiance[numbers], transmittance=self.transmittance[numbers])


def folder_name(scene: str, plate_of: str, filming: Filming) -> str:
    """Return the folder of a composed scene, such as "plume-1-planks-crf30"."""
    return f"{scene}-{plate_name(plate_of)}{filming.name}"


def compose(smoke: BakedSmoke, behind: str, filming: Filming, out: Path) -> Composed:
    """Put smoke before a plate and write everything into a folder, unless that is done already.

    The folder gets clip.mp4, `WITH_EMPTY_SET`, plate.png, the true element as `TRUTH`, and a scene file for each of
    `KNOWN`. It appears whole or not at all.

    Parameters
    ----------
    smoke
        What passes before the plate.
    behind
        The plate, as `benchmarks.extraction.plates.plate` takes it.
    filming
        What the camera adds.
    out
        The folder.

    Raises
    ------
    ValueError
        If the folder has another number of frames, or the plate cannot be read.
    """
    front = smoke.front
    if out.is_dir():
        composed = Composed.load(out)
        if len(composed.radiance) != len(front.radiance):
            raise ValueError(
                f"{out}: has {len(composed.radiance)} frames, not {len(front.radiance)}; take another OUT."
            )
        return composed
    composed = Composed(front.radiance, front.transmittance, plate(behind, *front.radiance.shape[1:]))
    part = out.with_name(f"{out.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    composed.save(part)
    write_image(part / "plate.png", composed.plate)
    pictures = filming.filmed(front.before(composed.plate))
    write_video(part / "clip.mp4", list(eight_bits(pictures)), FPS, filming.crf)
    scene = replace(smoke.scene, clip=ClipSource(part / "clip.mp4"))
    known = Background(color=(0.0, 0.0, 0.0)) if behind == BLACK else Background(image=part / "plate.png")
    replace(scene, background=known).save(part / f"{GIVEN}.toml")
    scene.save(part / f"{UNKNOWN}.toml")
    # the whole clip begins when the set is empty; the part in use does not hold that
    empty = np.concatenate([composed.plate[None], front.before(composed.plate)])
    write_video(part / WITH_EMPTY_SET, list(eight_bits(filming.filmed(empty))), FPS, filming.crf)
    used = ClipSource(part / WITH_EMPTY_SET, frames=(1, len(front.radiance)))
    replace(scene, clip=used, background=Background(frame=(0,))).save(part / f"{FRAME}.toml")
    part.rename(out)
    return composed


def _transmittance(scene: Scene, densities: Half) -> Picture:
    """Return the fraction of light (frames, rows, columns) that passes densities on the way to a scene's camera."""
    x, y, z = densities.shape[1:]
    renderer = scene_renderer(on_grid(completed(scene), (x, y, z)), None, np.zeros(3, np.float32))
    found = []
    for density in densities:
        renderer.image(np.ascontiguousarray(density, np.float32))
        found.append(renderer.transmittance)
    return np.stack(found)
