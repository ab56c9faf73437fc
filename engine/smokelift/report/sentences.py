"""The sentences of remarks and estimates by their kinds: the only place of their words.

A sentence fills in the figures of its remark, as `str.format` does, and for an estimate ``what``, ``value``,
``tolerance`` and ``spread``. Beside the usual formats a noun counts, and "place" says a depth in words; numbers are
joined by commas, lengths whose format ends with " x" and whole numbers by that; models of scattering have names.
"""

from __future__ import annotations

from collections.abc import Mapping
from string import Formatter
from typing import Any

from smokelift.checks import Remark, counted
from smokelift.setup.estimate import Estimate

MODELS: Mapping[object, str] = {
    "absorption": "absorption only",
    "unshadowed": "scattering without shadows",
    "single": "single scattering with shadows",
    "multiple": "multiple scattering",
}
"""Models of scattering in words."""

MIN_DEPTH = 0.005
"""Smallest distance from the middle of the box that is said, in metres: less would look exact."""

SENTENCES: Mapping[str, str] = {
    # how the clips are read
    "truncated clip": "{path}: is truncated; {frames:frame} of it can be used.",
    "damaged frames": "{path}: {frames} missing or damaged; the last sound frame stands in.",
    "pictures without a frame rate": "{path}: pictures carry no frame rate; {fps:g} frames a second are taken.",
    "varying frame rate": "The frame rate varies: the clip is read at its mean, {fps:.4g} frames a second.",
    "interlaced clip": "The clip is interlaced: one field of each frame is used, so its lines are half as fine.",
    "high dynamic range": "Transfer {transfer}: diffuse white is brought to 1, highlights exceed it.",
    "other primaries": "Primaries {primaries} are brought to BT.709.",
    "scaled pictures": "Pictures of {size} pixels are scaled to {scaled} square ones.",
    "further view": "{name}, {degrees:.0f} degrees from the input, frames {first} to {last}.",
    "disagreeing views": (
        "The views agree on {agreed:.0%} of the smoke that they show: check where their cameras stand, which frames "
        "belong together and what stands behind the smoke."
    ),
    "cut": (
        "The picture changes at once between frames {before} and {after}, as at a cut, so that no background fits both "
        "sides; use frames {first} to {before} or {after} to {last}."
    ),
    # what is behind the smoke, and where it is
    "alpha channel": "The clip has an alpha channel, which is the matte: the smoke is shown before {behind}.",
    "background unused": "The background that is given is not used: the alpha channel says what is smoke.",
    "black background": "Background not given: it is black.",
    "background of one colour": "Background not given: it is of one color, {color:.2g} (linear).",
    "background with objects": (
        "Background: {share:.1%} of the picture has other colors and never changes, as a nozzle, a floor or a logo "
        "does. If that is smoke, give the color as background."
    ),
    "background seen": "Background estimated from the clip, which shows every part of it free of smoke.",
    "background partly seen": (
        "Background estimated from the clip; {unknown:.0%} of the picture is hardly ever free of smoke, and what is "
        "behind it there is continued from around it, so how thick the smoke is there is undetermined. A clean plate "
        "as background would show it."
    ),
    "turning camera": (
        "The camera moves, by up to {pixels:.0f} pixels: it is steadied against the background, as a camera that turns "
        "in its place, and has a matrix for every frame."
    ),
    "exposure": "The exposure of the clip changes by up to {change:.0%}: every frame is brought to the background's.",
    "background of one frame": (
        "One frame alone does not show what moves: the color around it counts as background, and all that has another "
        "as smoke. If that is wrong, hide what is no smoke by a mask, or give a clean plate or a color as background."
    ),
    "background never seen": (
        "Next to nothing of the picture is ever free of smoke, so what is behind it is taken to be black. Give a clean "
        "plate or a color as background."
    ),
    "background of few frames": (
        "Only {frames} frames show what is behind the smoke: what is the same in all that there are counts as "
        "background, smoke too. Give a clean plate or a color as background."
    ),
    "strong compression": (
        "The clip is strongly compressed (quantiser {quantiser:.0f} of 51): faint smoke may be missing from the "
        "result, because the codec lets it stand still as the background does. Use a copy that is compressed less, or "
        "give a clean plate as background."
    ),
    "smoke in the background": (
        "The background may hold most of the smoke: {share:.0%} of where smoke is or may be is never free of it, so "
        "what stays there all the time is missing from the result. Give a clean plate or a color as background."
    ),
    "bars": (
        "Only bars beside the picture never change, so all between them is taken for smoke: crop them off, or give a "
        "clean plate as background."
    ),
    "no smoke examined": "No smoke found in {frames:examined frame}, so that nothing of it could be measured.",
    "no smoke before the given background": (
        "The background that is given may hold the smoke, or belong to another clip: check it."
    ),
    "no smoke in one frame": (
        "One frame alone does not show what is behind its smoke: give a clean plate or a color as background."
    ),
    "no smoke before a changing background": (
        "The background changes by {codes:.0f} of 255 from frame to frame, and fainter smoke is not seen: if the "
        "camera moves, track it in Blender, and give the camera and a clean plate; if it stands still, give a clean "
        "plate or a color as background."
    ),
    "no smoke before an estimated background": (
        "Smoke that never moves counts as background: give a clean plate or a color as background."
    ),
    "smoke of several colours": (
        "The smoke has more than one color: its light is {degrees:.0f} degrees from the nearest single one on the "
        "mean, but one is taken for all of it, so colors are wrong and the thickness may be. Use frames with smoke "
        "of one color, crop the clip to it, or give a mask."
    ),
    # where the camera stands, and where the smoke is
    "assumed camera": (
        "Camera not given: a level {lens:.0f} mm lens on {film:g} mm film, the picture taken to be {height:.3g} m high "
        "where the smoke is."
    ),
    "assumed camera with the file's lens": (
        "Camera not given: level, {lens:g} mm as the file says, the picture taken to be {height:.3g} m high where the "
        "smoke is."
    ),
    "assumed scale": "Box not given: the picture taken to be {height:.3g} m high where the smoke is.",
    "box around the smoke": "Domain around the smoke: {size:.2f x} m, {resolution} voxels.",
    "box over the picture": "Domain over all of the picture: {size:.2f x} m, {resolution} voxels.",
    "grown box": "The box grows to {size:.4g x} m, a whole number of cubic voxels along every side.",
    "resolution": (
        "Resolution: {value} voxels for {pixels:.0f} pixels along the longest side: {quality} loses {lost:.1%} of "
        "the smoke's contrast in the clip."
    ),
    "resolution without smoke": "Resolution: {value} voxels, since no smoke is seen.",
    "inlets": "Smoke enters at {inlets:marked inlet} ({voxels:voxel}); others are not looked for.",
    "inlets found later": "No inlet marked: where smoke enters is found from the densities.",
    "no inlets": "No inlet marked: none is assumed.",
    "open box": "All sides of the box are open.",
    "closed sides": "Closed sides of the box: {sides}; the others are open.",
    # where in depth it stands
    "axis depth by box": (
        "Where the smoke stands in depth is undetermined: it is taken to be {depth:place}, give or take {spread:.2g} "
        "m. If you know better, give its distance, an inlet or a second view."
    ),
    "axis depth by floor contact": (
        "By its contact with the floor of the box the smoke stands {depth:place}, give or take {spread:.2g} m. If you "
        "know better, give its distance, an inlet or a second view."
    ),
    "axis depth by distance": (
        "By the distance of its lower end the smoke stands {depth:place}, give or take {spread:.2g} m."
    ),
    "axis depth by inlets": "By the marked inlets the smoke stands {depth:place}, give or take {spread:.2g} m.",
    # the smoke as a medium, fire, and the light
    "assumed medium": (
        "Medium not given: extinction {extinction:.3g} 1/m (density 1 is thick smoke), albedo {albedo:g}, isotropic."
    ),
    "smoke colour": (
        "Smoke color: {value} (linear), at least {degrees:.0f} degrees from that of grey smoke; if the light has this "
        "color and the smoke is grey, give grey as the smoke's color."
    ),
    "smoke colour unseen": (
        "Smoke color: undetermined, grey is taken: no smoke is thick, bright and free of clipped pixels enough to show "
        "a color."
    ),
    "smoke colour near the light's": (
        "Smoke color: undetermined, grey is taken: it may be {degrees:.0f} degrees from grey smoke or what is behind "
        "it, less than the {tolerance:g} of colored light."
    ),
    "fire": (
        "Fire: {share:.1%} of the smoke's pixels shine by themselves. The grid flame holds their light, of the color "
        "{red:g}, {green:g}, {blue:g}; the smoke beside it is continued over it."
    ),
    "light as behind the smoke": (
        "Light not given: as much from everywhere as comes from behind the smoke, irradiance {irradiance:.2f}, with "
        "shadows."
    ),
    "light as the smoke hides": (
        "Light not given: as much from everywhere as the smoke adds for what it hides, irradiance {irradiance:.2f}, "
        "without shadows."
    ),
    "light as the thickest smoke": (
        "Light not given: as much from everywhere as the thickest smoke shows, irradiance {irradiance:.2f}, without "
        "shadows."
    ),
    "light without smoke": (
        "Light not given: as much from everywhere as makes thick smoke white, irradiance {irradiance:.2f}, without "
        "shadows."
    ),
    "likely wrong light": (
        "The light that is taken is likely wrong, and the smoke too thick or too thin by half and more: it leaves "
        "{error:.0%} of what the smoke changes unexplained. Give the lights."
    ),
    "light strength": (
        "Light: {factor:.2f} times as strong as given, since the smoke is brighter than the given light can make it: "
        "the densities that come nearest ask for {asked_for_as_given:.2f} times as much, and now for {asked_for:.2f}."
    ),
    "smoke thickness": (
        "Smoke thickness: by the texture behind it the smoke hides {hidden:.0%} of what it covers, right to "
        "{spread:.0%}; its light is as strong as that asks for."
    ),
    "smoke thickness without texture": (
        "Smoke thickness: undetermined, too little texture shows through it; thinner smoke in stronger light looks the "
        "same. Give the lights if you know them."
    ),
    "uncertain smoke thickness": (
        "Smoke thickness: undetermined, the texture behind it shows it no better than that (error {spread:.0%}, "
        "{tolerance:.0%} at most would do); thinner smoke in stronger light looks the same. Give the lights if you "
        "know them."
    ),
    "light direction": (
        "Light direction: {value}, give or take 20 degrees, as the {views} views show together; "
        "{ambient_share:.0%} of the light comes from everywhere."
    ),
    "light direction undetermined by one view": (
        "Light direction: undetermined, and so are the color of a sun and the share of light from everywhere; suns "
        "from many sides explain one view alike. Give the lights if you know them."
    ),
    "light direction undetermined by several views": (
        "Light direction: undetermined, and so are the color of a sun and the share of light from everywhere. With "
        "{ambient_share:.0%} of the light from everywhere the {views} views are explained best; that alone leaves "
        "{shading:.0%} of the smoke's light, a sun explains {explained:.0%} of the rest, and its direction is right to "
        "{spread:.0f} degrees. Give the lights if you know them."
    ),
    "scattering": "Scattering: {value}.",
    "compared scattering": (
        "Scattering: {value}; held-out pixels differ by {error:.1%} of the smoke's contrast, with {other} by "
        "{other_error:.1%}."
    ),
    "scattering in light from everywhere": (
        "Scattering: {value}, in light from everywhere, for want of a known one; held-out pixels differ by {error:.1%} "
        "of the smoke's contrast, with {other} by {other_error:.1%}."
    ),
    "environment directions": (
        "Environment: {value} directions; the last doubling changed the picture by {change:.1%}."
    ),
    "gain of a view": (
        "It shows the smoke {value} times (red, green, blue) as bright as the input, which is evened out; the pictures "
        "differ by {error:.1%} of the smoke's contrast instead of {error_as_it_is:.1%}. If the cameras are exposed "
        "alike, light is missing: give the lights."
    ),
    # what a run needs besides
    "given": "{what} by hand: {value}.",
    "domain": (
        "Domain: only voxels that the picture allows to hold smoke are worked on, {hull_share:.0%} of the box; frames "
        "without smoke cost nothing."
    ),
    "iterations": (
        "Iterations: until one lowers the error by less than {tolerance:.0%} or noise is all that is left, "
        "{iterations:.0f} on the coarse frames, {value} at most."
    ),
    "velocity grid coarsening": (
        "Velocity grid: {voxels:.0f} voxels along the longest side, because the depth of the smoke is uncertain."
    ),
    "velocity levels": "Velocity grids: {value}, because the fastest smoke goes {voxels_a_frame:.1f} voxels a frame.",
    "velocity levels without motion": "Velocity grids: {value}, since there is no motion to measure.",
    # where the parts of a result come from
    "replaced pictures": "Those of {frames} missing or damaged; the last sound one stands in.",
    "pictures that are fitted": (
        "The density renders to the pictures of {cameras:camera} in the scene's light and medium; psnr in the figures "
        "of a frame says how closely."
    ),
    "velocity between frames": (
        "It carries the density of one frame to that of the next, and is known along the rays no better than they."
    ),
    "depth by the smoke's width in one view": (
        "One camera does not show it: the smoke is taken to be as deep as it is wide."
    ),
    "depth by the view from the side in one view": (
        "One camera does not show it: its picture is taken to be the view from 90 degrees as well."
    ),
    "depth by the smoke's width in several views": (
        "{cameras:camera} limit it and do not determine it: the rest follows from the smoke's width in each picture."
    ),
    "depth by thin fog in several views": (
        "{cameras:camera} limit it and do not determine it: the rest follows from the thin fog that the fit starts "
        "from."
    ),
    "emission along the rays": (
        "Along each ray of the camera it adds up to the light that fire adds to the picture; a flame is taken to be as "
        "deep as it is wide, in the middle of the smoke, of one color."
    ),
    "texture of the clip": (
        "From sides that no camera is near to the smoke has the texture of the clip's own pictures. Another seed makes "
        "it differently, detail 0 not at all."
    ),
    # what is said of a result
    "reconstructed": (
        "{frames:frame} in {directory} ({seconds:.0f} s), {psnr:.1f} dB inside the smoke at the clip's pixels (median)."
    ),
    "written": "{frames:frame} in {directory} ({seconds:.0f} s).",
    "continued": "{frames:frame} in {directory}, {simulated} of them simulated ({seconds:.0f} s).",
    "looped": "{frames:frame} in {directory}, which repeat frames {first} to {last} ({seconds:.0f} s).",
    "proxy": "A proxy of {frames:frame} in {directory}.",
    "empty frames": "No smoke is seen in {empty} of {frames} frames; such frames are empty.",
    "hardly any smoke fitted": (
        "Hardly any smoke was fitted: a typical frame still differs from the clip by {error:.0%} of what its smoke "
        "changes there, and its psnr is as high as it is because the smoke is faint. Give the background, the light or "
        "the medium of the clip, or a mask around its smoke; `smokelift inspect` says what was taken."
    ),
    "not all is smoke": (
        "Not all that was taken for smoke may be smoke: a typical frame still differs from the clip by {error:.0%} of "
        "what changes in it. What moves, light that changes and labels look like smoke, too; `smokelift inspect` shows "
        "what was taken. Hide what is no smoke by a mask, crop the clip, cut its frames out of a longer file in which "
        "the light changes, or give a clean plate as background."
    ),
    "dissolving smoke": (
        "From frame {frame} on the smoke dissolves before it reaches the end of its box, which cannot grow any more: "
        "give it more room than {room:g}, or move a camera or a lamp that is in its way."
    ),
}
"""All sentences."""


