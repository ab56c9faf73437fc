"""What disturbs a take, how a run is scored, and what the report makes of the figures."""

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.disturbances import calls, smoke, spoiled
from benchmarks.disturbances.known import GRID, SIZE, Known
from benchmarks.disturbances.report import Results, losing
from benchmarks.disturbances.table import DISTURBANCES
from benchmarks.disturbances.whole_run import flow_error, whole_run
from smokelift import Camera
from tests.benchmarks.ball import cameras, scene

FPS = 24.0


def blob(moment: int, shape: tuple[int, int, int] = GRID) -> np.ndarray:
    """A ball of smoke that rises."""
    x, y, z = np.meshgrid(*((np.arange(n) + 0.5) / n for n in shape), indexing="ij")
    distance = (x - 0.5) ** 2 + (y - 0.5) ** 2 + 2 * (z - 0.3 - 0.01 * moment) ** 2
    return np.maximum(1 - distance / 0.05, 0).astype(np.float32)


@pytest.fixture(scope="module")
def known() -> Known:
    """Smoke with all its moments, pictured by the renderer."""
    count = spoiled.MOMENTS
    velocities = np.zeros((count, *GRID, 3), np.float32)
    velocities[..., 2] = 0.03 * FPS
    return Known(
        name="ball",
        scene=scene(GRID, SIZE, 1),
        cameras=cameras(SIZE),
        views={},
        densities=np.stack([blob(moment) for moment in range(count)]),
        velocities=velocities,
        inlets=np.zeros((count, *GRID), bool),
        fps=FPS,
    ).pictured()


def moments(take) -> list[int]:
    """Which moments a take of the ball shows."""
    every = {blob(moment).tobytes(): moment for moment in range(spoiled.MOMENTS)}
    return [every[density.tobytes()] for density in take.known.densities]


WHOLE = list(range(spoiled.FIRST, spoiled.MOMENTS))


@pytest.mark.parametrize("make", [spoiled.noise, spoiled.wrong_light, spoiled.blur, spoiled.crushing, spoiled.flicker,
                                  spoiled.saturation, spoiled.missing, spoiled.doubled])  # fmt: skip
def test_without_strength_a_take_is_the_plain_one(known, make) -> None:
    take, plain = make(known, 0), spoiled.taken(spoiled.usual(known))
    np.testing.assert_allclose(take.pictures, plain.pictures, atol=1e-6)
    assert take.given == replace(plain.given, lights=take.given.lights)
    assert np.allclose(take.given.lights[0].direction, known.light.direction)
    assert moments(take) == WHOLE


def test_frames_are_missing_doubled_and_jumped_over(known) -> None:
    first = spoiled.FIRST
    assert moments(spoiled.missing(known, 1 / 3)) == [first, first + 1, first + 3, first + 4]
    assert moments(spoiled.doubled(known, 1 / 3))[:4] == [first, first + 1, first + 2, first + 2]
    take = spoiled.cut(known, 10)
    assert moments(take) == [first - 10, first - 9, first - 8, *WHOLE[3:]]
    assert take.scored == 3
    take = spoiled.clip_length(known, 1)
    assert (moments(take), take.scored) == (WHOLE[-1:], 0)


def test_a_share_of_the_smoke_is_white(known) -> None:
    take = spoiled.saturation(known, 0.3)
    seen = known.front.radiance[WHOLE]
    bright = seen > spoiled.SMOKE * seen.max()
    assert (take.pictures[..., 0][bright] == 1).mean() == pytest.approx(0.3, abs=0.02)
    assert take.given.lights[0].irradiance[0] == pytest.approx(take.gain * known.light.irradiance[0])


def test_a_description_is_wrong_and_the_pictures_are_not(known) -> None:
    plain = spoiled.taken(spoiled.usual(known))
    turned = spoiled.wrong_light(known, 90)
    x, y, z = known.light.direction
    np.testing.assert_allclose(turned.given.lights[0].direction, (-y, x, z), atol=1e-6)
    thicker = spoiled.wrong_extinction(known, 2)
    assert thicker.given.medium.extinction == 2
    assert spoiled.wrong_albedo(known, 2).given.medium.albedo == 1
    assert spoiled.wrong_anisotropy(known, 0.5).given.medium.anisotropy == 0.5
    assert all(np.array_equal(take.pictures, plain.pictures) for take in (turned, thicker))


