"""What is kept with a result, in words: which parts of it are measured, and what was decided for it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from smokelift.checks import Remark
from smokelift.density.detailed_depth import unseen_sides
from smokelift.density.turntable import Turntable
from smokelift.footage.clip import Clip
from smokelift.report.sentences import sentence
from smokelift.setup.estimate import Estimate
from smokelift.setup.shot import Shot

Origin = Literal["measured", "estimated", "assumed", "made up"]


@dataclass(frozen=True)
class Provenance:
    """Where one part of a result comes from.

    Attributes
    ----------
    origin
        ``"measured"``: the pictures show it. ``"estimated"``: it follows from what they show. The pictures leave the
        others undetermined: ``"assumed"`` is one answer for all clips, ``"made up"`` one of many for this one.
    how
        The remark whose sentence explains it.
    settings
        The values that chose it, by the names of `Settings`.
    """

    what: str
    origin: Origin
    how: Remark
    settings: Mapping[str, float] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """The fields as JSON holds them."""
        return {"what": self.what, "origin": self.origin, "how": sentence(self.how), "settings": dict(self.settings)}


def record(estimate: Estimate[Any]) -> dict[str, Any]:
    """Return an estimate as JSON holds it, with four digits, since further ones decide nothing."""
    known = {**estimate.figures, **({} if estimate.spread is None else {"spread": estimate.spread})}
    value = estimate.value
    return {
        "what": estimate.what,
        "chosen": list(value) if isinstance(value, tuple) else value,
        "kind": estimate.kind,
        "reason": sentence(estimate),
        "measured": {name: float(f"{v:.4g}") for name, v in known.items() if isinstance(v, float | int)},
        "tolerance": estimate.tolerance,
        "by_hand": estimate.source == "given",
    }


def provenance(shot: Shot) -> tuple[Provenance, ...]:
    """Where the parts of a shot's result come from, the best known first."""
    settings, cameras = shot.settings, {"cameras": len(shot.views)}
    parts = [
        *_pictures(shot.clip),
        Provenance("optical depth of every ray", "measured", Remark("pictures that are fitted", cameras)),
        Provenance("velocity", "estimated", Remark("velocity between frames")),
        Provenance("distribution along the rays", "assumed", Remark(_distribution(shot), cameras)),
    ]
    if shot.fire is not None:
        parts.append(Provenance("emission of fire", "assumed", Remark("emission along the rays")))
    if settings.detail > 0 and _unseen(shot):
        made = {"detail": settings.detail, "seed": settings.seed}
        parts.append(Provenance("fine structure along the rays", "made up", Remark("texture of the clip"), made))
    return tuple(parts)


def made_up(shot: Shot) -> tuple[Remark, ...]:
    """What a run will make up, to be said before it."""
    return tuple(part.how for part in provenance(shot) if part.origin == "made up")


def _pictures(clip: Clip) -> Iterator[Provenance]:
    """What was done to the input's pictures, and which were replaced."""
    for note in clip.notes:
        yield Provenance("pictures", "measured", note)
    if clip.damaged:
        yield Provenance("some pictures", "assumed", Remark("replaced pictures", {"frames": clip.damaged_frames}))


def _distribution(shot: Shot) -> str:
    """The kind of remark on the distribution along the rays, which no number of cameras determines."""
    taken = "thin fog" if len(shot.views) > 1 else "the view from the side"
    if shot.settings.method != "paper":
        taken = "the smoke's width"
    return f"depth by {taken} in {'several views' if len(shot.views) > 1 else 'one view'}"


def _unseen(shot: Shot) -> bool:
    """Whether there is a side without a camera near it."""
    cameras = [view.working.camera for view in shot.views]
    return unseen_sides(Turntable.before(cameras[0], shot.optics.domain), cameras)
