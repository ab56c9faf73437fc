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
from av.video.stream import VideoStream

import smokelift._core as _core
from smokelift.checks import Remark
from smokelift.footage.colour import ENCODINGS, Encoding, primaries_name, to_bt709
from smokelift.footage.frame_source import (
    DEFAULT_FPS,
    ClipError,
    DamagedFrameError,
    Layer,
    StoredPicture,
    backdrop_of,
    focal_length,
    shown_before,
    sound_samples,
)
from smokelift.footage.images import (
    Transfer,
    code_values,
    decode_alpha,
    decode_integers,
    open_container,
    readable_size,
    size_refusal,
    srgb_to_linear,
)

_EXACT = int(Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INT | Interpolation.FULL_CHR_H_INP)
_GROWING, _SHRINKING = int(Interpolation.BICUBIC) | _EXACT, int(Interpolation.AREA) | _EXACT
_FOCAL_LENGTH = "com.apple.quicktime.camera.focal_length.35mm_equivalent"
_ALPHA_DECODERS = {"vp8": "libvpx", "vp9": "libvpx-vp9"}
"""FFmpeg's own decoders of these leave the alpha channel out."""

BEYOND_ALPHA = 0.02
"""Share of white by which colours may exceed alpha through rounding and compression."""

SQUARE = 0.01
"""Difference from 1 of the shape of pixels that is not worth another grid of pixels: half a pixel in fifty."""

QUANTISED_FRAMES = 21
"""Frames at the start of a file whose quantisers are read: their median needs no more."""


