"""A run whose system fails, and the run that goes on from it: nothing that was said to be done may be lost."""

import json
import shutil
import signal
from collections.abc import Callable
from collections.abc import Sequence as Words
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.stability.environments import Environment
from benchmarks.stability.forked import Ended, files_of, nothing, run, verdict
from benchmarks.stability.shot import TinyShot
from smokelift.app.cli import main
from smokelift.output.index import INDEX, SequenceError
from smokelift.output.sequence import Sequence
from smokelift_command.exits import CANCELLED, Termination

RECONSTRUCT = (
    *("reconstruct", "scene.toml", "--quality", "draft", "--device", "cpu"),
    *("--out", "out", "--npz", "--progress", "json"),
)


def recovered(
    environment: Environment, shot: TinyShot, place: Path, random: np.random.Generator | None
) -> tuple[Ended, str]:
    """Reconstruct while the system fails, then go on while it is well.

    Parameters
    ----------
    environment
        What fails.
    shot
        What is reconstructed: its pictures, or its video.
    place
        A folder to be made.
    random
        Decides how bad it is; without it nothing fails.

    Returns
    -------
    ended
        How the first run ended, or the second if that is what is wrong.
    wrong
        In a few words what is wrong; "" if nothing is.
    """
    filmed = random is not None and random.random() < 0.5
    shutil.copytree(shot.video if filmed else shot.pictures, place)
    out, wanted = place / "out", (shot.filmed if filmed else shot.finished) / "out"
    before = files_of(place)
    if random is None:
        ended = _reconstruct(place, nothing)
        return ended, _differs(out, wanted)
    with environment(out, random) as failure:
        ended = _reconstruct(place, failure.begin)
        failure.mend()
        if failure.ends:
            wrong = "" if ended.status in failure.ends else f"status {ended.status}"
        else:
            wrong = verdict(ended, before, files_of(place), "out/")
        wrong = wrong or _lost(ended, out, wanted)
        if wrong:
            return ended, wrong
        again = _reconstruct(place, nothing, "--resume")
        if again.status:
            return again, f"cannot go on ({again.status})"
        wrong = verdict(again, before, files_of(place), "out/") or _differs(out, wanted)
        return (again, wrong) if wrong else (ended, "")


def _command(words: Words[str]) -> int:
    """What `smokelift_command.main` does, but for loading the engine, which a failing system may not allow."""
    signal.signal(signal.SIGTERM, Termination.handle)
    try:
        return main(words)
    except KeyboardInterrupt:
        return CANCELLED


def _reconstruct(place: Path, begin: Callable[[], None], *words: str) -> Ended:
    """Run the command; what its events call an error counts as said on standard error."""
    ended = run(_command, (*RECONSTRUCT, *words), place, begin)
    said = [event["text"] for event in _events(ended) if event["event"] == "error"]
    return replace(ended, errors="\n".join([*ended.errors.splitlines(), *said]))


def _events(ended: Ended) -> list[dict[str, Any]]:
    lines = ended.output.splitlines()
    return [json.loads(line) for line in lines if line.endswith("}")]  # a killed run may leave half a line


def _lost(ended: Ended, out: Path, wanted: Path) -> str:
    """What is wrong with the frames that a run said to have finished, and with those that its folder lists."""
    reported = {event["frame"] for event in _events(ended) if event["event"] == "frame"}
    if not (out / INDEX).exists():
        return "lost" if reported else ""
    try:
        there = Sequence.open(out)
        listed = [number for number in there.frames if _same(there, Sequence.open(wanted), number)]
    except SequenceError as error:
        return f"damaged: {error}"
    if len(listed) < len(there.frames):
        return "other frames are listed than were computed"
    return "lost" if reported - set(listed) else ""


def _differs(out: Path, wanted: Path) -> str:
    """What tells a finished sequence from the one that a run makes in one go."""
    if [path.name for path in sorted(out.iterdir())] != [path.name for path in sorted(wanted.iterdir())]:
        return "other files than of a run in one go"
    found, whole = Sequence.open(out), Sequence.open(wanted)
    same = found.complete and found.frames == whole.frames and all(_same(found, whole, n) for n in whole.frames)
    return "" if same else "other bits than of a run in one go"


def _same(one: Sequence, other: Sequence, number: int) -> bool:
    volumes = ((each.density(number), *each.velocity(number).faces) for each in (one, other))
    return all(map(np.array_equal, *volumes))
