"""Clips that are videos.

The container is first read through, without decoding, for the times of all frames. Then any frame can be read, and
frames in a row cost one decode each.

What a file says of its pictures is applied: matrix and range by FFmpeg's converter (an untagged video is read as
BT.601, as FFmpeg writes one), transfer and primaries (`image_files`), rotation and mirroring, the shape of pixels,
interlacing (one field of each frame is used) and alpha. The converter is set to round exactly: by default it is half an
8 bit step too dark.

A video whose rate varies by more than 1 % is read at its mean rate: frame n is the picture on show at n / fps.
"""

import bisect
from collections.abc import Iterator
from fractions import Fraction
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
from av.filter import Graph
from av.sidedata.sidedata import Type as SideData
from av.video.reformatter import ColorRange, Interpolation

from smokelift.checks import Finding
from smokelift.footage.frame_source import DEFAULT_FPS, ClipError, DamagedFrameError, FrameSource, StoredPicture
from smokelift.footage.image_files import (
    DECODERS,
    ENCODINGS,
    PRIMARIES,
    Encoding,
    Layer,
    Transfer,
    code_values,
    decode,
    encoded_values,
    open_container,
    readable_size,
    require_size,
    to_bt709,
)
from smokelift.footage.images import Picture, linear_to_srgb, srgb_to_linear

_EXACT = int(Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INT | Interpolation.FULL_CHR_H_INP)
_GROWING, _SHRINKING = int(Interpolation.BICUBIC) | _EXACT, int(Interpolation.AREA) | _EXACT
_FOCAL_LENGTH = "com.apple.quicktime.camera.focal_length.35mm_equivalent"
_ALPHA_DECODERS = {"vp8": "libvpx", "vp9": "libvpx-vp9"}
"""Decoders of codecs whose default decoder in FFmpeg leaves the alpha channel out."""

SQUARE = 0.01
"""Largest difference of a pixel's shape from 1 that is ignored: half a pixel in fifty."""

_COARSE_COLORS = {(2, 2): "yuv420p16le", (2, 1): "yuv422p16le"}
"""Layouts of 16 bits that hold one color for so many pixels along rows and columns (by definition)."""

QUANTIZED_FRAMES = 21
"""Frames at a file's start whose quantizers are read: their median needs no more."""


