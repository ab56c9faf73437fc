"""The engine's sentences in the panel's words: it speaks of scene files and options. Knows nothing of Blender."""

import re
from collections.abc import Callable

NAMES = {
    "background": "Background",
    "camera": "Scene Camera",
    "clip": "clip",
    "domain": "Box",
    "inlet": "Inlet",
    "lights": "Scene Lights",
    "medium": "Smoke Material",
    "views": "views",
}
"""What the panel calls the tables of a scene file."""

_PHRASES: tuple[tuple[str, str | Callable[[re.Match[str]], str]], ...] = (
    (r"(?<![\w/\\.-])([cC])olour(?!\w*(?:[/\\]|\.\w))", r"\1olor"),  # not in a path
    (r" \(\[background\] in a scene file, Clean Plate in Blender\)", " (Clean Plate)"),
    (r", or a color, in \[background\]", " as Background"),
    (r"give the color in \[background\]", "give a picture of the color as Clean Plate"),
    (r"give its matrices in \[camera\] and what is behind the smoke in \[background\]", "give a Clean Plate"),
    (r"in \[background\]", "as Background"),
    (r"a mask in \[clip\]", "a Mask"),
    (r"fps in the \[clip\] whose file says it wrongly", "Frame Rate"),
    (r"Give \[\[lights\]\]( in a scene file)?", "Choose Scene Lights"),
    (r"give (one|it) in \[\[lights\]\]", "choose Scene Lights with it"),
    (r"Give \[camera\] and \[domain\] in metres", "Choose Scene Camera and make a Box"),
    (r"Give \[medium\] if", "Set Smoke Material if"),
    (r"say so by color = \[1, 1, 1\] in \[medium\]", "set Color in Look"),
    (r"say it by --axis-depth, an \[\[inlet\]\] or a second view", "set Known Depth or an Inlet"),
    (r" in a scene file", ""),
    (r"`smokelift inspect`", "Report"),
    # the engine counts frames from 0, and the panel from 1
    (r"between frames (\d+) and (\d+), as at a cut", lambda found: f"between frames {_next(found)}, as at a cut"),
    (r"--frames (\d+):(\d+) or (\d+):(\d+)", lambda found: "Frames {} to {} or {} to {}".format(*_after(found))),
    (
        r"^(\d+ frames?) in .+? \((\d+ s)\), ([\d.]+) dB inside the smoke at the clip's pixels \(median\)\.$",
        r"\1 made in \2. They match the clip to \3 dB; more is closer.",
    ),
    (r"^(\d+ frames?) in .+?(, \d+ of them simulated|, which repeat)? \((\d+ s)\)\.$", r"\1 made in \3\2."),
    (r"^A proxy of (\d+ frames?) in .+\.$", r"The proxy of \1 is made."),
    (r"^\S.*[/\\]take_\d+: has the frames", "The result has the frames"),
    (
        r"install it \(pip install .+? zip (smokelift_gpu)\)(, or use .*cpu)?",
        r"install the extension \1, or choose Device CPU",
    ),
    (r"^The axis depth (\S+ m) is outside", r"Known Depth: \1 is outside"),
    (r"go on with --resume, or choose another directory", "press Resume, or choose another Output"),
    (r"(?<!\S)--([a-z]+)(?:-([a-z]+))?", lambda found: " ".join(found.groups("")).title().strip()),
    (r"(?<!\S)\[\[?([a-z]+)\]?\](?!\w)", lambda found: NAMES.get(found[1], found[0])),
)


def _after(found: re.Match[str]) -> list[int]:
    return [int(number) + 1 for number in found.groups()]


def _next(found: re.Match[str]) -> str:
    return " and ".join(map(str, _after(found)))


def in_panel(sentence: str) -> str:
    """A sentence of the engine as the panel shows it."""
    for pattern, words in _PHRASES:
        sentence = re.sub(pattern, words, sentence)
    return sentence
