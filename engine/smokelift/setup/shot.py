"""From what a user gives (a clip, perhaps a scene file) to everything that a reconstruction needs.

What a scene file leaves out is estimated from the clip or defaulted, and every such choice is put into words.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from smokelift.density import Observation, SmokeAxis
from smokelift.density.hull import agreement, project_voxels
from smokelift.footage.background import open_plates
from smokelift.footage.clip import Clip, is_video
from smokelift.footage.images import area_average, read_image
from smokelift.footage.matte import matte
from smokelift.footage.plate import Plate, changing_plate, known_plate
from smokelift.footage.plate_estimation import estimate_plate, one_colour
from smokelift.footage.working import CameraError, WorkingPicture, voxel_width, working_picture
from smokelift.render import scene_lights
from smokelift.scene import (
    Background,
    Camera,
    ClipSource,
    DirectionalLight,
    Domain,
    Light,
    Medium,
    Scattering,
    Scene,
    as_matrix,
)
from smokelift.setup.choice import Choice
from smokelift.setup.detail import TOLERANCE as DETAIL_TOLERANCE
from smokelift.setup.detail import Detail, smoke_detail
from smokelift.setup.model import choose_model
from smokelift.setup.settings import LONGEST_SIDE, Settings

PICTURE_HEIGHT = 2.0
"""Metres that an uncalibrated picture is taken to be high where the smoke is: the size of a person."""

LENS = 50 / 36
"""Focal length over the longer side of the picture of an uncalibrated camera: Blender's default lens."""

OPTICAL_DEPTH_AT_ONE = 5.0
"""Optical depth of smoke of density 1 across the domain when the medium is not given: thick, not solid."""

AGREEMENT_SAMPLES = 4
LEAST_AGREED = 0.9
"""Share of the smoke's pixels. True views of four baked scenes and a captured one agreed on all of it; upside down ones
on a tenth to nine tenths, but for smoke that fills the picture."""

SAMPLES = 16
DETAIL_FRAMES = 3
COARSEST = 32
"""Voxels along the longest side at least: with fewer there is nothing more to save."""

PICTURE_SIDE = 320


