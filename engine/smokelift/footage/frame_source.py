"""Frames as they are stored, read in linear light; what a clip format implements, and that of numbered pictures."""

import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from PIL import Image

import smokelift._core as _core
from smokelift.checks import Finding
from smokelift.footage.image_files import (
    DECODERS,
    FOREIGN_ERRORS,
    READABLE,
    Association,
    Decoder,
    ImageError,
    Layer,
    PictureKindError,
    Transfer,
    association,
    encoded_values,
    linear_layer,
    may_be_straight,
    read_stored,
    readable_size,
)
from smokelift.footage.images import Codes, Picture, area_average, area_weights, linear_to_srgb, look_up

DEFAULT_FPS = 24.0
"""Frames per second if neither the file nor the user gives a rate: that of film."""

FOCAL_LENGTHS = (4.0, 2000.0)
"""Focal lengths in millimeters on 35 mm film, from a fisheye to a telescope; others, often 0, mean it is unknown."""

OPAQUE = 0.999
"""Alpha from which on a pixel is opaque: less than a step of 8 bits below 1."""

MAX_ALPHA_BESIDE = 0.5
"""Mean alpha below which the pictures beside opaque ones show that they lack theirs: smoke does not go from half of a
picture, or less, to opaque all over it and back."""

Edges = npt.NDArray[np.int32]
Sample = TypeVar("Sample")
Value = TypeVar("Value", np.float32, np.uint16)

_OTHER_PATTERN = re.compile(r"[*?]|%\d*d")
"""How a shell or another program writes the number of a picture."""


class ClipError(ValueError):
    """A clip, or a frame of it, that cannot be read."""


class DamagedFrameError(ClipError):
    """A frame that is missing or cannot be decoded; those around it may be sound."""


@dataclass(frozen=True, eq=False)
class StoredPicture:
    """A picture in linear values, or in codes for them: 8 bit codes take a quarter of the memory.

    ``values`` (rows, columns, 3) are linear float32, or uint8 or uint16 codes, row 0 at the top. ``table`` (n,) float32
    is the linear value of each code, None if the values are linear. ``alpha`` (rows, columns) is that of a picture of
    the file which has it, and is shown over the `alpha_background`; None of others, and of what is made of pictures.
    """

    values: npt.NDArray[Any]
    table: Picture | None = None
    alpha: Picture | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.values.shape[1], self.values.shape[0]

    def linear(self) -> Picture:
        """Return the linear picture (rows, columns, 3), which may be read-only."""
        return self.values if self.table is None else look_up(self.table, self.values)

    def cut(self, part: Callable[[npt.NDArray[Any]], npt.NDArray[Any]]) -> "StoredPicture":
        """Return the pixels that a function takes, whether they are codes or linear."""
        return StoredPicture(part(self.linear() if self.table is None else self.values), self.table)

    def through(self, change: Callable[[Picture], npt.NDArray[Value]]) -> npt.NDArray[Value]:
        """Return the picture with a function applied to each linear value, computed once for each code."""
        return change(self.linear()) if self.table is None else look_up(change(self.table), self.values)

    def averaged(self, width: int, height: int) -> Picture:
        """Return the `area_average` of the linear picture."""
        lines, rows = None, len(self.values)
        if self.table is not None and self.values.dtype == np.uint8 and 1 <= height < rows:
            weights = area_weights(rows, height)
            lines = _core.sum_lines(self.values, self.table, weights.indptr, weights.indices, weights.data)
        return area_average(self.linear() if lines is None else lines, width, height)

    def add_weighted(self, weights: Picture, edges: tuple[Edges, Edges], sums: Picture) -> None:
        """Add the linear picture, times weights (m, n, 3) of its parts, to sums (rows, columns, 3).

        ``edges`` are the rows (m + 1,) and the columns (n + 1,) where parts begin, and where the last ends.
        """
        if self.table is None or self.values.dtype != np.uint8:
            rows, columns = (np.diff(each) for each in edges)
            sums += self.linear() * np.repeat(np.repeat(weights, rows, axis=0), columns, axis=1)
        else:
            _core.add_weighted(self.values, self.table, weights, *edges, sums)


