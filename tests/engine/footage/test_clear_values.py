"""What the smoke of a clip is like."""

from __future__ import annotations

import numpy as np

from smokelift.footage.clear_values import smoke_of

FRAMES, ROWS, COLUMNS, BRIGHTNESS = 32, 24, 24, 0.65
SHADOW = 0.55
"""Brightness of the smoke's darkest parts."""


def passing(wall: np.ndarray) -> np.ndarray:
    """Samples (frames, rows, columns) of smoke that is over each pixel four times, now thin, now thick."""
    random = np.random.default_rng(0)
    opacity = np.zeros((FRAMES, *wall.shape))
    opacity[12:16] = random.uniform(0.2, 0.9, (4, *wall.shape))
    brightness = random.uniform(SHADOW, BRIGHTNESS, opacity.shape)
    return (wall + opacity * (brightness - wall)).astype(np.float32)


def test_smoke_brightens_what_is_darker_and_darkens_what_is_brighter() -> None:
    wall = np.random.default_rng(1).uniform(0.1, 0.2, (ROWS, COLUMNS))
    wall[:, COLUMNS // 2 :] += 0.75
    smoke = smoke_of(passing(wall), 3 / 255)
    assert smoke.brightens[:, : COLUMNS // 2].all()
    assert smoke.brightens[:, COLUMNS // 2 :].mean() < 0.02


def test_what_moves_both_ways_does_not_overrule_the_few_that_are_clear() -> None:
    """Leaves that never rest, before a sky that smoke darkens in one place."""
    random = np.random.default_rng(2)
    samples = np.full((FRAMES, ROWS, COLUMNS), 0.5, np.float32)
    samples[:, :8] += random.uniform(-0.3, 0.3, (FRAMES, 8, COLUMNS)).astype(np.float32)
    samples[3, 20, 12:16] = 0.3
    assert not smoke_of(samples, 3 / 255).brightens.any()
    samples[:, :8] = 0.5 + random.uniform(0.1, 0.3, (FRAMES, 8, COLUMNS))
    assert smoke_of(samples, 3 / 255).brightens.all()
