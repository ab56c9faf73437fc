"""Clips: videos and picture sequences as lazily decoded linear frames.

Frames are counted from 0 in the order in which they are shown. The container is read once at the start,
without decoding, for the times of all frames; after that any frame can be had, and frames in a row cost one
decode each.

What a file says about its colours is honoured: matrix and range through FFmpeg's converter (an untagged
video is read as BT.601, as FFmpeg writes one), rotation and mirroring flags, alpha (shown over black). Its
conversion is asked to round exactly: by default FFmpeg's is half an 8-bit step too dark.

A video whose rate varies by more than 1 % is read at its mean rate: frame n is the picture on show at n /
fps.
"""

from __future__ import annotations

import bisect
import re
from collections import OrderedDict
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol

import av
import numpy as np
import numpy.typing as npt
from av.sidedata.sidedata import Type as SideData
from av.video.reformatter import Interpolation

from smokelift.footage.images import READABLE, ImageError, Picture, Transfer, decode_integers, read_image
from smokelift.scene import ClipSource

PICTURES_FPS = 24.0
"""Frames a second of a picture sequence for which nobody said any."""

_CACHE_BYTES = 128 * 2**20
_EXACT = int(
    Interpolation.BICUBIC | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INT | Interpolation.FULL_CHR_H_INP
)


class ClipError(ValueError):
    """A clip, or a frame of it, that cannot be read."""


class _Source(Protocol):
    """What a clip reads from; frames counted from 0 over the whole file."""

    count: int
    fps: float
    warning: str | None

    def read(self, n: int) -> Picture: ...

    def close(self) -> None: ...


