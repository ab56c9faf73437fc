"""How much of the density carried along goes into a first guess: as much as the picture bears out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from smokelift.density import DensitySettings, depth_guess, gather_evidence
from smokelift.density.initial import AMOUNTS, Guess, first_guess
from smokelift.footage.plate import Plate
from smokelift.render import render
from smokelift.render.renderer import Volume
from smokelift.scene import Scene

MOST = 0.5


@dataclass(frozen=True, eq=False)
class Moment:
    """A frame of the plume: its picture and static guess, the true density, and that of the frame before."""

    scene: Scene
    image: np.ndarray
    plate: Plate
    static: Volume
    true: Volume
    before: Volume

    def guess(self, carried: Volume, most: float = MOST) -> Guess:
        return first_guess(self.image, self.scene, self.plate, "single", self.static, carried, self.before, most)


@pytest.fixture(scope="module")
def moment(plume) -> Moment:
    """The third frame, before black with the noise of 8 bits."""
    scene, before, true = plume.scene, *plume.densities[1:3]
    image = render(true, scene)
    plate = Plate(np.zeros_like(image), np.ones(image.shape[:2], np.float32), np.full(3, 1e-4))
    static = depth_guess(gather_evidence(image, scene, DensitySettings(), plate), scene)
    return Moment(scene, image, plate, static, true, before)


def test_what_proves_right_is_taken_over(moment) -> None:
    """Carried to where the picture shows it, the density gets nearly all of the share that it may have."""
    guess = moment.guess(moment.true)
    assert 0.9 * MOST < guess.figures["share"] <= MOST
    assert 0.9 * AMOUNTS < guess.figures["amounts"] <= AMOUNTS
    assert np.linalg.norm(guess.density - moment.true) < 0.7 * np.linalg.norm(moment.static - moment.true)


@pytest.mark.parametrize("step", [-3, -1, 8])
def test_a_wrong_motion_is_rejected(moment, step) -> None:
    """Carried downward, or far too fast, the density is no better than left in place, and none of it is taken over."""
    assert moment.guess(np.roll(moment.before, step, axis=2)).figures["share"] == 0


def test_the_better_the_motion_the_more(moment) -> None:
    """Half of the way is worth less than all of it."""
    half = (moment.true + moment.before) / 2
    assert 0 < moment.guess(half).figures["share"] < moment.guess(moment.true).figures["share"]


def test_amounts_that_are_worse_than_the_pictures_own_are_not_taken_over(moment) -> None:
    """With hardly any smoke carried along, or far too much, the static guess stays as it is but for the share."""
    for wrong in (0.02, 12.0):
        guess = moment.guess(np.float32(wrong) * moment.true, most=0.0)
        assert guess.figures["amounts"] == 0
        np.testing.assert_array_equal(guess.density, moment.static)


def test_amounts_go_towards_carried(moment) -> None:
    """Without a share in depth the smoke of every height lies between what the picture alone and what carried says."""
    static, guess, true = (d.sum((0, 1)) for d in (moment.static, moment.guess(moment.true, 0.0).density, moment.true))
    shadowed = true > 1.1 * static
    assert shadowed.sum() > 5
    assert ((guess > static) & (guess < true))[shadowed].all()


@pytest.mark.parametrize("crumpled", [False, True])
def test_what_does_not_look_like_smoke_along_the_rays_is_rejected(moment, crumpled) -> None:
    """The picture hardly tells, but smoke in sheets across the rays is none."""
    carried = moment.true.copy()
    if crumpled:
        carried[:, ::2] *= 2
        carried[:, 1::2] = 0
    figures = moment.guess(carried).figures
    assert (figures["share"] == 0) == crumpled
    assert figures["loss_carried"] < figures["loss_before"]


@pytest.mark.parametrize("empty", ["static", "carried"])
def test_without_smoke_the_static_guess_stays(moment, empty) -> None:
    """Before smoke comes and after it has gone there is nothing to compare."""
    nothing = np.zeros_like(moment.true)
    static, carried = (nothing, moment.true) if empty == "static" else (moment.static, nothing)
    guess = first_guess(moment.image, moment.scene, moment.plate, "single", static, carried, moment.before, MOST)
    np.testing.assert_array_equal(guess.density, static)
    assert guess.figures == {"share": 0.0, "amounts": 0.0}


def test_even_fog_is_no_failure(moment) -> None:
    """Smoke that changes along the rays only, beyond all measure relative to across them, has a finite guess."""
    fog = np.broadcast_to(np.linspace(0.1, 0.2, 24, dtype=np.float32)[:, None], moment.true.shape).copy()
    guess = first_guess(moment.image, moment.scene, moment.plate, "single", fog, fog, moment.before, MOST)
    assert np.isfinite(guess.density).all()
