"""A frame as it is stored, and what is read of it in linear light without making all of it linear."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np
import numpy.typing as npt
import scipy.sparse

import smokelift._core as _core
from smokelift.footage.images import Picture, area_average, area_weights, look_up, sum_lines

Edges = npt.NDArray[np.int32]
Cut = Callable[[npt.NDArray[Any]], npt.NDArray[Any]]
Value = TypeVar("Value", np.float32, np.uint16)


class StoredPicture(Protocol):
    """A picture (rows, columns, 3), row 0 at the top, whose values stand for linear light."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""

    @property
    def nbytes(self) -> int:
        """Memory that it takes."""

    def linear(self) -> Picture:
        """Return the linear picture (rows, columns, 3), read-only if it is kept."""

    def cut(self, part: Cut) -> StoredPicture:
        """Return some of the pixels, which a function takes whatever their values are."""

    def through(self, change: Callable[[Picture], npt.NDArray[Value]]) -> npt.NDArray[Value]:
        """Return the picture with a function applied to every linear value by itself."""

    def averaged(self, width: int, height: int) -> Picture:
        """Return the `area_average` of the linear picture."""

    def sum_lines(self, weights: scipy.sparse.csr_array) -> Picture:
        """Return sums (n, columns, 3) of the lines of the linear picture, each of weights (n, rows)."""

    def add_weighted(self, weights: Picture, edges: tuple[Edges, Edges], sums: Picture) -> None:
        """Add the linear picture, times weights of its parts, to sums.

        Parameters
        ----------
        weights : (m, n, 3)
            Of the parts.
        edges : (m + 1,), (n + 1,)
            Row, and column, where each part begins, and where the last ends.
        sums : (rows, columns, 3)
            Changed.
        """

    def filled(self, where: npt.NDArray[np.bool_], values: Picture) -> StoredPicture:
        """Return the picture with other linear values (n, 3), or the next that it can store, at some pixels."""

    def lock(self) -> None:
        """Make it read-only."""


@dataclass(frozen=True, eq=False)
class LinearPicture:
    """A picture that is stored in linear light.

    Attributes
    ----------
    values : (rows, columns, 3) float32
        Linear.
    """

    values: Picture

    @property
    def size(self) -> tuple[int, int]:
        return self.values.shape[1], self.values.shape[0]

    @property
    def nbytes(self) -> int:
        return self.values.nbytes

    def linear(self) -> Picture:
        return self.values

    def cut(self, part: Cut) -> LinearPicture:
        return LinearPicture(part(self.values))

    def through(self, change: Callable[[Picture], npt.NDArray[Value]]) -> npt.NDArray[Value]:
        return change(self.values)

    def averaged(self, width: int, height: int) -> Picture:
        return area_average(self.values, width, height)

    def sum_lines(self, weights: scipy.sparse.csr_array) -> Picture:
        return sum_lines(self.values, weights)

    def add_weighted(self, weights: Picture, edges: tuple[Edges, Edges], sums: Picture) -> None:
        lines, columns = edges
        for low, high, each in zip(lines[:-1], lines[1:], np.repeat(weights, np.diff(columns), axis=1), strict=True):
            sums[low:high] += self.values[low:high] * each

    def filled(self, where: npt.NDArray[np.bool_], values: Picture) -> LinearPicture:
        whole = self.values.copy()
        whole[where] = values
        return LinearPicture(whole)

    def lock(self) -> None:
        self.values.flags.writeable = False


@dataclass(frozen=True, eq=False)
class CodedPicture:
    """An opaque picture as the integers that it is stored in: a quarter of the memory, at 8 bits, of linear values.

    Attributes
    ----------
    codes : (rows, columns, 3) uint8 or uint16
        Row 0 at the top.
    table : (n,) float32
        Linear value of each code.
    """

    codes: npt.NDArray[np.uint8] | npt.NDArray[np.uint16]
    table: Picture

    @property
    def size(self) -> tuple[int, int]:
        return self.codes.shape[1], self.codes.shape[0]

    @property
    def nbytes(self) -> int:
        return self.codes.nbytes  # the table is that of many pictures

    def linear(self) -> Picture:
        return self.through(lambda values: values)

    def cut(self, part: Cut) -> CodedPicture:
        return CodedPicture(part(self.codes), self.table)

    def through(self, change: Callable[[Picture], npt.NDArray[Value]]) -> npt.NDArray[Value]:
        return look_up(change(self.table), self.codes)  # each code once

    def averaged(self, width: int, height: int) -> Picture:
        rows = self.codes.shape[0]
        if not 1 <= height < rows:
            return area_average(self.linear(), width, height)
        return area_average(self.sum_lines(area_weights(rows, height)), width, height)

    def sum_lines(self, weights: scipy.sparse.csr_array) -> Picture:
        if self.codes.dtype != np.uint8:
            return sum_lines(self.linear(), weights)
        codes = np.asarray(self.codes, np.uint8)
        return _core.sum_lines(codes, self.table, weights.indptr, weights.indices, weights.data)

    def add_weighted(self, weights: Picture, edges: tuple[Edges, Edges], sums: Picture) -> None:
        if self.codes.dtype == np.uint8:
            _core.add_weighted(np.asarray(self.codes, np.uint8), self.table, weights, *edges, sums)
        else:
            LinearPicture(self.linear()).add_weighted(weights, edges, sums)

    def filled(self, where: npt.NDArray[np.bool_], values: Picture) -> CodedPicture:
        codes = self.codes.copy()
        codes[where] = np.searchsorted(self.table, values).clip(max=len(self.table) - 1).astype(codes.dtype)
        return CodedPicture(codes, self.table)

    def lock(self) -> None:
        self.codes.flags.writeable = False


def chequered_averages(picture: StoredPicture, width: int, height: int, first: int) -> tuple[Picture, Picture]:
    """Resize a picture twice: by the pixels of either colour of a chequerboard, as `area_average` does by all of them.

    Parameters
    ----------
    picture
        As it is stored.
    width, height
        The new size in pixels.
    first
        0 if the pixel at the top left belongs to the first of the two pictures, 1 if to the second.
    """
    columns, rows = picture.size
    sums, shares = [], []
    for odd in (0, 1):
        weights = area_weights(rows, height).copy()
        weights.data[weights.indices % 2 != odd] = 0
        weights.eliminate_zeros()
        sums.append(picture.sum_lines(weights))
        shares.append(np.repeat(sum_lines(np.ones((rows, 1), np.float32), weights), columns, axis=1))

    def average(colour: int) -> Picture:
        """The mean of the pixels whose row and column add up to an even number, or to an odd one."""
        light, share = sums[colour].copy(), shares[colour].copy()
        light[:, 1::2], share[:, 1::2] = sums[1 - colour][:, 1::2], shares[1 - colour][:, 1::2]
        weight = np.maximum(area_average(share, width, height), np.float32(1e-6))
        return np.asarray(area_average(light, width, height) / weight[..., None], np.float32)

    return average(first), average(1 - first)
