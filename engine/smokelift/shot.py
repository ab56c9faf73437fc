"""From what a user gives (a clip, perhaps a scene file) to everything that a reconstruction needs.

What a scene file leaves out is estimated from the clip or defaulted, and every such choice is put into words.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from smokelift.background import (
    Plate,
    changing_plate,
    estimate_plate,
    known_plate,
    matte,
    one_colour,
    open_plates,
)
from smokelift.cameras import CameraError, WorkingPicture, as_matrix, working_picture
from smokelift.clip import Clip
from smokelift.density import SmokeAxis
from smokelift.images import area_average, read_image
from smokelift.render import scene_lights
from smokelift.render.setup import Scattering
from smokelift.scene import Background, Camera, DirectionalLight, Domain, Medium, Scene
from smokelift.settings import LONGEST_SIDE, Settings

PICTURE_HEIGHT = 2.0
"""Metres that an uncalibrated picture is taken to be high where the smoke is: the size of a person."""

LENS = 50 / 36
"""Focal length over the longer side of the picture of an uncalibrated camera: Blender's default lens."""

OPTICAL_DEPTH_AT_ONE = 5.0
"""Optical depth of smoke of density 1 across the domain when the medium is not given: thick, not solid."""

SAMPLES = 16
PICTURE_SIDE = 320


@dataclass(frozen=True, eq=False)
class Shot:
    """A clip with a complete scene.

    Attributes
    ----------
    scene
        With the camera of the full picture, domain, medium and lights (empty only if nothing is scattered); its
        background stays unknown where it was estimated.
    working
        The small picture that the grid is fitted to; of the first frame that shows the domain if the camera moves.
    plate
        Background of that small picture, with the clip's noise.
    scattering
        How light is scattered: ``"single"`` where the light is known, else ``"unshadowed"``.
    estimated_background
        Full picture behind the smoke where the scene does not give one, (rows, columns, 3).
    notes
        What was assumed or estimated, a sentence each.
    plate_at
        Background of the full picture in every frame, counted from 0, where camera or background change; else None.
    """

    scene: Scene
    working: WorkingPicture
    plate: Plate
    scattering: Scattering
    estimated_background: NDArray[np.float32] | None
    notes: tuple[str, ...]
    plate_at: Callable[[int], Plate] | None = None

    def at(self, frame: int) -> Shot | None:
        """The shot as it is in a frame, counted from 0; None if nothing of the domain is in the picture then."""
        if self.plate_at is None:
            return self
        assert self.scene.camera is not None and self.scene.domain is not None
        try:
            working = working_picture(self.scene.camera.at(frame), self.scene.domain)
        except CameraError:
            return None
        # An environment is as many lights as one camera needs; were they chosen anew, the light would flicker.
        lit = replace(self.scene, lights=scene_lights(self.small_scene))
        return replace(self, scene=lit, working=working, plate=_small(self.plate_at(frame), working))

    @property
    def small_scene(self) -> Scene:
        """The scene as the small picture's camera sees it."""
        return replace(self.scene, camera=self.working.camera)


def prepare_shot(clip: Clip, scene: Scene, settings: Settings) -> Shot:
    """Complete a scene from its clip.

    Parameters
    ----------
    clip
        The footage.
    scene
        Whatever is known.
    settings
        For the resolution.

    Raises
    ------
    ValueError
        If the scene contradicts the clip or itself, or lacks what cannot be estimated.
    """
    notes: list[str] = []
    if clip.warning:
        notes.append(clip.warning)
    moves = scene.camera is not None and scene.camera.moves
    if scene.camera is not None and moves and len(scene.camera.matrices) != len(clip):
        raise ValueError(
            f"[camera] matrices are given for {len(scene.camera.matrices)} frames, and {len(clip)} frames of the clip "
            "are used; give one matrix for each."
        )
    plates = open_plates(scene)
    if plates is not None:
        plate_at = changing_plate(plates, clip)
    else:
        plate, scene = _plate(clip, scene, notes)
        plate_at = lambda _frame: plate  # noqa: E731
    samples = _smoke_samples(clip, plate_at)
    camera, domain = _geometry(clip, scene, settings, samples, notes)
    if settings.axis_depth is not None:
        SmokeAxis.given(settings.axis_depth, camera, domain)  # before anything is spent on what cannot be
    medium = scene.medium
    if medium is None:
        width = min(high - low for low, high in zip(domain.min, domain.max, strict=True))
        medium = Medium(extinction=OPTICAL_DEPTH_AT_ONE / width)
        notes.append(
            f"Medium not given: extinction {medium.extinction:.3g} 1/m (density 1 is thick smoke), "
            f"albedo {medium.albedo:g}, isotropic."
        )
    lights, scattering = scene.lights, settings.density.scattering
    if medium.albedo == 0:
        scattering = "absorption"
    if not lights and scattering != "absorption":
        sun = _ambient_sun(samples, medium)
        lights = (sun,)
        scattering = "unshadowed"
        notes.append(
            "Light not given: as much from everywhere as the thickest smoke shows, "
            f"irradiance {', '.join(f'{v:.2f}' for v in sun.irradiance)}, without shadows."
        )
    working, shown = _working(camera, domain)
    source = None if scene.clip is None else replace(scene.clip, fps=clip.fps)
    complete = replace(scene, clip=source, camera=camera, domain=domain, medium=medium, lights=lights)
    plate = plate_at(shown)
    estimated = plate.image if _unknown(scene.background) else None
    changing = plate_at if moves or plates is not None else None
    return Shot(complete, working, _small(plate, working), scattering, estimated, tuple(notes), changing)


