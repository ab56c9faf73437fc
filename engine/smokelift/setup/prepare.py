"""A shot in which everything is decided, from a clip and a scene that may leave things open.

What is open is estimated from the clip or defaulted; the findings say what, and why.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from smokelift.checks import UNDETERMINED, Finding, Source, counted, require_kind
from smokelift.density import AxisEstimate, clip_axis
from smokelift.footage.clip import Clip
from smokelift.render import Image, scene_optics
from smokelift.scene import SHADOWED, Background, CompleteScene, Domain, Scattering, Scene
from smokelift.setup.coarse import coarse_frame, coarse_frames
from smokelift.setup.first_estimate import FirstEstimate, first_estimate, first_findings, is_given
from smokelift.setup.further_views import disagreement, open_views
from smokelift.setup.geometry import find_geometry
from smokelift.setup.illumination import find_light, find_medium, find_scattering, light_doubts
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot, ShotView
from smokelift.velocity.pyramid import COARSEST_SIDE, default_coarsening

SHADOWED_SOURCE = 0.5
"""Usual source radiance of smoke over that without shadows, within the factor of two that an extraction needs (measured
on two baked scenes: .52 and .55)."""


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
    _check(len(clip), scene, settings)
    estimate = first_estimate(clip, scene.camera, scene.background, scene.medium, by_hue=not scene.lights)
    samples = estimate.samples
    geometry = find_geometry(scene, estimate, settings)
    camera, domain = geometry.camera, geometry.domain
    medium, of_medium = find_medium(scene, estimate, camera, domain)
    asked = scene.scattering if settings.scattering == "auto" else settings.scattering
    lights, richest, of_light = find_light(scene.lights, asked, geometry, medium, estimate)
    complete = CompleteScene(
        camera=camera,
        domain=domain,
        medium=medium,
        lights=lights,
        background=estimate.found.background or Background(),
        scattering=richest,
        clip=None if scene.clip is None else replace(scene.clip, fps=clip.fps),
        views=scene.views,
        closed=scene.closed,
        inlets=scene.inlets,
    )
    source = _source_in_light(estimate, complete) if scene.lights else estimate.source
    first = ShotView.facing(domain, estimate.clip, camera, estimate.plate, source, not scene.lights)
    complete, of_scattering = _with_scattering(complete, asked, first, estimate, bool(of_light), settings)
    if complete.scattering == "absorption":
        of_light = [found for found in of_light if found.about != "source radiance"]
    others, of_views = open_views(first, complete, samples.typical, bool(scene.lights), settings)
    findings = [
        *clip.findings(),
        *first_findings(estimate, is_given(scene.background, estimate.found)),
        *geometry.findings,
        *of_medium,
        *of_light,
        *of_scattering,
        *of_views,
    ]
    if settings.measure:
        coarsening, chosen = velocity_coarsening(domain, settings)
        findings.append(chosen)
        settings = replace(settings, velocity=replace(settings.velocity, coarsening=coarsening))
    shot = Shot(
        scene=complete,
        optics=scene_optics(complete),
        views=(first, *others),
        settings=settings,
        findings=tuple(findings),
        qualities=geometry.qualities,
        smoky=samples.smoky,
        place=None,
        fire=None if estimate.fire is None else replace(first, clip=estimate.fire.light),
    )
    if scene.views:
        return replace(shot, findings=(*shot.findings, *disagreement(shot)))
    place = clip_axis(shot, settings.distance) if settings.method == "default" else None
    return shot if place is None else replace(shot, place=place, findings=(*shot.findings, found_place(place)))


def _source_in_light(estimate: FirstEstimate, scene: CompleteScene) -> Image | None:
    """The usual source radiance (3,) of the smoke in the scene's light; None where the estimate has none."""
    if estimate.source is None:
        return None
    lit = scene_optics(scene).unshadowed_source()
    if scene.scattering in SHADOWED:
        lit = SHADOWED_SOURCE * lit
    if estimate.found.kind == "picture" and estimate.samples.exposure:
        # a plate from a clip whose white balance changes has that of some frame, and no light's
        lit = lit.mean() * estimate.source / estimate.source.mean()
    return np.asarray(lit, np.float32)


def _with_scattering(
    scene: CompleteScene,
    asked: Scattering | None,
    first: ShotView,
    estimate: FirstEstimate,
    light_assumed: bool,
    settings: Settings,
) -> tuple[CompleteScene, list[Finding]]:
    """The scene with the model of scattering that is asked for, or else explains the input's clip; and why."""
    coarse = coarse_frames((first,), estimate.samples.typical, scene) if settings.measure else ()
    if not coarse:
        return scene, []
    if asked is not None:
        return scene, [Finding("given", about="scattering", value=asked, source="given")]
    finer = partial(coarse_frame, (first,), coarse[0].number, scene, times=2)
    scattering, chosen = find_scattering(coarse, finer, settings)
    findings = [chosen]
    if light_assumed and estimate.source is None:
        # an element says how thick the smoke is, whatever its light
        findings += light_doubts(chosen, estimate.samples, estimate.plate.noise, burns=estimate.fire is not None)
    return replace(scene, scattering=scattering), findings


def found_place(place: AxisEstimate) -> Finding:
    """Return where in depth the smoke stands; undetermined if only the box says it."""
    found = partial(Finding, f"axis depth by {place.cue}", {"depth": place.depth}, about="axis depth")
    if place.cue == "box":
        return found(value=UNDETERMINED, source="assumed", spread=place.deviation)
    source: Source = "given" if place.cue == "distance" else "measured"
    return found(value=place.cue, source=source, spread=place.deviation)


def velocity_coarsening(domain: Domain, settings: Settings) -> tuple[int, Finding]:
    """Return how many times the densities' grid is halved for the velocity, and why."""
    about = "velocity grid coarsening"
    if (given := settings.velocity.coarsening) is not None:
        return given, Finding("given", about=about, value=given, source="given")
    coarsening = default_coarsening(domain.resolution)
    figures = {"voxels": float(-(-max(domain.resolution) // 2**coarsening)), "tolerance": COARSEST_SIDE}
    return coarsening, Finding(about, figures, about=about, value=coarsening, source="estimated")


def _check(length: int, scene: Scene, settings: Settings) -> None:
    """Refuse what is wrong already before any frame, of so many, is examined."""
    if settings.distance is not None and (scene.views or scene.inlets):
        known = "further views show" if scene.views else "inlets say"
        raise ValueError(f"The {known} where the smoke stands; leave the distance out.")
    moves = scene.camera is not None and scene.camera.moves
    if scene.views and (scene.camera is None or scene.domain is None):
        raise ValueError("Further views need the input's camera and the box, in the same meters as theirs; give both.")
    if scene.domain is not None:
        for camera in (scene.camera, *(view.camera for view in scene.views)):
            if camera is not None:
                camera.require_outside(scene.domain)
    if scene.views and (moves or any(view.camera.moves for view in scene.views)):
        raise ValueError("With further views no camera may move; give one matrix per camera, or one view only.")
    if scene.camera is not None and moves and len(scene.camera.matrices) != length:
        given, used = counted(len(scene.camera.matrices), "frame"), counted(length, "frame")
        raise ValueError(
            f"The camera's matrices are given for {given}, but the clip is used with {used}; give one matrix for each."
        )
