"""Checks on footage and truth that is not part of the project: a folder ``shared/data`` beside the checkout."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import smokelift
from smokelift.evaluation.metrics import psnr
from smokelift.footage.images import linear_to_srgb
from smokelift.footage.matte import matte
from smokelift.output.vdb import VdbUnavailable, read_vdb, vdb_module
from smokelift.render import Renderer
from smokelift.setup.prepare import prepare_shot

DATA = Path(__file__).parents[3] / "shared" / "data"

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="no shared/data beside this checkout")


@pytest.mark.parametrize("view", ["front", "side", "nov20", "nov45"])
@pytest.mark.parametrize("name", ["plume", "puff"])
def test_render_agrees_with_mitsuba(name, view):
    """The true density, rendered, is within 2 % of the stored images that agree with Mitsuba 3."""
    scene = smokelift.Scene.load(DATA / "synthetic" / name / "scene.toml")
    camera = smokelift.Scene.load(DATA / "synthetic" / name / f"{view}.toml").camera
    with np.load(DATA / "synthetic" / name / "truth.npz") as file:
        densities = file["density"]
    with np.load(DATA / "synthetic" / name / f"{view}.npz") as file:
        images = file["image"]
    renderer = Renderer(camera, scene.domain, scene.medium, scene.lights, np.zeros(3, np.float32))
    for frame in (5, 20, 35):
        expected = images[frame].astype(np.float64)
        error = renderer.image(densities[frame])[..., 0] - expected
        assert np.linalg.norm(error) < 0.02 * np.linalg.norm(expected)


def test_real_plume_before_black(tmp_path):
    """A calibrated real clip: the input view is fitted, and OpenVDB files hold what the arrays say."""
    scene = smokelift.Scene.load(DATA / "scalar_real" / "scene.toml")
    settings = smokelift.Settings.preset("draft")
    try:
        module = vdb_module()
    except VdbUnavailable:
        module = None
    with smokelift.Clip.open(replace(scene.clip, frames=(60, 63))) as clip:
        frames = []
        smokelift.reconstruct(clip, scene, settings).write(tmp_path / "out", npz=True, on_frame=frames.append)
    assert min(frame.figures["psnr_working"] for frame in frames) > 35
    if module is not None:
        density, velocity = read_vdb(tmp_path / "out" / "smoke_0002.vdb", scene.domain)
        half = np.float32(2**-11)
        np.testing.assert_allclose(density, frames[1].density, rtol=half, atol=1e-7)
        near = np.any(velocity != 0, -1)
        np.testing.assert_allclose(velocity[near], frames[1].velocity.centres()[near], rtol=half, atol=1e-6)


def test_real_smoke_before_a_textured_wall():
    """A clip and nothing else: the smoke's part of the picture is fitted."""
    scene = smokelift.Scene.load(DATA / "fluidnexus" / "scene.toml")
    settings = smokelift.Settings.preset("balanced")
    with smokelift.Clip.open(scene.clip) as clip:
        shot = prepare_shot(clip, scene, settings)
        (seen,) = shot.observe(60)
    image, scene = seen.image, replace(shot.scene, camera=seen.camera)
    fitted = smokelift.reconstruct_density(image, scene, settings=settings.density, plate=seen.plate)
    renderer = shot.optics.renderer(seen.camera, seen.plate.image)
    rows, columns = np.nonzero(matte(image, seen.plate).mask)
    box = np.s_[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    rendered = linear_to_srgb(np.clip(renderer.image(fitted.density)[box], 0, 1))
    assert psnr(rendered, linear_to_srgb(image[box])) > 30
