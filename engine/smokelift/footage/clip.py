"""Clips: videos and picture sequences as lazily decoded linear frames, counted from 0 in the order of their times."""

from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import replace
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from smokelift.checks import Finding
from smokelift.footage.frame_source import (
    ClipError,
    DamagedFrameError,
    FrameSource,
    ImageSequence,
    StoredPicture,
    is_video,
)
from smokelift.footage.image_files import Transfer
from smokelift.footage.images import Picture, reduced_size
from smokelift.footage.mask import Mask, Seen
from smokelift.footage.noise import COMPARED_SIDE
from smokelift.footage.registration import IDENTITY, Read, Similarity, registered, registered_mask
from smokelift.footage.video import Video
from smokelift.scene import ClipSource, SceneError
from smokelift.scene.checks import file_path

STORED_BYTES, LINEAR_BYTES = 128 * 2**20, 64 * 2**20
"""Bytes of memory for kept frames: as stored, twenty of 1080p at 8 bits, since the same ones spread over a clip are
read again; linear, two of 1080p."""

Kept = OrderedDict[int, StoredPicture]
Value = TypeVar("Value")


class Clip:
    """A video or a picture sequence as linear frames.

    Made by :meth:`open`; a context manager. Not for several threads at once. What a clip is made of from another
    (`part`, `changed`, ...) shares the open file with it.

    Attributes
    ----------
    path
        What was opened.
    fps
        Frames a second.
    size
        Width and height in pixels, upright.
    numbers
        The frames' numbers in the file, which has them from 0. Everything outside the engine names frames by these.
    warning
        What is said of a defect (a truncated file, say), else None.
    lens
        Focal length in millimeters on 35 mm film, if the file says it.
    alpha_background
        Linear gray that is shown behind pictures with an alpha channel; None behind opaque ones.
    mask
        What hides a part of the frames, if anything does.
    """

    def __init__(
        self, path: Path, source: FrameSource, fps: float | None = None, frames: tuple[int, int] | None = None
    ) -> None:
        self.path = path
        self.fps = source.fps if fps is None else float(fps)
        self.warning, self.lens, self.alpha_background = source.warning, source.lens, source.alpha_background
        self.mask: Mask | None = None
        self._source = source
        self._damaged = lru_cache(maxsize=None)(source.damaged)
        self._count = source.count
        self._filmed: Read = partial(_kept, Kept(), STORED_BYTES, source.read)
        self._read, self._gain = self._filmed, _no_gain
        self._use(frames or (0, source.count - 1))
        self.size = self.stored(0).size

    @classmethod
    def open(
        cls,
        path: str | Path | ClipSource,
        *,
        fps: float | None = None,
        frames: tuple[int, int] | None = None,
        transfer: Transfer | None = None,
        mask: str | Path | None = None,
    ) -> "Clip":
        """Open a video, or a picture sequence.

        Parameters
        ----------
        path
            A video; a pattern ``frame_####.png`` (each # a digit at least); the first picture of a sequence,
            ``frame_0001.exr``; one picture without a number; or a ClipSource, whose values the arguments
            override.
        fps
            Frames a second of the captured motion; None takes the file's (24 for pictures, with a warning).
        frames
            First and last frame to use, both included, counted from 0; None takes all.
        transfer
            ``"srgb"`` or ``"linear"``; None takes srgb for integer pixels and linear for EXR.
        mask
            A picture that is white where smoke may be and black where none is, or one for each frame of the file: a
            video, or a pattern ``mask_####.png``. What it hides is continued from around it in every frame.

        Raises
        ------
        ClipError
            With the path: no such file, no video in it, a picture missing, nothing that can be decoded, a range of
            frames outside the clip, a mask that hides all or nearly all of them, or one of another shape.
        ImageError
            If the mask is a picture that cannot be read.
        """
        try:
            given = path if isinstance(path, ClipSource) else ClipSource(file_path(path, "path"))
            changes: dict[str, Any] = {"fps": fps, "frames": frames, "transfer": transfer, "mask": mask}
            given = replace(given, **{name: value for name, value in changes.items() if value is not None})
        except SceneError as error:
            raise ClipError(str(error) if error.key == "path" else f"{path}: {error}") from error
        source: FrameSource
        if is_video(given.path):
            source = Video(given.path, given.transfer)
        else:
            source = ImageSequence(given.path, given.transfer, given.fps)
        try:
            clip = cls(given.path, source, given.fps, given.frames)
            return clip if given.mask is None else clip._behind(given.mask)
        except BaseException:
            source.close()
            raise

    @property
    def files(self) -> tuple[Path, ...]:
        """What the frames are read from: the video, or the pictures of the range that exist."""
        files = self._source.files
        own = files if len(files) == 1 else files[self.numbers.start : self.numbers.stop]
        return tuple(file for file in own if file.exists())

    def findings(self) -> tuple[Finding, ...]:
        """Return what is found of the file: defects, frames that are replaced, how pictures are read where that is not
        the usual way; ClipError as of `damaged`."""
        found = [self.warning] if self.warning else []
        if self.damaged:
            figures = {"path": str(self.path), "frames": numbered([self.numbers[n] for n in self.damaged])}
            found.append(Finding("damaged frames", figures, about="some pictures", source="assumed"))
        return (*found, *(replace(note, about="pictures", source="measured") for note in self._source.notes))

    @property
    def damaged(self) -> tuple[int, ...]:
        """Frames that cannot be decoded; for each the last one before it that can be, or else the next, stands in.

        Raises
        ------
        ClipError
            If there are more of them than of others.
        """
        damaged = self._damaged(self.numbers[0], self.numbers[-1])
        if 2 * len(damaged) > len(self) > 1:
            raise ClipError(
                f"{self.path}: {len(damaged)} of its {len(self)} frames are missing, cannot be decoded, or lack the "
                "alpha of the others; export the clip again, or choose other frames"
            )
        return tuple(map(self.numbers.index, damaged))

    def frame(self, n: int) -> Picture:
        """Return frame ``n``, counted from 0 at the start of the range: linear (height, width, 3), float32, read-only.

        Raises
        ------
        ClipError
            If there is no such frame, or most frames of the clip are damaged.
        """
        return _kept(self._linear, LINEAR_BYTES, lambda n: StoredPicture(self.stored(n).linear()), n).values

    def stored(self, n: int) -> StoredPicture:
        """Return frame ``n`` as it is stored, of which a part or means cost less than the linear `frame`."""
        return _kept(self._stored, LINEAR_BYTES, partial(self._sound, self._read), n)

    def alpha(self, n: int) -> Picture | None:
        """Return the alpha (height, width) of frame ``n`` as filmed, 0 where a mask hides it; None if opaque."""
        if self.alpha_background is None:
            return None
        alpha = self._sound(self._filmed, n).alpha
        if alpha is None:  # an opaque picture among others
            alpha = np.ones(self.size[::-1], np.float32)
        seen = self.seen(n, *self.size)
        return alpha if seen is None else np.where(seen, alpha, np.float32(0))

    def as_held(self, picture: Picture) -> Picture:
        """Return a linear picture (rows, columns, 3) of the clip's size with its colors as coarse as the file's."""
        return self._source.as_held(picture)

    def seen(self, n: int, width: int, height: int) -> Seen | None:
        """Return which pixels of frame ``n`` no mask hides, (height, width) of them; None of a clip without a mask.

        A changed clip asks for frames of its file before and after its own, too: below 0 and from its length on.
        """
        return None if self.mask is None else self.mask.seen(self.numbers.start + n, width, height)

    def as_seen(self, n: int, picture: Picture) -> Picture:
        """Return a picture (rows, columns, 3) of frame ``n`` in which what is hidden is not a number."""
        rows, columns = picture.shape[:2]
        seen = self.seen(n, columns, rows)
        return picture if seen is None else np.where(seen[..., None], picture, np.float32(np.nan))

    def __len__(self) -> int:
        return len(self.numbers)

    def __iter__(self) -> Iterator[Picture]:
        return (self.frame(n) for n in range(len(self)))

    def spread(self, count: int) -> list[int]:
        """Return the numbers of ``count`` frames (of all, if there are fewer), spread evenly over the clip."""
        numbers = np.unique(np.linspace(0, len(self) - 1, min(count, len(self))).round())
        return [int(number) for number in numbers]

    def whole(self) -> "Clip":
        """Return all of the file, whatever part of it this clip is; of one with a mask a frame, what has one."""
        return self._with(frames=(0, self._count - 1))

    def part(self, first: int, last: int) -> "Clip":
        """Return the frames of the file from one number to another, both included."""
        return self if self.numbers == range(first, last + 1) else self._with(frames=(first, last))

    def as_filmed(self) -> "Clip":
        """Return the clip with what a mask hides, as the file has it."""
        return self if self.mask is None else self._with(_read=self._filmed, _gain=_no_gain, mask=None)

    def changed(self, change: Callable[[int, Picture], Picture]) -> "Clip":
        """Return the clip with each frame, by its number, replaced by another."""
        before, first = self._read, self.numbers[0]
        return self._with(_read=lambda number: StoredPicture(change(number - first, before(number).linear())))

    def exposed(self, measure: Callable[[int, Picture], Picture]) -> "Clip":
        """Return the clip with each frame divided by its gain (3,), which is measured once.

        ``measure`` takes a frame's number and its small linear picture, in which what is hidden is not a number.
        """
        before, first = self._read, self.numbers[0]

        @cache
        def gain(number: int) -> Picture:
            image, n = before(number), number - first
            return measure(n, self.as_seen(n, image.averaged(*reduced_size(*image.size, COMPARED_SIDE))))

        def read(number: int) -> StoredPicture:
            image, of_frame = before(number), gain(number)
            return image if (of_frame == 1).all() else StoredPicture(image.linear() / of_frame)

        return self._with(_read=read, _gain=gain)

    def gain(self, n: int) -> Picture:
        """Return how many times brighter (3,) frame ``n`` was filmed than a clip that is `exposed` shows it; else 1."""
        return self._sound(self._gain, n)

    def registered(self, motion: Callable[[int, StoredPicture], Similarity]) -> "Clip":
        """Return the clip with each frame as a reference shows it; what a frame does not show of that is hidden.

        ``motion`` gives that of a frame, by its number in the file and what is stored of it.
        """
        before, filmed = self._read, self._filmed

        @cache
        def known(number: int) -> Similarity:
            with suppress(DamagedFrameError):
                return motion(number, before(number))
            return IDENTITY  # another frame stands in, as it is registered

        mask = registered_mask(self.mask, known)
        return self._with(_read=registered(before, known), _filmed=registered(filmed, known), mask=mask)

    def close(self) -> None:
        """Close the file, and that of a mask."""
        self._source.close()
        if self.mask is not None:
            self.mask.close()

    def __enter__(self) -> "Clip":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _with(self, frames: tuple[int, int] | None = None, **attributes: Any) -> "Clip":
        """A clip of the same open file with other frames or attributes."""
        clip = copy(self)
        vars(clip).update(attributes)
        clip._use(frames or (self.numbers[0], self.numbers[-1]))
        return clip

    def _use(self, frames: tuple[int, int]) -> None:
        """Use the file's frames from one number to another, both included."""
        first, last = frames
        if not 0 <= first <= last < self._count:
            raise ClipError(
                f"{self.path}: there are no frames {first} to {last}; choose some of 0 to {self._count - 1}"
            )
        self.numbers = range(first, last + 1)
        self._stored, self._linear = Kept(), Kept()

    def _behind(self, path: Path) -> "Clip":
        """The clip with what a mask hides continued from around it."""
        mask, filmed = Mask.open(path, self.numbers, self.size), self._filmed
        read = partial(_kept, Kept(), STORED_BYTES, lambda number: mask.applied(number, filmed(number)))
        count = min(self._count, mask.count or self._count)
        return self._with(_read=read, mask=mask, _count=count)

    def _sound(self, read: Callable[[int], Value], n: int) -> Value:
        """What is read of frame ``n``, or of what stands in for a damaged one (see `damaged`)."""
        if not isinstance(n, int | np.integer) or not 0 <= n < len(self):
            raise ClipError(f"{self.path}: there is no frame {n!r}; there are 0 to {len(self) - 1}")
        try:
            return read(self.numbers[n])
        except DamagedFrameError as error:
            damage = error
        for other in (*reversed(range(n)), *range(n + 1, len(self))):
            if other not in self.damaged:
                with suppress(DamagedFrameError):
                    return read(self.numbers[other])
        raise damage


def _no_gain(_: int) -> Picture:
    """The gain of a frame that is shown as it was filmed."""
    return np.ones(3, np.float32)


def _kept(pictures: Kept, most: int, read: Read, n: int) -> StoredPicture:
    """A picture, kept or else read, made read-only; the latest ones are kept, up to ``most`` bytes."""
    image = pictures.pop(n) if n in pictures else read(n)
    image.values.flags.writeable = False
    pictures[n] = image
    while len(pictures) > max(1, most // image.values.nbytes):
        pictures.popitem(last=False)
    return image


def numbered(frames: Sequence[int]) -> str:
    """Return "frame 3 is", or "frames 3, 4 and 9 are"; of many the first five."""
    words = [str(n) for n in frames[:5]]
    if len(frames) == 1:
        return f"frame {words[0]} is"
    last = f"{len(frames) - 5} more" if len(frames) > 5 else words.pop()
    return f"frames {', '.join(words)} and {last} are"
