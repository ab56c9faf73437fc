"""What is known of a shot before it is reconstructed, fact by fact: its value, and where that comes from."""

from __future__ import annotations

from typing import Any

from smokelift.checks import Remark, counted
from smokelift.footage.exposure import shows_exposure, small
from smokelift.footage.plate import Plate
from smokelift.report.cost import Cost
from smokelift.report.page import Fact
from smokelift.report.sentences import sentence
from smokelift.scene import CompleteScene, Scene
from smokelift.setup.backdrop_remarks import BLACK
from smokelift.setup.estimate import UNDETERMINED, Estimate
from smokelift.setup.first_estimate import unknown_part
from smokelift.setup.geometry import PICTURE_HEIGHT
from smokelift.setup.shot import Shot

CLEAN_NOISE, HEAVY_NOISE = 2.0, 6.0
"""Noise in 8 bit codes up to which a clip is clean, and from which it hides thin smoke
(docs/experiments/background.md)."""


def facts(shot: Shot, given: Scene, cost: Cost) -> tuple[Fact, ...]:
    """Return what is known of a shot; ``given`` is the user's scene."""
    scene, domain = shot.scene, shot.scene.domain
    plate = shot.views[0].plates.at(0)
    size = " x ".join(f"{high - low:.3g}" for low, high in zip(domain.min, domain.max, strict=True))
    has_camera, has_box = given.camera is not None, given.domain is not None
    has_scale = has_box or shot.settings.distance is not None
    height = f"The picture is taken to be {PICTURE_HEIGHT:g} m high where the smoke is."
    return (
        _background(shot, given, plate),
        *_mask(shot),
        _exposure(shot, plate),
        _noise(plate),
        _given_or_undetermined(
            "camera",
            f"{scene.camera.type}, {'moves' if scene.camera.moves else 'stands still'}",
            has_camera,
            _said(shot, "assumed camera"),
        ),
        _given_or_undetermined(
            "scale", f"box of {size} m", has_scale, f"{height} Give its distance, or camera and box, in meters."
        ),
        _box(shot, has_box),
        _chosen(shot, "resolution", "grid", " x ".join(map(str, domain.resolution)), has_box),
        *_medium(shot, not any(remark.kind == "assumed medium" for remark in shot.remarks)),
        *_light(shot, given),
        _chosen(shot, "scattering", "scattering", scene.scattering, given.scattering is not None),
        _place(shot),
        _cost(shot, cost),
    )


def _box(shot: Shot, is_given: bool) -> Fact:
    if is_given:
        return Fact("box", "as given", "given")
    if not shot.smoky:
        return Fact("box", "over all of the picture", UNDETERMINED, _said(shot, "box"))
    return Fact("box", "around the smoke of the whole clip", "estimated", _said(shot, "box"))


def _medium(shot: Shot, is_given: bool) -> tuple[Fact, ...]:
    medium, know = shot.scene.medium, "Give the medium if you know it."
    extinction = f"{medium.extinction:.3g} 1/m at density 1"
    colour = "gray" if medium.is_grey else ", ".join(f"{v:.2f}" for v in medium.color)
    product = f"A picture shows it times the density only. {know}"
    light = f"A picture shows it times the light only. {know}"
    return (
        _given_or_undetermined("extinction", extinction, is_given, product),
        _given_or_undetermined("albedo", f"{medium.albedo:.3g}", is_given, light),
        _chosen(shot, "smoke colour", "smoke color", colour, is_given),
    )


def _cost(shot: Shot, cost: Cost) -> Fact:
    spent = f"about {cost.seconds:.0f} s, {cost.memory / 2**30:.1f} GiB of memory, {cost.disk / 1e6:.0f} MB on disk"
    free = f"Right to a factor of 1.5 if nothing else runs; {cost.memory_free / 2**30:.1f} GiB of memory are free."
    return Fact("cost", f"{counted(shot.length, 'frame')}: {spent}", "estimated", free)


def _said(shot: Shot, *about: str) -> str:
    """The sentence of the remark on the input whose kind begins with one of ``about``, else nothing."""
    own = (remark for remark in shot.remarks if "view" not in remark.figures)
    return next((sentence(remark) for remark in own if remark.kind.startswith(about)), "")


def _given_or_undetermined(what: str, value: str, is_given: bool, how: str) -> Fact:
    """The fact about what a user may give and no measurement determines."""
    return Fact(what, value, "given") if is_given else Fact(what, value, UNDETERMINED, how)