class Video(FrameSource):
    """One video stream with an index of its frames' times.

    ``_times`` are the frames' presentation times in the stream's time base, in order; ``_keys`` are those where
    decoding can start; ``_shown`` maps a frame of the clip to an index into ``_times``. A container without such times
    (raw streams, some AVI) has no keys: it is decoded once to count its frames, whose numbers are their times, and then
    only forward.
    """

    def __init__(self, path: Path, transfer: Transfer | None) -> None:
        self._path = path
        self.files = (path,)
        self._transfer = transfer
        if not path.exists():
            raise ClipError(f"{path}: no such file")
        if path.is_dir():
            raise ClipError(f"{path}: is a folder; for pictures give a pattern such as {path}/frame_####.png")
        if not path.is_file():
            raise ClipError(f"{path}: is a pipe or a device, which cannot be read twice; save it as a file")
        self._failed = False  # whether any decoding has failed
        self._lost: set[int] = set()  # indices into _times of damaged frames, not to be tried again
        self._keys: list[int] = []
        self._shown: list[int] = []
        self._start()
        self._times, broken = self._index()
        if broken:
            self._drop_undecodable_end()
            self.warning = Finding("truncated clip", {"path": str(path), "frames": len(self._times)})
        if not self._times:
            self.close()
            raise ClipError(f"{path}: holds no frame that can be decoded; export it again")
        self._varies, self._interlaced = False, False
        self.fps, self._shown = self._steady()
        self.count = len(self._shown)
        self._examine_alpha()
        self._format = self._described()
        self._set_lens({**self._container.metadata, **self._stream.metadata}.get(_FOCAL_LENGTH))

    @property
    def notes(self) -> tuple[Finding, ...]:
        return (*self._format, Finding("interlaced clip")) if self._interlaced else self._format

    def read(self, n: int) -> StoredPicture:
        frame = self._decode(self._shown[n])
        if _has_alpha(frame) or self._stream.codec_context.color_primaries in PRIMARIES:
            return self.shown(self._layer(frame))
        codes = self._codes(frame)
        upright = np.ascontiguousarray(_upright(codes, frame))
        return StoredPicture(upright, code_values(np.iinfo(codes.dtype).max, self._encoding(), _white(frame)))

    def as_held(self, picture: Picture) -> Picture:
        rows, columns = picture.shape[:2]
        held = self._stream.codec_context.format
        layout = held and _COARSE_COLORS.get(
            (round(columns / (held.chroma_width(columns) or 1)), round(rows / (held.chroma_height(rows) or 1)))
        )
        if not layout:
            return picture
        shown = np.clip(picture, 0, 1)
        codes = np.rint(65535 * linear_to_srgb(shown)).astype(np.uint16)
        frame = av.VideoFrame.from_ndarray(codes, "rgb48le")
        for each in (layout, "rgb48le"):
            frame = frame.reformat(columns, rows, each, interpolation=_GROWING, threads=1)
        coarse = srgb_to_linear(frame.to_ndarray() / np.float32(65535))
        return picture + (coarse - shown)  # what is beyond black and white stays there

    def damaged(self, first: int, last: int) -> tuple[int, ...]:
        if not self._keys:
            return ()  # only frames that decode were counted
        wanted = [self._times[self._shown[n]] for n in range(first, last + 1)]
        self._seek(wanted[0])
        good = self._good_times(wanted[-1])
        if not good.issuperset(wanted):  # as in `_found`
            self._rewind()
            good |= self._good_times(wanted[-1])
        self._rewind()
        damaged = tuple(first + n for n, time in enumerate(wanted) if time not in good)
        self._lost.update(self._shown[n] for n in damaged)
        return damaged

    def close(self) -> None:
        self._container.close()

    def _start(self) -> None:
        """Open the file at its beginning."""
        try:
            self._container = open_container(self._path)
        except (av.FFmpegError, ValueError) as error:
            raise _unreadable(self._path, error) from error
        stream = next(iter(self._container.streams.video), None)
        if stream is None:
            raise _unreadable(self._path, None)
        if stream.codec_context is None:
            raise ClipError(
                f"{self._path}: holds video of a kind that cannot be decoded; convert it, for example to H.264"
            )
        require_size(self._path, (stream.width, stream.height), ClipError)
        self._stream = stream
        # a decoder of several frames at once loses sound ones with the one that fails
        self._stream.thread_type = "SLICE" if self._failed else "AUTO"
        decoder = _ALPHA_DECODERS.get(self._stream.codec_context.name)
        self._decoder: Any = self._stream.codec_context
        if decoder is not None and self._stream.metadata.get("alpha_mode") == "1":
            self._decoder = av.CodecContext.create(av.Codec(decoder, "r"), "r")
        self._decoded = self._frames()
        self._next = 0  # index into _times of the frame that is decoded next

    def _frames(self) -> Iterator[tuple[int | None, av.VideoFrame]]:
        """Decode times and frames from where the container stands; what cannot be decoded is left out."""
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
        """Return the times of all frames, and whether the file breaks off; keep the times of key frames."""
        times, keys, seen, broken = set(), [], 0, False
        try:
            for packet in self._container.demux(self._stream):
                if packet.is_corrupt:
                    broken = True
                    break
                seen += 1
                if packet.size == 0 or packet.is_discard:  # a dropped frame, or one that an edit cuts away
                    continue
                if packet.pts is None:  # a container without times: its frames' numbers are theirs
                    self._rewind()
                    count = sum(1 for _ in self._decoded)
                    self._rewind()
                    return list(range(count)), False
                times.add(packet.pts)
                if packet.is_keyframe:
                    keys.append(packet.pts)
        except av.FFmpegError:
            broken = True
        broken = broken or seen < self._stream.frames or self._goes_on_after(sorted(times))
        self._keys = sorted(keys)
        self._rewind()
        return sorted(times) if keys else list(range(len(times))), broken

    def _goes_on_after(self, times: list[int]) -> bool:
        """Whether a file that gives no count of frames, as Matroska, is longer than its frames by more than two."""
        stream, length = self._stream, self._container.duration
        base, rate, silent = stream.time_base, stream.average_rate, len(self._container.streams) == 1
        if not (times and base and rate and length and silent) or stream.frames or stream.duration is not None:
            return False  # sound may last longer than the pictures
        frame = max(1 / rate, base * max((b - a for a, b in pairwise(times)), default=0))
        return Fraction(length, av.time_base) > times[-1] * base + 3 * frame

    def _rewind(self) -> None:
        self._container.close()
        self._start()

    def _drop_undecodable_end(self) -> None:
        """Cut the index after the last frame that decodes; only the end is read."""
        while self._times:
            try:
                self._decode(len(self._times) - 1)
                return
            except ClipError:
                self._times.pop()

    def _steady(self) -> tuple[float, list[int]]:
        """Return the frame rate and, for each frame of the clip, the index into ``_times`` of what it shows."""
        count = len(self._times)
        base = self._stream.time_base
        rate = float(self._stream.average_rate or self._stream.guessed_rate or 0)
        if not self._keys or count < 3 or base is None:
            return rate or DEFAULT_FPS, list(range(count))
        gaps = np.diff(np.array(self._times, np.float64))
        mean = (self._times[-1] - self._times[0]) / (count - 1)
        # times are whole ticks (1 ms in Matroska): at a steady rate, gaps may still differ by one
        if np.abs(gaps - mean).max() <= max(0.01 * mean, 1.0):
            steady = 1.0 / (mean * float(base))
            return rate if abs(rate - steady) < 0.01 * steady else steady, list(range(count))
        self._varies = True
        shown = [bisect.bisect_right(self._times, self._times[0] + mean * n + 0.5) - 1 for n in range(count)]
        return float(Fraction(1) / (Fraction(mean) * base)), shown

    def _described(self) -> tuple[Finding, ...]:
        """How the file's format is read."""
        context, stream = self._stream.codec_context, self._stream
        encoding, primaries = ENCODINGS.get(context.color_trc), PRIMARIES.get(context.color_primaries)
        notes = [Finding("varying frame rate", {"fps": self.fps})] * self._varies
        notes.extend(super().notes)
        if encoding in ("hlg", "pq") and self._transfer is None:
            notes.append(Finding("high dynamic range", {"transfer": encoding.upper()}))
        if primaries is not None:
            notes.append(Finding("other primaries", {"primaries": primaries[0]}))
        if self._size() != (stream.width, stream.height):
            notes.append(Finding("scaled pictures", {"size": (stream.width, stream.height), "scaled": self._size()}))
        return tuple(notes)

    def _decode(self, index: int) -> av.VideoFrame:
        """Return the frame at an index into ``_times``, decoded."""
        frame = None if index in self._lost else self._found(index)
        if frame is None:
            self._rewind()
            self._lost.add(index)
            number = bisect.bisect_left(self._shown, index)
            raise DamagedFrameError(
                f"{self._path}: frame {number} is damaged and cannot be decoded; export the clip again"
            )
        self._next = index + 1
        return frame

    def _found(self, index: int) -> av.VideoFrame | None:
        """The decoded frame, by the shortest way, or None if it is damaged."""
        wanted = self._times[index]
        reached = self._times[self._next] if self._next < len(self._times) else None
        if reached is None or wanted < reached or any(reached < key <= wanted for key in self._keys):
            self._seek(wanted)
        frame = self._forward_to(wanted)
        if frame is None:
            # a seek may land late (open groups of pictures); from the start nothing is missed
            self._rewind()
            frame = self._forward_to(wanted)
        return frame

    def _seek(self, wanted: int) -> None:
        """Go to the last key frame at or before a time, or to the start if there are no keys."""
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
        """Times of the frames that can be decoded from where the container stands up to a last one."""
        good = set()
        for time, frame in self._decoded:
            if time is not None and not frame.is_corrupt:
                good.add(time)
            if time is not None and time >= last:
                break
        return good

    def _examine_alpha(self) -> None:
        """Find out how colors are held beside alpha, and the gray to show them over, if there is alpha."""
        frames = []
        for frame in self._sound_samples(lambda n: self._decode(self._shown[n])):
            if not _has_alpha(frame):
                return
            frames.append(frame)
        encoded = (encoded_values(self._codes(frame), _white(frame)) for frame in frames)
        self._find_matte(encoded, DECODERS[self._encoding()], map(self._layer, frames))

    def _size(self) -> tuple[int, int]:
        """Return the width and height that pictures are read at, before they are turned: pixels are square."""
        shape = self._stream.sample_aspect_ratio or Fraction(1)
        square = abs(shape - 1) <= SQUARE
        return readable_size(self._stream.width * (1 if square else Fraction(shape)), self._stream.height)

    def _encoding(self) -> Encoding:
        return self._transfer or ENCODINGS.get(self._stream.codec_context.color_trc, "srgb")

    def _codes(self, frame: av.VideoFrame) -> npt.NDArray[Any]:
        """RGB, and alpha if there is any, in codes, not yet turned upright."""
        wide, alpha = max(component.bits for component in frame.format.components) > 8, _has_alpha(frame)
        # FFmpeg writes planes three times as fast as pixels, with the same codes
        layout = ("rgb24" if frame.format.is_rgb else "gbrp", "rgba", "rgb48le", "rgba64le")[2 * wide + alpha]
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
        # in this thread: after a fork of a process that has read a video, the converter waits forever for its own
        return np.asarray(shown.reformat(*size, layout, interpolation=way, threads=1).to_ndarray())

    def _layer(self, frame: av.VideoFrame) -> Layer:
        linear, alpha = decode(self._codes(frame), self._encoding(), _white(frame), self._held)
        picture = to_bt709(_upright(linear, frame), self._stream.codec_context.color_primaries)
        return picture, None if alpha is None else _upright(alpha, frame)

    def _of_one_moment(self, frame: av.VideoFrame) -> av.VideoFrame:
        """The even lines of an interlaced frame, with the lines between interpolated."""
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


