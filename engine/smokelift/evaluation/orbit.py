"""Whether smoke looks like smoke from every azimuth, lit on a turntable: beside the truth, or its own front.

Patches are what the method itself matches, from azimuths all around. Shapes along rays are independent of that: they
see one soft body per ray where true smoke has lobes behind one another (docs/experiments/orbit-shapes.md).
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from smokelift.density.turntable import Turntable
from smokelift.evaluation.metrics import PatchStatistics, RayShapes, flicker, mean_gradient
from smokelift.evaluation.truth import finite_mean
from smokelift.render import Image, Volume, scene_optics
from smokelift.scene import Camera, CompleteScene, FiniteLight, PointLight
from smokelift.transport import Array

GAMMA = 2.2
"""Exponent of the gray values: differences count as they are seen."""

Densities = Callable[[int], Volume]
"""Returns the density (nx, ny, nz) of a frame, from 0."""

AZIMUTHS = tuple(range(15, 180, 15))
"""Azimuths (degrees) of the pictures. From behind smoke has nearly the outline that it has from the front, so half a
turn says all."""

OWN_STEP = 5
"""Azimuths, of 15 degrees each, from one picture of the truth to the one that it is compared with for its own distance:
pictures that far from each other have next to no detail in common."""

FLICKER_AZIMUTHS = (45, 75, 105, 135)
"""Azimuths (degrees) at which three consecutive frames are compared."""

SCORED_FRAMES, FIRST_FRAMES = 6, 4
"""Frames that are scored, spread over the clip, and the first ones, which have hardly any before them to start from
and are left out."""

OUTLINE_FRACTION, OUTLINE_MARGIN = 0.08, 2
"""Fraction of the truth's largest value from which on a pixel is within its outline, and the pixels around that are,
too: a linear interpolation and a pixel's rounding reach no farther."""

SHAPES = ("several_modes", "scatter", "depth_over_width", "row_middles", "ray_length")
"""Figures of `RayShapes`."""

SHAPE_AZIMUTHS = (0, 45, 90, 135)
"""Azimuths (degrees) of the rays. Along those of 0, the camera's, nothing shows how smoke stands."""

BANDS = 6
"""Bands of equal height, from the floor of the box up, for depth over width."""


class Orbit:
    """Renders densities of one scene from all azimuths about the vertical; 0 is the camera's, orthographic.

    Smoke that no light makes brighter is shown by what it takes from white light behind it. The scene's background does
    not count. With `lights_turn` the lights go around with the camera, so that every azimuth is lit as the front is.
    """

    def __init__(self, scene: CompleteScene, *, lights_turn: bool = False) -> None:
        self.table = Turntable.facing(scene.camera.at(0), scene.domain)
        self._optics = scene_optics(scene)
        self._shines = scene.scattering != "absorption" and bool(self._optics.unshadowed_source().max() > 0)
        self._lights_turn = lights_turn

    def image(self, density: Volume, degrees: float, rows: int | None = None) -> Image:
        """Render a density (nx, ny, nz), by default at one pixel per voxel; linear radiance (rows, columns, 3)."""
        camera = self.table.camera(degrees)
        if rows is not None:
            columns = round(camera.size[0] * rows / camera.size[1])
            camera = camera.resized(columns, rows)
        optics = self._optics
        if self._lights_turn:
            optics = replace(optics, lights=tuple(self._turned(light, camera) for light in optics.lights))
        behind = np.full(3, 0 if self._shines else 1, np.float32)
        return optics.renderer(camera, behind).image(density)

    def picture(self, density: Volume, degrees: float) -> Array:
        """Render a density (nx, ny, nz) at one pixel per voxel as gray values (rows, columns) before black."""
        image = self.image(density, degrees)
        return gray(image if self._shines else 1 - image)

    def _turned(self, light: FiniteLight, camera: Camera) -> FiniteLight:
        """Return a light that stands to a camera as it does to the front's."""
        turn: npt.NDArray[np.float64] = _axes(camera) @ _axes(self.table.camera(0)).T
        if isinstance(light, PointLight):
            center = np.array(self._optics.domain.centre)
            x, y, z = (center + turn @ (np.array(light.position) - center)).tolist()
            return replace(light, position=(x, y, z))
        x, y, z = (turn @ np.array(light.direction)).tolist()
        return replace(light, direction=(x, y, z))


def gray(image: Image) -> Array:
    """Return linear radiance (rows, columns, 3) as gray values (rows, columns)."""
    return np.asarray(np.maximum(image.mean(-1), 0) ** (1 / GAMMA), np.float32)


