"""A frame as it is stored, and what is read of it in linear light without making all of it linear."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
import scipy.sparse

import smokelift._core as _core
from smokelift.footage.images import Picture, area_average, area_weights, look_up, sum_lines

Edges = npt.NDArray[np.int32]
Value = TypeVar("Value", np.float32, np.uint16)


@dataclass(frozen=True, eq=False)
class StoredPicture:
    """A picture whose values stand for linear light: integers take a quarter of the memory, at 8 bits.

    Attributes
    ----------
    values : (rows, columns, 3) float32, uint8 or uint16
        Linear light, or codes; row 0 at the top.
    table : (n,) float32, optional
        Linear value of each code; None where the values are linear.
    """

    values: npt.NDArray[Any]
    table: Picture | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.values.shape[1], self.values.shape[0]

    def linear(self) -> Picture:
        """Return the linear picture (rows, columns, 3), read-only if it is kept."""
        return self.values if self.table is None else look_up(self.table, self.values)

    def cut(self, part: Callable[[npt.NDArray[Any]], npt.NDArray[Any]]) -> StoredPicture:
        """Return some of the pixels, which a function takes whatever their values are."""
        return StoredPicture(part(self.values), self.table)

    def through(self, change: Callable[[Picture], npt.NDArray[Value]]) -> npt.NDArray[Value]:
        """Return the picture with a function applied to every linear value by itself, to each code once."""
        return change(self.values) if self.table is None else look_up(change(self.table), self.values)

    def averaged(self, width: int, height: int) -> Picture:
        """Return the `area_average` of the linear picture."""
        rows = len(self.values)
        lines = self.sum_lines(area_weights(rows, height)) if 1 <= height < rows else self.linear()
        return area_average(lines, width, height)

    def sum_lines(self, weights: scipy.sparse.csr_array) -> Picture:
        """Return sums (n, columns, 3) of the lines of the linear picture, each of weights (n, rows)."""
        if self.table is None or self.values.dtype != np.uint8:
            return sum_lines(self.linear(), weights)
        return _core.sum_lines(self.values, self.table, weights.indptr, weights.indices, weights.data)

    def add_weighted(self, weights: Picture, edges: tuple[Edges, Edges], sums: Picture) -> None:
        """Add the linear picture, times weights (m, n, 3) of its parts, to sums (rows, columns, 3).

        The edges (m + 1,) and (n + 1,) are the row, and the column, where each part begins, and where the last ends.
        """
        if self.table is None or self.values.dtype != np.uint8:
            rows, columns = (np.diff(each) for each in edges)
            sums += self.linear() * np.repeat(np.repeat(weights, rows, axis=0), columns, axis=1)
        else:
            _core.add_weighted(self.values, self.table, weights, *edges, sums)


def chequered_averages(picture: StoredPicture, width: int, height: int, first: int) -> tuple[Picture, Picture]:
    """Resize a picture twice: by the pixels of either colour of a chequerboard, as `area_average` does by all of them.

    ``first`` is 0 if the pixel at the top left belongs to the first of the two pictures, 1 if to the second.
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
