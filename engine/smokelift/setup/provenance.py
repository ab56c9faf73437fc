"""What of a result is measured and what is not, in words that are kept with it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from smokelift.density.detailed_depth import unseen_sides
from smokelift.density.turntable import Turntable
from smokelift.footage.clip import Clip, numbered
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot

Origin = Literal["measured", "estimated", "assumed", "made up"]


@dataclass(frozen=True)
class Provenance:
    """Where one part of a result comes from.

    Attributes
    ----------
    what
        The part.
    origin
        ``"measured"``: the pictures show it. ``"estimated"``: it follows from what they show. ``"assumed"``: they leave
        it undetermined, and one answer is taken for all clips. ``"made up"``: they leave it undetermined, and it is one
        of many answers that show the same pictures.
    how
        In a sentence.
    settings
        What chose it, by the names of `Settings`.
    """

    what: str
    origin: Origin
    how: str
    settings: Mapping[str, float] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """The fields as JSON holds them."""
        return asdict(self)


def provenance(shot: Shot) -> tuple[Provenance, ...]:
    """Where the parts of a shot's densities and velocities come from, the best known first."""
    settings, cameras = shot.settings, len(shot.views)
    parts = [
        *_pictures(shot.clip),
        Provenance(
            "optical depth of every ray",
            "measured",
            f"The density renders to the pictures of {_cameras(cameras)} in the scene's light and medium; psnr in the "
            "figures of a frame says how closely.",
        ),
        Provenance(
            "velocity",
            "estimated",
            "It carries the density of one frame to that of the next, and is known along the rays no better than they.",
        ),
        Provenance("distribution along the rays", "assumed", _assumed(settings, cameras)),
    ]
    if shot.fire is not None:
        parts.append(
            Provenance(
                "emission of fire",
                "assumed",
                "Along each ray of the camera it adds up to the light that fire adds to the picture; a flame is taken "
                "to be as deep as it is wide, in the middle of the smoke, of one color.",
            )
        )
    if settings.detail > 0 and _unseen(shot):
        parts.append(
            Provenance(
                "fine structure along the rays",
                "made up",
                "From sides that no camera is near to the smoke has the texture of the clip's own pictures. Another "
                "seed makes it differently, detail 0 not at all.",
                {"detail": settings.detail, "seed": settings.seed},
            )
        )
    return tuple(parts)


def made_up(shot: Shot) -> tuple[str, ...]:
    """What of a result will be made up, a sentence each, to be said before a run."""
    return tuple(part.how for part in provenance(shot) if part.origin == "made up")


def _pictures(clip: Clip) -> Iterator[Provenance]:
    """What was done to the input's pictures, and which of them are not its own."""
    if clip.notes:
        yield Provenance("pictures", "measured", " ".join(clip.notes))
    if clip.damaged:
        how = "Those of {} missing or damaged; the last sound one stands in."
        yield Provenance("some pictures", "assumed", how.format(numbered([n + 1 for n in clip.damaged])))


def _assumed(settings: Settings, cameras: int) -> str:
    paper = settings.method == "paper"
    if cameras > 1:
        rest = "the thin fog that the fit starts from" if paper else "the smoke's width in each picture"
        return f"{_cameras(cameras)} limit it and do not determine it: the rest follows from {rest}."
    if paper:
        return "One camera does not show it: its picture is taken to be the view from 90 degrees as well."
    return "One camera does not show it: the smoke is taken to be as deep as it is wide."


def _unseen(shot: Shot) -> bool:
    """Whether there is a side that no camera is near to."""
    cameras = [view.working.camera for view in shot.views]
    return unseen_sides(Turntable.before(cameras[0], shot.optics.domain), cameras)


def _cameras(count: int) -> str:
    return "one camera" if count == 1 else f"{count} cameras"