def _axes(camera: Camera) -> npt.NDArray[np.float64]:
    return np.array(camera.matrix)[:3, :3]


def orbit_scores(
    scene: CompleteScene, count: int, density: Densities, truth: Densities | None = None
) -> dict[str, Any]:
    """Compare lit pictures from `AZIMUTHS` with the truth's, or with those from the front.

    Beside the truth all are lit as the scene is. Beside the front the lights go around with the camera, for what counts
    is the texture of the smoke, and not on which side the sun stands. The front is the sequence's own, rendered at
    azimuth 0, and not the clip's frames: camera, light and resolution are then the same, there is no grain, and a
    blurred front shows in its PSNR. There are `count` consecutive frames, at least one, on the scene's grid.

    Returns
    -------
    ``patches`` and ``texture``, the distances of `PatchStatistics`, means over azimuths, and by azimuth;
    ``patches_worst``, the largest of an azimuth; ``patches_own`` and ``texture_own``, those of the truth from itself
    `OWN_STEP` azimuths on, or of the front from the front half the clip on; ``edges`` and ``flicker``, mean gradients
    and second differences in time over the reference's; ``halo``, the fraction of the light outside the outlines that
    the truth has at any azimuth. The figures of `RayShapes`, along the camera's rays and by azimuth, and the truth's.
    None where there is nothing to say.
    """
    orbit = Orbit(scene, lights_turn=truth is None)
    first = FIRST_FRAMES if count > 2 * FIRST_FRAMES else 0
    spread = np.linspace(first, count - 1, min(SCORED_FRAMES, count - first))
    frames = sorted({round(float(frame)) for frame in spread})
    found: dict[str, list[list[float | None]]] = {name: [] for name in ("patches", "texture", "edges", "halo")}
    own: dict[str, list[list[float | None]]] = {"patches": [], "texture": []}
    fronts: list[PatchStatistics] = []
    shapes: list[list[RayShapes | None]] = []
    true_shapes: list[list[RayShapes | None]] = []
    for frame in frames:
        smoke = density(frame)
        shapes.append(azimuth_shapes(orbit.table, smoke))
        pictures = _pictures(orbit, smoke, AZIMUTHS)
        if truth is None:
            front = orbit.picture(smoke, 0)
            fronts.append(PatchStatistics.of(front))
            references, sharp = len(AZIMUTHS) * fronts[-1:], len(AZIMUTHS) * [mean_gradient(front)]
        else:
            true_smoke = truth(frame)
            true_shapes.append(azimuth_shapes(orbit.table, true_smoke))
            true = _pictures(orbit, true_smoke, AZIMUTHS)
            references, sharp = [PatchStatistics.of(picture) for picture in true], list(map(mean_gradient, true))
            _add_distances(own, [*references[OWN_STEP:], *references[:OWN_STEP]], references)
            brightest = np.max(true, axis=0)  # wherever the smoke is seen from
            shown = brightest > OUTLINE_FRACTION * brightest.max()
            outline = np.asarray(ndimage.binary_dilation(shown, iterations=OUTLINE_MARGIN))
            beyond = ((float(picture[~outline].sum()), float(picture.sum())) for picture in pictures)
            found["halo"].append([_ratio(*sums) for sums in beyond])
        _add_distances(found, [PatchStatistics.of(picture) for picture in pictures], references)
        edges = zip(map(mean_gradient, pictures), sharp, strict=True)
        found["edges"].append([_ratio(value, reference) for value, reference in edges])
    if len(fronts) > 1:
        half = len(fronts) // 2
        _add_distances(own, [*fronts[half:], *fronts[:half]], fronts)
    by_azimuth = {name: _means(values) for name, values in found.items()}
    known = [value for value in by_azimuth["patches"] if value is not None]
    return {
        "reference": "front" if truth is None else "truth",
        **{name: finite_mean(values) for name, values in by_azimuth.items()},
        "patches_worst": max(known, default=None),
        **{f"{name}_own": finite_mean(_means(values)) for name, values in own.items()},
        "flicker": _relative_flicker(orbit, frames, count, density, truth),
        "azimuths": list(AZIMUTHS),
        **{f"{name}_by_azimuth": by_azimuth[name] for name in ("patches", "texture", "edges")},
        "patches_own_by_azimuth": None if truth is None else _means(own["patches"]),
        "shape_azimuths": list(SHAPE_AZIMUTHS),
        **shape_means(shapes),
        **({} if truth is None else shape_means(true_shapes, "_truth")),
    }


