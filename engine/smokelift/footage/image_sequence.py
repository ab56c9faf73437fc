"""Clips of numbered pictures."""

import re
from contextlib import suppress
from pathlib import Path

from PIL import Image

from smokelift.checks import Finding
from smokelift.footage.frame_source import DEFAULT_FPS, ClipError, DamagedFrameError, FrameSource, StoredPicture
from smokelift.footage.images import (
    DECODERS,
    FOREIGN_ERRORS,
    READABLE,
    Codes,
    ImageError,
    Layer,
    PictureKindError,
    Transfer,
    area_average,
    encoded_values,
    linear_layer,
    read_stored,
    readable_size,
)

_OTHER_PATTERN = re.compile(r"[*?]|%\d*d")
"""How a shell or another program writes the number of a picture."""


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

    @property
    def notes(self) -> tuple[Finding, ...]:
        if self._size is None or self._size == (small := readable_size(*self._size)):
            return super().notes
        return (*super().notes, Finding("scaled pictures", {"size": self._size, "scaled": small}))

    def read(self, n: int) -> StoredPicture:
        image = self.shown(self._layer(n))
        height, width = image.shape[:2]
        self._size = self._size or (width, height)
        if (width, height) != self._size:
            raise ClipError(
                f"{self.files[n]}: is {width} x {height} pixels, the first picture {self._size[0]} x {self._size[1]}"
            )
        return StoredPicture(area_average(image, *readable_size(width, height)))

    def _stored(self, n: int) -> Codes | Layer:
        try:
            return read_stored(self.files[n])
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