def boundaries(scene: Scene, settings: Settings) -> tuple[str, ...]:
    """How smoke gets in and out of the box of a complete scene, a sentence each."""
    inflow = scene.inflow()
    if inflow is None:
        search = settings.velocity.method == "default" and settings.velocity.sources
        entry = f"No inlet marked: {'where smoke enters is found from the densities' if search else 'none is assumed'}."
    else:
        places, voxels = (
            f"{n} {what}{'s' * (n > 1)}"
            for n, what in ((len(scene.inlets), "marked inlet"), (int(inflow.sum()), "voxel"))
        )
        entry = f"Smoke enters at {places} ({voxels}); others are not looked for."
    if not scene.closed:
        return entry, "All sides of the box are open."
    walls = ", ".join(scene.closed)
    return entry, f"Closed sides of the box: {walls}; the others are open."


def _working(camera: Camera, domain: Domain) -> tuple[WorkingPicture, int]:
    """The small picture of the first frame that shows the domain, and that frame."""
    for frame in range(len(camera.matrices)):
        with suppress(CameraError):
            return working_picture(camera.at(frame), domain), frame
    return working_picture(camera, domain), 0


def _small(plate: Plate, working: WorkingPicture) -> Plate:
    return Plate(working.cut(plate.image), working.cut(plate.confidence), plate.noise)


@dataclass(frozen=True, eq=False)
class _SmokeSamples:
    """Where and how bright smoke is in some frames, at reduced size.

    Attributes
    ----------
    scale
        Full pixels to a reduced one.
    covered : (rows, columns) bool
        Pixels with smoke in at least one sample.
    colours : (n, 3)
        Radiance of all smoke pixels.
    behind : (n, 3)
        Background radiance at the same pixels.
    """

    scale: float
    covered: NDArray[np.bool_]
    colours: NDArray[np.float32]
    behind: NDArray[np.float32]


def _smoke_samples(clip: Clip, plate_at: Callable[[int], Plate]) -> _SmokeSamples:
    width, height = clip.size
    scale = max(1.0, max(width, height) / PICTURE_SIDE)
    columns, rows = max(1, round(width / scale)), max(1, round(height / scale))
    covered = np.zeros((rows, columns), np.bool_)
    colours, behind = [], []
    for number in clip.spread(SAMPLES):
        plate = plate_at(number)
        small = Plate(
            area_average(plate.image, columns, rows), area_average(plate.confidence, columns, rows), plate.noise
        )
        picture = area_average(clip.frame(number), columns, rows)
        mask = matte(picture, small).mask
        covered |= mask
        colours.append(picture[mask])
        behind.append(small.image[mask])
    return _SmokeSamples(scale, covered, np.concatenate(colours), np.concatenate(behind))


def _plate(clip: Clip, scene: Scene, notes: list[str]) -> tuple[Plate, Scene]:
    """The plate of a background that does not change, and the scene with what was found out about it."""
    background = scene.background
    if background is not None and not _unknown(background):
        known = background.color if background.image is None else read_image(background.image)
        assert known is not None
        return known_plate(known, clip), scene
    plate = estimate_plate(clip)
    if scene.camera is not None and scene.camera.moves:
        colour = one_colour(plate)
        if colour is None:
            raise ValueError(
                "The camera moves, so what is behind the smoke cannot be found from the clip; give a clean plate with "
                "a picture for every frame (a video or plate_####.png), or a color, in [background]."
            )
        notes.append(f"Background not given: one colour, {', '.join(f'{v:.2g}' for v in colour)} (linear).")
        return known_plate(colour, clip), replace(scene, background=Background(color=colour))
    unseen = float(np.mean(plate.confidence < 0.5))
    notes.append(f"Background estimated from the clip; {unseen:.0%} of the picture is hardly ever free of smoke.")
    return plate, scene


def _unknown(background: Background | None) -> bool:
    return background is None or (background.color is None and background.image is None)