def _add_distances(
    figures: dict[str, list[list[float | None]]], found: list[PatchStatistics], references: list[PatchStatistics]
) -> None:
    pairs = list(zip(found, references, strict=True))
    figures["patches"].append([one.distance(reference) for one, reference in pairs])
    figures["texture"].append([one.texture_distance(reference) for one, reference in pairs])


def _relative_flicker(
    orbit: Orbit, frames: list[int], count: int, density: Densities, truth: Densities | None
) -> float | None:
    """Flicker over that of the reference, each the mean over frames and azimuths."""
    if count < 3:
        return None
    found, reference = [], []
    for middle in np.unique(np.clip(frames, 1, count - 2)).tolist():
        around = range(middle - 1, middle + 2)
        densities = [density(frame) for frame in around]
        found.append(_flicker(orbit, densities, FLICKER_AZIMUTHS))
        if truth is None:
            reference.append(_flicker(orbit, densities, (0,)))
        else:
            reference.append(_flicker(orbit, [truth(frame) for frame in around], FLICKER_AZIMUTHS))
    a, b = finite_mean(found), finite_mean(reference)
    return None if a is None or b is None else _ratio(a, b)


def _flicker(orbit: Orbit, densities: list[Volume], azimuths: tuple[int, ...]) -> float | None:
    frames = [_pictures(orbit, density, azimuths) for density in densities]
    return finite_mean(flicker(np.stack(pictures)) for pictures in zip(*frames, strict=True))


def _pictures(orbit: Orbit, density: Volume, azimuths: tuple[int, ...]) -> list[Array]:
    return [orbit.picture(density, degrees) for degrees in azimuths]


def _ratio(value: float, reference: float) -> float | None:
    return value / reference if reference > 0 else None


def _means(frames: list[list[float | None]]) -> list[float | None]:
    """Means over the frames of what there is at each azimuth."""
    return [finite_mean(values) for values in zip(*frames, strict=True)]


def azimuth_shapes(table: Turntable, density: Volume) -> list[RayShapes | None]:
    """Shapes of a frame's smoke (nx, ny, nz) along the rays of `SHAPE_AZIMUTHS`; None where there is none."""
    upright = table.upright(density)
    return [RayShapes.of(_turned(upright, table, degrees)) for degrees in SHAPE_AZIMUTHS]


def shape_means(frames: Iterable[list[RayShapes | None]], ending: str = "") -> dict[str, Any]:
    """`SHAPES` along the camera's rays, by azimuth, and depth over width by height: means, their names with an ending.

    The frames are `azimuth_shapes`.
    """
    known = [[shape for shape in shapes if shape is not None] for shapes in zip(*frames, strict=True)]
    by_azimuth = {name: [finite_mean(getattr(shape, name) for shape in shapes) for shapes in known] for name in SHAPES}
    return {
        **{f"{name}{ending}": values[0] for name, values in by_azimuth.items()},
        **{f"{name}{ending}_by_azimuth": values for name, values in by_azimuth.items()},
        f"depth_over_width{ending}_by_height": [
            finite_mean(_band_ratio(shape, band) for shape in known[0]) for band in range(BANDS)
        ],
    }


def _band_ratio(shape: RayShapes, band: int) -> float | None:
    """Depth over width in a band of the box; None where it holds no smoke."""
    part = slice(*(len(shape.masses) * end // BANDS for end in (band, band + 1)))
    depths, widths, masses = shape.depths[part], shape.widths[part], shape.masses[part]
    return float(np.average(depths / np.maximum(widths, 1e-9), weights=masses)) if masses.any() else None


def _turned(upright: Volume, table: Turntable, degrees: float) -> Volume:
    """Smoke (columns, voxels along the rays of an azimuth, rows), read linearly from an upright volume."""
    camera = np.array(table.camera(degrees).matrix)
    axes = [axis for axis in range(3) if axis != table.axis]
    turn = np.eye(3)
    turn[:2, :2] = np.stack([camera[axes, 0], -camera[axes, 2]], -1)
    # voxels stay where they are as the box is turned by quarters
    sizes = np.abs(turn).T @ upright.shape
    offset = (np.array(upright.shape) - 1) / 2 - turn @ (sizes - 1) / 2
    shape = tuple(np.ceil(sizes - 0.5).astype(int).tolist())
    return np.asarray(ndimage.affine_transform(upright, turn, offset, shape, order=1, mode="grid-constant"))