class Video:
    """One video stream with an index of the times of its frames; a `FrameSource`.

    ``_times`` are the frames' presentation times in the stream's time base, in order; ``_keys`` those where
    decoding can start; ``_shown`` maps a frame of the clip to one of them. Containers without presentation
    times (raw streams, some AVI) have no keys: they are decoded once to count, which gives their times, and then only
    forward.
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
        self._keys: list[int] = []
        self._start()
        self._times, broken = self._index()
        if broken:
            self._drop_undecodable_end()
            self.warning = Remark("truncated clip", {"path": str(path), "frames": len(self._times)})
        if not self._times:
            self.close()
            raise ClipError(f"{path}: holds no frame that can be decoded; export it again")
        self._varies, self._interlaced, self._premultiplied = False, False, False
        self.fps, self._shown = self._steady()
        self.count = len(self._shown)
        self.backdrop = self._matted()
        self._format = self._described()
        self.lens = focal_length({**self._container.metadata, **self._stream.metadata}.get(_FOCAL_LENGTH))

    @property
    def notes(self) -> tuple[Remark, ...]:
        """How the pictures are read, as far as they have been."""
        return (*self._format, Remark("interlaced clip")) if self._interlaced else self._format

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
        if not self._keys:
            return ()  # they were counted by decoding them
        wanted = [self._times[self._shown[n]] for n in range(first, last + 1)]
        from_start = self._failed and wanted[0] == self._times[0]  # and one frame at a time
        self._seek(wanted[0])
        good = self._good_times(wanted[-1])
        if not (from_start or good.issuperset(wanted)):  # as in `_found`
            self._rewind()
            good |= self._good_times(wanted[-1])
        self._rewind()
        damaged = tuple(first + n for n, time in enumerate(wanted) if time not in good)
        self._lost.update(self._shown[n] for n in damaged)
        return damaged

    def close(self) -> None:
        """Close the file."""
        self._container.close()

    def _start(self) -> None:
        """Open the file at its beginning."""
        try:
            self._container = open_container(self._path)
        except (av.FFmpegError, ValueError) as error:
            raise _unreadable(self._path, error) from error
        try:
            self._stream = self._usable_stream()
        except ClipError:
            self._container.close()
            raise
        # A decoder of several frames at once takes sound ones along when one fails.
        self._stream.thread_type = "SLICE" if self._failed else "AUTO"
        decoder = _ALPHA_DECODERS.get(self._stream.codec_context.name)
        self._decoder: Any = self._stream.codec_context
        if decoder is not None and self._stream.metadata.get("alpha_mode") == "1":
            self._decoder = av.CodecContext.create(av.Codec(decoder, "r"), "r")
        self._decoded = self._frames()
        self._next = 0  # index into _times of the frame that decoding on will give

    def _usable_stream(self) -> VideoStream:
        if not self._container.streams.video:
            raise _unreadable(self._path, None)
        stream = self._container.streams.video[0]
        if stream.codec_context is None:
            raise ClipError(
                f"{self._path}: holds video of a kind that cannot be decoded; convert it, for example to H.264"
            )
        if refusal := size_refusal(stream.width, stream.height):
            raise ClipError(f"{self._path}: {refusal}")
        return stream

    def _frames(self) -> Iterator[tuple[int | None, av.VideoFrame]]:
        """Decode on from where the container stands: times and frames, without what cannot be decoded."""
        packets = self._container.demux(self._stream)
        count = 0
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
            for frame in frames:
                yield frame.pts if self._keys else count, frame
                count += 1

    def _index(self) -> tuple[list[int], bool]:
        """Return the times of all frames, and whether the file broke off; keep those of the key frames."""
        times, keys, seen, broken = set(), [], 0, False
        try:
            for packet in self._container.demux(self._stream):
                if packet.is_corrupt:
                    broken = True
                    break
                seen += 1
                if packet.size == 0 or packet.is_discard:  # a dropped frame, or one that an edit cuts away
                    continue
                if packet.pts is None:
                    return self._counted(), False
                times.add(packet.pts)
                if packet.is_keyframe:
                    keys.append(packet.pts)
        except av.FFmpegError:
            broken = True
        broken = broken or seen < self._promised()
        self._keys = sorted(keys)
        self._rewind()
        return sorted(times) if keys else list(range(len(times))), broken

    def _promised(self) -> int:
        """Return how many frames the file says it holds; 0 if it does not say."""
        stream, length = self._stream, self._container.duration
        if stream.frames or stream.duration is not None or length is None or stream.average_rate is None:
            return stream.frames
        # Matroska counts no frames, but knows how long the whole is, give or take one. Sound may last longer.
        alone = len(self._container.streams) == 1
        return int(length * stream.average_rate / av.time_base) - 1 if alone else 0

    def _counted(self) -> list[int]:
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

    def _steady(self) -> tuple[float, list[int]]:
        """Return the frame rate and, for each frame of the clip, the decoded frame that it shows."""
        count = len(self._times)
        base = self._stream.time_base
        rate = float(self._stream.average_rate or self._stream.guessed_rate or 0)
        if not self._keys or count < 3 or base is None:
            return rate or DEFAULT_FPS, list(range(count))
        gaps = np.diff(np.array(self._times, np.float64))
        mean = (self._times[-1] - self._times[0]) / (count - 1)
        # Times are whole ticks: a gap may be off by one without the rate being another (Matroska: 1 ms).
        if np.abs(gaps - mean).max() <= max(0.01 * mean, 1.0):
            steady = 1.0 / (mean * float(base))
            return rate if abs(rate - steady) < 0.01 * steady else steady, list(range(count))
        self._varies = True
        shown = [bisect.bisect_right(self._times, self._times[0] + mean * n + 0.5) - 1 for n in range(count)]
        return float(Fraction(1) / (Fraction(mean) * base)), shown

    def _described(self) -> tuple[Remark, ...]:
        """How the file's format is read."""
        context, stream = self._stream.codec_context, self._stream
        encoding, primaries = ENCODINGS.get(context.color_trc), primaries_name(context.color_primaries)
        notes = [Remark("varying frame rate", {"fps": self.fps})] * self._varies
        if encoding in ("hlg", "pq") and self._transfer is None:
            notes.append(Remark("high dynamic range", {"transfer": encoding.upper()}))
        if primaries is not None:
            notes.append(Remark("other primaries", {"primaries": primaries}))
        if self._size() != (stream.width, stream.height):
            notes.append(Remark("scaled pictures", {"size": (stream.width, stream.height), "scaled": self._size()}))
        return tuple(notes)

    def _decode(self, index: int) -> av.VideoFrame:
        """Return the decoded frame at an index into ``_times``."""
        frame = None if index in self._lost else self._found(index)
        if frame is None:
            self._rewind()
            self._lost.add(index)
            raise DamagedFrameError(
                f"{self._path}: frame {index} is damaged and cannot be decoded; export the clip again"
            )
        self._next = index + 1
        return frame

    def _found(self, index: int) -> av.VideoFrame | None:
        """The decoded frame, by the shortest way; None if it is damaged."""
        wanted = self._times[index]
        reached = self._times[self._next] if self._next < len(self._times) else None
        if reached is None or wanted < reached or any(reached < key <= wanted for key in self._keys):
            self._seek(wanted)
        frame = self._forward_to(wanted)
        if frame is None:
            # A seek may land late (open groups of pictures); from the start nothing can be missed.
            self._rewind()
            frame = self._forward_to(wanted)
        return frame

    def _seek(self, wanted: int) -> None:
        """Go to the last key frame at or before a time; to the start where there are none."""
        if not self._keys:
            self._rewind()
            return
        self._container.seek(wanted, stream=self._stream)
        self._decoded = self._frames()

    def _forward_to(self, wanted: int) -> av.VideoFrame | None:
        for time, frame in self._decoded:
            if time is not None and time >= wanted:
                return frame if time == wanted and not (frame.is_corrupt and self._keys) else None
        return None

    def _good_times(self, last: int) -> set[int]:
        """Times of the frames that can be decoded from where the container stands, up to one."""
        good = set()
        for time, frame in self._decoded:
            if time is not None and not frame.is_corrupt:
                good.add(time)
            if time is not None and time >= last:
                break
        return good

    def _matted(self) -> float | None:
        """Find out how alpha is meant, and what is shown behind it; None if there is none."""
        frames = []
        for frame in sound_samples(self.count, lambda n: self._decode(self._shown[n])):
            if not _has_alpha(frame):
                return None
            frames.append(frame)
        self._premultiplied = bool(frames) and all(map(_is_premultiplied, frames))
        return backdrop_of(map(self._layer, frames))

    def _size(self) -> tuple[int, int]:
        """Return width and height of the pictures that are read, as stored: pixels are square."""
        shape = self._stream.sample_aspect_ratio or Fraction(1)
        square = abs(shape - 1) <= SQUARE
        return readable_size(self._stream.width * (1 if square else Fraction(shape)), self._stream.height)

    def _encoding(self) -> Encoding | None:
        """How the codes stand for light; None is sRGB."""
        return self._transfer or ENCODINGS.get(self._stream.codec_context.color_trc)

    def _codes(self, frame: av.VideoFrame) -> npt.NDArray[Any]:
        """RGB, and alpha if there is any, in codes, as stored."""
        wide = max(component.bits for component in frame.format.components) > 8
        alpha = _has_alpha(frame)
        # FFmpeg writes planes three times as fast as it writes pixels, of the same codes
        planes = not (wide or alpha or frame.format.is_rgb)
        layout = {False: ("rgb24", "rgba"), True: ("rgb48le", "rgba64le")}[wide][alpha]
        width, height = self._stream.width, self._stream.height
        if (frame.width, frame.height) != (width, height):
            raise ClipError(
                f"{self._path}: changes its picture size from {width} x {height} to {frame.width} x {frame.height}; "
                "export it in one size"
            )
        size, shown = self._size(), frame
        if frame.interlaced_frame:
            self._interlaced, shown = True, self._of_one_moment(frame)
        way = _SHRINKING if size[0] < width else _GROWING
        # in this thread: after a fork of a process that has read a video, the converter waits for its own for ever
        converted = shown.reformat(*size, "gbrp" if planes else layout, interpolation=way, threads=1)
        if planes:
            green, blue, red = (_lines(plane) for plane in converted.planes)
            return _core.interleave((red, green, blue))
        codes: npt.NDArray[Any] = converted.to_ndarray()
        return codes

    def _layer(self, frame: av.VideoFrame) -> Layer:
        codes, white = self._codes(frame), _white(frame)
        linear = _upright(decode_integers(codes, self._encoding(), white, self._premultiplied), frame)
        alpha = decode_alpha(codes, white)
        picture = to_bt709(linear, self._stream.codec_context.color_primaries)
        return picture, None if alpha is None else _upright(alpha, frame)

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


