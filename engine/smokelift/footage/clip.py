"""Clips: videos and picture sequences as lazily decoded linear frames, counted from 0 in the order of their times."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import cached_property, lru_cache
from pathlib import Path
from types import TracebackType

import numpy as np

from smokelift.checks import Remark
from smokelift.footage.exposure import COMPARED_SIDE
from smokelift.footage.frame_source import ClipError, DamagedFrameError, FrameSource, Wrapped
from smokelift.footage.image_sequence import ImageSequence, is_video
from smokelift.footage.images import Picture, Transfer, reduced_size
from smokelift.footage.mask import Mask, Masked, Seen
from smokelift.footage.stored_picture import StoredPicture
from smokelift.footage.video import Video
from smokelift.scene import ClipSource, SceneError
from smokelift.scene.checks import file_path

__all__ = ["Clip", "ClipError", "is_video"]

STORED_BYTES, LINEAR_BYTES = 128 * 2**20, 64 * 2**20
"""Memory for the frames of a file that are kept as they are stored, twenty of 1080p at 8 bits, for what reads the same
ones spread over a clip; and for the linear frames of a clip that are kept: two of 1080p."""


class Clip:
    """A video or a picture sequence as linear frames.

    Made by :meth:`open`; a context manager. Not for several threads at once.

    Attributes
    ----------
    path
        What was opened.
    fps
        Frames a second.
    size
        Width and height in pixels, upright.
    first
        Number in the file of the clip's frame 0 (not 0 if a range was asked for).
    warning
        A remark on a defect (a truncated file, say), else None.
    lens
        Focal length in millimetres on 35 mm film, if the file says it.
    backdrop
        Linear grey that is shown behind pictures with an alpha channel; None behind opaque ones.
    """

    def __init__(
        self,
        path: Path,
        source: FrameSource,
        fps: float | None,
        frames: tuple[int, int] | None,
        size: tuple[int, int] | None = None,
        masked: Masked | None = None,
    ) -> None:
        self.path = path
        self._masked = masked
        self.fps = source.fps if fps is None else float(fps)
        self.warning = source.warning
        self.lens = source.lens
        self.backdrop = source.backdrop
        self._source = source
        first, last = (0, source.count - 1) if frames is None else frames
        if not 0 <= first <= last < source.count:
            raise ClipError(f"{path}: there are no frames {first} to {last}; choose some of 0 to {source.count - 1}")
        self.first = first
        self._count = last - first + 1
        self._cache: OrderedDict[int, StoredPicture] = OrderedDict()
        self.size = self.stored(0).size if size is None else size

    @classmethod
    def open(
        cls,
        path: str | Path | ClipSource,
        *,
        fps: float | None = None,
        frames: tuple[int, int] | None = None,
        transfer: Transfer | None = None,
        mask: str | Path | None = None,
    ) -> Clip:
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
            said = path if isinstance(path, ClipSource) else ClipSource(file_path(path, "path"))
            said = ClipSource(
                said.path,
                fps=said.fps if fps is None else fps,
                frames=said.frames if frames is None else frames,
                transfer=said.transfer if transfer is None else transfer,
                mask=said.mask if mask is None else file_path(mask, "mask"),
            )
        except SceneError as error:
            raise ClipError(str(error) if error.key == "path" else f"{path}: {error}") from error
        path, fps, frames, transfer = said.path, said.fps, said.frames, said.transfer
        source: FrameSource = Video(path, transfer) if is_video(path) else ImageSequence(path, transfer, fps)
        try:
            clip = cls(path, _Kept(source), fps, frames)
            if said.mask is None:
                return clip
            needed = range(clip.first, clip.first + len(clip))
            masked = Masked(clip._source, Mask(said.mask, needed, clip.size))
            return cls(path, _Kept(masked), fps, frames, clip.size, masked)
        except BaseException:
            source.close()
            raise

    @property
    def files(self) -> tuple[Path, ...]:
        """What the frames are read from: the video, or the pictures of the range that exist."""
        files = self._source.files
        own = files if len(files) == 1 else files[self.first : self.first + self._count]
        return tuple(file for file in own if file.exists())

    @property
    def notes(self) -> tuple[Remark, ...]:
        """How the pictures are read where that is not the usual way."""
        return self._source.notes

    def remarks(self) -> tuple[Remark, ...]:
        """Remarks on the clip: defects, frames that are replaced, how pictures are read; ClipError as of `damaged`."""
        remarks = [self.warning] if self.warning else []
        if self.damaged:
            frames = numbered([self.first + n for n in self.damaged])
            remarks.append(Remark("damaged frames", {"path": str(self.path), "frames": frames}))
        return (*remarks, *self.notes)

    @cached_property
    def damaged(self) -> tuple[int, ...]:
        """Frames that cannot be decoded; for each the last one before it that can be, or else the next, stands in.

        Raises
        ------
        ClipError
            If there are more of them than of others.
        """
        damaged = self._source.damaged(self.first, self.first + self._count - 1)
        if 2 * len(damaged) > self._count > 1:
            raise ClipError(
                f"{self.path}: {len(damaged)} of its {self._count} frames are missing or cannot be decoded; export "
                "the clip again, or choose other frames"
            )
        return tuple(n - self.first for n in damaged)

    def frame(self, n: int) -> Picture:
        """Return frame ``n``, counted from 0 at the start of the range: linear (height, width, 3), float32, read-only.

        Raises
        ------
        ClipError
            If there is no such frame, or most frames of the clip are damaged.
        """
        return _keep(self._cache, n, StoredPicture(self.stored(n).linear()), LINEAR_BYTES).values

    def stored(self, n: int) -> StoredPicture:
        """Return frame ``n`` as it is stored, of which a part or means cost less than the linear `frame`."""
        if n in self._cache:
            self._cache.move_to_end(n)
            return self._cache[n]
        image = self._read(n)
        return _keep(self._cache, n, image, LINEAR_BYTES) if image.table is None else image

    @property
    def mask(self) -> Mask | None:
        """What hides a part of the frames, if anything does."""
        return None if self._masked is None else self._masked.mask

    def as_filmed(self) -> Clip:
        """Return the clip with what a mask hides. The two share the open file."""
        if self._masked is None:
            return self
        return Clip(self.path, self._masked.source, self.fps, (self.first, self.first + len(self) - 1), self.size)

    def seen(self, n: int, width: int, height: int) -> Seen | None:
        """Return which pixels of frame ``n`` no mask hides, (height, width) of them; None of a clip without a mask."""
        return None if self._masked is None else self._masked.mask.seen(self.first + n, width, height)

    def as_seen(self, n: int, picture: Picture) -> Picture:
        """Return a picture (rows, columns, 3) of frame ``n`` in which what is hidden is not a number."""
        rows, columns = picture.shape[:2]
        seen = self.seen(n, columns, rows)
        return picture if seen is None else np.where(seen[..., None], picture, np.float32(np.nan))

    def _read(self, n: int) -> StoredPicture:
        """Return a frame from the file, or what stands in for it: the last sound one lasts on, as when one drops."""
        if not isinstance(n, int | np.integer) or not 0 <= n < self._count:
            raise ClipError(f"{self.path}: there is no frame {n!r}; there are 0 to {self._count - 1}")
        try:
            return self._source.read(self.first + n)
        except DamagedFrameError as error:
            damage = error
        for other in (*reversed(range(n)), *range(n + 1, self._count)):
            if other not in self.damaged:
                with suppress(DamagedFrameError):
                    return self._source.read(self.first + other)
        raise damage

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[Picture]:
        return (self.frame(n) for n in range(self._count))

    def spread(self, count: int) -> list[int]:
        """Return the numbers of ``count`` frames (of all, if there are fewer), spread evenly over the clip."""
        numbers = np.unique(np.linspace(0, len(self) - 1, min(count, len(self))).round())
        return [int(number) for number in numbers]

    def whole(self) -> Clip:
        """Return all of the file, whatever part of it this clip is. The two share the open file."""
        return Clip(self.path, self._source, self.fps, None, self.size, self._masked)

    def part(self, first: int, last: int) -> Clip:
        """Return the frames of the file from one number to another, both included. The two share the open file."""
        if (first, last) == (self.first, self.first + len(self) - 1):
            return self
        return Clip(self.path, self._source, self.fps, (first, last), self.size, self._masked)

    def changed(
        self,
        change: Callable[[int, Picture], Picture],
        keeps: Callable[[int, Callable[[], Picture]], bool] | None = None,
    ) -> Clip:
        """Return the clip with each frame, by its number, replaced by another. The two share the open file.

        ``keeps`` says of a frame's number, and of what makes its `small` picture, that ``change`` leaves it as it is.
        """
        last = self.first + len(self) - 1
        source = _Changed(self, self._source, change, keeps)
        return Clip(self.path, source, self.fps, (self.first, last), self.size, self._masked)

    def close(self) -> None:
        """Close the file."""
        self._source.close()

    def __enter__(self) -> Clip:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _Kept(Wrapped):
    """The frames of a source, of which the last ones read are kept for all clips that share it."""

    def __init__(self, source: FrameSource) -> None:
        super().__init__(source)
        self._kept: OrderedDict[int, StoredPicture] = OrderedDict()
        self._damaged = lru_cache(maxsize=None)(source.damaged)

    def read(self, n: int) -> StoredPicture:
        image = self._kept.pop(n) if n in self._kept else self.source.read(n)
        return _keep(self._kept, n, image, STORED_BYTES)

    def damaged(self, first: int, last: int) -> tuple[int, ...]:
        return self._damaged(first, last)


class _Changed(Wrapped):
    """The frames of a clip's source, each replaced; numbers count from the clip's first one."""

    def __init__(
        self,
        clip: Clip,
        source: FrameSource,
        change: Callable[[int, Picture], Picture],
        keeps: Callable[[int, Callable[[], Picture]], bool] | None,
    ) -> None:
        super().__init__(source)
        self.lens = clip.lens
        self._first, self._change, self._keeps = clip.first, change, keeps

    def read(self, n: int) -> StoredPicture:
        image, number = self.source.read(n), n - self._first
        if self._keeps is not None and self._keeps(
            number, lambda: image.averaged(*reduced_size(*image.size, COMPARED_SIDE))
        ):
            return image
        return StoredPicture(self._change(number, image.linear()))


def _keep(kept: OrderedDict[int, StoredPicture], n: int, image: StoredPicture, most: int) -> StoredPicture:
    """A picture, read-only from now on, put beside the last ones in so many bytes."""
    image.values.flags.writeable = False
    kept[n] = image
    while len(kept) > max(1, most // image.values.nbytes):
        kept.popitem(last=False)
    return image


def numbered(frames: Sequence[int]) -> str:
    """Return "frame 3 is", or "frames 3, 4 and 9 are"; of many the first five."""
    words = [str(n) for n in frames[:5]]
    if len(frames) == 1:
        return f"frame {words[0]} is"
    last = f"{len(frames) - 5} more" if len(frames) > 5 else words.pop()
    return f"frames {', '.join(words)} and {last} are"