@dataclass(frozen=True, eq=False)
class FurtherView:
    """What another camera saw.

    Attributes
    ----------
    clip
        Its frame 0 is of the same moment as the input's.
    working
        The small picture that the grid is fitted to.
    plate_at
        Background of that small picture in a frame, with the clip's noise.
    """

    clip: Clip
    working: WorkingPicture
    plate_at: Callable[[int], Plate]

    def cut(self, frame: int) -> NDArray[np.float32]:
        """The small picture of a frame, counted from 0."""
        return self.working.cut(self.clip.frame(frame))

    def seen(self, frame: int) -> Observation:
        """What it saw in a frame, counted from 0."""
        return Observation(self.working.camera, self.cut(frame), self.plate_at(frame))


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
        How light is scattered: what the settings say, or else the cheapest model that does; never with shadows where
        the light is not known.
    estimated_background
        Full picture behind the smoke where the scene does not give one, (rows, columns, 3).
    notes
        What was assumed or estimated, a sentence each.
    plate_at
        Background of the full picture in every frame, counted from 0, where camera or background change; else None.
    coarsening, levels
        Of the grid of the velocity, and grids of one without a past.
    choices
        What was chosen by measurement or by hand, with the figures that decided it.
    views
        Further cameras.
    beside
        What those saw in the frame that this is the shot in; see `at`.
    """

    scene: Scene
    working: WorkingPicture
    plate: Plate
    scattering: Scattering
    estimated_background: NDArray[np.float32] | None
    notes: tuple[str, ...]
    plate_at: Callable[[int], Plate] | None = None
    coarsening: int | None = None
    levels: int | None = None
    choices: tuple[Choice, ...] = ()
    views: tuple[FurtherView, ...] = ()
    beside: tuple[Observation, ...] = ()

    def at(self, frame: int) -> Shot | None:
        """The shot as it is in a frame, counted from 0; None if nothing of the domain is in the picture then."""
        beside = tuple(view.seen(frame) for view in self.views)
        if self.plate_at is None:
            return replace(self, beside=beside)
        assert self.scene.camera is not None and self.scene.domain is not None
        try:
            working = working_picture(self.scene.camera.at(frame), self.scene.domain)
        except CameraError:
            return None
        # An environment is as many lights as one camera needs; were they chosen anew, the light would flicker.
        lit = replace(self.scene, lights=scene_lights(self.small_scene))
        plate = self.plate_at(frame).through(working.cut)
        return replace(self, scene=lit, working=working, plate=plate, beside=beside)

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
        What they leave open is chosen by measurement.

    Raises
    ------
    ValueError
        If the scene contradicts the clip or itself, or lacks what cannot be estimated.
    """
    notes: list[str] = []
    if clip.warning:
        notes.append(clip.warning)
    moves = scene.camera is not None and scene.camera.moves
    if scene.views and (scene.camera is None or scene.domain is None):
        raise ValueError("Further [[views]] need the input's [camera] and the [domain], in the same metres as theirs.")
    if scene.views and (moves or any(view.camera.moves for view in scene.views)):
        raise ValueError("With further [[views]] no camera may move; give one matrix a camera, or one view only.")
    if scene.camera is not None and moves and len(scene.camera.matrices) != len(clip):
        raise ValueError(
            f"[camera] matrices are given for {len(scene.camera.matrices)} frames, and {len(clip)} frames of the clip "
            "are used; give one matrix for each."
        )
    plates = open_plates(scene)
    if plates is not None:
        plate_at: Callable[[int], Plate] = changing_plate(plates, clip).at
    else:
        plate, scene = _plate(clip, scene, notes)
        plate_at = plate.at
    samples = _smoke_samples(clip, plate_at)
    camera, domain, resolved = _geometry(clip, scene, settings, plate_at, samples, notes)
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
    lights, richest = scene.lights, _richest(scene.lights, medium, settings)
    if not lights and richest != "absorption":
        sun = _ambient_sun(samples, medium)
        lights = (sun,)
        notes.append(
            "Light not given: as much from everywhere as the thickest smoke shows, "
            f"irradiance {', '.join(f'{v:.2f}' for v in sun.irradiance)}, without shadows."
        )
    source = None if scene.clip is None else replace(scene.clip, fps=clip.fps)
    complete = replace(scene, clip=source, camera=camera, domain=domain, medium=medium, lights=lights)
    working, shown = _working(camera, domain)
    plate = plate_at(shown)
    estimated = plate.image if _unknown(scene.background) else None
    changing = plate_at if moves or plates is not None else None
    scattering, coarsening, levels = richest, settings.velocity.coarsening, settings.velocity.levels
    choices = () if resolved is None else (resolved,)
    if settings.method != "paper":
        model = choose_model(clip, complete, plate_at, samples.smoky, richest, settings)
        complete, scattering = model.scene, model.scattering
        coarsening, levels = model.coarsening, model.levels
        choices = (*choices, *model.choices)
    views = tuple(_further_view(number, clip, complete, notes) for number in range(len(scene.views)))
    if views:
        first = FurtherView(clip, working, lambda frame: plate_at(frame).through(working.cut))
        agreed = _agreed((first, *views), domain, clip.spread(AGREEMENT_SAMPLES))
        if agreed < LEAST_AGREED:
            notes.append(
                f"The views agree on {agreed:.0%} of the smoke that they show: check where their cameras stand, which "
                "frames belong together and what stands behind the smoke."
            )
    return Shot(
        complete,
        working,
        plate.through(working.cut),
        scattering,
        estimated,
        tuple(notes),
        changing,
        coarsening,
        levels,
        choices,
        views,
    )


def _richest(lights: tuple[Light, ...], medium: Medium, settings: Settings) -> Scattering:
    """The richest model of scattering that may be used: the one in the settings, or what is known of the light allows.

    Raises
    ------
    ValueError
        If shadows are asked for without a light to cast them.
    """
    said = settings.density.scattering
    if said == "single" and not lights:
        raise ValueError(
            'Scattering "single" needs a light that casts the shadows; give one in [[lights]], or leave it to "auto".'
        )
    if said != "auto":
        return said
    if medium.albedo == 0:
        return "absorption"
    return "single" if lights else "unshadowed"


def boundaries(scene: Scene, settings: Settings) -> tuple[str, ...]:
    """How smoke gets in and out of the box of a complete scene, a sentence each."""
    inflow = scene.inflow()
    if inflow is None:
        search = settings.method == "default" and settings.velocity.sources is not None
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


