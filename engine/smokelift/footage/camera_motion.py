"""Whether the camera of a clip moves, by where in its frames the texture of the middle one is found again.

The two pictures are cut into cells, band-passed and of one contrast everywhere, which are correlated. Before a camera
that stands still the cells are in place but for the few that smoke covers; before one that shakes, pans, zooms or
travels nearly all are found again elsewhere. No motion is estimated: what stands behind the smoke of a camera that
moves has to be given (docs/experiments/turning-camera.md).
"""

from __future__ import annotations

import numpy as np
from scipy import fft

from smokelift.footage.images import Picture, blurred, channel_mean, linear_to_srgb

FINE_SIGMA, COARSE_SIGMA, CONTRAST_SIGMA = 0.8, 3.0, 6.0
"""Standard deviations in pixels of the two Gaussians whose difference is compared, and of that over which its contrast
is measured."""

MIN_CONTRAST = 4 / 255
"""Contrast in sRGB values below which there is more noise or fog than texture (docs/experiments/turning-camera.md)."""

CELLS = 6
"""Cells along the picture's longer side, which others between them overlap by half."""

HALF = 0.5
"""Share of a cell's variance that is texture, and that is the same in another picture in which it is found again; share
of the frames in which `MIN_MOVED` of the cells are elsewhere, from which on the camera moves."""

MIN_MOVED = 0.9
"""Share of the cells that are elsewhere if the camera moves: 1 of four clips, .6 where smoke alone has texture
(docs/experiments/turning-camera.md)."""

MIN_TEXTURED, MIN_REFOUND = 1 / 3, 0.8
"""Share of the cells with texture, since less may be smoke alone before something smooth, and share of those that are
found again: .9 to 1 before cameras that move, less of smoke (docs/experiments/turning-camera.md)."""


def moves(pictures: Picture) -> bool:
    """Return whether the camera of linear pictures (frames, rows, columns, 3), small as a proxy's, moves.

    It does if nearly all that has texture is half a pixel or more from where it is in the middle one, in most of those
    in which it is found again.
    """
    shape, middle = pictures.shape[1:3], len(pictures) // 2
    side = min(round(max(shape) / CELLS), *shape)
    if side < 4 * CONTRAST_SIGMA:  # it has to hold all over which contrast is measured
        return False
    window = np.outer(*[np.hanning(side + 2)[1:-1].astype(np.float32)] * 2)
    places = np.ix_(*(np.arange(0, n - side + 1, side // 2) for n in shape))

    def cells(picture: Picture) -> Picture:
        detail = _detail(picture)
        return np.asarray(np.lib.stride_tricks.sliding_window_view(detail, (side, side))[places] * window)

    key = cells(pictures[middle])
    power = (key**2).mean((2, 3))
    textured = power > HALF * (window**2).mean()
    if textured.mean() < MIN_TEXTURED:
        return False
    moved = []
    for picture in np.delete(pictures, middle, axis=0):
        other = cells(picture)
        peaks = fft.irfft2(np.conj(fft.rfft2(key)) * fft.rfft2(other), (side, side)).reshape(*power.shape, -1)
        found = textured & (peaks.max(-1) > HALF * side**2 * np.sqrt(power * (other**2).mean((2, 3))))
        if found.sum() >= MIN_REFOUND * textured.sum():
            moved.append((peaks.argmax(-1) != 0)[found].mean() > MIN_MOVED)
    return bool(moved) and float(np.mean(moved)) > HALF


def _detail(picture: Picture) -> Picture:
    """A linear picture (rows, columns, 3) in grey, band-passed, in units of the contrast around each pixel."""
    grey = channel_mean(linear_to_srgb(picture))
    detail = blurred(grey, FINE_SIGMA) - blurred(grey, COARSE_SIGMA)
    return np.asarray(detail / np.sqrt(blurred(detail**2, CONTRAST_SIGMA) + MIN_CONTRAST**2), np.float32)