def _is_premultiplied(frame: av.VideoFrame) -> bool:
    """Whether colours are multiplied by alpha: none is brighter than white multiplied by it in linear light."""
    pixels = frame.reformat(format="rgba", threads=1).to_ndarray() / np.float32(255)
    return bool((srgb_to_linear(pixels[..., :3]) <= pixels[..., 3:] + np.float32(BEYOND_ALPHA)).all())


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


def _side_data(frame: av.VideoFrame, kind: SideData) -> Any:
    sides: Any = frame.side_data  # PyAV's stub of it knows motion vectors only
    return sides.get(kind)


def _upright(pixels: npt.NDArray[Any], frame: av.VideoFrame) -> npt.NDArray[Any]:
    """Turn and mirror a picture as its display matrix says; angles other than quarter turns are ignored.

    The matrix sends the stored column p and row q to the shown column a p + c q and row b p + d q.
    """
    side = _side_data(frame, SideData.DISPLAYMATRIX)
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
    return ClipError(f"{path}: is not a video, or is damaged: {getattr(error, 'strerror', None) or error}")


def lacks_index(path: Path) -> bool:
    """Return whether a file is an MP4 or QuickTime one without its whole index, as a recording that was cut short is.

    Such a file is a row of boxes: eight bytes with size and name, and what it holds (ISO/IEC 14496-12, 4.2).
    """
    with path.open("rb") as file:
        if file.read(8)[4:] != b"ftyp":
            return False
        start, end = 0, path.stat().st_size
        while start + 8 <= end:
            file.seek(start)
            head = file.read(16)
            size = int.from_bytes(head[:4], "big")
            if size == 1:  # the true size follows the name
                size = int.from_bytes(head[8:], "big")
            if head[4:8] == b"moov":
                return start + size > end
            if size < 8:  # 0: up to the end of the file
                break
            start += size
    return True


def median_quantiser(path: Path) -> float | None:
    """Return the median of the mean quantisers of a video's first frames, 0 to 51; None where the file gives none.

    They say how strongly a video is compressed: an encoder leaves a block as it was where it differs by less than the
    quantiser's step, which doubles every six. Those of H.264 are read; other codecs have other scales.
    """
    try:
        with open_container(path) as container:
            stream = next(iter(container.streams.video), None)
            if stream is None or stream.codec_context is None or stream.codec_context.name != "h264":
                return None
            stream.codec_context.options = {"export_side_data": "venc_params"}
            frames = islice(container.decode(stream), QUANTISED_FRAMES)
            sides = [_side_data(frame, SideData.VIDEO_ENC_PARAMS) for frame in frames]
            means = [float(side.qp_map().mean()) for side in sides if side is not None]
    except (av.FFmpegError, ValueError, RuntimeError):  # the last if the blocks do not cover the frame
        return None
    return float(np.median(means)) if means else None
