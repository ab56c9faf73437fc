"""How the camera of a clip moves: one similarity of each frame to a reference.

The texture of a reference is searched in a frame. Both pictures are band-passed, brought to one contrast, cut into
cells and correlated. A camera that moves moves all cells, and their shifts fit one similarity; smoke moves the cells
where it is, each its own way. So the camera of a frame has moved if most of the cells that are found again fit one
similarity that moves them, and hardly any are in place (docs/experiments/turning-camera.md).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy import fft

from smokelift.checks import Doubles, Indices, Mask
from smokelift.extraction.proxy import PROXY_SIDE, Proxy
from smokelift.footage.frame_source import StoredPicture
from smokelift.footage.images import Picture, blurred, brightest_channel, channel_mean, linear_to_srgb, reduced_size
from smokelift.footage.noise import median_of_seen
from smokelift.footage.registration import IDENTITY, Similarity, corners

MOVING_CAMERA = (
    "The camera moves, so what is behind the smoke cannot be found from the clip. Stabilize the clip (Blender's Movie "
    "Clip Editor does), or track it and give a clean plate with a picture for every frame (a video or plate_####.png) "
    "as background. If the camera stood still, give one clean plate, or a color."
)
"""Message that refuses a clip."""

Complex = npt.NDArray[np.complex128]
"""Points and shifts of the picture plane, columns + i rows."""

FINE_SIGMA, COARSE_SIGMA, CONTRAST_SIGMA = 0.8, 3.0, 6.0
"""Standard deviations, in pixels, of the band-pass's two Gaussians, and of the one that measures its contrast."""

MIN_CONTRAST, CLEAR = 1.6 / 255, 0.66
"""Contrast in sRGB values from which on there is texture, and smallest part of a cell's variance that is clear texture,
of 1.4 times that contrast. From 4 of 255 on a plastered wall that shakes has too few cells to see it
(docs/experiments/turning-camera.md)."""

CELLS = 6
"""Cells side by side along the picture's longer side; the cells between these overlap them by half."""

HALF = 0.5
"""Smallest part of a cell's variance that is texture, correlation at which a cell is found again, part of the found
cells that fit a motion, and part of the textured cells that have to be found if those that fit none are to count."""

IN_PLACE = 0.5
"""Largest distance, in pixels of the proxy, of a cell that is in place, or that fits a motion."""

MIN_CELLS = 6
"""Smallest number of cells that fit a motion of four unknowns: two cells alone determine it."""

FITTING_OVER_PLACED = 3
"""Cells that fit a motion, over cells in place, up to which the camera stands still. What a still camera shows is in
place even where smoke hides most of it; labels that are drawn into a picture stay while a camera moves."""

CLEARLY = 0.65
"""Part of the found cells that fit the motion of a camera for certain. Shakes and drifts have .65 to 1 in half of their
frames, a forest that a drone nears slowly .4 (docs/experiments/turning-camera.md)."""

MIN_TEXTURED, MAX_PLACED = 1 / 3, 0.1
"""Smallest part of the cells with clear texture, and largest part of the found ones in place, where shifts that fit no
motion are those of a camera that travels: smoke alone has less texture, falling ash .22, and leaves more in place."""

MIN_MOVED = 1 / 8
"""Smallest part of the frames of a camera that moves: of falling ash the frames next to the reference fit a motion, and
a knock is over in fewer."""

JUDGED = 16
"""Frames that show whether the camera moves at all; the others cost as much again."""

MIN_REGISTERED = 0.8
"""Smallest part of the frames that have to be registered: what is behind the smoke of the others is unknown."""

MAX_REACH = 1 / 8
"""Largest motion that is registered, over the picture's longer side: more hides a quarter of the picture and more."""

BLACK, MIN_BLACK = np.float32(4 / 255), 0.15
"""Largest sRGB value of black with its noise, and smallest part of all pixels in it from which on shifts that fit no
motion are the smoke's: what a camera that travels sees has texture or a sky."""

USUAL, FIT_ROUNDS = 0.1, 5
"""Distance, in pixels of the proxy, at which a cell's weight in a fit is half (Cauchy weights): smoke moves cells by
less than `IN_PLACE`, too. Rounds in which they settle."""

ROUNDS = 2
"""Times that a motion is measured again on the frame that is registered by it."""