def _white(frame: av.VideoFrame) -> float:
    """Return FFmpeg's white as a fraction of the largest code: the converter only shifts wide codes up."""
    bits = max(component.bits for component in frame.format.components)
    if bits <= 8 or bits >= 16 or frame.format.is_rgb:
        return 1.0
    gray = len(frame.format.components) < 3  # always read as full range
    limited = frame.color_range != ColorRange.JPEG and not gray
    return 255 / 256 if limited else (2**bits - 1) * 2 ** (16 - bits) / 65535


def _side_data(frame: av.VideoFrame, kind: SideData) -> Any:
    sides: Any = frame.side_data  # PyAV's stub knows motion vectors only
    return sides.get(kind)


def _upright(pixels: npt.NDArray[Any], frame: av.VideoFrame) -> npt.NDArray[Any]:
    """Turn and mirror a picture as its display matrix says; other than quarter turns are ignored.

    The matrix maps the stored column p and row q to the shown column a p + c q and row b p + d q.
    """
    side = _side_data(frame, SideData.DISPLAYMATRIX)
    if side is None:
        return pixels
    a, b, _, c, d = (int(v) for v in np.frombuffer(bytes(side), np.int32)[:5])
    if abs(a) < abs(c):
        pixels, a, d = np.swapaxes(pixels, 0, 1), c, b
    return pixels[:: -1 if d < 0 else 1, :: -1 if a < 0 else 1]


