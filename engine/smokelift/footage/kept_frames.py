"""The frames of a file that are kept for what looks at the same ones again."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from smokelift.checks import Remark
from smokelift.footage.frame_source import FrameSource, Look
from smokelift.footage.stored_picture import StoredPicture

Image = TypeVar("Image", bound=StoredPicture)

KEPT_BYTES = 128 * 2**20
"""Memory for the frames of a file that are kept as they are stored: twenty of 1080p at 8 bits, for what looks at the
same ones spread over a clip."""

DECODED_BYTES = 256 * 2**20
"""Memory for the frames of a file that are kept as they were decoded, reckoned as if stored: what most videos decode to
takes half of that."""


@dataclass(frozen=True)
class _Expected:
    """Frames of a source that are asked for next: for certain, or perhaps."""

    whole: frozenset[int] = frozenset()
    perhaps: frozenset[int] = frozenset()


class KeptFrames:
    """The frames of a source, of which the last ones read are kept for all clips that share it."""

    def __init__(self, source: FrameSource) -> None:
        self._source = source
        self._kept: OrderedDict[int, StoredPicture] = OrderedDict()
        self._decoded: dict[int, Callable[[], StoredPicture]] = {}
        self._damaged: dict[tuple[int, int], tuple[int, ...]] = {}
        self._expected = _Expected()
        self.count, self.fps, self.warning = source.count, source.fps, source.warning
        self.files, self.lens, self.backdrop = source.files, source.lens, source.backdrop

    @property
    def notes(self) -> tuple[Remark, ...]:
        return self._source.notes

    def read(self, n: int) -> StoredPicture:
        if n in self._kept:
            self._kept.move_to_end(n)
            return self._kept[n]
        image = self._decoded[n]() if n in self._decoded else self._source.read(n)
        keep(self._kept, n, image, KEPT_BYTES)
        return image

    def expect(self, whole: Sequence[int], perhaps: Sequence[int]) -> None:
        size = max((image.nbytes for image in self._kept.values()), default=0)
        self._decoded.clear()
        self._expected = _Expected(
            # of larger pictures the first would be gone before the last is there
            frozenset(whole if len(whole) * size <= KEPT_BYTES else ()),
            frozenset(perhaps if len(perhaps) * size <= DECODED_BYTES else ()),
        )

    def damaged(self, first: int, last: int, look: Look | None = None) -> tuple[int, ...]:
        expected = self._expected

        def look_at(n: int, picture: Callable[[], StoredPicture]) -> None:
            if n in expected.whole and n not in self._kept:
                keep(self._kept, n, picture(), KEPT_BYTES)
            if n in expected.perhaps and n not in self._kept:
                self._decoded[n] = picture
            if look is not None:
                look(n, picture)

        if (first, last) not in self._damaged:
            self._damaged[first, last] = self._source.damaged(first, last, look_at)
        return self._damaged[first, last]

    def close(self) -> None:
        self._source.close()


def keep(kept: OrderedDict[int, Image], key: int, image: Image, most: int) -> None:
    """Put a picture, which is read-only from now on, beside the last ones in so many bytes."""
    image.lock()
    kept[key] = image
    while len(kept) > max(1, most // image.nbytes):
        kept.popitem(last=False)