def sentence(remark: Remark) -> str:
    """Return a remark or an estimate in words."""
    figures = all_figures(remark)
    words = _Words().vformat(SENTENCES[remark.kind], (), figures)
    return f"View {figures['view']}: {words}" if "view" in figures else words


def all_figures(remark: Remark) -> dict[str, Any]:
    """Return what the sentence of a remark or an estimate fills in."""
    own = {}
    if isinstance(remark, Estimate):
        own = {"value": remark.value, "tolerance": remark.tolerance, "spread": remark.spread}
        own["what"] = remark.what.capitalize()
    return {**remark.figures, **own}


class _Words(Formatter):
    """Fills figures in."""

    def format_field(self, value: Any, format_spec: str) -> str:
        """Return one of them in words."""
        if isinstance(value, tuple):
            lengths = format_spec.endswith(" x") or all(isinstance(one, int) for one in value)
            return (" x " if lengths else ", ").join(format(one, format_spec.removesuffix(" x")) for one in value)
        if format_spec == "place":
            return _place(value)
        if isinstance(value, int) and len(format_spec) > 1 and format_spec.replace(" ", "").isalpha():
            return counted(value, format_spec)
        return format(MODELS.get(value, value), format_spec)


def _place(depth: float) -> str:
    """Say how far behind the middle of the box something is, in metres."""
    if abs(depth) < MIN_DEPTH:
        return "in the middle of the box"
    return f"{abs(depth):.2g} m {'behind' if depth > 0 else 'before'} the middle of the box"
