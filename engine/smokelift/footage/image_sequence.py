"""Clips that are numbered pictures."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from PIL import Image

from smokelift.checks import Remark
from smokelift.footage.frame_source import (
    DEFAULT_FPS,
    ClipError,
    DamagedFrameError,
    Layer,
    backdrop_of,
    believed_focal_length,
    sample_numbers,
    shown_before,
)
from smokelift.footage.images import READABLE, ImageError, Transfer, area_average, read_layer, reduction
from smokelift.footage.stored_picture import StoredPicture

_EXIF, _FOCAL_LENGTH_IN_35MM_FILM = 0x8769, 0xA405
_OTHER_PATTERN = re.compile(r"[*?]|%\d*d")
"""How a shell or another program writes the number of a picture."""


class ImageSequence:
    """Numbered pictures on disk, or a single one.

    Parameters
    ----------
    path
        A pattern ``frame_####.png`` (each # a digit at least), the first picture of a sequence, or one picture without
        a number.
    transfer
        As in `Clip.open`.
    fps
        What the user gives; without it there is a warning.

    Raises
    ------
    ClipError
        If there is no such picture, or more are missing than there are.
    """

    def __init__(self, path: Path, transfer: Transfer | None, fps: float | None) -> None:
        self.files = tuple(_numbered(path))
        self._transfer = transfer
        self.count = len(self.files)
        self.fps = DEFAULT_FPS
        self.warning = None
        if fps is None and self.count > 1:
            self.warning = Remark("pictures without a frame rate", {"path": str(path), "fps": DEFAULT_FPS})
        self.lens = _focal_length(self.files[0])
        self._shape: tuple[int, ...] | None = None
        self.backdrop = backdrop_of(self._samples())

    @property
    def notes(self) -> tuple[Remark, ...]:
        """That the pictures are reduced, if they are."""
        if self._shape is None or reduction(*self._shape[:2]) == 1:
            return ()
        height, width = self._shape[:2]
        small = tuple(round(side / reduction(width, height)) for side in (width, height))
        return (Remark("scaled pictures", {"size": (width, height), "scaled": small}),)

    def read(self, n: int) -> StoredPicture:
        """Return a picture, or raise ClipError if it is damaged or of another size than the first."""
        image = shown_before(self._layer(n), self.backdrop)
        self._shape = self._shape or image.shape
        if image.shape != self._shape:
            raise ClipError(
                f"{self.files[n]}: is {image.shape[1]} x {image.shape[0]} pixels, "
                f"the first picture {self._shape[1]} x {self._shape[0]}"
            )
        height, width = image.shape[:2]
        divisor = reduction(width, height)
        return StoredPicture(area_average(image, round(width / divisor), round(height / divisor)))

    def _layer(self, n: int) -> Layer:
        try:
            return read_layer(self.files[n], self._transfer)
        except ImageError as error:
            raise DamagedFrameError(str(error)) from error

    def _samples(self) -> Iterator[Layer]:
        """Some pictures; the first alone if that has no alpha channel."""
        for n in sample_numbers(self.count):
            with suppress(DamagedFrameError):
                layer = self._layer(n)
                yield layer
                if layer[1] is None:
                    return

    def damaged(self, first: int, last: int) -> tuple[int, ...]:
        """Return which pictures from one to another are missing or cannot be read."""
        damaged = []
        for n in range(first, last + 1):
            try:
                self.read(n)
            except DamagedFrameError:
                damaged.append(n)
        return tuple(damaged)

    def close(self) -> None:
        """Nothing is held open."""


def is_pattern(path: Path) -> bool:
    """Return whether a path stands for numbered pictures: its last row of # for the number, unless it is a file."""
    return "#" in path.name and not path.is_file()


def is_video(path: Path) -> bool:
    """Return whether a path, to judge by its name, is that of a video, not of one or more pictures."""
    return not is_pattern(path) and path.suffix.lower() not in READABLE


def _focal_length(path: Path) -> float | None:
    """The focal length in the EXIF of a picture, in millimetres on 35 mm film; None if there is none."""
    try:
        with Image.open(path) as picture:
            return believed_focal_length(picture.getexif().get_ifd(_EXIF).get(_FOCAL_LENGTH_IN_35MM_FILM))
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):  # no picture that has such tags
        return None


def _numbered(path: Path) -> list[Path]:
    """Return the pictures of a sequence in order, or raise ClipError if most are missing."""
    hashes = re.fullmatch(r"(.*?)(#+)([^#]*)", path.name) if is_pattern(path) else None
    digits = re.fullmatch(r"(.*?)(\d+)(\.[^.]+)", path.name)
    named = hashes or digits
    if named is None or (hashes is None and not path.is_file()):
        if not path.is_file():
            hint = "; give numbered pictures as frame_####.png" if _OTHER_PATTERN.search(path.name) else ""
            raise ClipError(f"{path}: no such file{hint}")
        return [path]
    prefix, number, suffix = named.groups()
    found: dict[int, Path] = {}
    if path.parent.is_dir():
        pattern = re.compile(re.escape(prefix) + rf"(\d{{{len(number)},}})" + re.escape(suffix))
        matches = ((pattern.fullmatch(file.name), file) for file in path.parent.iterdir())
        found = {int(match[1]): file for match, file in matches if match}
    start = min(found, default=0) if hashes else int(number)
    if start not in found:
        raise ClipError(f"{path}: no such pictures; check the folder and the name")
    later = [n for n in found if n >= start]
    last = max(later)
    if last - start + 1 > 2 * len(later):
        missing = next(n for n in range(start, last) if n not in found)
        name = path.with_name(f"{prefix}{missing:0{len(number)}d}{suffix}")
        raise ClipError(
            f"{name}: this picture is missing, as are most up to {found[last].name}; give the "
            "first picture of a sequence without such gaps"
        )
    return [found.get(n) or path.with_name(f"{prefix}{n:0{len(number)}d}{suffix}") for n in range(start, last + 1)]