class FrameSource:
    """The frames of one file or sequence, counted from 0 over the whole of it; a subclass for each kind."""

    count: int
    """Frames that can be read."""
    fps = DEFAULT_FPS
    """Frames a second."""
    warning: Finding | None = None
    """What is said of a defect, else None."""
    files: tuple[Path, ...] = ()
    """The video, or one picture for each frame."""
    lens: float | None = None
    """Focal length in millimeters on 35 mm film (of its diagonal, as CIPA DCG-001 defines it), if the file says it."""
    alpha_background: float | None = None
    """Linear gray shown behind pictures with an alpha channel; None if they are opaque."""
    _held: Association = "straight"

    @property
    def notes(self) -> tuple[Finding, ...]:
        """How the pictures are read, as far as they have been, where that is unusual."""
        return () if self._held == "straight" else (Finding("premultiplied colors", {"held": self._held}),)

    def read(self, n: int) -> StoredPicture:
        """Return a frame; raise `DamagedFrameError` if it cannot be decoded, ClipError if it differs in size."""
        raise NotImplementedError

    def as_held(self, picture: Picture) -> Picture:
        """Return a linear picture (rows, columns, 3) with its colors as coarse as the file holds them."""
        return picture

    def damaged(self, first: int, last: int) -> tuple[int, ...]:
        """Return the frames from one to another, both included, that raise `DamagedFrameError`."""
        damaged = []
        for n in range(first, last + 1):
            try:
                self.read(n)
            except DamagedFrameError:
                damaged.append(n)
        return tuple(damaged)

    def close(self) -> None:
        """Close the file, if one is held open."""

    def shown(self, layer: Layer) -> StoredPicture:
        """Return a picture over the background that alpha leaves open, or over black if there is none."""
        picture, alpha = layer
        if self.alpha_background is None:
            return StoredPicture(picture)
        if alpha is not None and self.alpha_background:
            picture = picture + (np.float32(1.0) - alpha[..., None]) * np.float32(self.alpha_background)
        return StoredPicture(picture, alpha=alpha)

    def _sound_samples(self, read: Callable[[int], Sample]) -> Iterator[Sample]:
        """Read a few frames spread over all, with smoke and without; damaged ones are left out."""
        for n in sorted({0, self.count // 4, self.count // 2, self.count - 1}):
            with suppress(DamagedFrameError):
                yield read(n)

    def _find_matte(self, encoded: Iterable[Picture], decode: Decoder, layers: Iterable[Layer]) -> None:
        """Find how pictures (rows, columns, rgba) of encoded values hold their colors, then the layers' background."""
        self._held = association(encoded, decode)
        self.alpha_background = alpha_background_of(layers)

    def _set_lens(self, value: object) -> None:
        """Take what a file says of the focal length in millimeters, if it says one."""
        with suppress(ValueError):
            focal = float(str(value))
            self.lens = focal if FOCAL_LENGTHS[0] <= focal <= FOCAL_LENGTHS[1] else None


def alpha_background_of(layers: Iterable[Layer]) -> float | None:
    """Return the linear gray to show pictures of a clip over; None if they are opaque, or most have no alpha.

    An alpha channel is the matte of the smoke, whatever stands behind it. Such pictures are shown over a color that is
    known for certain: white behind dark smoke, black behind bright smoke.
    """
    light, opacity, opaque, without = 0.0, 0.0, True, 0
    for picture, alpha in layers:
        without += 1 if alpha is None else -1
        if alpha is not None and mean_alpha(alpha) < 1:
            light += float(picture.mean(-1).sum(dtype=np.float64))
            opacity += float(alpha.sum(dtype=np.float64))
            opaque = False
    if opaque or without > 0:
        return None
    return 1.0 if opacity > 0 and linear_to_srgb(light / opacity) < 0.5 else 0.0


def mean_alpha(alpha: Picture | None) -> float:
    """Return the mean alpha of a picture; 1 if it is opaque."""
    return 1.0 if alpha is None or (alpha >= OPAQUE).all() else float(alpha.mean())


class ImageSequence(FrameSource):
    """Numbered pictures on disk, or a single one, as `numbered_files` finds them.

    ``transfer`` is that of `Clip.open`. There is a warning if the user gives no ``fps``.
    """

    def __init__(self, path: Path, transfer: Transfer | None, fps: float | None) -> None:
        self.files = numbered_files(path)
        self._transfer = transfer
        self.count = len(self.files)
        if fps is None and self.count > 1:
            self.warning = Finding("pictures without a frame rate", {"path": str(path), "fps": DEFAULT_FPS})
        with suppress(*FOREIGN_ERRORS), Image.open(self.files[0]) as picture:
            self._set_lens(picture.getexif().get_ifd(0x8769).get(0xA405))  # FocalLengthIn35mmFilm of Exif
        self._size: tuple[int, int] | None = None
        samples = self._sound_samples(self._stored)
        codes = (stored for stored in samples if not isinstance(stored, tuple) and stored.shape[-1] == 4)
        self._find_matte(map(encoded_values, codes), DECODERS[transfer or "srgb"], self._sound_samples(self._layer))
        layers = (layer for layer in self._sound_samples(self._stored) if isinstance(layer, tuple))
        linear = (np.dstack((values, alpha)) for values, alpha in layers if alpha is not None)
        self._unlikely = self.alpha_background is not None and may_be_straight(linear)
        self._mean_alpha = cache(self._read_mean_alpha)

    @property
    def notes(self) -> tuple[Finding, ...]:
        notes = (*super().notes, *[Finding("perhaps straight colors", doubt=True)] * self._unlikely)
        if self._size is None or self._size == (small := readable_size(*self._size)):
            return notes
        return (*notes, Finding("scaled pictures", {"size": self._size, "scaled": small}))

    def read(self, n: int) -> StoredPicture:
        layer = self._layer(n)
        if self.alpha_background is not None and mean_alpha(layer[1]) == 1 and self._lacks_alpha(n, layer[1] is None):
            raise DamagedFrameError(f"{self.files[n]}: lacks the alpha that the pictures beside it have")
        image = self.shown(layer)
        width, height = image.size
        self._size = self._size or (width, height)
        if (width, height) != self._size:
            raise ClipError(
                f"{self.files[n]}: is {width} x {height} pixels, the first picture {self._size[0]} x {self._size[1]}"
            )
        size = readable_size(width, height)
        alpha = None if image.alpha is None else area_average(image.alpha, *size)
        return StoredPicture(area_average(image.values, *size), alpha=alpha)

    def _lacks_alpha(self, n: int, without: bool) -> bool:
        """Whether pictures beside an opaque one show that it lacks its alpha: those on both sides, if it is not
        ``without`` the channel.
        """
        sides = range(n - 1, -1, -1), range(n + 1, self.count)
        means = [next((mean for mean in map(self._mean_alpha, side) if mean < 1), 1.0) for side in sides]
        return (min if without else max)(means) < MAX_ALPHA_BESIDE

    def _read_mean_alpha(self, n: int) -> float:
        """The mean alpha of a picture; 1 of one that cannot be read."""
        with suppress(DamagedFrameError):
            return mean_alpha(self._layer(n)[1])
        return 1.0

    def _stored(self, n: int) -> Codes | Layer:
        try:
            stored = read_stored(self.files[n])
            if not all(
                np.isfinite(part).all() for part in (stored if isinstance(stored, tuple) else ()) if part is not None
            ):
                raise ImageError(f"{self.files[n]}: holds values that are not finite")
            return stored
        except PictureKindError as error:
            raise ClipError(str(error)) from error
        except ImageError as error:
            raise DamagedFrameError(str(error)) from error

    def _layer(self, n: int) -> Layer:
        return linear_layer(self._stored(n), self._transfer, self._held)


def is_pattern(path: Path) -> bool:
    """Return whether a path stands for numbered pictures: it has a # in its name, and is no file."""
    return "#" in path.name and not path.is_file()


def is_video(path: Path) -> bool:
    """Return whether a path names a video, by its suffix, and not one or more pictures."""
    return not is_pattern(path) and path.suffix.lower() not in READABLE


def numbered_files(path: Path) -> tuple[Path, ...]:
    """Return the files of a sequence, pictures say, in order, with those missing in between.

    The path is a pattern ``frame_####.png`` (its last row of #, each a digit at least, or the sign of a negative
    number), the first file of a sequence, or one without a number. ClipError is raised if there is none, or more are
    missing than there are.
    """
    pattern = is_pattern(path)
    named = re.fullmatch(r"(.*?)(#+)([^#]*)" if pattern else r"(.*?)(\d+)(\.[^.]+)", path.name)
    if not path.is_file() and (named is None or not pattern):
        hint = "; give numbered pictures as frame_####.png" if _OTHER_PATTERN.search(path.name) else ""
        raise ClipError(f"{path}: no such file{hint}")
    if named is None:
        return (path,)
    prefix, number, suffix = named.groups()
    if not pattern and prefix.endswith("-") and 0 in _found(path, prefix[:-1], len(number) + 1, suffix):
        prefix, number = prefix[:-1], f"-{number}"
    digits = len(number)
    found = _found(path, prefix, digits, suffix)
    start = min(found, default=0) if pattern else int(number)
    if start not in found:
        raise ClipError(f"{path}: no such files; check the folder and the name")
    if start < 0 and 0 not in found:
        raise ClipError(
            f"{found[start]}: has a dash before its number, which may be a minus sign; number the pictures from 0 on, "
            f"or give {prefix}-{'#' * max(1, digits - 1)}{suffix}"
        )
    last = max(found)

    def file(n: int) -> Path:
        return found.get(n) or path.with_name(f"{prefix}{n:0{digits}d}{suffix}")

    if last - start + 1 > 2 * sum(n >= start for n in found):
        missing = next(n for n in range(start, last) if n not in found)
        raise ClipError(
            f"{file(missing)}: this file is missing, as are most up to {found[last].name}; give the "
            "first of a sequence without such gaps"
        )
    return tuple(file(n) for n in range(start, last + 1))


def _found(path: Path, prefix: str, digits: int, suffix: str) -> dict[int, Path]:
    """The pictures beside a path by their numbers of at least so many digits, a minus sign counted as one."""
    number = rf"-0*[1-9]\d*|\d{{{digits},}}"
    numbered = re.compile(re.escape(prefix) + rf"({number})" + re.escape(suffix))
    folder = path.parent.iterdir() if path.parent.is_dir() else ()
    found = {match[1]: each for each in folder if (match := numbered.fullmatch(each.name))}
    return {int(number): each for number, each in found.items() if len(number) >= digits}
