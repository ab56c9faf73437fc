"""The background behind a camera that turns: one wide picture, of which each frame shows a part."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from PIL import Image
from scipy.spatial.transform import Rotation

from smokelift.footage.alignment import Lens
from smokelift.footage.behind_smoke import DETAIL
from smokelift.footage.clear_picture import clear_picture
from smokelift.footage.clip import Clip
from smokelift.footage.exposure import sample_gains, small
from smokelift.footage.images import Picture, linear_to_srgb
from smokelift.footage.noise import Noise, block_means, lasting_noise, noise_about, some_blocks
from smokelift.footage.plate import Plate, noise_before
from smokelift.footage.seen import median_of_seen
from smokelift.footage.turning import Turns, file_turns

WIDEST = 3.0
"""Width and height of the wide picture over those of a frame, at most: beyond, what is far aside gets ever larger on a
flat picture."""

SAMPLE_BYTES = 512 * 2**20
"""Memory for the frames from which the wide picture is made."""

PADDING = 8
"""Pixels by which a frame is continued beyond its border, so that it can be smoothed there as a still one is."""


@dataclass(frozen=True, eq=False)
class WidePicture:
    """The picture of a camera that stands still in the mean pose and sees all that any frame shows.

    Attributes
    ----------
    turns
        Of the frames.
    left, top
        Of the wide picture, in pixels of the mean pose's.
    size
        Its width and height.
    """

    turns: Turns
    left: int
    top: int
    size: tuple[int, int]

    @staticmethod
    def around(turns: Turns) -> WidePicture:
        """Return the one that holds all frames.

        Raises
        ------
        ValueError
            If the camera turns too far for a flat picture.
        """
        width, height = turns.lens.size
        corners = turns.lens.rays(np.array([[0, 0], [width, 0], [0, height], [width, height]], np.float64))
        rays = np.concatenate([turn.apply(corners) for turn in turns.rotations])
        places = turns.lens.pixels(rays)
        low, high = np.floor(places.min(0)), np.ceil(places.max(0))
        if (rays[:, 2] <= 0).any() or ((high - low) > WIDEST * np.array([width, height])).any():
            raise ValueError(
                "The camera turns too far to be steadied against the background; track it in Blender, and give its "
                "camera and a clean plate, or use fewer frames."
            )
        (left, top), (across, down) = low.astype(int), (high - low).astype(int)
        return WidePicture(turns, int(left), int(top), (int(across), int(down)))

    @property
    def lens(self) -> Lens:
        """Lens of the wide picture."""
        x, y = self.turns.lens.centre
        return Lens(self.size, self.turns.lens.focal, (x - self.left, y - self.top))

    def resized(self, width: int, height: int) -> WidePicture:
        """Return the one of frames with another number of pixels."""
        return WidePicture.around(replace(self.turns, lens=self.turns.lens.resized(width, height)))

    def spread_out(self, picture: Picture, frame: int, padding: int = 0) -> Picture:
        """Return where the pixels of a frame's picture (rows, columns, ...) lie; 0 where it shows nothing.

        With a padding the picture is continued by so many pixels beyond its border.
        """
        lens = self.turns.lens
        width, height = lens.size
        (x, y), margin = lens.centre, 2 * padding
        padded = Lens((width + margin, height + margin), lens.focal, (x + padding, y + padding))
        sides = [(padding, padding), (padding, padding), (0, 0)][: picture.ndim]
        matrix = _between(self.lens, self.turns.rotations[frame].inv(), padded)
        return reprojected(np.pad(picture, sides, mode="edge"), matrix, self.size)

    def part(self, picture: Picture, frame: int) -> Picture:
        """Return the part of a wide picture (rows, columns, ...) that a frame shows."""
        lens = self.turns.lens
        return reprojected(picture, _between(lens, self.turns.rotations[frame], self.lens), lens.size)


@dataclass(frozen=True, eq=False)
class PanoramaPlate:
    """What a camera that turns sees without smoke.

    Attributes
    ----------
    place
        Where the frames lie in the wide picture.
    image : (rows, columns, 3)
        The wide picture, linear.
    confidence : (rows, columns)
        As in `smokelift.footage.plate.Plate`.
    errors : (3, 3)
        As there.
    noise
        Of the footage before it.
    cuts
        As in `smokelift.footage.plate.ChangingPlate`.
    """

    place: WidePicture
    image: Picture
    confidence: Picture
    errors: Picture
    noise: Noise
    cuts: tuple[tuple[Callable[[Picture], Picture], float], ...] = ()

    def __post_init__(self) -> None:
        """Remember the last frames: a frame's plate is asked for more than once."""
        object.__setattr__(self, "at", lru_cache(maxsize=2)(self.at))

    def at(self, frame: int) -> Plate:
        """Return the plate of a frame of the footage, counted from 0."""
        image, confidence = (self.place.part(wide, frame) for wide in (self.image, self.confidence))
        plate = Plate(image, np.clip(confidence, 0, 1), self.noise, self.errors)
        for cut, pixels in self.cuts:
            plate = plate.through(cut, pixels)
        return plate

    def through(self, cut: Callable[[Picture], Picture], pixels: float = 1.0) -> PanoramaPlate:
        """Return the plates of a part of the picture, or of a smaller one; see `Plate.through`."""
        return replace(self, cuts=(*self.cuts, (cut, pixels)))


