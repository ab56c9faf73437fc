"""Clips that are videos.

The container is read once at the start, without decoding, for the times of all frames; after that any frame can be
had, and frames in a row cost one decode each.

What a file says about its pictures is honoured: matrix and range through FFmpeg's converter (an untagged video is read
as BT.601, as FFmpeg writes one), transfer and primaries (`colour`), rotation and mirroring flags, the shape of pixels,
interlacing (one field of each frame is used), alpha (`layer`). The converter is asked to round exactly: by default
FFmpeg's is half an 8 bit step too dark.

A video whose rate varies by more than 1 % is read at its mean rate: frame n is the picture on show at n / fps.
"""

from __future__ import annotations

import bisect
from collections.abc import Iterator
from contextlib import suppress
from fractions import Fraction
from itertools import islice
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
from av.filter import Graph
from av.sidedata.sidedata import Type as SideData
from av.video.plane import VideoPlane
from av.video.reformatter import ColorRange, Interpolation

import smokelift._core as _core
from smokelift.checks import Remark
from smokelift.footage.colour import ENCODINGS, Encoding, primaries_name, to_bt709
from smokelift.footage.container import lacks_index, open_container
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
from smokelift.footage.images import (
    MAX_PIXELS,
    Transfer,
    code_values,
    decode_alpha,
    decode_integers,
    reduction,
    srgb_to_linear,
)
from smokelift.footage.stored_picture import StoredPicture
from smokelift.scene import LARGEST_PICTURE

_EXACT = int(Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INT | Interpolation.FULL_CHR_H_INP)
_FOCAL_LENGTH = "com.apple.quicktime.camera.focal_length.35mm_equivalent"
_ALPHA_DECODERS = {"vp8": "libvpx", "vp9": "libvpx-vp9"}
"""FFmpeg's own decoders of these leave the alpha channel out."""

_GROWING, _SHRINKING = int(Interpolation.BICUBIC) | _EXACT, int(Interpolation.AREA) | _EXACT

BEYOND_ALPHA = 0.02
"""Share of white by which colours may exceed alpha through rounding and compression."""

SQUARE = 0.01
"""Difference from 1 of the shape of pixels that is not worth another grid of pixels."""