@dataclass(frozen=True)
class Match:
    """How a frame lies on a reference."""

    motion: Similarity
    """The motion that most cells fit."""
    found: int
    placed: int
    fitting: int
    """Numbers of cells with texture that the frame shows again, that are in place, and that fit the motion."""
    certain: int
    """Number of those that fit it and have clear texture: drawn fog that drifts as one has hardly any."""
    full: bool
    """Whether the reference is full of clear texture, and the frame shows most of it again."""

    @property
    def fits(self) -> bool:
        """Whether enough cells fit the motion."""
        return self.fitting >= max(MIN_CELLS, HALF * self.found)

    def registers(self, shape: tuple[int, ...]) -> bool:
        """Whether a frame of a shape (rows, columns, ...) can be registered by the motion."""
        return self.fits and self.motion.reach(*shape[1::-1]) <= MAX_REACH

    @property
    def camera(self) -> Literal["still", "moved", "travelled", "unknown"]:
        """What the frame shows of the camera: that it travelled if its motion is none of the picture plane."""
        if self.placed >= MIN_CELLS and FITTING_OVER_PLACED * self.placed >= self.fitting:
            return "still"
        if self.certain >= MIN_CELLS and self.fitting >= CLEARLY * self.found:
            return "moved"
        if self.full and not self.fits and self.placed <= MAX_PLACED * self.found:
            return "travelled"
        return "unknown"