def estimate_panorama(clip: Clip, turns: Turns, sample_count: int = 32) -> PanoramaPlate:
    """Estimate the background of a clip whose camera turns, from its shot in the file, whatever is trimmed.

    Parameters
    ----------
    clip
        The footage.
    turns
        Of its camera.
    sample_count
        Frames that are sampled, spread evenly; fewer of very large pictures.

    Raises
    ------
    ClipError
        If a frame cannot be read.
    ValueError
        If the camera turns too far for a flat picture.
    """
    place = WidePicture.around(turns)
    samples, seen = wide_samples(clip, place, sample_count)
    deviations = linear_to_srgb(samples)
    deviations[~seen] = np.nan
    deviations -= median_of_seen(deviations)
    noise = noise_about(np.stack([some_blocks(each) for each in deviations]), block_means(deviations))
    found = clear_picture(samples, seen, noise, DETAIL, masked=False)
    plates = PanoramaPlate(place, found.image, found.known.astype(np.float32), found.errors, lasting_noise(0.0))
    return replace(plates, noise=noise_before(plates, clip))


def wide_samples(clip: Clip, place: WidePicture, count: int) -> tuple[Picture, npt.NDArray[np.bool_]]:
    """Return frames spread over a clip's shot in its file as parts of the wide picture, all of one exposure.

    Returns
    -------
    samples : (frames, rows, columns, 3)
        Linear.
    seen : (frames, rows, columns) bool
        What each frame shows.
    """
    columns, rows = place.size
    whole, of_file = clip.whole(), sorted(file_turns(clip, place.turns).items())
    chosen = np.linspace(
        0, len(of_file) - 1, min(count, max(3, SAMPLE_BYTES // (12 * columns * rows)), len(of_file))
    ).round()
    numbers, rotations = zip(*(of_file[int(n)] for n in chosen), strict=True)
    place = replace(place, turns=replace(place.turns, rotations=Rotation.concatenate(rotations)))
    all_of_it = np.ones(clip.size[::-1], np.float32)
    parts = [all_of_it if (own := whole.seen(n, *clip.size)) is None else own.astype(np.float32) for n in numbers]
    seen = np.stack([place.spread_out(part, n) > 0.5 for n, part in enumerate(parts)])
    tiny = []
    for n, (number, shown) in enumerate(zip(numbers, seen, strict=True)):
        wide = place.spread_out(whole.frame(number), n)
        wide[~shown] = np.nan
        tiny.append(small(wide))
    gains = sample_gains(np.stack(tiny))
    samples = np.empty((len(numbers), rows, columns, 3), np.float32)
    for n, (sample, number, gain) in enumerate(zip(samples, numbers, gains, strict=True)):
        sample[...] = place.spread_out(whole.frame(number), n, PADDING) / gain
    return samples, seen


def reprojected(picture: Picture, matrix: npt.NDArray[np.float64], size: tuple[int, int]) -> Picture:
    """Return a picture (rows, columns, ...) as a homography shows it, by cubic interpolation; 0 where it shows nothing.

    Parameters
    ----------
    picture
        None of its values is negative.
    matrix : (3, 3)
        From places in the new picture to places in the old one, in pixels whose centres are at half integers.
    size
        Width and height of the new picture.
    """
    numbers = (matrix / matrix[2, 2]).ravel()[:8]
    if picture.ndim == 3:
        channels = [reprojected(picture[..., channel], matrix, size) for channel in range(picture.shape[2])]
        return np.stack(channels, -1)
    whole = Image.fromarray(np.ascontiguousarray(picture, np.float32))
    turned = whole.transform(size, Image.Transform.PERSPECTIVE, numbers.tolist(), Image.Resampling.BICUBIC)
    return np.maximum(np.asarray(turned, np.float32), 0)


def _between(lens: Lens, turn: Rotation, other: Lens) -> npt.NDArray[np.float64]:
    """The homography (3, 3) from pixels of one lens to those of another, whose directions are turned."""
    return np.asarray(other.matrix() @ turn.as_matrix() @ np.linalg.inv(lens.matrix()))