class Video:
    """One video stream with an index of the times of its frames.

    Its attributes are those of `FrameSource`.

    ``_times`` are the frames' presentation times in the stream's time base, in order; ``_keys`` those where
    decoding can start; ``_shown`` maps a frame of the clip to one of them. Containers without presentation
    times (raw streams, some AVI) have no index: they are decoded once to count and then only forward.
    """

    def __init__(self, path: Path, transfer: Transfer | None) -> None:
        self._path = path
        self.files: tuple[Path, ...] = (path,)
        self._transfer = transfer
        self.warning: Remark | None = None
        if not path.exists():
            raise ClipError(f"{path}: no such file")
        if path.is_dir():
            raise ClipError(f"{path}: is a folder; for pictures give a pattern such as {path}/frame_####.png")
        if not path.is_file():
            raise ClipError(f"{path}: is a pipe or a device, which cannot be read twice; save it as a file")
        self._failed = False  # whether decoding has
        self._lost: set[int] = set()  # indices into _times of what is known to be damaged, lest it is tried again
        self._start()
        self._times, self._keys, broken = self._index()
        if not self._times:
            self.close()
            raise ClipError(f"{path}: holds no frame that can be decoded; export it again")
        if broken:
            self._drop_undecodable_end()
            self.warning = Remark("truncated clip", {"path": str(path), "frames": len(self._times)})
        self._varies, self._interlaced = False, False
        self.fps, self._shown = self._steady()
        self.count = len(self._shown)
        self._premultiplied = False
        self.backdrop = self._matted()
        self._format = self._described()
        self.lens = believed_focal_length({**self._container.metadata, **self._stream.metadata}.get(_FOCAL_LENGTH))

    def _start(self) -> None:
        """Open the file at its beginning."""
        try:
            self._container = open_container(self._path)
        except (av.FFmpegError, ValueError) as error:
            raise _unreadable(self._path, error) from error
        if not self._container.streams.video:
            self._container.close()
            raise _unreadable(self._path, None)
        self._stream = self._container.streams.video[0]
        if self._stream.codec_context is None:
            self._container.close()
            raise ClipError(
                f"{self._path}: holds video of a kind that cannot be decoded; convert it, for example to H.264"
            )
        width, height = self._stream.width, self._stream.height
        if max(width, height) > LARGEST_PICTURE or not 0 < width * height <= MAX_PIXELS:
            self._container.close()
            raise ClipError(
                f"{self._path}: has pictures of {width} x {height} pixels; those that are read have 1 to "
                f"{LARGEST_PICTURE} along a side and at most {MAX_PIXELS} in all"
            )
        # A decoder of several frames at once takes sound ones along when one fails.
        self._stream.thread_type = "SLICE" if self._failed else "AUTO"
        decoder = _ALPHA_DECODERS.get(self._stream.codec_context.name)
        self._decoder: Any = self._stream.codec_context
        if decoder is not None and self._stream.metadata.get("alpha_mode") == "1":
            self._decoder = av.CodecContext.create(av.Codec(decoder, "r"), "r")
        self._decoded = self._frames()
        self._next = 0  # index into _times of the frame that decoding on will give

    def _frames(self) -> Iterator[av.VideoFrame]:
        """Decode on from where the container stands, without what cannot be decoded."""
        packets = self._container.demux(self._stream)
        while True:
            try:
                packet = next(packets)
            except (StopIteration, av.FFmpegError):
                return
            try:
                frames = self._decoder.decode(packet)
            except av.FFmpegError:
                self._failed = True
                continue
            yield from frames

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
        count = sum(1 for _ in self._decoded)
        self._rewind()
        return list(range(count))

    def _rewind(self) -> None:
        self._container.close()
        self._start()

    def _drop_undecodable_end(self) -> None:
        """Cut the index after the last frame that decodes, reading the end only."""
        while self._times:
            try:
                self._decode(len(self._times) - 1)
                return
            except ClipError:
                self._times.pop()
        raise ClipError(f"{self._path}: holds no frame that can be decoded; export it again")

    def _steady(self) -> tuple[float, list[int]]:
        """Return the frame rate and, for each frame of the clip, the decoded frame that it shows."""
        count = len(self._times)
        base = self._stream.time_base
        rate = self._stream.average_rate or self._stream.guessed_rate
        if not self._keys or count < 3 or base is None:
            return float(rate or DEFAULT_FPS), list(range(count))
        gaps = np.diff(np.array(self._times, np.float64))
        mean = (self._times[-1] - self._times[0]) / (count - 1)
        # Times are whole ticks: a gap may be off by one without the rate being another (Matroska: 1 ms).
        if np.abs(gaps - mean).max() <= max(0.01 * mean, 1.0):
            steady = 1.0 / (mean * float(base))
            near = rate is not None and abs(float(rate) - steady) < 0.01 * steady
            return float(rate if near and rate is not None else steady), list(range(count))
        self._varies = True
        shown = [bisect.bisect_right(self._times, self._times[0] + mean * n + 0.5) - 1 for n in range(count)]
        return float(Fraction(1) / (Fraction(mean) * base)), shown

    @property
    def notes(self) -> tuple[Remark, ...]:
        """How the pictures are read, as far as they have been."""
        if not self._interlaced:
            return self._format
        return (*self._format, Remark("interlaced clip"))

    def _described(self) -> tuple[Remark, ...]:
        """How the file's format is read."""
        context, stream = self._stream.codec_context, self._stream
        encoding, primaries = ENCODINGS.get(context.color_trc), primaries_name(context.color_primaries)
        width, height = self._size()
        notes = [Remark("varying frame rate", {"fps": self.fps})] * self._varies
        if encoding in ("hlg", "pq") and self._transfer is None:
            notes.append(Remark("high dynamic range", {"transfer": encoding.upper()}))
        if primaries is not None:
            notes.append(Remark("other primaries", {"primaries": primaries}))
        if (width, height) != (stream.width, stream.height):
            notes.append(Remark("scaled pictures", {"size": (stream.width, stream.height), "scaled": (width, height)}))
        return tuple(notes)

    def close(self) -> None:
        """Close the file."""
        self._container.close()

    def read(self, n: int) -> StoredPicture:
        """Return a frame, or raise `DamagedFrameError`."""
        frame = self._decode(self._shown[n])
        if _has_alpha(frame) or primaries_name(self._stream.codec_context.color_primaries) is not None:
            return StoredPicture(shown_before(self._layer(frame), self.backdrop))
        codes = self._codes(frame)
        upright = np.ascontiguousarray(_upright(codes, frame))
        return StoredPicture(upright, code_values(np.iinfo(codes.dtype).max, self._encoding(), _white(frame)))

    def damaged(self, first: int, last: int) -> tuple[int, ...]:
        """Return which frames from one to another cannot be decoded."""
        wanted = [self._times[self._shown[n]] for n in range(first, last + 1)]
        if not self._keys:
            return ()  # they were counted by decoding them
        from_start = self._failed and wanted[0] == self._times[0]  # and one frame at a time
        self._container.seek(wanted[0], stream=self._stream)
        self._decoded = self._frames()
        good = self._good_times(wanted[-1])
        if not (from_start or good.issuperset(wanted)):  # as in `_decode`
            self._rewind()
            good |= self._good_times(wanted[-1])
        damaged = tuple(first + n for n, time in enumerate(wanted) if time not in good)
        if damaged or self._failed:
            self._rewind()
        else:  # what follows is decoded on from there
            self._next = self._shown[last] + 1
        self._lost.update(self._shown[n] for n in damaged)
        return damaged

    def _good_times(self, last: int) -> set[int]:
        """Times of the frames that can be decoded from where the container stands, up to one."""
        good = set()
        for frame in self._decoded:
            if frame.pts is not None and not frame.is_corrupt:
                good.add(frame.pts)
            if frame.pts is not None and frame.pts >= last:
                break
        return good

    def _decode(self, index: int) -> av.VideoFrame:
        """Return the decoded frame at an index into ``_times``."""
        frame = None
        if not self._keys:
            frame = self._count_to(index)
        elif index not in self._lost:
            frame = self._seek(index)
        if frame is None:
            self._rewind()
            self._lost.add(index)
            raise DamagedFrameError(
                f"{self._path}: frame {index} is damaged and cannot be decoded; export the clip again"
            )
        self._next = index + 1
        return frame

    def _seek(self, index: int) -> av.VideoFrame | None:
        wanted = self._times[index]
        reached = self._times[self._next] if self._next < len(self._times) else None
        key_between = reached is not None and any(reached < key <= wanted for key in self._keys)
        if reached is None or wanted < reached or key_between:
            self._container.seek(wanted, stream=self._stream)
            self._decoded = self._frames()
        frame = self._forward_to(wanted)
        if frame is None:
            # A seek may land late (open groups of pictures); from the start nothing can be missed.
            self._rewind()
            frame = self._forward_to(wanted)
        return frame

    def _forward_to(self, wanted: int) -> av.VideoFrame | None:
        for frame in self._decoded:
            if frame.pts is not None and frame.pts >= wanted:
                return frame if frame.pts == wanted and not frame.is_corrupt else None
        return None

    def _count_to(self, index: int) -> av.VideoFrame | None:
        if index < self._next:
            self._rewind()
        return next(islice(self._decoded, index - self._next, None), None)

    def _pixel_shape(self) -> Fraction:
        """Return how many times as wide as high a pixel is, as stored."""
        shape = self._stream.sample_aspect_ratio
        return Fraction(1) if not shape or abs(shape - 1) <= SQUARE else Fraction(shape)

    def _size(self) -> tuple[int, int]:
        """Return the width and the height of the pictures that are read, as stored: pixels are square."""
        width, height = self._stream.width * self._pixel_shape(), self._stream.height
        divisor = reduction(round(width), height)
        return max(1, round(width / divisor)), max(1, round(height / divisor))

    def _matted(self) -> float | None:
        """Find out how alpha is meant, if there is any: colours beyond it are not multiplied by it."""
        layers = []
        for n in sample_numbers(self.count):
            with suppress(DamagedFrameError):
                frame = self._decode(self._shown[n])
                if not _has_alpha(frame):
                    return None
                codes: npt.NDArray[Any] = frame.reformat(format="rgba", threads=1).to_ndarray()
                # white that is multiplied by alpha in linear light is the brightest that there may be
                limit = codes[..., 3:] / np.float32(255) + np.float32(BEYOND_ALPHA)
                layers.append((frame, bool((srgb_to_linear(codes[..., :3] / np.float32(255)) <= limit).all())))
        self._premultiplied = bool(layers) and all(within for _, within in layers)
        return backdrop_of(self._layer(frame) for frame, _ in layers)

    def _encoding(self) -> Encoding | None:
        """How the codes stand for light; None is sRGB."""
        return self._transfer or ENCODINGS.get(self._stream.codec_context.color_trc)

    def _codes(self, frame: av.VideoFrame) -> npt.NDArray[Any]:
        """RGB, and alpha if there is any, in codes."""
        wide = max(component.bits for component in frame.format.components) > 8
        alpha = _has_alpha(frame)
        # FFmpeg writes planes three times as fast as it writes pixels, of the same codes
        planes = not (wide or alpha or frame.format.is_rgb)
        layout = {False: ("rgb24", "rgba"), True: ("rgb48le", "rgba64le")}[wide][alpha]
        size = (self._stream.width, self._stream.height)
        if (frame.width, frame.height) != size:
            raise ClipError(
                f"{self._path}: changes its picture size from {size[0]} x {size[1]} to {frame.width} x {frame.height}; "
                "export it in one size"
            )
        width, height = self._size()
        if frame.interlaced_frame:
            self._interlaced, frame = True, self._of_one_moment(frame)
        way = _SHRINKING if width < size[0] else _GROWING
        # in this thread: after a fork of a process that has read a video, the converter waits for its own for ever
        converted = frame.reformat(width, height, "gbrp" if planes else layout, interpolation=way, threads=1)
        if planes:
            green, blue, red = (_lines(plane) for plane in converted.planes)
            return _core.interleave((red, green, blue))
        codes: npt.NDArray[Any] = converted.to_ndarray()
        return codes

    def _layer(self, frame: av.VideoFrame) -> Layer:
        codes, white = self._codes(frame), _white(frame)
        linear = decode_integers(codes, self._encoding(), white, self._premultiplied)
        opacity = decode_alpha(codes, white)
        picture = to_bt709(_upright(linear, frame), self._stream.codec_context.color_primaries)
        return picture, None if opacity is None else _upright(opacity, frame)

    def _of_one_moment(self, frame: av.VideoFrame) -> av.VideoFrame:
        """The even lines of an interlaced frame, with others between them."""
        graph = Graph()
        nodes = graph.add_buffer(self._stream), graph.add("estdif", "mode=frame:parity=tff"), graph.add("buffersink")
        graph.link_nodes(*nodes)
        graph.configure()
        graph.vpush(frame)
        graph.vpush(None)
        whole: av.VideoFrame = graph.vpull()
        return whole


