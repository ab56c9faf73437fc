"""The smoke's own color: found where no light explains it, and called undetermined elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.checks import UNDETERMINED
from smokelift.setup.first_estimate import SmokeSamples
from smokelift.setup.medium import several_colors, smoke_color, source_radiance

WHITE = np.ones(3)
RED, DUST = np.array((1.0, 0.3, 0.2)), np.array((1.0, 0.75, 0.48))
BLACK, SKY, BRICK = np.zeros(3), np.array((0.25, 0.45, 0.9)), np.array((0.2, 0.12, 0.08))
GREEN, PALE_SKY = np.array((0.0, 0.6, 0.01)), np.array((0.36, 0.42, 0.46))


def samples(source, behind, thickest=0.9):
    """Smoke of optical depths up to one before one color, with a little noise."""
    rng = np.random.default_rng(1)
    opacity = rng.random((500, 1)) * thickest
    behind = np.broadcast_to(behind, (500, 3))
    colors = (1 - opacity) * behind + opacity * source + 0.002 * rng.standard_normal((500, 3))
    return SmokeSamples(1.0, *np.ones((2, 1, 1), bool), colors.astype("f4"), behind.astype("f4"), (0,))


def apart(one, other):
    """Degrees between two colors."""
    return np.degrees(np.arccos(np.dot(one, other) / (np.linalg.norm(one) * np.linalg.norm(other))))


@pytest.mark.parametrize(
    ("source", "behind"), [(RED, BLACK), (RED, BRICK), (0.1 * RED, BLACK)], ids=["black", "brick", "dim"]
)
def test_a_color_of_its_own_is_found(source, behind):
    color, choice = smoke_color(samples(source, behind), WHITE)
    assert apart(color, RED) < 6
    assert max(color) == 1
    assert choice.source == "measured"


@pytest.mark.parametrize("thickest", [0.3, 0.9])
@pytest.mark.parametrize("behind", [BLACK, SKY, BRICK], ids=["black", "sky", "brick"])
@pytest.mark.parametrize("source", [0.8 * WHITE, 0.02 * WHITE, BLACK], ids=["white", "soot", "black"])
def test_gray_smoke_stays_gray_before_anything(source, behind, thickest):
    color, choice = smoke_color(samples(source, behind, thickest), WHITE)
    assert (color, choice.value) == ((1, 1, 1), UNDETERMINED)


@pytest.mark.parametrize(
    ("source", "behind", "undetermined"),
    [((1.0, 0.9, 0.8), BLACK, True), (DUST, BLACK, False), (0.8 * DUST, 0.4 * DUST, True)],
    ids=["white balance", "dust", "in its surroundings' color"],
)
def test_what_light_explains_is_the_lights(source, behind, undetermined):
    assert (smoke_color(samples(np.array(source), behind), WHITE)[1].value == UNDETERMINED) == undetermined


def test_a_dark_side_is_not_colored():
    """Thick smoke in the sun, whose shadow is darker than it is: before a sky it takes away more than it adds."""
    rng = np.random.default_rng(2)
    seen = samples(BLACK, PALE_SKY, 0.0)
    opacity, lit = 1 - rng.random((500, 1)) ** 4, rng.random((500, 1))
    lit_smoke = (1 - opacity) * PALE_SKY + opacity * 0.4 * lit**3 * np.array((1.0, 0.92, 0.84))
    _, choice = smoke_color(replace(seen, colors=lit_smoke.astype("f4")), WHITE)
    assert choice.value == UNDETERMINED


def shredded():
    """Red smoke that is clipped where it is thick, with a shred of pale smoke that is not."""
    red, pale = samples(2 * RED, BLACK), samples(0.9 * WHITE, BLACK)
    colors = np.concatenate([np.minimum(red.colors, 1), pale.colors[:25]])
    return replace(red, colors=colors, behind=np.concatenate([red.behind, pale.behind[:25]]))


@pytest.mark.parametrize("seen", [shredded(), samples(RED, GREEN)], ids=["shred", "green screen"])
def test_the_source_has_a_color_that_the_pixels_show_together(seen):
    """The brightest of each channel may be other smoke, or the background, and together a color that none shows."""
    assert apart(source_radiance(seen), RED) < 12
    assert apart(np.percentile(seen.colors, 99, axis=0), RED) > 15
    if (seen.behind == 0).all():
        assert apart(smoke_color(seen, WHITE)[0], RED) < 6


def test_the_source_is_beyond_the_thickest_smoke():
    """Thin smoke before a background that is brighter in the one channel in which smoke is darker."""
    source = np.array((0.4, 0.3, 0.0))
    seen = samples(source, GREEN, 0.5)
    amounts = (seen.colors - GREEN) @ (source - GREEN)
    found = source_radiance(seen)
    assert (found - GREEN) @ (source - GREEN) > amounts.max()


def test_a_known_light_leaves_the_smoke_the_rest():
    light = np.array((1.0, 0.5, 0.3))
    assert smoke_color(samples(0.8 * light, BLACK), light)[1].value == UNDETERMINED
    assert apart(smoke_color(samples(0.8 * light * RED, BLACK), light)[0], RED) < 1


def two_kinds(one, other, behind=BLACK):
    """Smoke of two colors, as much of each."""
    parts = samples(one, behind), samples(other, behind)
    colors, grounds = (np.concatenate([getattr(part, name) for part in parts]) for name in ("colors", "behind"))
    return SmokeSamples(1.0, *np.ones((2, 1, 1), bool), colors, grounds, (0,))


def test_smoke_of_more_than_one_color_is_said():
    """One whose color changes from a frame to the next asks for other frames: no crop and no mask helps there."""
    seen = two_kinds(RED, np.array((0.2, 0.3, 1.0)))
    half = len(seen.colors) // 2
    mixed = np.random.default_rng(3).permutation(len(seen.colors))
    for samples_of, kind in (
        (seen, "smoke of several colors"),
        (replace(seen, counts=(half, half)), "smoke that changes its color"),
        (replace(seen, colors=seen.colors[mixed], counts=(half, half)), "smoke of several colors"),
    ):
        assert [found.kind for found in several_colors(samples_of)] == [kind]


@pytest.mark.parametrize(
    ("one", "other", "behind"),
    [
        (RED, 0.4 * RED, BLACK),  # lit more and less
        (WHITE, 0.8 * DUST, BLACK),  # warm and neutral light at once
        (np.array((0.1, 0.25, 0.9)), WHITE, BLACK),  # blue, and clipped where it is brightest
        (RED, WHITE, SKY),  # what is behind it has a color as well
    ],
    ids=["shaded", "mixed light", "clipped", "sky"],
)
def test_smoke_of_one_color_is_not_said_to_have_several(one, other, behind):
    both = two_kinds(one, other, behind)
    if behind is BLACK and other is WHITE:
        both.colors[500:] = 1.0
    assert several_colors(both) == []
