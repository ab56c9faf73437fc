"""Workloads: how many voxels may hold smoke is what the run finds."""

from collections.abc import Iterator
from dataclasses import replace

import pytest

from smokelift.footage.clip import Clip
from smokelift.pipeline import Reconstruction, compose
from smokelift.report.cost import MAX_SIDE_VOXELS, Workload
from smokelift.setup.prepare import prepare_shot
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot

SMOOTH = replace(Settings.preset("draft"), detail=0.0)


@pytest.fixture(scope="module")
def shot(plume) -> Iterator[Shot]:
    with Clip.open(plume.scene.clip) as clip:
        yield prepare_shot(clip, plume.scene, SMOOTH)


def shares_of_a_run(shot: Shot) -> list[float]:
    return [frame.figures["hull_share"] for frame in Reconstruction(shot, compose(shot.settings))]


def test_shares_are_those_of_the_run(plume, shot) -> None:
    found, shares = Workload.of(shot, SMOOTH), shares_of_a_run(shot)
    assert found.largest == pytest.approx(max(shares), rel=0.02)
    assert found.mean == pytest.approx(sum(shares) / len(shares), rel=0.1)
    assert (found.frames, found.views, found.pixels) == (len(shares), 1, 40 * 56)


def test_a_large_grid_is_looked_at_coarsely(plume) -> None:
    with Clip.open(plume.scene.clip) as clip:
        shot = prepare_shot(clip, plume.scene, replace(SMOOTH, resolution=(96, 96, 128)))
        assert max(shot.optics.domain.resolution) > MAX_SIDE_VOXELS
        assert 1 < Workload.of(shot, SMOOTH).largest / max(shares_of_a_run(shot)) < 1.4


def test_frames_without_smoke_count_in_the_mean(shot) -> None:
    one = Workload.of(replace(shot, smoky=shot.smoky[:1]), SMOOTH)
    assert one.mean == pytest.approx(one.largest / shot.length)
    none = Workload.of(replace(shot, smoky=()), SMOOTH)
    assert none.largest == none.mean == 0


def test_the_papers_densities_are_anywhere(shot) -> None:
    assert Workload.of(shot, Settings.preset(method="paper")).largest == 1
