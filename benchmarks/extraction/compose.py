"""Baked smoke before a plate: the clip that a camera would film, scene files that know more or less, and the truth."""

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.baked import Baked, Seen
from benchmarks.filming import FPS, drift, eight_bits, exposed, noisy
from benchmarks.plates import plate, plate_name
from benchmarks.truth.clip import write_video
from smokelift import Background, ClipSource
from smokelift.footage.images import Picture
from smokelift.output.images import write_image

GIVEN, FRAME, UNKNOWN = KNOWN = ("given", "frame", "unknown")
"""What a scene file knows of the plate: the picture, a frame of the clip without smoke, or nothing."""

CRF = 18
"""Quality of H.264 at which a compressed clip is hard to tell from its original."""

WITH_EMPTY_SET = "with_empty_set.mp4"
"""File of the clip that begins with one frame without smoke."""

TRUTH = "element.npz"
"""File of a composed scene with its true element."""


@dataclass(frozen=True)
class Filming:
    """What a camera does to the picture.

    Attributes
    ----------
    crf
        Of H.264; a larger number loses more.
    noise
        Standard deviation of white noise in sRGB values; white is 1.
    drifts
        Whether exposure and white balance drift as `benchmarks.filming.drift` says.
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

    def write(self, path: Path, pictures: Picture) -> None:
        """Write linear pictures (frames, rows, columns, 3) as a video, with what the camera adds."""
        encoded = exposed(pictures, drift(len(pictures)) if self.drifts else 1.0)
        write_video(path, list(eight_bits(noisy(encoded, self.noise) if self.noise else encoded)), FPS, self.crf)


@dataclass(frozen=True, eq=False)
class Composed:
    """The true element of a composed clip: what is seen of the smoke alone, and the plate (rows, columns, 3)."""

    seen: Seen
    plate: Picture

    @staticmethod
    def load(folder: Path) -> "Composed":
        """Read what `compose` wrote."""
        with np.load(folder / TRUTH) as file:
            radiance, clear, behind = (file[name].astype(np.float32) for name in ("radiance", "transmittance", "plate"))
        return Composed(Seen(radiance, clear), behind)

    def save(self, folder: Path) -> None:
        """Write it; radiance and transmittance are rounded to half precision."""
        halves = {name: getattr(self.seen, name).astype(np.float16) for name in ("radiance", "transmittance")}
        np.savez_compressed(folder / TRUTH, **halves, plate=self.plate)

    def pictures(self) -> Picture:
        """Return what the camera sees, linear (frames, rows, columns, 3), before it adds anything."""
        return self.seen.before(self.plate)

    def at(self, frames: Sequence[int]) -> "Composed":
        """Return some frames of it."""
        return replace(self, seen=self.seen.at(list(frames)))


def folder_name(scene: str, plate_of: str, filming: Filming) -> str:
    """Return the folder of a composed scene, such as "plume-1-planks-crf30"."""
    return f"{scene}-{plate_name(plate_of)}{filming.name}"


def compose(smoke: Baked, behind: str, filming: Filming, out: Path) -> Composed:
    """Put smoke before a plate and write everything into a folder, unless that is done already.

    The folder gets clip.mp4, `WITH_EMPTY_SET`, plate.png, the true element as `TRUTH`, and a scene file for each of
    `KNOWN`. It appears whole or not at all.

    Parameters
    ----------
    smoke
        What passes before the plate.
    behind
        The plate, as `benchmarks.plates.plate` takes it.
    filming
        What the camera adds.
    out
        The folder.

    Raises
    ------
    ValueError
        If the folder has another number of frames, or the plate cannot be read.
    """
    if out.is_dir():
        composed = Composed.load(out)
        if (count := len(composed.seen.radiance)) != len(smoke):
            raise ValueError(f"{out}: has {count} frames, not {len(smoke)}; take another OUT.")
        return composed
    composed = Composed(smoke.front, plate(behind, *smoke.front.shape))
    part = out.with_name(f"{out.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    composed.save(part)
    write_image(part / "plate.png", composed.plate)
    pictures = composed.pictures()
    filming.write(part / "clip.mp4", pictures)
    scene = replace(smoke.scene, clip=ClipSource(part / "clip.mp4"))
    known = Background(color=(0.0, 0.0, 0.0)) if behind == "black" else Background(image=part / "plate.png")
    replace(scene, background=known).save(part / f"{GIVEN}.toml")
    scene.save(part / f"{UNKNOWN}.toml")
    # the whole clip begins when the set is empty; the part in use does not hold that
    filming.write(part / WITH_EMPTY_SET, np.concatenate([composed.plate[None], pictures]))
    used = ClipSource(part / WITH_EMPTY_SET, frames=(1, len(smoke)))
    replace(scene, clip=used, background=Background(frame=(0,))).save(part / f"{FRAME}.toml")
    part.rename(out)
    return composed
