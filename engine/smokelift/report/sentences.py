"""The words of findings: a sentence, a line of a table and JSON, from the kinds of findings and their figures.

The engine has no other words of findings. They fill in the figures of their finding, as `str.format` does; also
``about``, ``value`` and ``spread``. There are formats of their own: a noun is counted, and "place" says a depth in
words. Tuples are joined by " x " if they are whole numbers or their format ends with " x", else by commas.
"""

from collections.abc import Iterable, Mapping
from string import Formatter
from typing import Any

from smokelift.checks import UNDETERMINED, Finding, counted

MODELS: Mapping[object, str] = {
    "absorption": "absorption only",
    "unshadowed": "scattering without shadows",
    "single": "single scattering with shadows",
    "multiple": "multiple scattering",
}
"""Models of scattering in words."""

MIN_DEPTH = 0.005
"""Smallest distance (m) from the middle of the box that is said: less would look exact."""

_SIMULATED = (
    "Frames {first} to {last} are a simulation that starts from frame {frame}, with the buoyancy, dissipation, inflow "
    "and fire of the clip, as far as it shows them"
)

SENTENCES: Mapping[str, str] = {
    # how the clips are read
    "truncated clip": (
        "{path}: is truncated; only {frames:frame} of it can be used. Copy or export it again for the rest."
    ),
    "damaged frames": (
        "{path}: {frames} missing, damaged, or without the alpha of the others (counted from 0); a neighboring good "
        "frame stands in, so the smoke stands still there. Export the clip again to mend that."
    ),
    "pictures without a frame rate": (
        "{path}: pictures carry no frame rate; {fps:g} frames per second are assumed. Give the frame rate if it is "
        "another."
    ),
    "varying frame rate": (
        "The frame rate varies: the clip is read at its mean, {fps:.4g} frames per second. Export it at a constant "
        "rate for even motion."
    ),
    "interlaced clip": "The clip is interlaced: one field of each frame is used, so the picture has half its lines.",
    "high dynamic range": (
        "The clip has a high dynamic range ({transfer}): diffuse white becomes 1, and highlights are brighter."
    ),
    "other primaries": "The clip's primaries, {primaries}, are converted to BT.709.",
    "scaled pictures": "Pictures of {size} pixels are scaled to {scaled}: they are large, or their pixels not square.",
    "premultiplied colors": (
        "The clip's colors are read as {held} by its alpha channel, because its smoke then has most nearly one color."
    ),
    "perhaps straight colors": (
        "The clip's colors are read as premultiplied by alpha, as its format says, but its smoke has more nearly one "
        "color if they are straight. If they are, premultiply them (in Blender's compositor, by Alpha Convert)."
    ),
    "further view": "{name}, {degrees:.0f} degrees from the input, frames {first} to {last}.",
    "disagreeing views": (
        "The views agree on only {agreed:.0%} of the smoke that they show. Check where their cameras stand, which "
        "frames belong together, and what is behind the smoke."
    ),
    "cut": (
        "The picture changes at once between frames {before} and {after}, as at a cut, so no single background fits "
        "both sides. Use frames {first} to {before} or {after} to {last}."
    ),
    # what is behind the smoke, and where it is
    "alpha channel": (
        "The clip has an alpha channel, which says where smoke is and how much it hides; it is shown before {behind}."
    ),
    "alpha is a mask": (
        "Alpha covers nothing, or most of what it covers is opaque, so it does not say how thick the smoke is: the "
        "picture's brightness says that."
    ),
    "background unused": "The background that is given is not used: the alpha channel says what is smoke.",
    "black background": "Background not given: it is black.",
    "background of one color": "Background not given: it is of one color, {color:.2g} (linear).",
    "background assumed": (
        "Background not given, and no part of the picture shows it: {color:.2g} (linear) is assumed, and all that "
        "differs from it counts as smoke."
    ),
    "background with objects": (
        "Background: {fraction:.1%} of the picture has other colors and never changes, as a nozzle, a floor or a logo "
        "does. If that is smoke, give the color as background."
    ),
    "background seen": "Background estimated from the clip, which shows every part of it free of smoke.",
    "background partly seen": (
        "Background estimated from the clip; {unknown:.0%} of the picture is hardly ever free of smoke. The background "
        "there is filled in from around it and from what the smoke lets through, so how thick the smoke is there is "
        "uncertain. Give a clean plate as background to show it."
    ),
    "frames registered": (
        "The camera moves: every frame is shifted, rotated and scaled to lie on frame {frame} (counted from 0), by up "
        "to {pixels:.0f} pixels. The result stands still as that frame shows it."
    ),
    "frames registered to the plate": (
        "The clip does not lie on the clean plate: every frame is shifted, rotated and scaled to lie on it, by up to "
        "{pixels:.0f} pixels. The result stands still as the plate shows it."
    ),
    "strokes": (
        "Strokes: of the picture {smoke:.1%} is painted as smoke, {other:.1%} as not smoke, and {behind:.1%} as "
        "background."
    ),
    "exposure": "The exposure of the clip changes by up to {change:.0%}: every frame is matched to the background.",
    "steady exposure": "Measured on what does not move, against the background.",
    "exposure unseen": "The background is too dark or too bright to show it, so what flickers is taken for smoke.",
    "noise": "{lasting:.1f} of it is shared by neighboring pixels.",
    "background of one frame": (
        "One frame alone does not show what moves: the color around it counts as background, and every other color as "
        "smoke. If that is wrong, hide what is no smoke by a mask, or give a clean plate or a color as background."
    ),
    "background never seen": (
        "Almost no part of the picture is ever free of smoke, so black is assumed behind it. Give a clean plate or a "
        "color as background."
    ),
    "background never seen beside strokes": (
        "Beside the green strokes almost no part of the picture is ever free of smoke, so black is assumed behind it. "
        "Paint only smoke green, or give a clean plate or a color as background."
    ),
    "given background never seen": (
        "{fraction:.0%} of what stands still in the picture is not the background that is given, which may belong to "
        "another clip or take: give one of this clip, or none."
    ),
    "smoke in the given frame": (
        "The frame that is given as background may hold smoke itself, or things that move: no smoke of one color "
        "explains {fraction:.0%} of what changes before it. Give a frame without any or a clean plate, or paint its "
        "smoke green."
    ),
    "smoke everywhere": (
        "Smoke covers {fraction:.0%} of a frame, and every part of the picture at some time. If another color than the "
        "one that was found is behind it, give that as background."
    ),
    "background of few frames": (
        "Only {frames} frames show what is behind the smoke. What is the same in all of them counts as background, "
        "even smoke. Give a clean plate or a color as background."
    ),
    "strong compression": (
        "The clip is strongly compressed (level {quantizer:.0f} of 51), so faint smoke may be missing from the result: "
        "compression makes it stand still as the background does. Use a copy that is compressed less, or give a clean "
        "plate as background."
    ),
    "smoke in the background": (
        "The background may hold most of the smoke: {fraction:.0%} of the area where smoke may be is never free of it. "
        "Smoke that stays there all the time is missing from the result. Give a clean plate or a color as background."
    ),
    "clearest frame": (
        "Frame {frame} (counted from 0) shows more of the background than the others: if it is free of smoke, give it "
        "as background."
    ),
    "bars": (
        "Only bars beside the picture never change, so everything between them counts as smoke. Crop the bars off, or "
        "give a clean plate as background."
    ),
    "alpha of evenly lit smoke": (
        "What is behind the smoke does not show how much of it the smoke hides, so alpha is a convention: that of "
        "evenly lit smoke whose thickest part is opaque."
    ),
    "no smoke found": (
        "No smoke found: nothing differs from the background by more than the clip's noise does, so all frames in "
        "{path} are empty."
    ),
    "no smoke examined": "No smoke found in {frames:examined frame}, so nothing about it could be measured.",
    "no smoke beside strokes": (
        "Nothing counts as smoke where red or blue is painted: if smoke passes there, erase these strokes. If it does "
        "not, give another background."
    ),
    "no smoke before the given background": (
        "The background that is given may hold the smoke, or belong to another clip: check it."
    ),
    "no smoke in one frame": (
        "One frame alone does not show what is behind its smoke: give a clean plate or a color as background."
    ),
    "smoke behind the mask": (
        "What the mask hides looks like smoke: if the mask is black where smoke may be and white elsewhere, invert it."
    ),
    "no smoke in alpha": "The clip's alpha covers no smoke in these frames: look at the file, and use other frames.",
    "no smoke before an estimated background": (
        "Smoke that never moves counts as background, and smoke that changes it no more than it changes by itself is "
        "not seen: paint strokes over the smoke, or give a clean plate or a color as background."
    ),
    "smoke of several colors": (
        "The smoke has more than one color, but one is assumed for all of it: on average its light is {degrees:.0f} "
        "degrees from the nearest single color. Its colors are wrong, and its thickness may be. Use frames with smoke "
        "of one color, crop the clip to it, or give a mask."
    ),
    "smoke that changes its color": (
        "The color of the smoke changes over time, but one is assumed for all of it: on average its light is "
        "{degrees:.0f} degrees from the nearest single color. Use a range of frames in which it stays the same."
    ),
    # where the camera stands, and where the smoke is
    "assumed camera": (
        "Camera not given: a level {lens:.0f} mm lens on {film:g} mm film is assumed, and a picture {height:.3g} m "
        "high where the smoke is."
    ),
    "assumed camera with the file's lens": (
        "Camera not given: a level camera with the file's {lens:g} mm lens is assumed, and a picture {height:.3g} m "
        "high where the smoke is."
    ),
    "assumed scale": "Box not given: the picture is assumed to be {height:.3g} m high where the smoke is.",
    "scale": (
        "The picture is taken to be {height:g} m high where the smoke is. Give its distance, or camera and box, in "
        "meters."
    ),
    "box around the smoke": "Domain around the smoke: {size:.2f x} m, {resolution} voxels.",
    "box over the picture": "Domain over all of the picture: {size:.2f x} m, {resolution} voxels.",
    "grown box": "The box grows to {size:.4g x} m, a whole number of cubic voxels along every side.",
    "resolution": (
        "Resolution: {value} voxels for {pixels:.0f} pixels along the longest side: {quality} loses {lost:.1%} of "
        "the smoke's contrast in the clip."
    ),
    "resolution without smoke": "Resolution: {value} voxels, since no smoke is seen.",
    "inlets": "Smoke enters at {inlets:marked inlet} ({voxels:voxel}); no others are searched for.",
    "no inlets": "No inlet marked: none is assumed.",
    "open box": "All sides of the box are open.",
    "closed sides": "Closed sides of the box: {sides}; the others are open.",
    # where in depth it stands
    "axis depth by box": (
        "Where the smoke stands in depth is undetermined: it is taken to be {depth:place} of the box, give or "
        "take {spread:.2g} m. If you know better, give its distance, an inlet or a second view."
    ),
    "axis depth by floor contact": (
        "By its contact with the floor of the box the smoke stands {depth:place} of the box, give or take {spread:.2g} "
        "m. If you know better, give its distance, an inlet or a second view."
    ),
    "axis depth by distance": (
        "By the distance of its lower end the smoke stands {depth:place} of the box, give or take {spread:.2g} m."
    ),
    "axis depth by inlets": (
        "By the marked inlets the smoke stands {depth:place} of the box, give or take {spread:.2g} m."
    ),
    # the smoke as a medium, fire, and the light
    "assumed medium": (
        "Medium not given: extinction {extinction:.3g} 1/m (density 1 is thick smoke), albedo {albedo:g}, isotropic."
    ),
    "extinction": "A picture shows it times the density only. Give the medium if you know it.",
    "albedo": "A picture shows it times the light only. Give the medium if you know it.",
    "measured smoke color": (
        "Smoke color: {value:.2f} (linear), at least {degrees:.0f} degrees from that of gray smoke; if the light has "
        "this color and the smoke is gray, give gray as the smoke's color."
    ),
    "smoke color unseen": (
        "Smoke color: undetermined, so gray is assumed: no smoke is thick, bright and free of clipped pixels enough to "
        "show a color. Give the color if you know it."
    ),
    "smoke color near the light's": (
        "Smoke color: undetermined, so gray is assumed: its color may be {degrees:.0f} degrees from that of gray smoke "
        "or of what is behind it, and colored light alone can make {tolerance:g}. Give the color if you know it."
    ),
    "fire": (
        "Fire: {fraction:.1%} of the smoke's pixels shine by themselves. The grid flame holds their light, of the "
        "color {red:g}, {green:g}, {blue:g}. The smoke over the fire is filled in from beside it."
    ),
    "possible fire": (
        "Some of the smoke may be fire: {fraction:.1%} of its pixels have the colors of fire and are brighter than the "
        "other smoke. They are too few or too faint to be certain, or something behind the smoke looks like it. If it "
        "is fire, give its color as the flame's, for example 1, 0.4, 0.1."
    ),
    "possible faint fire": (
        "Some of the smoke may be fire: {fraction:.1%} of its pixels have nearly the colors of fire and are brighter "
        "than the other smoke, but too pale or too faint to be told from it. If it is fire, hide it by a mask."
    ),
    "assumed light": (
        "Light not given: light from everywhere is assumed, as bright as smoke and background ask for (irradiance "
        "{irradiance:.2f})."
    ),
    "likely wrong light": (
        "The assumed light is likely wrong, and the smoke too thick or too thin by half or more: {error:.0%} of what "
        "the smoke changes in the clip is unexplained. Give the lights."
    ),
    "light of fire": (
        "Fire lights its smoke from within, but the light is taken to come from outside: {error:.0%} of the smoke's "
        "contrast is left unexplained, so how thick the smoke near the fire is may be wrong. Hide the fire by a mask, "
        "or use frames with less fire."
    ),
    "source radiance": (
        "Source radiance: {value:.2g} (red, green, blue), as what is left of the picture behind the smoke shows. The "
        "light is as strong as that asks for."
    ),
    "undetermined source radiance": (
        "Source radiance: undetermined, because nothing behind the smoke has detail or another hue, which would show "
        "how much it hides. Thinner smoke in stronger light looks the same. Give the lights if you know them."
    ),
    "sun's direction": "Suns from many sides look the same. Give the lights.",
    "scattering": "Scattering: {value}.",
    "compared scattering": (
        "Scattering: {value}; pixels that the fit leaves out differ by {error:.1%} of the smoke's contrast, with "
        "{other} by {other_error:.1%}."
    ),
    "gain of a view": (
        "It shows the smoke {value:.2f} times (red, green, blue) as bright as the input. This is evened out: the "
        "pictures differ by {error:.1%} of the smoke's contrast instead of {error_as_it_is:.1%}. If the cameras have "
        "the same exposure, light is missing: give the lights."
    ),
    # what a run needs besides
    "given": "{what} by hand: {value}.",
    "velocity grid coarsening": (
        "Velocity grid: {voxels:.0f} voxels along the longest side, because the depth of the smoke is uncertain."
    ),
    "cost": "Right to a factor of 1.5 if nothing else runs; {free:.1f} GiB of memory are free.",
    # where the parts of a result come from
    "pictures that are fitted": (
        "The density renders to the pictures of {cameras:camera} in the scene's light and medium; psnr in the figures "
        "of a frame says how closely."
    ),
    "velocity between frames": (
        "It carries the density of one frame to that of the next. Along the rays it is no more certain than they are."
    ),
    "depth by the smoke's width in one view": (
        "One camera does not show it: the smoke is taken to be as deep as it is wide."
    ),
    "depth by the view from the side in one view": (
        "One camera does not show it: its picture is taken to be the view from 90 degrees as well."
    ),
    "depth by the smoke's width in several views": (
        "{cameras:camera} limit it but do not determine it: the rest follows from the smoke's width in each picture."
    ),
    "depth by thin fog in several views": (
        "{cameras:camera} limit it but do not determine it: the rest follows from the thin fog that the fit starts "
        "from."
    ),
    "emission along the rays": (
        "Along each ray of the camera it adds up to the light that fire adds to the picture; a flame is taken to be as "
        "deep as it is wide, in the middle of the smoke, of one color."
    ),
    "texture of the clip": (
        "Seen from sides that no camera is near, the smoke has the texture of the clip's own pictures. Another seed "
        "makes another texture; detail 0 makes none."
    ),
    "simulated frames": _SIMULATED + ".",
    "simulated frames with given values": _SIMULATED + ", but with a given {given}.",
    "interpolated frames": (
        "Frames between those of the clip are made of both neighbors, carried there by the velocity."
    ),
    "overlap of a loop": (
        "In frames {first} to {last} the end of the loop becomes its start: both are carried to a shape between them."
    ),
    # what is said of a result
    "reconstructed": (
        "{frames:frame} in {directory} ({seconds:.0f} s), {psnr:.1f} dB inside the smoke at the clip's pixels (median)."
    ),
    "written": "{frames:frame} in {directory} ({seconds:.0f} s).",
    "continued": "{frames:frame} in {directory}, {simulated} of them simulated ({seconds:.0f} s).",
    "looped": "{frames:frame} in {directory}, which repeat frames {first} to {last} ({seconds:.0f} s).",
    "proxy": "A proxy of {frames:frame} in {directory}.",
    "empty frames": (
        "No smoke is seen in {empty} of {frames} frames, so these are empty. If you see smoke in them, give a clean "
        "plate as background."
    ),
    "hardly any smoke fitted": (
        "Hardly any smoke was fitted: a typical frame still differs from the clip by {error:.0%} of what its smoke "
        "changes there. Its psnr is high only because the smoke is faint. Hide by a mask what is no smoke, or give the "
        "background, the light or the medium of the clip. `smokelift inspect` says what was assumed."
    ),
    "fire beside what is fitted": (
        "Fire and smoke are not separated well: a typical frame still differs from the clip by {error:.0%} "
        "of what changes in it. Smoke that fire lights looks like fire, and flames that are clipped to white look "
        "like smoke. Use a copy that is exposed for the flames, frames with less fire, or hide the fire by a mask."
    ),
    "not all may be smoke": (
        "Some of what counts as smoke may be something else: a first, coarse fit leaves {error:.0%} of what changes in "
        "the clip unexplained. Things that move, light that changes and labels look like smoke, too. Hide what is no "
        "smoke by a mask, crop the clip, use frames in which the light is steady, or give a clean plate as background."
    ),
    "not all is smoke": (
        "Some of what counts as smoke may be something else: a typical frame still differs from the clip by "
        "{error:.0%} of what changes in it. Things that move, light that changes and labels look like smoke, too. "
        "`smokelift inspect` shows what counts as smoke. Hide what is no smoke by a mask, crop the clip, use frames in "
        "which the light is steady, or give a clean plate as background."
    ),
    "dissolving smoke": (
        "From frame {frame} on the smoke dissolves before it reaches the end of its box, because the box cannot grow "
        "any more. Give it more room than {room:g}, or move the camera or lamp in its way."
    ),
    "contradicted buoyancy": (
        "The smoke goes on without buoyancy: one of {buoyancy:.2g} m/s2 was fitted, but the smoke of the clip "
        "{motion}. Give a buoyancy if you know better."
    ),
}
"""Sentences by kind."""

