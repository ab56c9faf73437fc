"""The fit at the clip's own pixels: exact where rays are sampled, and blind to nothing that the grid lacks."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from smokelift import Clip, ClipSource, Reconstruction, Scene, Shot, prepare_shot, reconstruct, render
from smokelift.extraction.matte import matte
from smokelift.pipeline import compose
from smokelift.pipeline.clip_fit import beside_clip, clip_psnr
from tests.engine.conftest import Plume
from tests.engine.films import clip_of

SHARPER = 6
"""Pixels of the clip along one of the plume's."""


@pytest.fixture(scope="module")
def sharp(plume, tmp_path_factory) -> Plume:
    """The plume's first frames with more pixels than its grid has voxels, and a fine grain in the smoke."""
    folder = tmp_path_factory.mktemp("sharp")
    width, height = plume.scene.camera.size
    camera = plume.scene.camera.resized(SHARPER * width, SHARPER * height)
    scene = replace(plume.scene, camera=camera)
    grain = 1 + np.random.default_rng(3).normal(0, 0.15, (*camera.size[::-1], 1))
    clip_of(folder, (render(density, scene) * grain for density in plume.densities[:3]), suffix=".exr").close()
    return replace(plume, scene=replace(scene, clip=ClipSource(folder / "frame_###.exr", fps=24.0)))


@pytest.fixture(scope="module")
def shot(sharp, draft) -> Iterator[Shot]:
    with Clip.open(sharp.scene.clip) as clip:
        yield prepare_shot(clip, sharp.scene, draft)


def test_all_pixels_are_those_of_the_clips_camera(shot, sharp) -> None:
    beside = beside_clip(shot.views[0], shot.optics, 1, sharp.densities[1], step=1)
    part = shot.views[0].working.part
    whole = render(sharp.densities[1], sharp.scene)
    np.testing.assert_allclose(beside.shown, part(whole), atol=1e-5)
    np.testing.assert_array_equal(beside.seen, part(shot.clip.frame(1)))
    plate = shot.views[0].plate.at(1).through(part)
    smoke = matte(beside.seen, plate).mask
    assert np.count_nonzero(beside.inside & smoke) > 0.9 * np.count_nonzero(beside.inside | smoke)
    wanted = -10 * np.log10(np.square(beside.seen - beside.shown)[beside.inside].mean())
    assert beside.psnr == pytest.approx(wanted, abs=1e-3)
    # the truth is as good as the clip's grain lets it be
    grain = np.square(0.15 * beside.shown)[beside.inside].mean()
    assert beside.psnr == pytest.approx(-10 * np.log10(grain), abs=0.1)
    assert clip_psnr(shot, 1, sharp.densities[1])["psnr"] == pytest.approx(beside.psnr, abs=1)


@pytest.mark.parametrize("step", [3, 5])
def test_rays_between_pixels_are_left_out_and_none_is_moved(shot, sharp, step) -> None:
    every, some = (beside_clip(shot.views[0], shot.optics, 1, sharp.densities[1], n) for n in (1, step))
    rows, columns = every.inside.shape
    down, right = (n % step // 2 + step // 2 for n in (rows, columns))
    for name in ("seen", "shown", "inside"):
        wanted = getattr(every, name)[down::step, right::step][: rows // step, : columns // step]
        np.testing.assert_allclose(getattr(some, name), wanted, atol=1e-5, err_msg=name)
    assert some.psnr == pytest.approx(every.psnr, abs=0.5)


def test_detail_that_the_grid_lacks_counts(sharp, draft) -> None:
    with Clip.open(sharp.scene.clip) as clip:
        for frame in reconstruct(clip, sharp.scene, draft):
            assert 15 < frame.figures["psnr"] < frame.figures["psnr_working"] - 5


def test_no_smoke_has_no_figure(plume, draft, tmp_path) -> None:
    """Nor has a frame whose picture shows nothing; one in which a density is missing has a bad one."""
    nothing = np.zeros_like(plume.densities[0])
    scene: Scene = plume.write(tmp_path, [plume.densities[1], nothing])
    with Clip.open(scene.clip) as clip:
        shot = prepare_shot(clip, scene, draft)
        assert clip_psnr(shot, 1, nothing) == {}
        assert clip_psnr(shot, 0, nothing)["psnr"] < 25
        figures = [frame.figures for frame in Reconstruction(shot, compose(shot.settings))]
    assert ["psnr" in each for each in figures] == ["psnr_working" in each for each in figures] == [True, False]
