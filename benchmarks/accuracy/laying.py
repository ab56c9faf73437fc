"""Lay a result where a camera that only scores sees it best: turned, moved, and with one gain.

A scale needs no search: a world twice as large from twice as far away shows one camera the same picture. One start
finds one of several sides of the smoke that look alike. So searches start from many places, the same ones for every
result, go on until they have converged, and the best counts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from benchmarks.accuracy.exposure import LARGEST_GAIN, best_gain
from smokelift import Camera, Domain
from smokelift.evaluation.frame_means import eight_bit_values
from smokelift.evaluation.metrics import psnr
from smokelift.footage.images import area_average, linear_to_srgb
from smokelift.render import Image, Volume, scene_renderer
from smokelift.scene import CompleteScene
from smokelift.scene.projection import project

TURNS = (0, -20, 20, -40, 40)
"""Turns about the vertical (degrees) from which a search starts."""

COARSE, FINE = 7, 3
"""Pixels along each side that are one while every start is followed, with voxels twice as wide, and while the best go
on."""

BEST = 2
"""Starts that go on with finer pictures."""

STEPS = np.array([0.1, 0.1, 0.1, 0.02, 0.02, 0.02, 0.1])
"""Turns (radians), shifts (shares of the distance) and logarithm of a gain that change a picture about equally."""

DIFFERENCE = 0.05
"""Steps over which the slopes of the misfit are taken."""

FARTHEST = 8.0
"""Steps that a search may go from its start."""

BLACK = np.zeros(3, np.float32)

Matrix = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Seen:
    """What a camera that only scores saw.

    Attributes
    ----------
    camera
        In the world that is given.
    pictures
        Linear radiance before black, by the number of the frame.
    """

    camera: Camera
    pictures: Mapping[int, Image]

    def smaller(self, pixels: int) -> Seen:
        """The same with so many pixels along each side as one."""
        columns, rows = (side // pixels for side in self.camera.size)
        small = {frame: area_average(picture, columns, rows) for frame, picture in self.pictures.items()}
        return Seen(self.camera.resized(columns, rows), small)


@dataclass(frozen=True, eq=False)
class Result:
    """Densities that are pictured: by the number of the frame, in the box of a scene."""

    scene: CompleteScene
    densities: Mapping[int, Volume]

    def halved(self) -> Result:
        """The same on voxels twice as wide; an odd last one is left out of the mean."""
        domain = self.scene.domain
        x, y, z = (count // 2 for count in domain.resolution)
        high = np.array(domain.min) + 2 * domain.voxel_size * np.array([x, y, z])
        half = replace(self.scene, domain=Domain(domain.min, tuple(high.tolist()), (x, y, z)))
        means = {
            frame: np.ascontiguousarray(
                values[: 2 * x, : 2 * y, : 2 * z].reshape(x, 2, y, 2, z, 2).mean((1, 3, 5), dtype=np.float32)
            )
            for frame, values in self.densities.items()
        }
        return Result(half, means)


@dataclass(frozen=True)
class Score:
    """What camera and result differ by: PSNR of displayed values over all of the picture before black (dB), by frame.

    Attributes
    ----------
    plain, gained
        As it is, and with the one gain for all frames that is best.
    """

    plain: tuple[float, ...]
    gained: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Laid:
    """Where a search ended.

    Attributes
    ----------
    camera
        In the result's world.
    ends
        PSNR (dB) with the best gain, mean over the frames, where the search from each start ended, in coarse pictures.
    """

    camera: Camera
    ends: tuple[float, ...]


def starts(given: CompleteScene, other: CompleteScene) -> tuple[Matrix, ...]:
    """Ways (4, 4) to lay the world that is given on another one of the same clip: what a search starts from.

    What is up stays up, or the input's cameras look alike; each turned by `TURNS` about the vertical. What the input's
    camera sees in the middle of the box that is given lies where it is in the other one, and is as large.
    """
    turns = [np.array(scene.camera.matrix)[:3, :3] for scene in (given, other)]
    middle = np.array(given.domain.centre)
    pixel = project(given.camera, middle)[0]
    origin, ray = _ray(other.camera, pixel)
    # the upright screen through the middle of the other box, across the way that its camera looks
    across = -turns[1][:2, 2]
    place = origin + ray * (across @ (np.array(other.domain.centre) - origin)[:2]) / (across @ ray[:2])
    apart = [float(project(scene.camera, at)[1]) / scene.camera.fx for scene, at in ((given, middle), (other, place))]
    ours, theirs = (np.arctan2(turn[1, 2], turn[0, 2]) for turn in turns)
    ways = []
    for alike in (Rotation.from_euler("z", theirs - ours).as_matrix(), turns[1] @ turns[0].T):
        for turn in TURNS:
            linear = apart[1] / apart[0] * Rotation.from_euler("z", turn, degrees=True).as_matrix() @ alike
            way = np.eye(4)
            way[:3, :3] = linear
            way[:3, 3] = place - linear @ middle
            ways.append(way)
    return tuple(ways)


def _ray(camera: Camera, pixel: Matrix) -> tuple[Matrix, Matrix]:
    """Where a camera stands, and the way (3,) to what it sees at a pixel, 1 long along the way that it looks."""
    matrix = np.array(camera.matrix)
    x, y = (pixel - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    return matrix[:3, 3], matrix[:3, :3] @ (x, -y, -1.0)


def moved(camera: Camera, start: Matrix, centre: Matrix, by: Matrix) -> Camera:
    """A camera of the world that is given, in the result's world.

    Parameters
    ----------
    camera
        In the world that is given.
    start : (4, 4)
        From the world that is given to that of the result: turn, shift and one scale.
    centre : (3,)
        Of the result's box.
    by : (6,)
        Rotation vector about the centre, shift as a share of the distance to it.
    """
    matrix = start @ np.array(camera.matrix)
    matrix[:3, :3] /= np.cbrt(np.linalg.det(matrix[:3, :3]))
    away = matrix[:3, 3] - centre
    turn = Rotation.from_rotvec(by[:3]).as_matrix()
    matrix[:3, :3] = turn @ matrix[:3, :3]
    matrix[:3, 3] = centre + turn @ away + np.linalg.norm(away) * by[3:]
    return replace(camera, matrix=tuple(map(tuple, matrix.tolist())))


def best_laid(result: Result, ways: Sequence[Matrix], seen: Seen) -> Laid:
    """Return where the camera sees a result best, with one gain."""
    few, coarse, fine = result.halved(), seen.smaller(COARSE), seen.smaller(FINE)
    first = [_followed(few, way, coarse, np.zeros(7)) for way in ways]
    there = [_camera(few, way, coarse, by) for way, by in zip(ways, first, strict=True)]
    ends = [float(np.mean(scores(few, camera, coarse).gained)) for camera in there]
    on = sorted(range(len(ways)), key=lambda number: -ends[number])[:BEST]
    cameras = []
    for number in on:
        by = _followed(result, ways[number], fine, first[number])
        cameras.append(_camera(result, ways[number], seen, by))
    best = max(cameras, key=lambda camera: np.mean(scores(result, camera, seen).gained))
    return Laid(best, tuple(ends))


def _camera(result: Result, way: Matrix, seen: Seen, by: Matrix) -> Camera:
    return moved(seen.camera, way, np.array(result.scene.domain.centre), by[:6] * STEPS[:6])


def _followed(result: Result, way: Matrix, seen: Seen, start: Matrix) -> Matrix:
    """Where the search from a start ends (7,): steps of turn, shift and gain."""
    true = [linear_to_srgb(picture) for picture in seen.pictures.values()]

    def misfit(by: Matrix) -> Matrix:
        shown = pictures(result, _camera(result, way, seen, by), seen)
        gain = np.exp(by[6] * STEPS[6])
        apart = [linear_to_srgb(gain * ours) - wanted for ours, wanted in zip(shown, true, strict=True)]
        return np.concatenate(apart, axis=None, dtype=np.float64)

    limit = np.full(7, FARTHEST)
    limit[6] = np.log(LARGEST_GAIN) / STEPS[6]

    def slopes(by: Matrix) -> Matrix:
        # steps that single precision does not drown, and that a voxel does not either
        here = misfit(by)
        ahead = [misfit(by + DIFFERENCE * unit) for unit in np.eye(by.size)]
        return np.stack([(there - here) / DIFFERENCE for there in ahead], -1)

    found = least_squares(misfit, start, slopes, bounds=(-limit, limit), ftol=1e-4, xtol=1e-3, max_nfev=40)
    return np.asarray(found.x)


def pictures(result: Result, camera: Camera, seen: Seen) -> list[Image]:
    """What a camera shows of a result before black in the frames that were seen."""
    renderer = scene_renderer(result.scene, camera, BLACK)
    return [renderer.image(result.densities[frame]) for frame in seen.pictures]


def scores(result: Result, camera: Camera, seen: Seen) -> Score:
    """Compare what a camera in the result's world shows with what was seen."""
    shown, true = pictures(result, camera, seen), list(seen.pictures.values())
    gain = best_gain(shown, true)

    def compared(factor: float) -> tuple[float, ...]:
        pairs = zip(shown, true, strict=True)
        return tuple(psnr(eight_bit_values(factor * ours), eight_bit_values(picture)) for ours, picture in pairs)

    return Score(compared(1.0), compared(gain))