_DEPTHS = tuple(f"axis depth by {cue}" for cue in ("box", "floor contact", "distance", "inlets"))

VALUES: Mapping[str, str] = {
    "alpha channel": "{behind}",
    "black background": "black",
    "background of one color": "one color, {color:.2g} (linear)",
    "background assumed": "one color, {color:.2g} (linear)",
    "background seen": "a picture",
    "background partly seen": "a picture, {unknown:.0%} of it unknown",
    "mask": "hides {hidden:.0%} of the first frame",
    "exposure": "changes by up to {change:.0%}, evened out",
    "steady exposure": "steady",
    "exposure unseen": "taken to be steady",
    "noise": "{level}, {codes:.1f} of 255",
    "assumed camera": "perspective, stands still",
    "assumed camera with the file's lens": "perspective, stands still",
    "scale": "box of {size:.3g x} m",
    "box around the smoke": "around the smoke of the whole clip",
    "box over the picture": "over all of the picture",
    "grown box": "as given, grown to whole voxels",
    "extinction": "{value:.3g} 1/m at density 1",
    "albedo": "{value:.3g}",
    "measured smoke color": "{value:.2f}",
    "smoke color unseen": "gray",
    "smoke color near the light's": "gray",
    "source radiance": "smoke of radiance {taken:.2g}",
    "undetermined source radiance": "smoke of radiance {taken:.2g}",
    **dict.fromkeys(_DEPTHS, "{depth:place} of the box, give or take {spread:.2g} m"),
    "cost": "about {seconds:.0f} s, {memory:.1f} GiB of memory, up to {disk:.0f} MB on disk",
}
"""What a line of a table says that is taken, by kind; of other kinds it is the value itself."""