def _further_view(number: int, clip: Clip, scene: Scene, notes: list[str]) -> FurtherView:
    """Open a further view of a complete scene and find its background."""
    view, name = scene.views[number], f"View {number + 1}"
    assert scene.camera is not None and scene.domain is not None
    opened = _opened(view.clip, clip, scene)
    if opened.warning:
        notes.append(opened.warning)
    if abs(opened.fps - clip.fps) > 0.01 * clip.fps:
        raise ValueError(
            f"{opened.path}: has {opened.fps:g} frames a second, the input {clip.fps:g}; all views need the same, so "
            "convert one, or give fps in the [clip] whose file says it wrongly."
        )
    camera = _fitting(view.camera, opened)
    try:
        working = working_picture(camera, scene.domain)
    except CameraError as error:
        raise ValueError(f"{name}: {error}") from error
    background = view.background
    if background is None and scene.background is not None and scene.background.color is not None:
        background = scene.background
    found: list[str] = []
    own = replace(scene, camera=camera, background=background, views=())
    plates = open_plates(own)
    if plates is not None:
        plate_at: Callable[[int], Plate] = changing_plate(plates, opened).through(working.cut).at
    else:
        plate = _plate(opened, own, found)[0].through(working.cut)
        plate_at = plate.at
    axes = [np.array(each.matrix)[:3, 2] for each in (scene.camera, camera)]
    angle = np.degrees(np.arccos(np.clip(axes[0] @ axes[1], -1, 1)))
    frames = f"frames {opened.first} to {opened.first + len(opened) - 1}"
    notes.append(" ".join([f"{name}: {opened.path.name}, {angle:.0f} degrees from the input, {frames}.", *found]))
    return FurtherView(opened, working, plate_at)


def _agreed(views: Sequence[FurtherView], domain: Domain, frames: Sequence[int]) -> float:
    """Median share, over some frames, of the smoke in all views that voxels of the domain can explain."""
    projections = [project_voxels(view.working.camera, domain) for view in views]
    seen = ([(view.cut(frame), view.plate_at(frame)) for view in views] for frame in frames)
    return float(np.median([agreement([matte(*pair).mask for pair in pairs], projections) for pairs in seen]))


def _opened(source: ClipSource, clip: Clip, scene: Scene) -> Clip:
    """The part of a view's clip that shows what the input does."""
    first = clip.first
    if source.frames is not None:
        first += source.first - (scene.clip.first if scene.clip is not None else clip.first)
    # pictures carry no rate of their own
    fps = clip.fps if source.fps is None and not is_video(source.path) else source.fps
    with Clip.open(replace(source, fps=fps, frames=None)) as whole:
        have = len(whole)
    last = first + len(clip) - 1
    if first < 0 or last >= have:
        raise ValueError(
            f"{source.path}: has frames 0 to {have - 1}, but {first} to {last} are those of the input's moments; use "
            "fewer frames of the input, or say with frames in the view's [clip] which ones belong to them."
        )
    return Clip.open(source, fps=fps, frames=(first, last))