def _background(shot: Shot, given: Scene, plate: Plate) -> Fact:
    if given.background is not None and not given.background.estimated:
        return Fact("background", "as given", "given")
    unknown = float(unknown_part(plate, shot.clip, 0).mean())
    colour = plate.image[0, 0]
    value = "a picture"
    if (plate.image == colour).all():
        value = "black" if colour.max() < BLACK else f"one color, {', '.join(f'{v:.2g}' for v in colour)} (linear)"
    assumed = any(remark.kind == "background assumed" for remark in shot.remarks)
    return Fact(
        "background",
        f"{value}, {unknown:.0%} of it unknown" if unknown else value,
        UNDETERMINED if assumed else "estimated",
        _said(shot, "background", "black background"),
    )


def _mask(shot: Shot) -> tuple[Fact, ...]:
    """The fact about the mask, if there is one."""
    seen = shot.clip.seen(0, *shot.clip.size)
    if seen is None or shot.clip.mask is None or not shot.clip.mask.files:
        return ()
    how = "No smoke is made there, and the fit ignores it."
    return (Fact("mask", f"hides {1 - seen.mean():.0%} of the first frame", "given", how),)


def _exposure(shot: Shot, plate: Plate) -> Fact:
    if not shows_exposure(small(plate.image)):
        how = "The background is too dark or too bright to show it, so what flickers is taken for smoke."
        return Fact("exposure", "taken to be steady", UNDETERMINED, how)
    changes = [remark.figures["change"] for remark in shot.remarks if remark.kind == "exposure"]
    value = f"changes by up to {changes[0]:.0%}, evened out" if changes else "steady"
    return Fact("exposure", value, "measured", "Measured on what does not move, against the background.")


def _noise(plate: Plate) -> Fact:
    codes = 255 * float(plate.noise.total.max())
    kind = "clean" if codes <= CLEAN_NOISE else "noisy: thin smoke is lost in it" if codes >= HEAVY_NOISE else "usual"
    lasting = 255 * float(plate.noise.lasting.max())
    return Fact(
        "noise", f"{kind}, {codes:.1f} of 255", "measured", f"{lasting:.1f} of it is shared by neighboring pixels."
    )


def _light(shot: Shot, given: Scene) -> tuple[Fact, ...]:
    """The facts about the light: how strong it is, and what one picture does not show of it."""
    if shot.scene.scattering == "absorption":
        return (Fact("light", "none is needed", "estimated" if given.scattering is None else "given"),)
    colour = ", ".join(f"{v:.2g}" for v in shot.optics.unshadowed_source())
    if given.lights or _estimate(shot, "source radiance") is None:
        return (Fact("light", "as given", "given"),)
    return (
        _chosen(shot, "source radiance", "light strength", f"smoke of radiance {colour}", False),
        Fact("sun's direction", "no sun", UNDETERMINED, "Suns from many sides look the same. Give the lights."),
        Fact("sun's color", "that of all light", UNDETERMINED),
        Fact("ambient share", "all light is from everywhere", UNDETERMINED),
    )


def _place(shot: Shot) -> Fact:
    given, place = shot.settings.distance, shot.place
    if given is not None:
        return Fact("place in depth", f"{given:.2f} m from the camera", "given")
    if len(shot.views) > 1:
        return Fact("place in depth", "as the cameras show it", "estimated")
    value = "the middle of the box"
    if place is not None:
        depth = round(place.depth, 2) + 0.0  # no minus before zero
        value = f"{depth:.2f} m behind the middle of the box, give or take {place.deviation:.2f} m"
    return _chosen(shot, "axis depth", "place in depth", value, False)


def _chosen(shot: Shot, what: str, name: str, value: str, is_given: bool) -> Fact:
    """The fact about an estimate, or about what was given or not measured instead."""
    estimate = _estimate(shot, what)
    if is_given or estimate is None:
        return Fact(name, value, "given" if is_given else UNDETERMINED)
    origin = {"given": "by hand", "measured": "measured", "assumed": UNDETERMINED}[estimate.source]
    return Fact(name, value, origin, sentence(estimate))


def _estimate(shot: Shot, what: str) -> Estimate[Any] | None:
    return next((estimate for estimate in shot.estimates if estimate.what == what), None)


def boundaries(scene: CompleteScene) -> tuple[Remark, ...]:
    """How smoke gets into the box and out of it."""
    inflow = scene.inflow()
    if inflow is None:
        entry = Remark("no inlets")
    else:
        entry = Remark("inlets", {"inlets": len(scene.inlets), "voxels": int(inflow.sum())})
    return entry, Remark("closed sides", {"sides": ", ".join(scene.closed)}) if scene.closed else Remark("open box")