class Texture:
    """The texture of a linear reference (rows, columns, 3), cut into cells."""

    def __init__(self, picture: Picture) -> None:
        shape = picture.shape[:2]
        self._length, self._side = max(shape), min(round(max(shape) / CELLS), *shape)
        self._window = np.outer(*[np.hanning(self._side + 2)[1:-1].astype(np.float32)] * 2)
        step = max(1, self._side // 2)
        starts = [np.arange((n - self._side) % step // 2, n - self._side + 1, step) for n in shape]
        self._places = np.ix_(*starts)
        down, right = (start + (self._side - n) / 2 for start, n in zip(starts, shape, strict=True))
        self._points = np.asarray((right + 1j * down[:, None]).ravel() / self._length, np.complex128)
        detail = _detail(picture)
        cells = self._cut(detail)
        self._power = np.square(cells).mean((1, 2))
        # a cell must hold the area that contrast is measured over
        large = self._side >= 4 * CONTRAST_SIGMA
        self._textured, self._clear = (
            large & (self._power > part * np.square(self._window).mean()) for part in (HALF, CLEAR)
        )
        self._tensors = _structure(cells)
        self._spectra, self._spectrum = (np.conj(fft.rfft2(each)) for each in (cells, detail))

    @property
    def enough(self) -> bool:
        """Whether there is enough of it to show a motion."""
        return int(self._textured.sum()) >= MIN_CELLS

    def match(self, picture: Picture) -> Match:
        """Return how a linear frame (rows, columns, 3) lies on the reference."""
        textured = int(self._textured.sum())
        if not self.enough:
            return Match(IDENTITY, 0, 0, 0, 0, full=False)
        detail = _detail(picture)
        shifts, found = self._shifts(detail)
        placed = int((_apart(shifts[found], self._tensors[:, found]) * self._length <= IN_PLACE).sum())
        best = self._fitted(shifts, found)
        if best.fitting < HALF * textured > FITTING_OVER_PLACED * placed:
            # it may have moved by more than a cell shows
            other = self._refined(detail, Similarity(shift=self._shift_of_all(detail)))
            best = other if other.fitting > best.fitting else best
        if best.fitting >= MIN_CELLS and best.motion.reach(*detail.shape[::-1]) * self._length > IN_PLACE:
            for _ in range(ROUNDS):
                best = self._refined(detail, best.motion)
        return replace(best, placed=placed)

    def _refined(self, detail: Picture, motion: Similarity) -> Match:
        """A motion, measured again on a frame that is registered by it."""
        rest = self._fitted(*self._shifts(motion.registered(detail, order=1)))
        return replace(rest, motion=motion.after(rest.motion))

    def _shifts(self, detail: Picture) -> tuple[Complex, Mask]:
        """How far each cell (n,) is from its place in a frame, and whether it is found there."""
        other, side = self._cut(detail), self._side
        peaks = fft.irfft2(self._spectra * fft.rfft2(other), (side, side))
        each = np.arange(len(peaks))
        down, right = np.divmod(peaks.reshape(len(peaks), -1).argmax(1), side)
        peak = peaks[each, down, right]
        found = self._textured & (peak > HALF * side**2 * np.sqrt(self._power * np.square(other).mean((1, 2))))

        def signed(place: Indices, before: Picture, after: Picture) -> Doubles:
            # the highest place of a parabola through three values
            away = (after - before) / np.maximum(2 * (2 * peak - before - after), np.float32(1e-6))
            return np.asarray((place + side // 2) % side - side // 2 + away, np.float64)

        rows = signed(down, peaks[each, down - 1, right], peaks[each, (down + 1) % side, right])
        columns = signed(right, peaks[each, down, right - 1], peaks[each, down, (right + 1) % side])
        return np.asarray((columns + 1j * rows) / self._length, np.complex128), np.asarray(found)

    def _shift_of_all(self, detail: Picture) -> complex:
        """The shift of a frame at which all of its texture is most alike."""
        peaks = fft.irfft2(self._spectrum * fft.rfft2(detail), detail.shape)
        place = np.unravel_index(peaks.argmax(), peaks.shape)
        down, right = ((n + size // 2) % size - size // 2 for n, size in zip(place, peaks.shape, strict=True))
        return complex(right, down) / self._length

    def _fitted(self, shifts: Complex, found: Mask) -> Match:
        """The motion that most of the found cells fit, by trying those of two cells (RANSAC), and the mean shift."""
        points, shifts, tensors = self._points[found], shifts[found], self._tensors[:, found]
        count, limit = len(points), IN_PLACE / self._length
        turn, shift = 0j, 0j
        near = _apart(shifts, tensors) <= limit
        if count > 1:
            lags = sorted({max(1, count * n // 5) for n in range(1, 5)})
            pairs = [(shifts - np.roll(shifts, lag)) / (points - np.roll(points, lag)) for lag in lags]
            turns = np.stack([np.zeros(count, np.complex128), *pairs])
            offsets = shifts - turns * points
            fits = _apart(shifts - turns[..., None] * points - offsets[..., None], tensors) <= limit
            near = fits[np.unravel_index(fits.sum(-1).argmax(), turns.shape)]
            weights = near.astype(np.float64)
            for _ in range(FIT_ROUNDS):
                turn, shift = _least_squares(points, shifts, tensors * weights)
                apart = _apart(shifts - turn * points - shift, tensors)
                near = apart <= limit
                weights = near / (1 + (apart * self._length / USUAL) ** 2)
        clear = int(self._clear.sum())
        full = clear >= MIN_TEXTURED * len(found) and int((self._clear & found).sum()) >= HALF * clear
        certain = int((self._clear[found] & near).sum())
        return Match(Similarity(1 + turn, shift), count, 0, int(near.sum()), certain, full)

    def _cut(self, detail: Picture) -> Picture:
        """The cells (n, side, side) of a band-passed picture, which fade to their edges."""
        views = np.lib.stride_tricks.sliding_window_view(detail, (self._side, self._side))[self._places]
        return np.asarray((views * self._window).reshape(-1, self._side, self._side))


def _structure(cells: Picture) -> Doubles:
    """How well each cell (n, side, side) shows a shift: its structure tensor (3, n), of columns, rows and both.

    One with texture to all sides has (1, 1, 0). One with a single edge shows only what crosses the edge (the aperture
    problem).
    """
    rows, columns = np.gradient(cells, axis=(1, 2))
    tensors = np.stack(
        [(one * other).mean((1, 2)) for one, other in ((columns, columns), (rows, rows), (rows, columns))]
    )
    return np.asarray(2 * tensors / np.maximum(tensors[0] + tensors[1], 1e-12), np.float64)


def _apart(shifts: Complex, tensors: Doubles) -> Doubles:
    """How far cells are apart, as far as their texture shows it."""
    columns, rows, both = tensors
    right, down = shifts.real, shifts.imag
    return np.asarray(np.sqrt(np.maximum(columns * right**2 + rows * down**2 + 2 * both * right * down, 0)))


def _least_squares(points: Complex, shifts: Complex, tensors: Doubles) -> tuple[complex, complex]:
    """The turn and the shift that fit the shifts of cells best, as far as their texture shows them."""
    x, y, one, none = points.real, points.imag, np.ones(len(points)), np.zeros(len(points))
    # the unknowns are the real and imaginary parts of both
    design = np.stack([np.stack([x, -y, one, none]), np.stack([y, x, none, one])])
    columns, rows, both = tensors
    weights = np.array([[columns, both], [both, rows]])
    found = np.stack([shifts.real, shifts.imag])
    products = np.einsum("ikn,ijn,jln->kl", design, weights, design)
    a, b, c, d = np.linalg.lstsq(products, np.einsum("ikn,ijn,jn->k", design, weights, found), rcond=1e-9)[0]
    return complex(a, b), complex(c, d)


@dataclass(frozen=True, eq=False)
class CameraMotion:
    """The motion of a camera that a similarity explains in every frame."""

    texture: Texture
    """What the frames are registered to."""
    measured: Mapping[int, Similarity]
    """The motion in some frames, by their numbers in the file."""
    reference: int | None
    """Number in the file of the frame that the others are registered to; None if they are to a given picture."""

    def at(self, number: int, frame: StoredPicture) -> Similarity:
        """Return the motion in a frame, by its number in the file and what is stored of it."""
        if number in self.measured:
            return self.measured[number]
        picture = frame.averaged(*reduced_size(*frame.size, PROXY_SIDE))
        match = self.texture.match(picture)
        if match.registers(picture.shape):
            return match.motion
        return self.measured[min(self.measured, key=lambda other: abs(other - number))]

    def reach(self, width: int, height: int) -> float:
        """Return the largest motion, in pixels of a picture of that size."""
        return max(width, height) * max(motion.reach(width, height) for motion in self.measured.values())


def find_motion(proxy: Proxy) -> CameraMotion | None:
    """Return how the camera moves in a proxy's frames, None if it stands still; ValueError if as no similarity does."""
    count = len(proxy.numbers)
    texture = Texture(proxy.pictures[count // 2])
    some = np.unique(np.linspace(0, count - 1, min(count, JUDGED)).round().astype(int))
    match = cache(lambda n: texture.match(proxy.pictures[n]))
    if not _some_move([match(n) for n in some]):
        return None
    found = _registered_to_median(proxy, [match(n) for n in range(count)])
    if found is None and (brightest_channel(proxy.encoded) <= BLACK).mean() < MIN_BLACK:
        raise ValueError(MOVING_CAMERA)
    return found


def motion_before(plate: Texture, proxy: Proxy) -> CameraMotion | None:
    """Return how the frames of a proxy lie on a given plate, None if in its place; ValueError if as no similarity."""
    matches = [plate.match(picture) for picture in proxy.pictures]
    if not _some_move(matches):
        return None
    measured = _measured(proxy, matches)
    known = sum(match.camera != "unknown" for match in matches)
    if not measured or len(measured) < MIN_REGISTERED * known:
        raise ValueError(
            "The clean plate does not lie on the clip: what both show is in other places, and no shift, rotation or "
            "zoom mends that. Give a plate that the clip's camera filmed from the same place, or frames of the clip "
            "without smoke."
        )
    return CameraMotion(plate, measured, None)


def _some_move(matches: Sequence[Match]) -> bool:
    """Whether the camera moves in frames."""
    cameras = [match.camera for match in matches]
    moved, travelled = cameras.count("moved"), cameras.count("travelled")
    least = MIN_MOVED * len(matches)
    return moved >= least or moved + travelled > max(cameras.count("still"), least)


def _registered_to_median(proxy: Proxy, matches: Sequence[Match]) -> CameraMotion | None:
    """The motion in a proxy's frames, by how they lie on one of them; None if too few fit one.

    The frames are registered to the one in the middle of the motion. Their median shows less smoke than any of them, so
    it is what the motion is measured by.
    """
    first, last = proxy.clip
    fitting = [n for n, match in enumerate(matches) if match.fits]
    own = [n for n in fitting if first <= proxy.numbers[n] <= last] or fitting
    if not own or len(fitting) < MIN_REGISTERED * len(matches):
        return None
    size = proxy.pictures.shape[2:0:-1]
    ways = {n: matches[n].motion.moves(corners(*size)) for n in fitting}
    middle = min(own, key=lambda n: sum(float(np.abs(way - ways[n]).max()) for way in ways.values()))
    back = matches[middle].motion.inverse()
    shown = []
    for n in fitting:
        motion = matches[n].motion.after(back)
        seen = motion.nearest(proxy.seen[n])
        shown.append(np.where(seen[..., None], motion.registered(proxy.pictures[n], order=1), np.float32(np.nan)))
    texture = Texture(np.nan_to_num(median_of_seen(np.stack(shown))))
    measured = _measured(proxy, [texture.match(picture) for picture in proxy.pictures])
    if len(measured) < MIN_REGISTERED * len(matches):
        return None
    return CameraMotion(texture, measured, proxy.numbers[middle])


def _measured(proxy: Proxy, matches: Sequence[Match]) -> dict[int, Similarity]:
    """The motion in the frames that can be registered, by their numbers in the file."""
    each, shape = zip(proxy.numbers, matches, strict=True), proxy.pictures.shape[1:]
    return {number: match.motion for number, match in each if match.registers(shape)}


def _detail(picture: Picture) -> Picture:
    """The band-passed gray of a linear picture (rows, columns, 3), in units of the contrast around each pixel."""
    gray = channel_mean(linear_to_srgb(picture))
    detail = blurred(gray, FINE_SIGMA) - blurred(gray, COARSE_SIGMA)
    return np.asarray(detail / np.sqrt(blurred(detail**2, CONTRAST_SIGMA) + MIN_CONTRAST**2), np.float32)
