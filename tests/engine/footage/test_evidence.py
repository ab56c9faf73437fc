"""The part of a file that is evidence for the background of a clip."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from films import COUNT, HEIGHT, WIDTH, codes_apart, film, puff, wall

from smokelift.footage.clip import Clip
from smokelift.footage.evidence import evidence
from smokelift.setup.background import find_plates


def test_a_trimmed_clip_has_the_background_of_its_file(tmp_path: Path) -> None:
    """Twelve frames in which smoke hardly leaves its place before the wall, of a file that shows the wall."""
    truth = wall(0.2, 0.5)

    def opacity(n: int) -> np.ndarray:
        return puff(8 + (n - 10) / 3) if 10 <= n < 22 else np.zeros((HEIGHT, WIDTH))

    film(tmp_path, truth, opacity, 0.6)
    trimmed = Clip.open(tmp_path / "frame_###.png", fps=24, frames=(11, 20))
    assert len(evidence(trimmed)) > 20
    plate = find_plates(trimmed, None, None).plates.at(0)
    assert np.percentile(codes_apart(plate.image, truth), 95) < 5


def test_another_shot_is_no_evidence(tmp_path: Path) -> None:
    clip = film(tmp_path, wall(0.2, 0.5), puff, 0.6)
    cut = clip.changed(lambda n, picture: picture if n < COUNT // 2 else np.ascontiguousarray(picture[::-1] + 0.3))
    assert len(evidence(cut.part(2, 8))) <= COUNT // 2


def test_an_earlier_look_at_the_same_is_no_evidence_across_another_shot(tmp_path: Path) -> None:
    clip = film(tmp_path, wall(0.2, 0.5), puff, 0.6)
    cut = clip.changed(
        lambda n, picture: np.ascontiguousarray(picture[::-1] + 0.3) if COUNT // 4 <= n < COUNT // 2 else picture
    )
    part = evidence(cut.part(COUNT - 6, COUNT - 3))
    assert part.first == COUNT // 2
    assert part.first + len(part) == COUNT
