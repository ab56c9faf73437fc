"""Views that are made of another view's pictures."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from smokelift.evaluation.copies import SideCopies

FRAMES = 15


def clip(seed: int) -> list[np.ndarray]:
    """A ball of smoke whose detail rises and changes within a few frames."""
    noise = ndimage.gaussian_filter(np.random.default_rng(seed).standard_normal((FRAMES, 72, 56)), (1.0, 1.5, 1.5))
    rows, columns = np.indices((72, 56))
    ball = np.exp(-(((rows - 36) / 18) ** 2) - ((columns - 28) / 14) ** 2)
    return [(ball * (1 + 3 * np.roll(frame, -n, 0))).astype(np.float32) for n, frame in enumerate(noise)]


def copied(sides: list[np.ndarray], fronts: list[np.ndarray]) -> dict[str, float | None]:
    """The figures of a side whose view between is its own picture, mirrored."""
    found = SideCopies()
    for side, front in zip(sides, fronts, strict=True):
        found.add(front, side[:, ::-1], side)
    return found.figures()


def test_a_mirrored_copy_of_the_same_moment() -> None:
    front = clip(1)
    found = copied([picture[:, ::-1] for picture in front], front)
    assert found["detail_correlation"] < 0.5
    for name in ("copied_detail", "copied_detail_moments", "copied_detail_between"):
        assert found[name] == pytest.approx(1, abs=1e-3)


def test_a_copy_of_another_moment_hides_from_the_same_moment_only() -> None:
    front, other = clip(1), clip(2)
    late = copied(front[6:] + front[:6], front)
    assert late["copied_detail"] < 0.6
    assert late["copied_detail_moments"] > 0.99
    assert copied(other, front)["copied_detail_moments"] < 0.7


def test_the_effort_of_looking_for_moments_is_bounded(monkeypatch) -> None:
    monkeypatch.setattr("smokelift.evaluation.copies.SOUGHT", 2)
    front = clip(1)
    calls: list[int] = []
    monkeypatch.setattr("smokelift.evaluation.metrics.aligned_detail_correlation", lambda a, b: calls.append(1) or 0.5)
    assert copied(front * 4, front * 4)["copied_detail_moments"] == 0.5
    assert len(calls) == 2 * len(front) * 4 + 2 * 6  # both ends of the clip, where only one side has frames


def test_pictures_of_other_sizes_are_compared_aligned_only() -> None:
    found = copied([picture[:, 3:] for picture in clip(1)], clip(1))
    assert found["detail_correlation"] is None
    assert found["copied_detail"] > 0.97


def test_without_frames_there_is_nothing_to_say() -> None:
    assert set(SideCopies().figures().values()) == {None}
