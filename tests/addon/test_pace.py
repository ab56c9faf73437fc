"""The pace that is tried out is the one that the engine makes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from addon.pace import paced
from smokelift.direct import playback

LONGEST_EXPRESSION = 256
"""Characters that Blender keeps of a driver's expression."""


@pytest.mark.parametrize("speeds", [(1.0,), (0.25,), (3.0,), (1.0, 0.2, 1.0), (0.5, 0.5, 2.0), (2.0, 1.0)])
def test_places_and_speeds_are_the_engines(speeds) -> None:
    """At every frame, as drivers compute them."""
    count = 41
    pace = paced(count, speeds)
    places, wanted = playback(count, speeds)
    for time, (place, speed) in enumerate(zip(places, wanted, strict=True)):
        found = [eval(text("t"), {"t": time, "exp": math.exp}) for text in (pace.place, pace.speed)]
        np.testing.assert_allclose(found, (place, speed), rtol=2e-3, atol=2e-3)
    assert len(places) - 1 <= pace.duration <= len(places) + 1 / speeds[-1]


def test_an_expression_is_short_enough_for_blender() -> None:
    """With long numbers."""
    pace = paced(1234, (0.123456789, 1.23456789, 0.987654321))
    time = "(frame-1234+0.001)/1.23456789"
    assert len(f"floor(min({pace.place(time)},1233))-(frame-1234)+1234") < LONGEST_EXPRESSION
