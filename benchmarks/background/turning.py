"""Clips of baked smoke before a wall as a camera sees them that shakes or pans in its place."""

import numpy as np
from scipy import ndimage
from scipy.spatial.transform import Rotation

from benchmarks.background.clips import Case, Smoke, filmed, wall
from smokelift.checks.array_types import Doubles
from smokelift.footage.images import Picture, area_average, linear_to_srgb
from smokelift.footage.turning import moved

FOV_DEGREES = 30.0
"""Vertical field of view of the cameras of `benchmarks.truth.picture`."""

FINER = 2
"""Rays along a pixel: each picture is the mean over its pixels' areas."""

UNSTEADY = 1.5
"""Pixels by which a panning hand shakes."""


def shaken(smoke: Smoke, pixels: float) -> Case:
    """A camera that shakes by up to so many pixels across, up and about its axis (at a focal length from it)."""
    lens = lens_of(smoke)
    return seen_turning(smoke, lens, _shake(len(smoke.radiance), pixels / lens[0, 0]))


def panned(smoke: Smoke, share: float) -> Case:
    """A camera that pans over a share of the picture's width in an unsteady hand."""
    lens = lens_of(smoke)
    count = len(smoke.radiance)
    along = np.linspace(-0.5, 0.5, count) * share * smoke.radiance.shape[2] / lens[0, 0]
    turns = Rotation.from_rotvec(np.outer(along, [0, 1, 0])) * _shake(count, UNSTEADY / lens[0, 0])
    return seen_turning(smoke, lens, turns)


def lens_of(smoke: Smoke) -> Doubles:
    """The lens (3, 3) of a scene's front pictures, from directions to pixels."""
    _, rows, columns = smoke.radiance.shape
    focal = 0.5 * rows / np.tan(np.radians(FOV_DEGREES / 2))
    return np.array([[focal, 0, columns / 2], [0, focal, rows / 2], [0, 0, 1]])


def ahead(smoke: Smoke) -> Picture:
    """What the camera sees of the wall of these clips, without smoke, where it looks straight ahead."""
    _, rows, columns = smoke.radiance.shape
    return wall((3 * rows, 3 * columns))[rows : 2 * rows, columns : 2 * columns]


def seen_turning(smoke: Smoke, lens: Doubles, turns: Rotation) -> Case:
    """The clip of a camera that turns, frame to mean pose, before a wall three times as wide and high as the picture.

    What the smoke looks like through each pixel is the same wherever the camera looks: it turns about its centre.
    """
    _, rows, columns = smoke.radiance.shape
    plate = wall((3 * rows, 3 * columns))
    y, x = np.mgrid[: FINER * rows, : FINER * columns] + 0.5
    places = np.column_stack([x.ravel(), y.ravel()]) / FINER
    clean, plates = [], []
    for number, turn in enumerate(turns):
        seen_at = moved(places, lens @ turn.as_matrix() @ np.linalg.inv(lens))
        across, down = (place.reshape(y.shape) - 0.5 for place in seen_at.T)
        behind = np.stack([_at(plate[..., c], down + rows, across + columns) for c in range(3)], -1)
        radiance = _at(smoke.radiance[number], down, across, 0)[..., None]
        transmittance = _at(smoke.transmittance[number], down, across, 1)[..., None]
        clean.append(area_average(radiance + transmittance * behind, columns, rows))
        plates.append(area_average(behind, columns, rows))
    seen = np.stack(clean)
    return Case(filmed(linear_to_srgb(seen), "turning"), np.stack(plates), seen, False, lens)


def _at(picture: Picture, down: Doubles, across: Doubles, beyond: float = 0) -> Picture:
    """A picture's values at some places, and another value beyond it."""
    values = ndimage.map_coordinates(picture, [down, across], order=1, cval=beyond, output=np.float32)
    return np.asarray(values)


def _shake(count: int, most: float) -> Rotation:
    """Turns of a hand about all axes, each at most so many radians."""
    turns = ndimage.gaussian_filter1d(np.random.default_rng(0).standard_normal((count, 3)), 1.0, axis=0)
    turns -= turns.mean(0)
    return Rotation.from_rotvec(most * turns / np.abs(turns).max(0))
