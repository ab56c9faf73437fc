"""Where in depth smoke stands: found by its contacts with the floor and the ceiling, else on the domain's axis."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift.density.axis_cues import estimate_axis
from smokelift.density.upright_plane import SmokeAxis, depth_at
from smokelift.render import Optics
from smokelift.scene import Camera, Domain, Inlet, Medium

BOX = Domain((-1, -1, 0), (1, 1, 3), (32, 32, 48))
TALLER = Domain((-1, -1, 0), (1, 1, 4), (32, 32, 64))
FRONT = Camera.look_at((0, -7, 1.5), (0, 0, 1.5), fov_y_degrees=30, size=(75, 113))
X, Y, Z = (low + (np.arange(n) + 0.5) / 16 for low, n in zip(BOX.min, BOX.resolution, strict=True))


def column(depth: float, lean: float = 0.0, low: float = 0.0, high: float = 2.0, radius: float = 0.25) -> np.ndarray:
    """Smoke between two heights around (0.2 + lean z, depth)."""
    across = X[:, None, None] - 0.2 - lean * Z
    inside = across**2 + (Y[None, :, None] - depth) ** 2 < radius**2
    return (inside & (low < Z) & (high > Z)).astype(np.float32)


def seen(*densities: np.ndarray, camera: Camera = FRONT) -> list[np.ndarray]:
    """Optical depths that a camera sees."""
    renderer = Optics(BOX, Medium(extinction=1.0), (), "absorption").renderer(camera, np.ones(3))
    return [-np.log(np.maximum(renderer.image(density)[..., 0], 1e-9)) for density in densities]


def axis_of(*known) -> SmokeAxis:
    """The axis that is estimated."""
    return estimate_axis(*known).axis


def rising(depth: float) -> list[np.ndarray]:
    """A column whose head rises from frame to frame."""
    return seen(*(column(depth, high=high) for high in (1.4, 1.7, 2.0, 2.3)))


@pytest.mark.parametrize("depth", [-0.3, -0.15, 0.0, 0.1])
def test_smoke_on_the_floor_shows_its_depth(depth) -> None:
    found = axis_of(rising(depth), FRONT, BOX)
    assert found.at(np.array([-1.2])) == pytest.approx(0.8 * depth, abs=0.05)
    assert found.at(np.array([0.5])) == pytest.approx(0.8 * depth, abs=0.06)


@pytest.mark.parametrize("low", [0.1, 0.2])
def test_smoke_that_begins_above_the_floor_stands_upright(low) -> None:
    """As from a bowl or a chimney: taken for smoke on the floor it would be far back, and lean over the box."""
    smoke = seen(*(column(0.1, low=low, high=high) for high in (1.4, 1.7, 2.0, 2.3)))
    found = axis_of(smoke, FRONT, BOX).at(np.linspace(-1.3, 1.0, 20))
    np.testing.assert_allclose(found, 0.1, atol=0.2)


@pytest.mark.parametrize("depth", [-0.3, 0.3])
def test_floating_smoke_is_left_on_the_axis(depth) -> None:
    for low in (0.05, 0.2, 1.0):
        distance = (X[:, None, None] ** 2 + (Y[None, :, None] - depth) ** 2 + (Z - low - 0.3) ** 2) ** 0.5
        ball = np.clip(1.5 - 4 * distance, 0, 1).astype(np.float32)
        assert not axis_of(seen(ball, ball), FRONT, BOX).depths.any()


@pytest.mark.parametrize("depth", [-0.5, -0.25, 0.0, 0.25])
def test_smoke_that_ends_at_the_ceiling_shows_its_depth_there(depth) -> None:
    smoke = seen(*(column(depth, low=0.5, high=high) for high in (2.0, 3.0, 3.0)))
    found = axis_of(smoke, FRONT, BOX)
    # what stands behind the middle shows as if it ended below the ceiling
    assert found.at(np.array([1.45])) == pytest.approx(min(depth, 0), abs=0.12)
    assert abs(found.at(np.array([-0.5]))) < 0.05, "what is far below stays"


def test_smoke_that_goes_on_above_the_ceiling_does_not_lean_there() -> None:
    smoke = np.pad(column(-0.25, low=0.5, high=3.0), ((0, 0), (0, 0), (0, 16)), mode="edge")
    renderer = Optics(TALLER, Medium(extinction=1.0), (), "absorption").renderer(FRONT, np.ones(3))
    found = axis_of([-np.log(renderer.image(smoke)[..., 0])], FRONT, BOX)
    np.testing.assert_allclose(found.depths, 0, atol=0.03)


def test_inlets_and_a_distance_are_surer_than_the_ceiling() -> None:
    smoke = seen(column(0.3, low=0.5, high=3.0))
    for known in ((FRONT, BOX, [Inlet((0.2, 0.3, 0.6), 0.25)]), (FRONT, BOX, (), 0.3)):
        assert axis_of(smoke, *known).at(np.array([1.45])) == pytest.approx(0.3, abs=0.05)


def test_a_thread_and_specks_under_the_ceiling() -> None:
    thread, specks = (np.zeros((75, 113)[::-1], np.float32) for _ in range(2))
    thread[:60, 37] = 1.0
    assert np.isfinite(axis_of([thread], FRONT, BOX).depths).all()
    (specks,) = seen(column(0.3, low=0.5, high=2.7))
    specks[:9:4, 30] += 0.02
    np.testing.assert_allclose(axis_of([specks], FRONT, BOX).depths, 0, atol=0.03)


def test_what_a_rolled_picture_cuts_does_not_end_at_the_ceiling() -> None:
    roll, matrix = np.radians(10), np.array(FRONT.matrix)
    turn = np.array([[np.cos(roll), -np.sin(roll), 0], [np.sin(roll), np.cos(roll), 0], [0, 0, 1]])
    matrix[:3, :3] = matrix[:3, :3] @ turn
    rolled = replace(FRONT, matrix=tuple(map(tuple, matrix.tolist())))
    smoke = np.pad(column(-0.25, low=0.5, high=3.0), ((0, 0), (0, 0), (0, 16)), mode="edge")
    renderer = Optics(TALLER, Medium(extinction=1.0), (), "absorption").renderer(rolled, np.ones(3))
    found = axis_of([-np.log(renderer.image(smoke)[..., 0])], rolled, BOX)
    np.testing.assert_allclose(found.depths, 0, atol=0.06)


def test_drifting_smoke_is_believed_less() -> None:
    straight, leaning = (axis_of(seen(column(-0.25, lean)), FRONT, BOX).at(np.array([0.4])) for lean in (0.0, 0.2))
    assert straight < -0.15
    assert abs(leaning) < 0.5 * abs(straight)


@pytest.mark.parametrize("height", [-0.5, 0.02])
def test_a_camera_that_does_not_look_down_on_the_floor_sees_no_contact(height) -> None:
    low = Camera.look_at((0, -7, height), (0, 0, 1.5), fov_y_degrees=35, size=(75, 113))
    assert not axis_of(seen(column(0.3), camera=low), low, BOX).depths.any()


def test_smoke_that_goes_on_below_the_box_has_no_contact() -> None:
    deep = Domain((-1, -1, -1), (1, 1, 3), (32, 32, 64))
    smoke = np.pad(column(0.3), ((0, 0), (0, 0), (16, 0)), mode="edge")
    renderer = Optics(deep, Medium(extinction=1.0), (), "absorption").renderer(FRONT, np.ones(3))
    assert not axis_of([-np.log(renderer.image(smoke)[..., 0])], FRONT, BOX).depths.any()


def test_known_inlets_need_no_contact() -> None:
    """Floating smoke stands where it is said to enter; above the second of two sources, between them."""
    smoke = seen(column(0.3, low=1.0), column(0.3, low=1.1))
    one = axis_of(smoke, FRONT, BOX, [Inlet((0.2, 0.25, 0.5), 0.2)])
    np.testing.assert_allclose(one.at(np.array([-1.0, 0.2])), 0.25, atol=0.03)
    sources = [Inlet((0.2, -0.05, 1.0), 0.2), Inlet((0.2, 0.25, 0.2), 0.2)]
    two, places = axis_of(smoke, FRONT, BOX, sources), (np.array([-1.3, 0.2]), np.full(2, 0.2))
    np.testing.assert_allclose(two.at(*places), (0.25, 0.1), atol=0.02)
    np.testing.assert_allclose(two.read(two.spreads, *places), (0.0, 0.15), atol=0.02)


@pytest.mark.parametrize("depth", [-0.3, 0.0, 0.3])
def test_smoke_stands_where_its_lower_end_is_given(depth) -> None:
    """At all heights if it goes straight up, even if it floats; the contact with the floor does not count."""
    for smoke in (seen(column(depth, low=1.0)), rising(-depth)):
        found = estimate_axis(smoke, FRONT, BOX, base=depth)
        assert found.cue == "distance"
        assert found.depth == pytest.approx(depth, abs=0.03)
        np.testing.assert_allclose(found.axis.at(np.array([-1.2, 0.5])), depth, atol=0.04)


def test_a_distance_is_measured_level_and_straight_ahead() -> None:
    """One outside the box is refused."""
    for height in (1.5, 4.0):
        camera = Camera.look_at((0, -7, height), (0, 0, 1.5), fov_y_degrees=30, size=(75, 113))
        assert depth_at(7.2, camera, BOX) == pytest.approx(0.2)
    for distance in (6.0, 8.2):
        with pytest.raises(ValueError, match=rf"{distance:g} m .* 6 to 8 m"):
            depth_at(distance, FRONT, BOX)


NEAR_RIGHT, FAR_LEFT = Inlet((0.45, -0.3, 0.1), 0.25), Inlet((-0.35, 0.3, 0.5), 0.25)


def beside() -> np.ndarray:
    """The smoke of two inlets: one near and to the right, one far and to the left, which begins higher."""
    far = np.roll(column(0.3, low=0.5), round(-0.55 * 16), 0)
    return np.maximum(np.roll(column(-0.3), round(0.25 * 16), 0), far)


def test_columns_beside_one_another_have_depths_of_their_own() -> None:
    found = axis_of(seen(beside(), beside()), FRONT, BOX, [NEAR_RIGHT, FAR_LEFT])
    heights, right, left = np.array([-0.9, 0.0, 0.4]), np.full(3, 0.45), np.full(3, -0.35)
    np.testing.assert_allclose(found.at(heights, right), -0.3, atol=0.03)
    np.testing.assert_allclose(found.at(heights, left), 0.3, atol=0.03)
    np.testing.assert_allclose(found.read(found.spreads, heights, left), 0.0, atol=0.1)
    assert (found.read(found.widths, heights, left) < 0.27).all()  # the row of both has 0.42
    # before the far one begins there is only the near one
    np.testing.assert_allclose(found.at(np.array([-1.4, -1.4]), np.array([-0.35, 0.45])), -0.3, atol=0.03)


def test_what_nothing_shows_is_as_uncertain_as_the_box_is_badly_centered() -> None:
    """Across the picture the smoke's distance from the middle is seen, and in depth it may be as large."""
    floating = column(0.3, low=1.0)
    offset, central = (estimate_axis(seen(np.roll(floating, by, 0)), FRONT, BOX) for by in (6, -3))
    assert (offset.cue, offset.depth) == ("box", 0)
    assert 0.134 < central.deviation < 0.14 < offset.deviation < 0.6
    nothing, given = estimate_axis([], FRONT, BOX), estimate_axis([], FRONT, BOX, base=0.3)
    assert (nothing.cue, nothing.depth, nothing.deviation) == ("box", 0, 0.165)
    assert (given.cue, given.depth, given.deviation) == ("distance", 0.3, 0.165)


def test_a_floor_contact_is_less_certain_the_less_of_it_is_believed() -> None:
    """Before the middle it is believed most; far behind it may be smoke that begins above the floor."""
    before, behind, far = (estimate_axis(rising(depth), FRONT, BOX) for depth in (-0.25, 0.25, 0.6))
    assert before.cue == behind.cue == "floor contact"
    assert far.cue == "box"
    assert before.depth == pytest.approx(-0.2, abs=0.05)
    assert before.deviation < behind.deviation < far.deviation
    assert before.deviation < 0.7 * estimate_axis(seen(column(-0.25, low=1.0)), FRONT, BOX).deviation
