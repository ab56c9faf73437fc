"""Views that are made of another view's pictures."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from smokelift.evaluation.copies import CopiedDetail

FRAMES = 15


def clip(seed: int) -> list[np.ndarray]:
    """A ball of smoke whose detail rises and changes within a few frames."""
    noise = ndimage.gaussian_filter(np.random.default_rng(seed).standard_normal((FRAMES, 72, 56)), (1.0, 1.5, 1.5))
    rows, columns = np.indices((72, 56))
    ball = np.exp(-(((rows - 36) / 18) ** 2) - ((columns - 28) / 14) ** 2)
    return [(ball * (1 + 3 * np.roll(frame, -n, 0))).astype(np.float32) for n, frame in enumerate(noise)]


def copied(views: list[np.ndarray], sources: list[np.ndarray]) -> CopiedDetail:
    found = CopiedDetail()
    for view, source in zip(views, sources, strict=True):
        found.add(view, source)
    return found


def test_a_mirrored_copy_of_the_same_moment() -> None:
    front = clip(1)
    found = copied([picture[:, ::-1] for picture in front], front)
    assert found.same_moment() == pytest.approx(1, abs=1e-3)
    assert found.any_moment() == pytest.approx(1, abs=1e-3)


def test_a_copy_of_another_moment_hides_from_the_same_moment_only() -> None:
    front, other = clip(1), clip(2)
    late = copied(front[6:] + front[:6], front)
    assert late.same_moment() < 0.6
    assert late.any_moment() > 0.99
    assert copied(other, front).any_moment() < 0.7


def test_long_clips_are_searched_around_each_frame(monkeypatch) -> None:
    """The effort grows with the clip only by its own frames."""
    monkeypatch.setattr("smokelift.evaluation.copies.SOUGHT", 2)
    front = clip(1)
    calls: list[int] = []
    monkeypatch.setattr("smokelift.evaluation.metrics.aligned_detail_correlation", lambda a, b: calls.append(1) or 0.5)
    assert copied(front * 4, front * 4).any_moment() == 0.5
    assert len(calls) == 2 * 6  # at both ends of the clip, where only one side has frames


def test_without_frames_there_is_nothing_to_say() -> None:
    assert CopiedDetail().same_moment() is None
    assert CopiedDetail().any_moment() is None