class Clip:
    """A video or a picture sequence as linear frames.

    Made by :meth:`open`; a context manager. Not for several threads at once.

    Attributes
    ----------
    path
        What was opened.
    fps
        Frames a second.
    frame_count
        Frames that can be had; the same as ``len(clip)``.
    size
        Width and height in pixels, upright.
    first
        Number in the file of the clip's frame 0 (not 0 if a range was asked for).
    warning
        A sentence about what is amiss (a truncated file, say), else None.
    """

    def __init__(self, path: Path, source: _Source, fps: float | None, frames: tuple[int, int] | None) -> None:
        self.path = path
        self.fps = source.fps if fps is None else float(fps)
        self.warning = source.warning
        self._source = source
        first, last = (0, source.count - 1) if frames is None else frames
        if not 0 <= first <= last < source.count:
            raise ClipError(f"{path}: frames {first} to {last} were asked for; it has 0 to {source.count - 1}")
        self.first = first
        self.frame_count = last - first + 1
        self._cache: OrderedDict[int, Picture] = OrderedDict()
        height, width = self.frame(0).shape[:2]
        self.size = (width, height)

    @classmethod
    def open(
        cls,
        path: str | Path | ClipSource,
        *,
        fps: float | None = None,
        frames: tuple[int, int] | None = None,
        transfer: Transfer | None = None,
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

        Raises
        ------
        ClipError
            With the path: no such file, no video in it, a picture missing, nothing that can be decoded, or a
            range of frames outside the clip.
        """
        if isinstance(path, ClipSource):
            fps = path.fps if fps is None else fps
            frames = path.frames if frames is None else frames
            transfer = path.transfer if transfer is None else transfer
            path = path.path
        path = Path(path)
        if fps is not None and not (np.isfinite(fps) and fps > 0.0):
            raise ClipError(f"{path}: fps must be a number above 0, not {fps}")
        if transfer not in (None, "srgb", "linear"):
            raise ClipError(f'{path}: transfer must be "srgb" or "linear", not "{transfer}"')
        source: _Source
        source = _Video(path, transfer) if is_video(path) else _Pictures(path, transfer, fps)
        try:
            return cls(path, source, fps, frames)
        except BaseException:
            source.close()
            raise

    def frame(self, n: int) -> Picture:
        """Return frame ``n``, counted from 0 at the start of the range.

        Returns
        -------
        Linear float32 array of shape (height, width, 3), read-only because it is kept for the next caller.

        Raises
        ------
        ClipError
            If there is no such frame or it is damaged.
        """
        if not 0 <= n < self.frame_count:
            raise ClipError(f"{self.path}: there is no frame {n}; there are 0 to {self.frame_count - 1}")
        if n in self._cache:
            self._cache.move_to_end(n)
            return self._cache[n]
        image = self._source.read(self.first + n)
        image.flags.writeable = False
        self._cache[n] = image
        while len(self._cache) > max(1, _CACHE_BYTES // image.nbytes):
            self._cache.popitem(last=False)
        return image

    def __len__(self) -> int:
        return self.frame_count

    def __iter__(self) -> Iterator[Picture]:
        return (self.frame(n) for n in range(self.frame_count))

    def spread(self, count: int) -> list[int]:
        """So many numbers of frames (or all, if there are fewer), spread evenly over the clip."""
        numbers = np.unique(np.linspace(0, len(self) - 1, min(count, len(self))).round())
        return [int(number) for number in numbers]

    def close(self) -> None:
        """Close the file."""
        self._source.close()

    def __enter__(self) -> Clip:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def is_video(path: Path) -> bool:
    """Return whether a path, to judge by its name, is that of a video, not of one or more pictures."""
    return "#" not in path.name and path.suffix.lower() not in READABLE


class _Pictures:
    """Numbered pictures on disk."""

    def __init__(self, path: Path, transfer: Transfer | None, fps: float | None) -> None:
        self._paths = _numbered(path)
        self._transfer = transfer
        self.count = len(self._paths)
        self.fps = PICTURES_FPS
        self.warning = None
        if fps is None and self.count > 1:
            self.warning = f"{path}: pictures carry no frame rate; {PICTURES_FPS:g} frames a second are taken"
        self._shape: tuple[int, ...] | None = None

    def read(self, n: int) -> Picture:
        try:
            image = read_image(self._paths[n], self._transfer)
        except ImageError as error:
            raise ClipError(str(error)) from error
        self._shape = self._shape or image.shape
        if image.shape != self._shape:
            raise ClipError(
                f"{self._paths[n]}: is {image.shape[1]} x {image.shape[0]} pixels, "
                f"the first picture {self._shape[1]} x {self._shape[0]}"
            )
        return image

    def close(self) -> None:
        """Nothing is held open."""


def _numbered(path: Path) -> list[Path]:
    """Return the pictures of a sequence in order, or raise ClipError naming the first that is missing."""
    hashes = re.fullmatch(r"([^#]*)(#+)([^#]*)", path.name)
    digits = re.fullmatch(r"(.*?)(\d+)(\.[^.]+)", path.name)
    if "#" in path.name and hashes is None:
        raise ClipError(f"{path}: a pattern has one row of # for the number, as in frame_####.png")
    named = hashes or digits
    if named is None or (hashes is None and not path.is_file()):
        if not path.is_file():
            raise ClipError(f"{path}: no such file")
        return [path]
    prefix, number, suffix = named.groups()
    found: dict[int, Path] = {}
    if path.parent.is_dir():
        pattern = re.compile(re.escape(prefix) + rf"(\d{{{len(number)},}})" + re.escape(suffix))
        matches = ((pattern.fullmatch(file.name), file) for file in path.parent.iterdir())
        found = {int(match[1]): file for match, file in matches if match}
    start = min(found, default=0) if hashes else int(number)
    if start not in found:
        raise ClipError(f"{path}: no such pictures")
    last = max(found)
    for n in range(start, last + 1):
        if n not in found:
            missing = path.with_name(f"{prefix}{n:0{len(number)}d}{suffix}")
            raise ClipError(f"{missing}: this picture is missing; the sequence goes on to {found[last].name}")
    return [found[n] for n in range(start, last + 1)]


class _Video:
    """One video stream with an index of the times of its frames.

    ``_times`` are the frames' presentation times in the stream's time base, in order; ``_keys`` those where
    decoding can start; ``_shown`` maps a frame of the clip to one of them. Containers without presentation
    times (raw streams, some AVI) have no index: they are decoded once to count and then only forward.
    """

    def __init__(self, path: Path, transfer: Transfer | None) -> None:
        self._path = path
        self._transfer = transfer
        self.warning: str | None = None
        if not path.exists():
            raise ClipError(f"{path}: no such file")
        if path.is_dir():
            raise ClipError(f"{path}: is a folder; for pictures give a pattern such as {path}/frame_####.png")
        self._start()
        self._times, self._keys, broken = self._index()
        if not self._times:
            self.close()
            raise ClipError(f"{path}: holds no frame that can be decoded")
        if broken:
            self._drop_undecodable_end()
            self.warning = f"{path}: is truncated; its first {len(self._times)} frames can be used"
        self.fps, self._shown = self._steady()
        self.count = len(self._shown)

    def _start(self) -> None:
        """Open the file at its beginning."""
        try:
            self._container = av.open(str(self._path))
        except (av.FFmpegError, ValueError) as error:
            raise ClipError(f"{self._path}: is not a video, or is damaged: {_reason(error)}") from error
        if not self._container.streams.video:
            self._container.close()
            raise ClipError(f"{self._path}: holds no video stream")
        self._stream = self._container.streams.video[0]
        self._stream.thread_type = "AUTO"
        self._decoded: Iterator[av.VideoFrame] = self._container.decode(self._stream)
        self._next = 0  # index into _times of the frame that decoding on will give

    def _index(self) -> tuple[list[int], list[int], bool]:
        """Return the times of all frames and of the key frames, and whether the file broke off."""
        times, keys, seen, broken = [], [], 0, False
        try:
            for packet in self._container.demux(self._stream):
                if packet.is_corrupt:
                    broken = True
                    break
                seen += 1
                if packet.size == 0 or packet.is_discard:  # a dropped frame, or one that an edit cuts away
                    continue
                if packet.pts is None:
                    return self._count(), [], False
                times.append(packet.pts)
                if packet.is_keyframe:
                    keys.append(packet.pts)
        except av.FFmpegError:
            broken = True
        broken = broken or seen < self._promised()
        self._rewind()
        return sorted(set(times)), sorted(keys), broken

    def _promised(self) -> int:
        """Return how many frames the file says it holds; 0 if it does not say."""
        stream, length = self._stream, self._container.duration
        if stream.frames or stream.duration is not None or length is None or stream.average_rate is None:
            return stream.frames
        # Matroska counts no frames, but knows how long the whole is, give or take one. Sound may last longer.
        alone = len(self._container.streams) == 1
        return int(length * stream.average_rate / av.time_base) - 1 if alone else 0

    def _count(self) -> list[int]:
        """Return made-up times, by decoding everything, for a container that has none."""
        self._rewind()
        count = 0
        try:
            for _ in self._decoded:
                count += 1
        except av.FFmpegError:
            self.warning = f"{self._path}: is damaged; its first {count} frames can be used"
        self._rewind()
        return list(range(count))

    def _rewind(self) -> None:
        self._container.close()
        self._start()

    def _drop_undecodable_end(self) -> None:
        """Cut the index after the last frame that decodes, looking at the end only."""
        while self._times:
            try:
                self._decode(len(self._times) - 1)
                return
            except ClipError:
                self._times.pop()
        raise ClipError(f"{self._path}: holds no frame that can be decoded")

    def _steady(self) -> tuple[float, list[int]]:
        """Return the frame rate and, for each frame of the clip, the decoded frame that it shows."""
        count = len(self._times)
        base = self._stream.time_base
        rate = self._stream.average_rate or self._stream.guessed_rate
        if not self._keys or count < 3 or base is None:
            return float(rate or PICTURES_FPS), list(range(count))
        gaps = np.diff(np.array(self._times, np.float64))
        mean = (self._times[-1] - self._times[0]) / (count - 1)
        # Times are whole ticks: a gap may be off by one without the rate being another (Matroska: 1 ms).
        if np.abs(gaps - mean).max() <= max(0.01 * mean, 1.0):
            steady = 1.0 / (mean * float(base))
            near = rate is not None and abs(float(rate) - steady) < 0.01 * steady
            return float(rate if near and rate is not None else steady), list(range(count))
        shown = [bisect.bisect_right(self._times, self._times[0] + mean * n + 0.5) - 1 for n in range(count)]
        return float(Fraction(1) / (Fraction(mean) * base)), shown

    def close(self) -> None:
        """Close the file."""
        self._container.close()

    def read(self, n: int) -> Picture:
        """Return a frame, or raise ClipError if it is damaged."""
        return self._picture(self._decode(self._shown[n]))

    def _decode(self, index: int) -> av.VideoFrame:
        """Return the decoded frame at an index into ``_times``."""
        if not self._keys:
            return self._decode_by_count(index)
        wanted = self._times[index]
        reached = self._times[self._next] if self._next < len(self._times) else None
        key_between = reached is not None and any(reached < key <= wanted for key in self._keys)
        if reached is None or wanted < reached or key_between:
            self._container.seek(wanted, stream=self._stream)
            self._decoded = self._container.decode(self._stream)
        frame = self._forward_to(wanted)
        if frame is None:
            # A seek may land late (open groups of pictures); from the start nothing can be missed.
            self._rewind()
            frame = self._forward_to(wanted)
        if frame is None:
            self._rewind()
            raise ClipError(f"{self._path}: frame {index} is damaged and cannot be decoded")
        self._next = index + 1
        return frame

    def _forward_to(self, wanted: int) -> av.VideoFrame | None:
        try:
            for frame in self._decoded:
                if frame.pts is not None and frame.pts >= wanted:
                    return frame if frame.pts == wanted and not frame.is_corrupt else None
        except av.FFmpegError:
            pass
        return None

    def _decode_by_count(self, index: int) -> av.VideoFrame:
        if index < self._next:
            self._rewind()
        try:
            while True:
                frame = next(self._decoded)
                self._next += 1
                if self._next == index + 1:
                    return frame
        except (StopIteration, av.FFmpegError) as error:
            self._rewind()
            raise ClipError(f"{self._path}: frame {index} is damaged and cannot be decoded") from error

    def _picture(self, frame: av.VideoFrame) -> Picture:
        components = frame.format.components
        wide = max(component.bits for component in components) > 8
        alpha = any(component.is_alpha for component in components)
        layout = {False: ("rgb24", "rgba"), True: ("rgb48le", "rgba64le")}[wide][alpha]
        size = (self._stream.width, self._stream.height)
        if (frame.width, frame.height) != size:
            raise ClipError(
                f"{self._path}: changes its picture size from {size[0]} x {size[1]} to {frame.width} x {frame.height}"
            )
        codes = frame.reformat(format=layout, interpolation=_EXACT).to_ndarray()
        return decode_integers(_upright(codes, frame), self._transfer)


def _upright(pixels: npt.NDArray[Any], frame: av.VideoFrame) -> npt.NDArray[Any]:
    """Turn and mirror a picture as its display matrix says; angles other than quarter turns are ignored.

    The matrix sends the stored column p and row q to the shown column a p + c q and row b p + d q.
    """
    sides: Any = frame.side_data  # PyAV's stub of it knows motion vectors only
    side = sides.get(SideData.DISPLAYMATRIX)
    if side is None:
        return pixels
    a, b, _, c, d = (int(v) for v in np.frombuffer(bytes(side), np.int32)[:5])
    if abs(a) < abs(c):
        pixels, a, d = np.swapaxes(pixels, 0, 1), c, b
    return pixels[:: -1 if d < 0 else 1, :: -1 if a < 0 else 1]


def _reason(error: Exception) -> str:
    return str(error.strerror) if isinstance(error, av.FFmpegError) else str(error)
