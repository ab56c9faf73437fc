"""What to say of a clip in which no smoke is found: why that may be, and what helps."""

from __future__ import annotations

from smokelift.footage.backdrop import ONE_COLOUR_NOISE
from smokelift.footage.clip import Clip
from smokelift.footage.plate import Plates
from smokelift.setup.smoke import SAMPLES, SmokeSamples

_WHERE = "([background] in a scene file, Clean Plate in Blender)"
_GIVE = f"give a clean plate, or a colour {_WHERE}"


def nothing_seen(
    clip: Clip, plates: Plates, samples: SmokeSamples, given: bool, cuts: tuple[str, ...]
) -> tuple[str, ...]:
    """What is to be said, before a run, of a clip whose samples show no smoke, two sentences; nothing of others.

    Parameters
    ----------
    clip
        The footage.
    plates, given
        What is behind the smoke, and whether the scene says so.
    samples
        The frames that were looked at.
    cuts
        The `cut_notes` of the clip.
    """
    if samples.smoky:
        return ()
    count = len(clip.spread(SAMPLES))
    looked = f"the {count} frames that were looked at" if count > 1 else "the one frame that was looked at"
    return (
        f"No smoke found in {looked}, so that nothing of it could be measured.",
        what_helps(clip, plates, given, cuts),
    )


def what_helps(clip: Clip, plates: Plates, given: bool, cuts: tuple[str, ...]) -> str:
    """What may show the smoke of a clip in which none is found, in a sentence; see `nothing_seen`."""
    if cuts:
        return cuts[0]
    if given:
        return f"Check the background that is given {_WHERE}: it may hold the smoke, or belong to another clip."
    if len(clip) == 1 and clip.backdrop is None:
        return f"One frame alone does not show what is behind its smoke: {_GIVE}."
    change = float(plates.noise.total.max())
    if change > ONE_COLOUR_NOISE:
        return (
            f"The background changes by {255 * change:.0f} of 255 from frame to frame, and fainter smoke is not seen: "
            "if the camera moves, track it in Blender, and give its matrices in [camera] and what is behind the smoke "
            f"in [background]; if it stands still, {_GIVE}."
        )
    return f"If there is any, {_GIVE}."
