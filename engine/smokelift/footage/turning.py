"""How the camera of a clip turned in each frame, found on what stands still.

A camera that turns about its centre maps one picture to another by K R K^-1, whatever the distance of what it shows
(Szeliski and Shum, "Creating full view panoramic image mosaics and environment maps", 1997): three numbers a frame.
Every frame is laid on the clip's middle one. Cells of the two pictures, band-passed and of one contrast everywhere, are
correlated; the turn is fitted to their shifts with a weight that leaves out what moves by itself (Tukey's biweight),
and they are compared again once the frame is turned.

Before a camera that stands still, cells that are found again are where they were; before one that turns, where the turn
takes them. If they are elsewhere the camera travels or zooms, and the clip is refused.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage
from scipy.spatial.transform import Rotation

from smokelift.checks.array_types import Doubles
from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture, blurred, channel_mean, linear_to_srgb
from smokelift.footage.proxy import proxy_size
from smokelift.scene import Camera, as_matrix

FINE_SIGMA, COARSE_SIGMA, CONTRAST_SIGMA = 0.8, 3.0, 6.0
"""Standard deviations in pixels of the two Gaussians whose difference is compared, and of that over which its contrast
is measured."""

MIN_CONTRAST = 3 / 255
"""Contrast in sRGB values below which there is more noise than texture."""

CELLS = 6
"""Cells along the picture's longer side; others between them overlap them by half."""

TEXTURE = 0.5
"""Mean square of a cell, in units of its contrast and `MIN_CONTRAST` together, from which on contrast is greater."""

SAME = 0.5
"""Correlation of a cell in two pictures from which on it is found again: half of its variance is the same."""

IN_PLACE = 0.5
"""Pixels of a proxy up to which a cell is where it is expected."""

ITERATIONS, CONVERGED = 5, 0.02
"""Times that a frame is compared at most, and pixels of a step that is no more worth while: turns are no surer."""

TUKEY, DEVIATION, MIN_SPREAD = 4.685, 1.4826, 0.02
"""Standard deviations from which on a shift counts nothing (95 % efficiency on normal ones), the standard deviation of
normal values over the median of their magnitudes, and the least one of shifts, in pixels."""

MIN_CELLS, MIN_FOUND = 8, 0.2
"""Cells with texture, and share of them that are found again, that can tell a turn: smoke may cover the others."""

EXPLAINED, MOSTLY = 0.7, 0.5
"""Share of the cells that are found again which are in place if the turn is right: .75 to 1 before cameras that turn,
less in some frames of clips whose smoke fills the picture or whose camera travels (docs/experiments/turning-camera.md).
Share of them that are in place before a camera that stands still."""

FIRST_FRAMES = 12
"""Frames that are examined first: less than `MOVING_FRAMES` of a clip lie between two of them."""

MOVING_FRAMES = 0.1
"""Share of the frames that have to be moved: a knock is not worth a panorama."""

UNEXPLAINED, LOST, MIN_LOST = 0.1, 12, 6
"""Share of the frames that no turn has to explain, such frames on a side of the middle one after which none is
looked for, and such frames before a camera that travels, at least."""

TEXTURE_EVERYWHERE, REFOUND = 1 / 3, 0.8
"""Share of the cells that need texture before a camera is refused, since less may be smoke alone before something
smooth, and share of those that are found again in most frames: .97 to 1 before cameras that travel, less of smoke."""

MIN_OFFSET = 1.0
"""Pixels that the picture has to be off its mean place in some frame: less blurs it no more than a lens does."""


@dataclass(frozen=True)
class Laid:
    """How a frame lies on the key frame.

    Attributes
    ----------
    turn
        Of directions of the key frame into those of the frame; x right, y down, z forward.
    found
        Share of the key frame's cells with texture that are found again.
    in_place
        Share of these that are where the turn takes them.
    step : (3,)
        By how much it would have to turn more, in the key frame.
    """

    turn: Rotation
    found: float
    in_place: float
    step: Doubles

    @property
    def explained(self) -> bool:
        """Whether the turn explains what is found again."""
        return self.found >= MIN_FOUND and self.in_place >= EXPLAINED

    @property
    def stands(self) -> bool:
        """Whether the turn explains most of it."""
        return self.found >= MIN_FOUND and self.in_place >= MOSTLY