def _geometry(
    clip: Clip, scene: Scene, settings: Settings, samples: _SmokeSamples, notes: list[str]
) -> tuple[Camera, Domain]:
    if scene.camera is not None:
        if scene.camera.size[0] * clip.size[1] != scene.camera.size[1] * clip.size[0]:
            raise ValueError(
                f"The camera's picture is {scene.camera.size[0]} x {scene.camera.size[1]}, the clip's "
                f"{clip.size[0]} x {clip.size[1]}; [camera] size must have the clip's shape."
            )
        camera = scene.camera.resized(*clip.size)
        if scene.domain is None:
            raise ValueError("The scene gives a camera but no box in [domain]; give the one that holds the smoke.")
        return camera, _with_resolution(scene.domain, settings.resolution)
    if scene.domain is not None:
        raise ValueError("The scene gives a [domain] but no [camera]; give the camera that filmed it.")
    if scene.inlets:
        raise ValueError(
            "The scene marks an [[inlet]] but gives no [camera] and [domain]; give both to say where it is."
        )
    camera, domain = _uncalibrated(clip, samples, settings)
    notes.append(
        "Camera not given: a level 50 mm lens on 36 mm film, the picture taken to be "
        f"{PICTURE_HEIGHT:g} m high where the smoke is."
    )
    size = " x ".join(f"{high - low:.2f}" for low, high in zip(domain.min, domain.max, strict=True))
    notes.append(f"Domain around the smoke: {size} m, {' x '.join(map(str, domain.resolution))} voxels.")
    return camera, domain


def _with_resolution(domain: Domain, resolution: tuple[int, int, int] | None) -> Domain:
    return domain if resolution is None else replace(domain, resolution=resolution)


def _uncalibrated(clip: Clip, samples: _SmokeSamples, settings: Settings) -> tuple[Camera, Domain]:
    """A level camera that looks along +Y, and the box around the smoke at the picture's distance."""
    width, height = clip.size
    focal = LENS * max(width, height)
    metres = PICTURE_HEIGHT / height
    distance = focal * metres
    matrix = np.array([[1, 0, 0, 0], [0, 0, -1, -distance], [0, 1, 0, PICTURE_HEIGHT / 2], [0, 0, 0, 1]], np.float64)
    camera = Camera("perspective", as_matrix(matrix), (width, height), focal, focal, width / 2, height / 2)
    rows, columns = np.nonzero(samples.covered)
    if rows.size == 0:  # no smoke: any box will do
        rows, columns = np.array([0, samples.covered.shape[0] - 1]), np.array([0, samples.covered.shape[1] - 1])
    # a hundredth of the smoke's pixels on each side may be noise or the last wisps
    left, right = np.percentile(columns, [1, 99]) + np.array([0, 1])
    top, bottom = np.percentile(rows, [1, 99]) + np.array([0, 1])
    left, right, top, bottom = (float(v) * samples.scale for v in (left, right, top, bottom))
    margin = 0.06 * max(right - left, bottom - top)
    left, right = max(left - margin, 0.0), min(right + margin, float(width))
    top, bottom = max(top - margin, 0.0), min(bottom + margin, float(height))
    across = max(right - left, 0.25 * (bottom - top)) * metres
    up = max(bottom - top, 0.25 * (right - left)) * metres
    # the far side of the box has to fill the picture too
    across *= 1 + across / (2 * distance)
    centre_x = ((left + right) / 2 - width / 2) * metres
    bottom_z = PICTURE_HEIGHT / 2 - (bottom - height / 2) * metres
    longest = LONGEST_SIDE[settings.quality]
    if settings.resolution is not None:
        resolution = settings.resolution
        voxel = max(across / resolution[0], across / resolution[1], up / resolution[2])
    else:
        voxel = max(across, up) / longest
        resolution = (_voxels(across, voxel), _voxels(across, voxel), _voxels(up, voxel))
    size = np.array(resolution) * voxel
    low = np.array([centre_x - size[0] / 2, -size[1] / 2, bottom_z])
    high = low + size
    return camera, Domain(
        (float(low[0]), float(low[1]), float(low[2])), (float(high[0]), float(high[1]), float(high[2])), resolution
    )


def _voxels(extent: float, voxel: float) -> int:
    """Voxels that cover an extent: a multiple of four, so that pyramids halve it evenly."""
    return max(8, 4 * int(np.ceil(extent / voxel / 4 - 1e-6)))


def _ambient_sun(samples: _SmokeSamples, medium: Medium) -> DirectionalLight:
    """Light such that thick, unshadowed smoke looks like the thickest in the clip.

    Thick smoke shows its source radiance J: the brightest smoke where smoke brightens its background, the darkest
    where it darkens it. A tenth beyond the 99th percentile leaves that smoke an optical depth of about 2.4.
    """
    if samples.colours.shape[0] == 0:
        source = np.ones(3)
    else:
        change = np.sum(samples.colours - samples.behind, -1)
        if np.sum(np.maximum(change, 0)) >= np.sum(np.maximum(-change, 0)):
            source = 1.1 * np.percentile(samples.colours, 99, axis=0)
        else:
            source = 0.9 * np.percentile(samples.colours, 1, axis=0)
    irradiance = source * 4 * np.pi / medium.albedo
    return DirectionalLight((0.0, 0.0, -1.0), (float(irradiance[0]), float(irradiance[1]), float(irradiance[2])))
