"""What the engine says, in the panel's words where its own are those of a command line; and amounts in words."""

from collections.abc import Collection, Mapping
from typing import Any

_SIMULATED = (
    "Frames {first} to {last} are a simulation that starts from frame {frame}, with the buoyancy, dissipation, inflow "
    "and fire of the clip, as far as it shows them"
)

SENTENCES = {
    "reconstructed": "Match to the clip: {psnr}. {frames} in {seconds}.",
    "written": "{frames} in {seconds}.",
    "continued": "{frames} in {seconds}, {simulated} of them simulated.",
    "looped": "A loop of {frames}, made in {seconds}.",
    "proxy": "The proxy of {frames} is made.",
    "hardly any smoke fitted": (
        "Hardly any smoke was fitted: a typical frame still differs from the clip by {error:.0%} of what its smoke "
        "changes there. Report says what was assumed."
    ),
    "not all is smoke": (
        "Some of what counts as smoke may be something else: a typical frame still differs from the clip by "
        "{error:.0%} of what changes in it. Things that move, light that changes and labels look like smoke, too. "
        "Report shows what counts as smoke."
    ),
    "not all may be smoke": (
        "Some of what counts as smoke may be something else: a coarse fit leaves {error:.0%} of it unexplained. "
        "People, leaves, labels and light that changes look like smoke, too."
    ),
    "smoke in the background": (
        "The background may hold most of the smoke: {fraction:.0%} of the area where smoke may be is never free of it. "
        "Smoke that stays there all the time is missing from the result."
    ),
    "clearest frame": (
        "Frame {frame} shows more of the background than the others: if it is free of smoke, go to it and press Plate "
        "from This Frame."
    ),
    "cut": (
        "The picture changes at once between frames {before} and {after}, as at a cut, so no single background fits "
        "both sides. Choose Frames {first} to {before} or {after} to {last}."
    ),
    "dissolving smoke": (
        "From frame {frame} on the smoke dissolves before it reaches the end of its box, because the box cannot grow "
        "any more. Give it more Room than {room:g}, or move the camera or lamp in its way."
    ),
    "simulated frames": _SIMULATED + ".",
    "simulated frames with given values": _SIMULATED + ", but with a given {given}.",
    "overlap of a loop": (
        "In frames {first} to {last} the end of the loop becomes its start: both are carried to a shape between them."
    ),
}
"""Sentences by kind, with the figures that the engine gives."""

_NOT_SMOKE = (
    ("mask", "hide by a Mask what is no smoke"),
    ("plate", "choose a Clean Plate"),
    ("", "make the Mask smaller, or use Frames in which less else changes"),
)

REMEDIES = {
    "hardly any smoke fitted": (
        ("mask", "hide by a Mask what is no smoke"),
        ("plate", "choose a Clean Plate"),
        ("light", "choose Scene Lights"),
        ("medium", "set Smoke Material"),
        ("", "use Frames with more smoke"),
    ),
    "not all is smoke": _NOT_SMOKE,
    "not all may be smoke": _NOT_SMOKE,
    "smoke in the background": (
        ("plate", "choose a Clean Plate"),
        ("strokes", "paint Strokes over the smoke"),
        ("", "use Frames in which the smoke moves more"),
    ),
}
"""What may end a doubt, by its kind: each remedy after the setting that it gives. The last one is for a shot that has
all others."""

REPLACED = {"not all may be smoke": ("not all is smoke", "hardly any smoke fitted")}
"""Doubts of a coarse fit, with those that say the same of the result."""

FRAME_NUMBERS = ("before", "after", "first", "last", "frame")  # the engine counts them from 0, the panel from 1

MATCHES = ((34.0, "very good"), (28.0, "good"), (22.0, "fair"))
"""Words for how well smoke matches its clip, by the least PSNR inside the smoke (dB), set by hand: the difference there
is at most 2, 4 and 8 % of the range."""

POOR = "poor"  # the word for a PSNR below these

UNRATED = (
    *("smoke in the background", "background never seen"),
    *("background never seen beside strokes", "given background never seen"),
    "smoke in the given frame",
)
"""Doubts with which smoke may match its clip well and still be wrong: a part of it is in the background."""

OF_RESULT = ("dissolving smoke", "simulated frames", "simulated frames with given values", "overlap of a loop")
"""Sentences whose frames are counted from the first of the result, from 1."""


def sentence(message: Mapping[str, Any], before: int = 0, doubts: Collection[str] = ()) -> str:
    """A message of the engine, as the panel shows it.

    It has a ``text``, and most have a ``kind`` and ``figures``. Of the clip's frames so many are ``before`` the
    first of the result. ``doubts`` are kinds of what was said before of why the result may be wrong.
    """
    kind = message.get("kind", "")
    words, add = SENTENCES.get(kind), before if kind in OF_RESULT else 1
    if words is None:
        return str(message["text"])
    figures = dict(message["figures"])
    figures |= {name: figures[name] + add for name in FRAME_NUMBERS if name in figures}
    if "frames" in figures:
        figures["frames"] = "1 frame" if figures["frames"] == 1 else f"{figures['frames']} frames"
    if "seconds" in figures:
        figures["seconds"] = spent(figures["seconds"])
    if "psnr" in figures:
        level = f"{figures['psnr']:.1f} dB"
        unrated = any(kind in doubts for kind in UNRATED)
        figures["psnr"] = f"{level}, not rated: see the warning" if unrated else f"{match(figures['psnr'])} ({level})"
    return words.format(**figures)


def advice(kind: str, given: Collection[str] = ()) -> str:
    """What may end a doubt, as a sentence without the settings that are ``given``; empty where nothing is known."""
    *remedies, last = REMEDIES.get(kind, (("", ""),))
    left = [words for setting, words in remedies if setting not in given] or [last[1]]
    words = " or ".join([", ".join(left[:-1]), left[-1]] if len(left) > 2 else left)
    return f"{words[:1].upper()}{words[1:]}." if words else ""


def repeats(kind: str, said: Collection[str]) -> bool:
    """Whether a doubt says what doubts of the kinds ``said`` do."""
    return bool(kind) and not {kind, *REPLACED.get(kind, ())}.isdisjoint(said)


def stopped(done: int) -> str:
    """What a run that was cancelled leaves, by the number of its finished frames."""
    return f"Cancelled; finished frames stay: {done}." if done else "Cancelled before its first frame was finished."


def match(psnr: float) -> str:
    """How well smoke matches its clip, in words, by the PSNR inside the smoke (dB)."""
    return next((word for least, word in MATCHES if psnr >= least), POOR)


def spent(seconds: float) -> str:
    """A time that something took, in words, to the second below an hour."""
    whole = max(1, round(seconds))
    return f"{whole // 60} min {whole % 60} s" if 60 <= whole < 3600 else duration(seconds)


def duration(seconds: float) -> str:
    """A time in words, to the second below a minute and to the minute above."""
    if seconds < 59.5:
        return f"{max(1, round(seconds))} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


def disk_size(megabytes: float) -> str:
    """An amount of disk in words."""
    if megabytes < 9.95:
        return f"{megabytes:.1f} MB"
    return f"{megabytes:.0f} MB" if megabytes < 999.5 else f"{megabytes / 1000.0:.1f} GB"