class Key:
    """The frame that others are laid on.

    Parameters
    ----------
    picture : (rows, columns, 3)
        Linear, of a proxy's size.
    lens : (3, 3)
        Of it, from directions to pixels.

    Attributes
    ----------
    textured : (cells,) bool
        Which cells have texture.
    """

    def __init__(self, picture: Picture, lens: Doubles) -> None:
        self._lens, detail = lens, detail_of(picture)
        self._shape = rows, columns = detail.shape
        self._side = side = max(8, 2 * round(max(rows, columns) / CELLS / 2))
        self._rows, self._columns = (np.arange(0, n - side + 1, side // 2) for n in (rows, columns))
        fading = np.hanning(side + 2)[1:-1].astype(np.float32)
        self._window = np.outer(fading, fading)
        self._whole, cells = fft.rfft2(detail), self._cut(detail)
        self._cells, self._power = fft.rfft2(cells), (cells**2).mean((1, 2))
        self.textured = self._power > TEXTURE * (self._window**2).mean()
        places = np.stack(np.meshgrid(self._columns, self._rows), -1).reshape(-1, 2) + side / 2
        a, b = ((places - lens[:2, 2]) / lens[[0, 1], [0, 1]]).T
        # a ray (a, b, 1) that turns by w moves by w x ray, and its place on the plane z = 1 by that less its drift
        turned = np.stack([-a * b, 1 + a**2, -b, -1 - b**2, a * b, a], -1).reshape(-1, 2, 3)
        self._slopes = turned * lens[[0, 1], [0, 1]][:, None]

    def lay(self, detail: Picture, start: Rotation) -> Laid:
        """Find how the camera turned to a picture, given by `detail_of`, from where it is thought to look."""
        laid = self._turned(detail, start)
        if laid.explained:
            return laid
        # it may have moved too far to be found from there: about how far, but for roll, the whole picture tells
        (_,), ((across, down),) = _highest(fft.irfft2(np.conj(self._whole) * fft.rfft2(detail), self._shape)[None])
        aside = [-np.arctan(down / self._lens[1, 1]), np.arctan(across / self._lens[0, 0]), 0.0]
        found = self._turned(detail, Rotation.from_rotvec(aside))
        return found if found.explained else laid

    def _turned(self, detail: Picture, start: Rotation) -> Laid:
        laid = self.compare(detail, start)
        for _ in range(ITERATIONS - 1):
            if np.abs(laid.step).max() * self._lens[0, 0] < CONVERGED:
                break
            laid = self.compare(detail, laid.turn * Rotation.from_rotvec(laid.step))
        return laid

    def compare(self, detail: Picture, turn: Rotation) -> Laid:
        """Compare a picture, given by `detail_of`, with this one, when the camera turned so from one to the other."""
        rows, columns = self._shape
        x, y = np.arange(columns) + 0.5, np.arange(rows)[:, None] + 0.5
        matrix = self._lens @ turn.as_matrix() @ np.linalg.inv(self._lens)
        across, down, ahead = (a * x + (b * y + c) for a, b, c in matrix)
        across, down = across / ahead, down / ahead
        inside = (across > 1) & (across < columns - 1) & (down > 1) & (down < rows - 1) & (ahead > 0)
        seen = ndimage.map_coordinates(detail, [down - 0.5, across - 0.5], order=1, mode="nearest") * inside
        cells = self._cut(seen)
        correlation = fft.irfft2(np.conj(self._cells) * fft.rfft2(cells), cells.shape[1:])
        best, shifts = _highest(correlation / self._side**2)
        compared = self.textured & (self._cut(inside).mean((1, 2)) > 0.9 * self._window.mean())
        found = compared & (best > SAME * np.sqrt(self._power * (cells**2).mean((1, 2))))
        weight, step = found.astype(np.float64), np.zeros(3)
        for _ in range(ITERATIONS if found.any() else 0):
            weighted = (self._slopes * weight[:, None, None]).reshape(-1, 3)
            step = np.linalg.lstsq(weighted.T @ self._slopes.reshape(-1, 3), weighted.T @ shifts.ravel(), None)[0]
            away = np.hypot(*(shifts - self._slopes @ step).T)
            spread = max(DEVIATION * float(np.median(away[found])), MIN_SPREAD)
            weight = found * np.maximum(1 - (away / (TUKEY * spread)) ** 2, 0) ** 2
        in_place = int((found & (np.hypot(*shifts.T) < IN_PLACE)).sum()) / max(int(found.sum()), 1)
        return Laid(turn, int(found.sum()) / max(int(compared.sum()), MIN_CELLS), in_place, step)

    def _cut(self, picture: NDArray[Any]) -> Picture:
        """The cells (cells, side, side) of a picture, each faded out towards its sides."""
        cells = np.lib.stride_tricks.sliding_window_view(picture, (self._side,) * 2)
        return np.asarray(cells[self._rows[:, None], self._columns] * self._window).reshape(-1, *(self._side,) * 2)


@dataclass(frozen=True, eq=False)
class Turns:
    """How a camera turned about its centre.

    Attributes
    ----------
    size
        Width and height of its pictures.
    lens : (3, 3)
        From directions to pixels.
    rotations
        Turn directions of each frame into those of the camera's mean pose; x right, y down, z forward.
    key, of_key
        The frame that the others were laid on, and the rotation of its directions.
    """

    size: tuple[int, int]
    lens: Doubles
    rotations: Rotation
    key: Key
    of_key: Rotation

    @property
    def farthest(self) -> float:
        """Pixels by which a corner of the picture is off its mean place, at most."""
        width, height = self.size
        corners = np.array([(0, 0), (width, 0), (0, height), (width, height)], np.float64)
        away = [moved(corners, self.between(turn)) - corners for turn in self.rotations]
        return float(np.linalg.norm(away, axis=-1).max())

    def between(self, turn: Rotation) -> Doubles:
        """Return the homography (3, 3) of places in a picture whose directions turn so."""
        return np.asarray(self.lens @ turn.as_matrix() @ np.linalg.inv(self.lens))

    def of(self, picture: Picture) -> Rotation | None:
        """Return the rotation of another frame of the shot, from a linear picture of a proxy's size; None of others."""
        laid = self.key.lay(detail_of(picture), Rotation.identity())
        return self.of_key * laid.turn.inv() if laid.explained else None

    def carried(self, camera: Camera) -> Camera:
        """Return a camera that stands in the mean pose with a matrix for every frame."""
        axes = np.diag([1.0, -1.0, -1.0])  # a camera's y is up, and it looks along -z
        matrices = []
        for turn in self.rotations.as_matrix():
            matrix = np.array(camera.matrix)
            matrix[:3, :3] = matrix[:3, :3] @ axes @ turn @ axes
            matrices.append(as_matrix(matrix))
        return replace(camera, matrix=matrices[0], matrices=tuple(matrices))


def find_turns(clip: Clip, *lenses: Doubles) -> Turns | None:
    """Find how the camera of a clip turned; None if it stood still or if nothing in the picture tells.

    Parameters
    ----------
    clip
        The footage.
    lenses : (3, 3)
        Of its frames, from directions to pixels; of several that it may have, the first with which turns explain them
        is taken.

    Raises
    ------
    ClipError
        If a frame cannot be read.
    ValueError
        If the camera moves in another way.
    """
    size, middle = proxy_size(*clip.size), len(clip) // 2
    scale = np.diag([size[0] / clip.size[0], size[1] / clip.size[1], 1.0])
    picture = clip.stored(middle).averaged(*size)
    keys = [Key(picture, scale @ lens) for lens in lenses]
    if keys[0].textured.sum() < MIN_CELLS or _stands_still(clip, keys[0], size):
        return None
    for lens, key in zip(lenses, keys, strict=True):
        turns, moving, lost = _followed(clip, key, size)
        if len(turns) == len(clip) and len(lost) <= UNEXPLAINED * len(clip):
            rotations = Rotation.concatenate([turns[number] for number in range(len(clip))]).inv()
            mean = rotations.mean().inv()
            found = Turns(clip.size, lens, mean * rotations, key, mean)
            return found if moving >= MOVING_FRAMES * len(clip) and found.farthest >= MIN_OFFSET else None
        # in a few frames, or a part of them, smoke alone moves so; a cell is found again whatever the lens
        if sum(lost) < max(MIN_LOST, len(lost) / 2):
            return None
    if keys[0].textured.mean() < TEXTURE_EVERYWHERE:
        return None
    raise ValueError(
        "The picture moves as if the camera travels or zooms, which cannot be steadied. Track it in Blender, and give "
        "its camera and a clean plate. If it stood still, give a clean plate, or a color, as background."
    )


def _followed(clip: Clip, key: Key, size: tuple[int, int]) -> tuple[dict[int, Rotation], int, list[bool]]:
    """How the camera turned from the key frame to others, as far as it is followed; how many of them show that it
    moves; and of each that no turn explains whether a camera that travels would."""
    middle, still = len(clip) // 2, Rotation.identity()
    turns, moving, lost = {middle: still}, 0, list[bool]()
    for numbers in (range(middle + 1, len(clip)), range(middle - 1, -1, -1)):
        turn, before = still, len(lost)
        for number in numbers:
            detail = detail_of(clip.stored(number).averaged(*size))
            laid = key.lay(detail, turn)
            if laid.explained:
                turn, moving = laid.turn, moving + (not key.compare(detail, still).stands)
            else:
                lost.append(laid.found >= REFOUND and not key.compare(detail, still).stands)
            turns[number] = turn
            if len(lost) - before == LOST:
                break
    return turns, moving, lost


def moved(places: Doubles, matrix: Doubles) -> Doubles:
    """Return where a homography (3, 3) takes places (n, 2)."""
    across, down, ahead = matrix @ np.column_stack([places, np.ones(len(places))]).T
    return np.column_stack([across / ahead, down / ahead])


def detail_of(picture: Picture) -> Picture:
    """Return a linear picture (rows, columns, 3) in grey, band-passed, in units of the contrast around each pixel."""
    grey = channel_mean(linear_to_srgb(picture))
    detail = blurred(grey, FINE_SIGMA) - blurred(grey, COARSE_SIGMA)
    return np.asarray(detail / np.sqrt(blurred(detail**2, CONTRAST_SIGMA) + MIN_CONTRAST**2), np.float32)


def _stands_still(clip: Clip, key: Key, size: tuple[int, int]) -> bool:
    """Whether most of some frames show all where it was, and a turn explains none of the others better."""
    stands = list[bool]()
    for number in set(clip.spread(FIRST_FRAMES)) - {len(clip) // 2}:
        detail = detail_of(clip.stored(number).averaged(*size))
        stands.append(key.compare(detail, Rotation.identity()).stands)
        if not stands[-1] and key.lay(detail, Rotation.identity()).explained:
            return False
    return 2 * sum(stands) >= len(stands)


def _highest(peaks: Picture) -> tuple[Picture, Doubles]:
    """The highest value (n,) of each periodic picture (n, rows, columns), and where its peak is, (n, 2) across and
    down, by the parabola through it and its neighbours."""
    count, rows, columns = peaks.shape
    every, shifts = np.arange(count), []
    down, across = np.divmod(peaks.reshape(count, -1).argmax(1), columns)
    best = peaks[every, down, across]
    for at, size, (x, y) in ((across, columns, (1, 0)), (down, rows, (0, 1))):
        low, high = (peaks[every, (down + sign * y) % rows, (across + sign * x) % columns] for sign in (-1, 1))
        bend = np.minimum(low - 2 * best + high, -np.finfo(np.float32).tiny)
        shifts.append((at + size // 2) % size - size // 2 + 0.5 * (low - high) / bend)
    return best, np.stack(shifts, -1)
