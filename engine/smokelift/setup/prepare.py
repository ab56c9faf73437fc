"""A shot in which everything is decided, from what a user gives (a clip, perhaps a scene file).

What a scene leaves out is estimated from the clip or defaulted; remarks and estimates say what, and why.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

from smokelift.checks import Remark, counted, require_kind
from smokelift.density.axis import depth_at
from smokelift.footage.clip import Clip
from smokelift.footage.plate import NOISE_FRAMES
from smokelift.footage.proxy import proxy_frames
from smokelift.footage.working_picture import CameraError, WorkingPicture, working_picture
from smokelift.render import scene_optics
from smokelift.scene import Background, Camera, CompleteScene, Domain, Medium, Scene
from smokelift.setup.coarse import CoarseClip
from smokelift.setup.estimate import Estimate
from smokelift.setup.first_estimate import FirstEstimate, first_estimate
from smokelift.setup.further_views import disagreement, open_view
from smokelift.setup.geometry import Geometry, clip_lenses, find_geometry
from smokelift.setup.illumination import Illumination, first_light, light_remarks, measured_light, sunlight
from smokelift.setup.medium_estimate import find_medium
from smokelift.setup.model import choose_model, tried_frames
from smokelift.setup.place import placed
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot, ShotView
from smokelift.setup.smoke import SAMPLE_FRAMES
from smokelift.setup.view_gain import balanced


def prepare_shot(clip: Clip, scene: Scene, settings: Settings | None = None) -> Shot:
    """Complete a scene from its clip.

    Parameters
    ----------
    clip
        The footage.
    scene
        Whatever is known.
    settings
        `Settings.preset` of a quality and a method, balanced by default; anything unset is measured on the clip.

    Raises
    ------
    ValueError
        If the scene contradicts the clip or itself, or lacks what cannot be estimated.
    """
    require_kind(clip, Clip, "clip", 'a Clip (Clip.open("clip.mp4") opens one)')
    require_kind(scene, Scene, "scene", "a Scene (Scene() leaves all open, Scene.load reads a file)")
    require_kind(settings, Settings | None, "settings", "Settings (Settings.preset makes them)")
    settings = settings or Settings.preset()
    _check(clip, scene, settings)
    _expect(clip, scene)
    remarks = clip.remarks()
    # a search for the lens finds turns of a camera; several cameras are calibrated, so they stand still where given
    lenses = () if scene.views else clip_lenses(scene.camera, clip)
    estimate = first_estimate(clip, scene.camera, scene.background, lenses)
    steadied, plates, samples = estimate.clip, estimate.plates, estimate.samples
    geometry = find_geometry(steadied, scene, settings, plates, samples, estimate.turns)
    camera, domain = geometry.camera, geometry.domain
    if settings.distance is not None:
        depth_at(settings.distance, camera, domain)  # refuse early what cannot be
    medium, coloured, taken = find_medium(scene.medium, estimate, scene.lights, camera, domain)
    asked = scene.scattering if settings.scattering == "auto" else settings.scattering
    light = first_light(scene.lights, asked, medium, samples)
    complete = _complete(scene, estimate, geometry, medium, light)
    first = ShotView(steadied, camera, plates, _working(camera, domain))
    measure, tried = settings.selection.measure, tried_frames(samples.smoky)
    coarse = CoarseClip((first,), complete)
    frames = coarse.smoky(tried) if measure else {}
    if frames:
        light = measured_light(light, coarse, frames, settings)
        complete = replace(complete, lights=light.lights, scattering=light.scattering)
    others, gains, said = _further_views(first, complete, estimate, settings, bool(scene.lights))
    if frames and estimate.fire is None:
        light = sunlight(light, CoarseClip((first, *others), complete), tried, settings)
        if light.sunny:  # gains stay: of real sets none has shown a sun (docs/experiments/view-gain.md)
            light = measured_light(light, coarse, frames, settings)
        complete = replace(complete, lights=light.lights, scattering=light.scattering)
    model = choose_model(complete, coarse, frames, settings) if measure else None
    clip.expect()  # lets go of frames that are kept as they were decoded
    shot = Shot(
        scene=complete,
        optics=scene_optics(complete),
        views=(first, *others),
        settings=settings if model is None else replace(settings, velocity=model.velocity),
        estimated_background=estimate.picture,
        remarks=(
            *remarks,
            *estimate.remarks,
            *geometry.remarks,
            *taken,
            *light_remarks(light, samples, plates.noise, burns=estimate.fire is not None),
            *said,
        ),
        estimates=(
            *geometry.estimates,
            *coloured,
            *light.estimates,
            *(() if model is None else model.estimates),
            *gains,
        ),
        qualities=geometry.qualities,
        exposure=samples.exposure,
        smoky=samples.smoky,
        place=None,
        fire=None if estimate.fire is None else replace(first, clip=estimate.fire.light),
    )
    return replace(shot, remarks=(*shot.remarks, *disagreement(shot))) if scene.views else placed(shot)


def _complete(
    scene: Scene, estimate: FirstEstimate, geometry: Geometry, medium: Medium, light: Illumination
) -> CompleteScene:
    """The scene with all that it left open."""
    return CompleteScene(
        camera=geometry.camera,
        domain=geometry.domain,
        medium=medium,
        lights=light.lights,
        background=estimate.found.background or Background(),
        scattering=light.scattering,
        clip=None if scene.clip is None else replace(scene.clip, fps=estimate.clip.fps),
        views=scene.views,
        closed=scene.closed,
        inlets=scene.inlets,
    )


def _check(clip: Clip, scene: Scene, settings: Settings) -> None:
    """Refuse what can be seen to be wrong before anything is examined."""
    if settings.distance is not None and (scene.views or scene.inlets):
        known = "further views show" if scene.views else "inlets say"
        raise ValueError(f"The {known} where the smoke stands; leave the distance out.")
    moves = scene.camera is not None and scene.camera.moves
    if scene.views and (scene.camera is None or scene.domain is None):
        raise ValueError("Further views need the input's camera and the box, in the same metres as theirs; give both.")
    if scene.domain is not None:
        for camera in (scene.camera, *(view.camera for view in scene.views)):
            if camera is not None:
                camera.require_outside(scene.domain)
    if scene.views and (moves or any(view.camera.moves for view in scene.views)):
        raise ValueError("With further views no camera may move; give one matrix a camera, or one view only.")
    if scene.camera is not None and moves and len(scene.camera.matrices) != len(clip):
        given, used = counted(len(scene.camera.matrices), "frame"), counted(len(clip), "frame")
        raise ValueError(
            f"The camera's matrices are given for {given}, but the clip is used with {used}; give one matrix for each."
        )


def _expect(clip: Clip, scene: Scene) -> None:
    """Say which frames are examined, so that each of them is decoded once."""
    examined = clip.spread(SAMPLE_FRAMES)
    # a velocity needs the frame after one with smoke, or before the last; turns are found from the middle one
    alone = sorted({n + 1 for n in examined} | {len(clip) - 2, len(clip) // 2})
    # a background needs more frames than the smoke; those that do not fit are read in a row
    given = scene.background is not None
    in_a_row = clip.spread(NOISE_FRAMES) if given else [n - clip.first for n in proxy_frames(clip)]
    clip.expect(dict.fromkeys(n for n in (*examined, *alone, *in_a_row) if n >= 0))


def _further_views(
    first: ShotView, scene: CompleteScene, estimate: FirstEstimate, settings: Settings, lit: bool
) -> tuple[list[ShotView], list[Estimate[str]], list[Remark]]:
    """The further views of a scene, at the first one's exposure; with what was measured and noticed."""
    views, remarks = [], []
    gains: list[Estimate[str]] = []
    smoky = estimate.samples.smoky
    for number in range(len(scene.views)):
        view, said = open_view(number, first.clip, scene)
        remarks += said
        if settings.selection.measure:
            shows = tried_frames(smoky)
            tolerance = settings.selection.scattering_error
            view, gain = balanced(number + 1, first, view, scene, lit, shows, settings.density, tolerance)
            gains += gain
        views.append(view)
    return views, gains, remarks


def _working(camera: Camera, domain: Domain) -> WorkingPicture:
    """The small picture of the first frame that shows the domain."""
    for frame in range(len(camera.matrices)):
        with suppress(CameraError):
            return working_picture(camera.at(frame), domain)
    return working_picture(camera, domain)