SHORT: Mapping[str, str] = {
    "background of one color": "one color",
    "background assumed": "one color",
    "background partly seen": "a picture",
    "scale": "{size:.3g x} m",
    **dict.fromkeys(_DEPTHS, "{depth:place}"),
}
"""Values in fewer words, for a sidebar."""


def sentence(finding: Finding) -> str:
    words = _filled(SENTENCES[finding.kind], finding)
    return f"View {finding.figures['view']}: {words}" if "view" in finding.figures else words


def message(finding: Finding) -> dict[str, Any]:
    """Return what an event says: the words, with kind and figures, of which programs make their own."""
    return {"text": sentence(finding), "kind": finding.kind, "figures": _figures(finding)}


def fact(finding: Finding) -> dict[str, str]:
    """Return a line of a table as JSON holds it; ``short`` is its value in a few words, for a sidebar.

    What is given needs no sentence.
    """
    said = finding.source != "given" and finding.kind in SENTENCES
    value = VALUES.get(finding.kind, "{value}")
    return {
        "what": finding.about,
        "value": _filled(value, finding),
        "short": _filled(SHORT.get(finding.kind, value), finding),
        "origin": UNDETERMINED if finding.source == "assumed" else finding.source or "",
        "how": sentence(finding) if said else "",
    }


