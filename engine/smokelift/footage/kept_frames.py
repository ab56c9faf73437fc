"""The frames of a file that are kept for what looks at the same ones again."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Sequence
from typing import TypeVar

from smokelift.checks import Remark
from smokelift.footage.frame_source import FrameSource, Visitor
from smokelift.footage.stored_picture import StoredPicture

Image = TypeVar("Image", bound=StoredPicture)

KEPT_BYTES = 128 * 2**20
"""Memory for the frames of a file that are kept as they are stored: twenty of 1080p at 8 bits, for what looks at the
same ones spread over a clip."""

DECODED_BYTES = 256 * 2**20
"""Memory for the frames of a file that are kept as they were decoded, reckoned as if stored: what most videos decode to
takes half of that."""


class KeptFrames:
    """The frames of a source, of which the last ones read are kept for all clips that share it."""

    def __init__(self, source: FrameSource) -> None:
        self._source = source
        self._kept: OrderedDict[int, StoredPicture] = OrderedDict()
        self._decoded: dict[int, Callable[[], StoredPicture]] = {}
        self._damaged: dict[tuple[int, int], tuple[int, ...]] = {}
        self._expected = frozenset[int]()
        self.count, self.fps, self.warning = source.count, source.fps, source.warning
        self.files, self.lens, self.backdrop = source.files, source.lens, source.backdrop

    @property
    def notes(self) -> tuple[Remark, ...]:
        return self._source.notes

    def read(self, n: int) -> StoredPicture:
        if n in self._kept:
            self._kept.move_to_end(n)
        else:
            keep(self._kept, n, self._decoded[n]() if n in self._decoded else self._source.read(n), KEPT_BYTES)
        return self._kept[n]

    def expect(self, numbers: Sequence[int]) -> None:
        """Keep frames as they are decoded while damage is looked for, as many as fit, until others are expected."""
        size = max((image.nbytes for image in self._kept.values()), default=1)
        self._decoded.clear()
        self._expected = frozenset(numbers[: DECODED_BYTES // size])

    def damaged(self, first: int, last: int, visit: Visitor | None = None) -> tuple[int, ...]:
        def look_at(n: int, picture: Callable[[], StoredPicture]) -> None:
            if n in self._expected:
                self._decoded[n] = picture
            if visit is not None:
                visit(n, picture)

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
