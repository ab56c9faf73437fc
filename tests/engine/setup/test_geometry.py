"""Voxels by measurement, as detail asks for them and blur and noise do not; and the picture that they are fitted to."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from smokelift.checks import Finding
from smokelift.footage.images import linear_to_srgb, srgb_to_linear
from smokelift.scene import Box, Camera, ClipSource, Domain, Scene
from smokelift.scene.camera import project_points, voxel_width
from smokelift.setup.geometry import RINGS, DetailSpectrum, smoke_detail, working_picture
from smokelift.setup.settings import LIMITS, Settings
from smokelift.setup.shot import ShotView
from tests.engine.films import clear_plate, clip_of
from tests.engine.scene.scene_examples import CENTER, DOMAIN, ORTHOGRAPHIC, PERSPECTIVE, TILTED
from tests.engine.setup.shots import geometry_of

SIZE = (192, 256)


def textured(grain: float) -> np.ndarray:
    """A cloud (rows, columns) with details as wide as so many pixels."""
    width, height = SIZE
    rows, columns = np.indices((height, width))
    ball = np.exp(-(((rows - height / 2) / 60) ** 2) - ((columns - width / 2) / 45) ** 2)
    white = np.random.default_rng(1).standard_normal((height, width))
    texture = ndimage.gaussian_filter(white, grain)
    return (0.4 * np.maximum(ball - 0.05, 0) * np.clip(1 + 0.5 * texture / texture.std(), 0, 3)).astype(np.float32)


@pytest.fixture
def filmed(plume, tmp_path) -> Callable[..., Scene]:
    """A clip of two equal pictures, blurred by so many pixels, in a box of 2 x 2 x 3 parts."""

    def film(blur: float, grain: float = 1.2) -> Scene:
        folder = tmp_path / f"{blur}-{grain}"
        clip_of(folder, [ndimage.gaussian_filter(textured(grain), blur)] * 2).close()
        return replace(
            plume.scene,
            clip=ClipSource(folder / "frame_###.png", fps=24.0),
            camera=Camera.look_at((0, -7, 1.5), (0, 0, 1.5), fov_y_degrees=27, size=SIZE),
            domain=Domain((-1, -1, 0), (1, 1, 3), (32, 32, 48)),
        )

    return film


AUTO = Settings.preset("draft", resolution="auto")


def test_a_blurred_clip_gets_a_coarser_grid(filmed) -> None:
    sharp, soft, blurred = (geometry_of(filmed(blur), AUTO) for blur in (0.0, 4.0, 12.0))
    sides = [max(found.domain.resolution) for found in (sharp, soft, blurred)]
    assert sides[0] >= LIMITS["draft"].most - 3
    assert sides[0] > sides[1] >= sides[2]
    assert sides[2] <= 36
    for found in (sharp, soft, blurred):
        (choice,) = (choice for choice in found.findings if choice.about == "resolution")
        assert choice.value == found.domain.resolution
        assert choice.figures["lost_beside_finest"] <= choice.figures["tolerance"]
        assert (choice.kind, choice.source) == ("resolution", "measured")
        assert (found.domain.min, found.domain.max) == ((-1, -1, 0), (1, 1, 3))
        x, y, z = found.domain.resolution
        assert x == y == z / 3 * 2


def test_noise_is_no_detail() -> None:
    """A blurred cloud before gray stays one when the clip is noisy: what is lost is that of the cloud."""
    gray = np.full((256, 192, 3), 0.2, np.float32)
    noise = np.random.default_rng(2).normal(0, 3 / 255, gray.shape)
    clean = gray + ndimage.gaussian_filter(textured(1.2), 8.0)[..., None]
    noisy = srgb_to_linear((linear_to_srgb(clean) + noise).astype(np.float32))
    assert smoke_detail([(clean, clear_plate(gray))], 256).lost(64) < 0.01
    assert smoke_detail([(noisy, clear_plate(gray, 3))], 256).lost(64) < 0.03


def test_a_given_resolution_wins(filmed) -> None:
    scene = filmed(12.0)
    assert geometry_of(scene, Settings.preset("draft")).domain == scene.domain
    for domain, resolution, top in (
        (scene.domain, (20, 20, 30), 3.0),
        (Box((-1, -1, 0), (1, 1, 3)), (20, 20, 30), 3.0),
        (Box((-1, -1, 0), (1, 1, 3)), (20, 20, 40), 4.0),
    ):
        found = geometry_of(replace(scene, domain=domain), Settings.preset("draft", resolution=resolution))
        assert Finding("given", about="resolution", value=resolution, source="given") in found.findings
        np.testing.assert_allclose([found.domain.min, found.domain.max], [(-1, -1, 0), (1, 1, top)], atol=1e-9)


@pytest.mark.parametrize("size", [(2, 2, 3), (1.97, 2, 2.9)])
def test_a_box_without_a_resolution_gets_that_of_the_quality(filmed, size) -> None:
    box = Box((-size[0] / 2, -1, 0), (size[0] / 2, 1, size[2]))
    scene = replace(filmed(0.0), domain=box)
    found = geometry_of(scene, Settings.preset("draft"))
    domain = found.domain
    assert LIMITS["draft"].most - 8 <= max(domain.resolution) <= LIMITS["draft"].most
    assert [each.source for each in found.findings if each.about == "resolution"] == ["measured"]
    over = np.subtract(domain.max, box.max)
    assert np.all((over > -1e-6) & (over < domain.voxel_size)) and domain.min[2] == 0
    assert (np.abs(over).max() > 1e-6) == ("grown box" in [remark.kind for remark in found.findings])


@pytest.mark.parametrize("box", [True, False])
def test_final_has_a_voxel_a_pixel(filmed, box) -> None:
    """Of a sharp clip, in a box that is given or found; of a blurred one fewer, and it loses nothing."""
    for blur in (0.0, 12.0):
        scene = filmed(blur, grain=0.3)
        scene = scene if box else Scene(clip=scene.clip, background=scene.background)
        found = geometry_of(scene, Settings.preset("final", resolution="auto"))
        (choice,) = (choice for choice in found.findings if choice.about == "resolution")
        pixels = choice.figures["pixels"]
        across = voxel_width(found.camera, found.domain) * max(choice.value)
        assert pixels == pytest.approx(across, rel=1e-3)
        if blur:
            assert max(choice.value) < 0.6 * pixels
        else:
            assert max(choice.value) == pytest.approx(pixels, rel=0.05)
        assert choice.figures["lost"] < 0.005


def test_a_grid_loses_what_is_finer_than_two_of_its_voxels() -> None:
    """A wave of six pixels is there with voxels of three and not with four; what there is not is not lost."""
    columns = np.indices((192, 192))[1]
    wave = (0.3 + 0.1 * np.cos(2 * np.pi * (columns + 0.5) / 6)).astype(np.float32)
    picture = np.repeat(wave[..., None], 3, -1)
    detail = smoke_detail([(picture, clear_plate(0 * picture))], 192)
    assert detail.lost(192 // 3 + 4) < 0.05
    assert detail.lost(192 // 4) > 0.1
    assert detail.lost(192) == detail.lost(192 // 4, 192 // 4) == 0
    assert detail.lost(100, 192) < 0.01
    assert detail.lost(192 // 4, 192) == detail.lost(192 // 4)
    assert DetailSpectrum(np.zeros(RINGS), 64).lost(32) == 0


both = pytest.mark.parametrize("camera", [PERSPECTIVE, ORTHOGRAPHIC])


@both
def test_a_working_pixel_is_a_voxel_wide_at_the_center(camera) -> None:
    small = working_picture(camera, DOMAIN).camera
    h = DOMAIN.voxel_size
    origin, _ = project_points(small, CENTER)
    for step in ((h, 0, 0), (0, 0, h)):
        moved, _ = project_points(small, CENTER + np.array(step))
        assert np.linalg.norm(moved - origin) == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize("camera", [PERSPECTIVE, ORTHOGRAPHIC, TILTED])
def test_points_fall_to_the_same_place_of_both_pictures(camera) -> None:
    work = working_picture(camera, DOMAIN)
    points = np.random.default_rng(1).uniform(DOMAIN.min, DOMAIN.max, (50, 3))
    full, depth = project_points(camera, points)
    small, small_depth = project_points(work.camera, points)
    shrink = np.array(work.camera.size) / (work.width, work.height)
    np.testing.assert_allclose(small, (full - (work.left, work.top)) * shrink, atol=1e-9)
    np.testing.assert_allclose(small_depth, depth)
    assert (small >= 0).all()
    assert (small <= work.camera.size).all()


@both
def test_the_cut_shows_what_the_small_camera_sees(camera) -> None:
    """A picture whose values are its own coordinates, cut, reads right at the projections of world points."""
    work = working_picture(camera, DOMAIN)
    width, height = camera.size
    y, x = np.mgrid[:height, :width] + 0.5
    cut = work.cut(np.stack([x, y], -1).astype(np.float32))
    columns, rows = work.camera.size
    assert cut.shape == (rows, columns, 2)
    small_y, small_x = np.mgrid[:rows, :columns] + 0.5
    across, down = work.width / columns, work.height / rows
    np.testing.assert_allclose(cut[..., 0], work.left + small_x * across, atol=0.05)
    np.testing.assert_allclose(cut[..., 1], work.top + small_y * down, atol=0.05)


@both
def test_coarse_footage_is_not_enlarged(camera) -> None:
    work = working_picture(camera.resized(20, 28), DOMAIN)
    assert work.camera.size == (work.width, work.height)
    assert work.width <= 20


@both
def test_a_domain_outside_the_view_is_refused(camera) -> None:
    beside = Domain((9.4, -0.6, 0), (10.6, 0.6, 1.6), (24, 24, 32))
    assert working_picture(camera, beside) is None
    with pytest.raises(ValueError, match="domain"):
        ShotView.facing(beside, None, camera, None, None)
