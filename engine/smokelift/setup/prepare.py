"""From what a user gives (a clip, perhaps a scene file) to a shot in which everything is decided.

What a scene leaves out is estimated from the clip or defaulted, and every such choice is put into words.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Any

from smokelift.density.axis import SmokeAxis
from smokelift.footage.clip import Clip
from smokelift.footage.evidence import GLIMPSE, looks
from smokelift.footage.fire import fire_colour, fire_share, firelight, without_fire
from smokelift.footage.large_plate import large_frames
from smokelift.footage.plate import Plate
from smokelift.footage.steady import steady
from smokelift.footage.working_picture import CameraError, WorkingPicture, working_picture
from smokelift.render import scene_optics
from smokelift.scene import Background, Camera, CompleteScene, Domain, Medium, Scene
from smokelift.scene.checks import Vector
from smokelift.setup import smoke
from smokelift.setup.background import cut_notes, exposure_notes, find_plates, smoke_in_plate
from smokelift.setup.choice import Choice
from smokelift.setup.further_views import disagreement, open_view
from smokelift.setup.geometry import clip_lens, find_geometry
from smokelift.setup.light import (
    ambient_sun,
    light_colour,
    light_doubts,
    light_note,
    richest_scattering,
    unknown_direction,
)
from smokelift.setup.model import choose_model, tried_frames
from smokelift.setup.no_smoke import nothing_seen
from smokelift.setup.place import placed
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot, ShotView
from smokelift.setup.smoke import sample_smoke
from smokelift.setup.smoke_colour import smoke_colour
from smokelift.setup.thickness import Thickness, smoke_thickness
from smokelift.setup.view_gain import balanced

OPTICAL_DEPTH_AT_ONE = 5.0
"""Optical depth of smoke of density 1 across the domain when the medium is not given: thick, not solid."""


def prepare_shot(clip: Clip, scene: Scene, settings: Settings) -> Shot:
    """Complete a scene from its clip.

    Parameters
    ----------
    clip
        The footage.
    scene
        Whatever is known.
    settings
        Anything unset is measured on the clip.

    Raises
    ------
    ValueError
        If the scene contradicts the clip or itself, or lacks what cannot be estimated.
    """
    _check(clip, scene)
    filmed, looked_at = clip, clip.spread(smoke.SAMPLES)
    estimates = scene.background is None
    # a velocity needs the frame after one with smoke, and a large background more frames than one colour does
    perhaps = {n + 1 for n in looked_at} | set(large_frames(clip) if estimates else ())
    clip.expect(looked_at, looks(clip) if estimates else (), GLIMPSE, perhaps.difference(looked_at))
    remarks = clip.remarks()
    # cameras that belong together are measured, and stand where they are said to
    lens = None if scene.views else clip_lens(scene.camera, clip)
    found = find_plates(clip, scene.camera, scene.background, lens)
    clip, plates = found.clip, found.plates
    samples = sample_smoke(clip, plates, found.turns)
    cuts = cut_notes(clip, samples.small) if found.turns is None else ()
    clip = steady(clip, plates, samples.gains)
    burning = fire_share(samples.colours, samples.behind)
    fire = None
    if burning:
        doused = without_fire(clip, plates)
        fire = firelight(clip, doused)
        glow = fire_colour(clip, fire)
        clip = doused
        samples = replace(sample_smoke(clip, plates, found.turns), gains=samples.gains)
    geometry = find_geometry(clip, scene, settings, plates, samples, found.turns)
    camera, domain = geometry.camera, geometry.domain
    nothing = nothing_seen(clip, plates, samples, scene.background is not None, cuts)
    doubts = (*(nothing or cuts), *found.doubts, *smoke_in_plate(samples))
    notes = [*remarks, *found.notes, *doubts, *exposure_notes(samples.exposure), *geometry.notes]
    if settings.axis_depth is not None:
        SmokeAxis.given(settings.axis_depth, camera, domain)  # refuse early what cannot be
    choices: tuple[Choice[Any], ...] = () if geometry.resolution is None else (geometry.resolution,)
    medium = scene.medium
    if medium is None:
        usual = _usual_medium(domain)
        colour = smoke_colour(samples, light_colour(scene.lights, camera, domain, usual))
        medium = replace(usual, color=colour.color)
        choices += (colour.choice,)
        notes.append(
            f"Medium not given: extinction {medium.extinction:.3g} 1/m (density 1 is thick smoke), "
            f"albedo {medium.albedo:g}, isotropic."
        )
    if fire is not None:
        told = medium.flame_color
        medium = replace(medium, flame_color=told or glow)
        choices += (_fire(burning, told or glow, told is not None),)
    asked = scene.scattering if settings.scattering == "auto" else settings.scattering
    thickness: Thickness | None = None
    light_choices: tuple[Choice[Any], ...] = ()
    lights, richest = scene.lights, richest_scattering(asked, scene.lights, medium)
    if not lights and richest != "absorption":
        thickness = smoke_thickness(samples.textures)
        light_choices = (thickness.choice, unknown_direction())
        lights = (ambient_sun(samples, medium, thickness.source),)
    complete = CompleteScene(
        camera=camera,
        domain=domain,
        medium=medium,
        lights=lights,
        background=found.background or Background(),
        scattering=richest,
        clip=None if scene.clip is None else replace(scene.clip, fps=clip.fps),
        views=scene.views,
        closed=scene.closed,
        inlets=scene.inlets,
    )
    if settings.selection.measure:
        guessed = thickness is not None and thickness.source is None
        model = choose_model(clip, complete, plates, samples.smoky, asked is not None, settings, guessed)
        complete, settings = model.scene, replace(settings, velocity=model.velocity)
        choices = (*choices, *model.choices)
    if thickness is not None:
        notes.append(light_note(complete, thickness.source is not None, bool(samples.smoky)))
        scattered = next((choice for choice in choices if choice.what == "scattering"), None)
        if scattered is not None:
            notes += light_doubts(scattered, samples, plates.noise)
    if complete.scattering != "absorption":
        choices += light_choices
    views = [ShotView(clip, camera, plates, _working(camera, domain))]
    for number in range(len(scene.views)):
        view, said = open_view(number, clip, complete)
        if settings.selection.measure:
            shows = tried_frames(samples.smoky)
            tolerance = settings.selection.scattering_error
            lit = bool(scene.lights)
            view, gain = balanced(number + 1, views[0], view, complete, lit, shows, settings.density, tolerance)
            choices = (*choices, *gain)
        views.append(view)
        notes += said
    filmed.expect()
    shot = Shot(
        scene=complete,
        optics=scene_optics(complete),
        views=tuple(views),
        settings=settings,
        estimated_background=plates.image if found.background is None and isinstance(plates, Plate) else None,
        notes=tuple(notes),
        doubts=doubts,
        choices=choices,
        exposure=samples.exposure,
        smoky=samples.smoky,
        place=None,
        fire=None if fire is None else replace(views[0], clip=fire),
    )
    return replace(shot, notes=(*notes, *disagreement(shot))) if scene.views else placed(shot)


def boundaries(scene: CompleteScene, settings: Settings) -> tuple[str, ...]:
    """How smoke gets in and out of the box of a complete scene, a sentence each."""
    inflow = scene.inflow()
    if inflow is None:
        search = settings.method == "default" and settings.velocity.sources
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


def _check(clip: Clip, scene: Scene) -> None:
    """Refuse what can be seen to be wrong before anything is looked at."""
    moves = scene.camera is not None and scene.camera.moves
    if scene.views and (scene.camera is None or scene.domain is None):
        raise ValueError("Further [[views]] need the input's [camera] and the [domain], in the same metres as theirs.")
    if scene.domain is not None:
        for camera in (scene.camera, *(view.camera for view in scene.views)):
            if camera is not None:
                camera.require_outside(scene.domain)
    if scene.views and (moves or any(view.camera.moves for view in scene.views)):
        raise ValueError("With further [[views]] no camera may move; give one matrix a camera, or one view only.")
    if scene.camera is not None and moves and len(scene.camera.matrices) != len(clip):
        raise ValueError(
            f"[camera] matrices are given for {len(scene.camera.matrices)} frames, and {len(clip)} frames of the clip "
            "are used; give one matrix for each."
        )


def _fire(share: float, colour: Vector, told: bool) -> Choice[str]:
    red, green, blue = colour
    reason = (
        f"Fire: {share:.1%} of the smoke's pixels shine by themselves. The grid flame holds their light, of the "
        f"color {red:g}, {green:g}, {blue:g}{' that is given' if told else ''}; the smoke beside it is continued over "
        "it."
    )
    return Choice("fire", f"{share:.3f}", reason, {"share": share, "red": red, "green": green, "blue": blue})


def _usual_medium(domain: Domain) -> Medium:
    width = min(high - low for low, high in zip(domain.min, domain.max, strict=True))
    return Medium(extinction=OPTICAL_DEPTH_AT_ONE / width)


def _working(camera: Camera, domain: Domain) -> WorkingPicture:
    """The small picture of the first frame that shows the domain."""
    for frame in range(len(camera.matrices)):
        with suppress(CameraError):
            return working_picture(camera.at(frame), domain)
    return working_picture(camera, domain)