def choices(findings: Iterable[Finding]) -> list[dict[str, Any]]:
    """Return those of the findings that chose something, as JSON holds them."""
    return [_choice(finding) for finding in findings if finding.value is not None]


def _choice(finding: Finding) -> dict[str, Any]:
    """A choice as JSON holds it, with four digits, since further ones decide nothing."""
    figures = {**finding.figures, "spread": finding.spread}
    tolerance = figures.pop("tolerance", None)
    return {
        "what": finding.about,
        "chosen": list(map(_rounded, finding.value)) if isinstance(finding.value, tuple) else _rounded(finding.value),
        "kind": finding.kind,
        "reason": sentence(finding),
        "measured": {name: _rounded(figure) for name, figure in figures.items() if isinstance(figure, float | int)},
        "tolerance": tolerance,
        "by_hand": finding.source == "given",
    }


def part(finding: Finding) -> dict[str, Any]:
    """Return where a part of a result comes from as JSON holds it; ``settings`` are those that chose it.

    Programs make their own words of kind and figures.
    """
    figures = dict(finding.figures)
    return {
        "what": finding.about,
        "origin": finding.source,
        "how": sentence(finding),
        "kind": finding.kind,
        "figures": figures,
        "settings": figures if finding.source == "made up" else {},
    }


def _rounded(figure: Any) -> Any:
    return float(f"{figure:.4g}") if isinstance(figure, float) else figure


def _figures(finding: Finding) -> dict[str, Any]:
    known = {"what": finding.about.capitalize(), "value": finding.value, "spread": finding.spread}
    return {**finding.figures, **{name: figure for name, figure in known.items() if figure not in ("", None)}}


class _Words(Formatter):
    """Fills figures in, by the formats of this module."""

    def format_field(self, value: Any, format_spec: str) -> str:
        if isinstance(value, tuple):
            lengths = format_spec.endswith(" x") or all(isinstance(one, int) for one in value)
            return (" x " if lengths else ", ").join(format(one, format_spec.removesuffix(" x")) for one in value)
        if format_spec == "place":  # of a depth (m) behind the middle
            way = "behind" if value > 0 else "before"
            return f"{abs(value):.2g} m {way} the middle" if abs(value) >= MIN_DEPTH else "in the middle"
        if isinstance(value, int) and len(format_spec) > 1 and format_spec.replace(" ", "").isalpha():
            return counted(value, format_spec)
        return format(MODELS.get(value, value), format_spec)


def _filled(words: str, finding: Finding) -> str:
    return _Words().vformat(words, (), _figures(finding))
