"""Runs of the accuracy benchmark by their names, and the methods without a part."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.accuracy.ablations import EvenDepth, UnprojectedPrediction, WithoutHull, leave_out
from benchmarks.accuracy.runs import run_method, run_settings, run_views
from benchmarks.accuracy.scenes import picture_on_plane
from smokelift.density import DetailedDepth, NothingCarried, Observation, RoundDepth, ViewSet
from smokelift.pipeline import compose
from smokelift.render import Optics
from smokelift.scene import Camera, DirectionalLight, Domain, Medium

CAMERA = Camera.look_at((0, -5, 0), (0, 0, 0), fov_y_degrees=30, size=(16, 16))
OPTICS = Optics(
    Domain((-1, -1, -1), (1, 1, 1), (12, 12, 12)), Medium(2.0), (DirectionalLight((0, 0, -1), (5, 5, 5)),), "single"
)


def test_a_name_says_quality_views_and_changes():
    run = "draft+90+45:transport=0.2,velocity.coarsening=2,resolution=8x9x10"
    settings = run_settings(run)
    assert run_views(run) == ["90", "45"]
    assert (settings.quality, settings.transport, settings.velocity.coarsening) == ("draft", 0.2, 2)
    assert settings.resolution == (8, 9, 10)
    assert run_settings("fine:resolution=auto").resolution == "auto"
    assert run_settings("paper").method == "paper"
    smooth = run_settings("draft:detail=0,seed=3")
    assert (smooth.detail, smooth.seed, settings.detail) == (0, 3, 1)
    with pytest.raises(ValueError, match="draft, balanced, fine"):
        run_settings("best")


def test_a_method_without_a_part_is_a_composition():
    settings = run_settings("draft")
    usual = compose(settings)
    assert leave_out("transport", usual) == replace(usual, temporal_prior=NothingCarried())
    assert leave_out("hull", usual) == replace(usual, density_fit=WithoutHull(usual.density_fit))
    assert leave_out("depth", usual) == replace(usual, depth_prior=EvenDepth())
    assert leave_out("pictures", usual) == replace(usual, optical_flow=False)
    assert isinstance(run_method("draft", settings).depth_prior, DetailedDepth)
    assert isinstance(run_method("draft", replace(settings, detail=0.0)).depth_prior, RoundDepth)
    both = run_method("draft:without=projection,without=pictures", settings)
    assert both.velocity_estimator == UnprojectedPrediction(settings.velocity)
    assert not both.optical_flow
    for run in ("draft:without=luck", "paper:without=projection"):
        with pytest.raises(ValueError, match="transport, hull"):
            run_method(run, run_settings(run))


def test_even_depth_does_not_change_along_the_rays():
    picture = np.zeros((16, 16, 3), np.float32)
    picture[5:11, 4:12] = 0.2
    views = ViewSet.of((Observation(CAMERA, picture),), OPTICS)
    even, round_ = (prior.estimate(views).density for prior in (EvenDepth(), RoundDepth()))
    assert even.max() > 0
    along = even[4:8, :, 5:7]
    assert np.ptp(along, axis=1).max() < 0.05 * along.max() < np.ptp(round_[4:8, :, 5:7], axis=1).max()


def test_a_picture_on_a_screen_is_unchanged_for_its_own_camera():
    picture = np.random.default_rng(0).random((16, 16, 3)).astype(np.float32)
    np.testing.assert_array_equal(picture_on_plane(picture, CAMERA, CAMERA, np.zeros(3)), picture)