def _unreadable(path: Path, error: Exception | None) -> ClipError:
    """Why FFmpeg cannot open a file or finds no video in it, and what to do if that is known."""
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
    """Return whether an MP4 or QuickTime file lacks its whole index, as a recording that was cut short does.

    Such a file is a row of boxes: eight bytes of size and name, then the content (ISO/IEC 14496-12, 4.2).
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


def median_quantizer(path: Path) -> float | None:
    """Return the median of the mean quantizers, 0 to 51, of a video's first frames; None if it gives none.

    It tells how strongly a video is compressed: an encoder leaves a block unchanged where it differs by less than the
    quantizer's step, which doubles every six. Only H.264 is read; other codecs have other scales.
    """
    try:
        with open_container(path) as container:
            stream = next(iter(container.streams.video), None)
            if stream is None or stream.codec_context is None or stream.codec_context.name != "h264":
                return None
            stream.codec_context.options = {"export_side_data": "venc_params"}
            frames = islice(container.decode(stream), QUANTIZED_FRAMES)
            sides = [_side_data(frame, SideData.VIDEO_ENC_PARAMS) for frame in frames]
            means = [float(side.qp_map().mean()) for side in sides if side is not None]
    except (av.FFmpegError, ValueError, RuntimeError):  # RuntimeError: the blocks do not cover the frame
        return None
    return float(np.median(means)) if means else None