@pytest.mark.parametrize("depth", [0.01, 10])
def test_smoke_has_its_optical_depth_and_the_exposure_follows(known, depth) -> None:
    take = smoke.optical_depth(known, depth)
    assert -math.log(take.known.front.transmittance.min()) == pytest.approx(depth, rel=0.1)
    assert take.known.front.radiance.max() == pytest.approx(smoke.BRIGHTEST, rel=1e-3)


@pytest.mark.parametrize("name", smoke.EVENTS)
def test_smoke_does_what_an_event_says(known, name) -> None:
    part = spoiled.usual(known)
    done = smoke.EVENTS[name](part)
    mass = done.densities.sum(axis=(1, 2, 3)) / part.densities.sum(axis=(1, 2, 3))
    there = {"slides in": mass[0] == 0 < mass[-1], "appears": mass[0] == 0, "vanishes": mass[-1] == 0,
             "slides out": mass[-1] < 0.5, "fills the box": mass[-1] > 2}  # fmt: skip
    assert there.get(name, np.allclose(mass, 1, rtol=0.05))
    if name in ("stands still", "slides out"):
        speed = done.velocities[1, 0, 0, 0]
        moved = 2 / 8 * FPS if name == "slides out" else 0
        np.testing.assert_allclose(speed, (moved, 0, 0), rtol=1e-5)


def test_a_true_velocity_has_no_error_and_an_unknown_one_none(known) -> None:
    assert flow_error(known, 1, known.velocities[1]) == 0
    assert flow_error(known, 1, 0 * known.velocities[1]) == pytest.approx(1)
    assert flow_error(smoke.EVENTS["splits"](spoiled.usual(known)), 1, known.velocities[1]) is None


def test_a_run_has_its_figures_or_a_refusal(known) -> None:
    part = known.at([14, 15])
    figures = whole_run(spoiled.taken(part), "default")
    assert figures["psnr_0"] > 30
    assert figures["psnr_new"] == figures["psnr_90"] > 15
    assert figures["mass_ratio"] == pytest.approx(1, abs=0.3)
    outside = replace(part.scene, camera=Camera.look_at((0, 0, 1.5), (0, 1, 1.5), fov_y_degrees=30, size=SIZE))
    refused = whole_run(replace(spoiled.taken(part), given=outside), "default")
    assert list(refused) == ["refused"]


def test_calls_need_no_run(known) -> None:
    assert calls.motion(known, 1, "default")["velocity_error"] < 0.7
    ours, papers = ([calls.scaled_density(known, factor, method)["velocity_error"] for factor in (0.01, 1)]
                    for method in ("default", "paper"))  # fmt: skip
    assert ours[0] == pytest.approx(ours[1], rel=0.01)
    assert papers[0] > 0.95 > papers[1]  # its weights hold thin smoke still


def test_where_a_decibel_is_lost() -> None:
    assert losing([0, 1, 2, 4], [0, -0.5, -1.5, -3], 0, False) == [1.5]
    assert losing([0.1, 1, 10], [-2, 0, -2], 1, True) == pytest.approx([10**-0.5, 10**0.5])
    assert losing([0, 1], [0, 0.5], 0, False) == []
    assert losing([0, 1], [0, math.nan], 0, False) == []


def test_changes_are_beside_the_default_undisturbed(tmp_path) -> None:
    results = Results(tmp_path / "stability.csv")
    for method, base in (("default", 25.0), ("paper", 20.0)):
        for strength in DISTURBANCES["missing"].strengths:
            results.add(results.key("missing", strength, "ball", method), {"psnr_new": base - 6 * strength})
    again = Results(tmp_path / "stability.csv")
    assert again.changes("missing", 1 / 3, "default") == pytest.approx([-2])
    assert again.changes("missing", 1 / 3, "paper") == pytest.approx([-7])
    assert again.scenes("noise", "default") == []


def test_every_disturbance_has_the_strengths_that_it_names() -> None:
    for disturbance in DISTURBANCES.values():
        assert {disturbance.undisturbed, *disturbance.common} <= set(disturbance.strengths)
        assert list(disturbance.strengths) == sorted(disturbance.strengths)
        assert len(disturbance.labels) in (0, len(disturbance.strengths))
