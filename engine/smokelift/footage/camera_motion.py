"""Whether the camera of a clip moves: the texture of the middle frame is searched in every other one.

Both pictures are band-passed, brought to one contrast, cut into cells and correlated. If the camera stands still, all
cells are in place but the few that smoke covers; if it shakes, pans, zooms or travels, nearly all are found elsewhere.
No motion is estimated: the background of a camera that moves has to be given (docs/experiments/turning-camera.md).
"""

from __future__ import annotations

import numpy as np
from scipy import fft

from smokelift.footage.images import Picture, blurred, channel_mean, linear_to_srgb

FINE_SIGMA, COARSE_SIGMA, CONTRAST_SIGMA = 0.8, 3.0, 6.0
"""Standard deviations, in pixels, of the band-pass's two Gaussians, and of the one that measures its contrast."""

MIN_CONTRAST = 4 / 255
"""Contrast in sRGB values below which there is more noise or fog than texture (docs/experiments/turning-camera.md)."""

CELLS = 6
"""Cells side by side along the picture's longer side; the cells between these overlap them by half."""

HALF = 0.5
"""Share of a cell's variance that must be texture; correlation at which it is found again; and share of the frames in
which `MIN_MOVED` of the cells are elsewhere, above which the camera moves."""

MIN_MOVED = 0.9
"""Share of the cells that are elsewhere if the camera moves. Four clips have 1; where smoke alone has texture it is .6
(docs/experiments/turning-camera.md)."""

MIN_TEXTURED, MIN_REFOUND = 1 / 3, 0.8
"""Smallest share of cells with texture (less may be smoke alone before something smooth), and of these found again:
cameras that move have .9 to 1, smoke has less (docs/experiments/turning-camera.md)."""


def moves(pictures: Picture) -> bool:
    """Return whether the camera of a proxy's linear pictures (frames, rows, columns, 3) moves.

    It does if nearly all texture is half a pixel or more away from its place in the middle picture, in most of the
    pictures that show it again.
    """
    shape, middle = pictures.shape[1:3], len(pictures) // 2
    side = min(round(max(shape) / CELLS), *shape)
    if side < 4 * CONTRAST_SIGMA:  # a cell must hold the area that contrast is measured over
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
    """The band-passed grey of a linear picture (rows, columns, 3), in units of the contrast around each pixel."""
    grey = channel_mean(linear_to_srgb(picture))
    detail = blurred(grey, FINE_SIGMA) - blurred(grey, COARSE_SIGMA)
    return np.asarray(detail / np.sqrt(blurred(detail**2, CONTRAST_SIGMA) + MIN_CONTRAST**2), np.float32)