def _has_alpha(frame: av.VideoFrame) -> bool:
    return any(component.is_alpha for component in frame.format.components)


def _lines(plane: VideoPlane) -> npt.NDArray[np.uint8]:
    """The codes (rows, columns) of one channel of 8 bits."""
    codes = np.frombuffer(memoryview(plane), np.uint8)
    return codes.reshape(plane.height, plane.line_size)[:, : plane.width]


def _white(frame: av.VideoFrame) -> float:
    """Return what FFmpeg's converter makes of white, as a share of the largest value: it only shifts wide codes up."""
    bits = max(component.bits for component in frame.format.components)
    if bits <= 8 or bits >= 16 or frame.format.is_rgb:
        return 1.0
    grey = len(frame.format.components) < 3  # read as of full range, whatever it says
    limited = frame.color_range != ColorRange.JPEG and not grey
    return 255 / 256 if limited else (2**bits - 1) * 2 ** (16 - bits) / 65535


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


def _unreadable(path: Path, error: Exception | None) -> ClipError:
    """Why FFmpeg cannot open a file, or finds no video in it, and what to do where that is known."""
    if path.stat().st_size == 0:
        return ClipError(f"{path}: is empty; copy or export it again")
    if lacks_index(path):
        return ClipError(
            f"{path}: breaks off before its index is complete, without which no frame is found; copy it again, or "
            "repair it"
        )
    if error is None:
        return ClipError(f"{path}: holds no video stream; choose another file")
    return ClipError(f"{path}: is not a video, or is damaged: {_reason(error)}")


def _reason(error: Exception) -> str:
    return str(error.strerror) if isinstance(error, av.FFmpegError) else str(error)