def _fitting(camera: Camera, clip: Clip) -> Camera:
    """The camera with as many pixels as its clip."""
    if camera.size[0] * clip.size[1] != camera.size[1] * clip.size[0]:
        raise ValueError(
            f"The camera's picture is {camera.size[0]} x {camera.size[1]}, the clip's {clip.size[0]} x {clip.size[1]} "
            f"({clip.path.name}); [camera] size must have the clip's shape."
        )
    return camera.resized(*clip.size)


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
    smoky
        Numbers of the frames with smoke, those with the most first.
    """

    scale: float
    covered: NDArray[np.bool_]
    colours: NDArray[np.float32]
    behind: NDArray[np.float32]
    smoky: tuple[int, ...]


def _smoke_samples(clip: Clip, plate_at: Callable[[int], Plate]) -> _SmokeSamples:
    width, height = clip.size
    scale = max(1.0, max(width, height) / PICTURE_SIDE)
    columns, rows = max(1, round(width / scale)), max(1, round(height / scale))
    covered = np.zeros((rows, columns), np.bool_)
    colours, behind = [], []
    amounts: dict[int, int] = {}
    for number in clip.spread(SAMPLES):
        plate = plate_at(number)
        small = plate.through(lambda whole: area_average(whole, columns, rows))
        picture = area_average(clip.frame(number), columns, rows)
        mask = matte(picture, small).mask
        covered |= mask
        colours.append(picture[mask])
        behind.append(small.image[mask])
        if mask.any():
            amounts[number] = int(mask.sum())
    smoky = tuple(sorted(amounts, key=lambda number: -amounts[number]))
    return _SmokeSamples(scale, covered, np.concatenate(colours), np.concatenate(behind), smoky)


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
    clip: Clip,
    scene: Scene,
    settings: Settings,
    plate_at: Callable[[int], Plate],
    samples: _SmokeSamples,
    notes: list[str],
) -> tuple[Camera, Domain, Choice | None]:
    if scene.camera is not None:
        camera = _fitting(scene.camera, clip)
        if scene.domain is None:
            raise ValueError("The scene gives a camera but no box in [domain]; give the one that holds the smoke.")
        if settings.resolution == "auto":
            grids = _same_shape(scene.domain, LONGEST_SIDE[settings.quality])
            return camera, *_resolved(clip, camera, grids, plate_at, samples.smoky)
        domain = _with_resolution(scene.domain, settings.resolution)
        return camera, domain, _resolution_by_hand(domain)
    if scene.domain is not None:
        raise ValueError("The scene gives a [domain] but no [camera]; give the camera that filmed it.")
    if scene.inlets:
        raise ValueError(
            "The scene marks an [[inlet]] but gives no [camera] and [domain]; give both to say where it is."
        )
    camera, grids = _uncalibrated(clip, samples, settings)
    if isinstance(settings.resolution, tuple):
        domain, choice = grids[-1], _resolution_by_hand(grids[-1])
    elif settings.method == "paper":
        domain, choice = grids[-1], None
    else:
        domain, choice = _resolved(clip, camera, grids, plate_at, samples.smoky)
    notes.append(
        "Camera not given: a level 50 mm lens on 36 mm film, the picture taken to be "
        f"{PICTURE_HEIGHT:g} m high where the smoke is."
    )
    size = " x ".join(f"{high - low:.2f}" for low, high in zip(domain.min, domain.max, strict=True))
    notes.append(f"Domain around the smoke: {size} m, {' x '.join(map(str, domain.resolution))} voxels.")
    return camera, domain, choice


def _resolution_by_hand(domain: Domain) -> Choice:
    said = " x ".join(map(str, domain.resolution))
    return Choice("resolution", domain.resolution, f"Resolution by hand: {said} voxels.", by_hand=True)


def _with_resolution(domain: Domain, resolution: tuple[int, int, int] | None) -> Domain:
    return domain if resolution is None else replace(domain, resolution=resolution)


def _uncalibrated(clip: Clip, samples: _SmokeSamples, settings: Settings) -> tuple[Camera, tuple[Domain, ...]]:
    """A level camera that looks along +Y, and the box around the smoke at the picture's distance.

    The box comes with every number of voxels that may be chosen, the fewest first.
    """
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

    def box(voxel: float, resolution: tuple[int, int, int]) -> Domain:
        size = np.array(resolution) * voxel
        low = np.array([centre_x - size[0] / 2, -size[1] / 2, bottom_z])
        high = low + size
        return Domain(
            (float(low[0]), float(low[1]), float(low[2])), (float(high[0]), float(high[1]), float(high[2])), resolution
        )

    if isinstance(settings.resolution, tuple):
        x, y, z = settings.resolution
        return camera, (box(max(across / x, across / y, up / z), settings.resolution),)
    grids = []
    for longest in range(COARSEST, LONGEST_SIDE[settings.quality] + 1, 4):
        voxel = max(across, up) / longest
        grids.append(box(voxel, (_voxels(across, voxel), _voxels(across, voxel), _voxels(up, voxel))))
    return camera, tuple(grids)


def _same_shape(domain: Domain, most: int) -> tuple[Domain, ...]:
    """The box with every number of cubic voxels that fills it exactly, the fewest first; none finer than allowed."""
    common = math.gcd(*domain.resolution)
    x, y, z = (n // common for n in domain.resolution)
    longest = max(x, y, z)
    fewest = -(-min(COARSEST, max(domain.resolution)) // longest)
    return tuple(
        replace(domain, resolution=(x * times, y * times, z * times))
        for times in range(fewest, max(most // longest, fewest) + 1)
    )


def _resolved(
    clip: Clip, camera: Camera, grids: tuple[Domain, ...], plate_at: Callable[[int], Plate], smoky: tuple[int, ...]
) -> tuple[Domain, Choice]:
    """The coarsest grid of some that loses no more of the smoke's detail than tolerated, and why."""
    finest = max(grids[-1].resolution)
    detail = _detail(clip, camera, grids[-1], plate_at, smoky)
    domain = next((grid for grid in grids if detail.lost(max(grid.resolution)) <= DETAIL_TOLERANCE), grids[-1])
    lost = detail.lost(max(domain.resolution))
    reason = (
        f"Resolution: {' x '.join(map(str, domain.resolution))} voxels, which lose {lost:.1%} of the smoke's contrast "
        f"against {finest} along the longest side, the most at this quality."
    )
    return domain, Choice("resolution", domain.resolution, reason, {"lost": lost}, DETAIL_TOLERANCE)


def _detail(
    clip: Clip, camera: Camera, finest: Domain, plate_at: Callable[[int], Plate], smoky: tuple[int, ...]
) -> Detail:
    """The detail of the smoke in some frames, up to that of a grid."""
    frames = []
    for number in smoky[:DETAIL_FRAMES]:
        with suppress(CameraError):
            now, plate = camera.at(number), plate_at(number)
            working = working_picture(now, finest)
            frames.append((working.part(clip.frame(number)), plate.through(working.part), voxel_width(now, finest)))
    return smoke_detail(frames, max(finest.resolution))


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
