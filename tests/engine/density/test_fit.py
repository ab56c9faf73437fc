"""Density from one picture: hull, depth profile, fit and descent, and what is refused."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

import smokelift._core as _core
from smokelift.density import DensitySettings, Observation, ObservedView, reconstruct_density
from smokelift.density.descent import BLOCK, SHARED, descend
from smokelift.density.hull import common_hull, project_voxels, visual_hull
from smokelift.density.multiplicative import fit_multiplicative, take_turns
from smokelift.density.objective import Fit, Term
from smokelift.evaluation.metrics import psnr
from smokelift.extraction.plate import Plate
from smokelift.footage.images import linear_to_srgb, srgb_to_linear
from smokelift.footage.noise import EIGHT_BIT_NOISE, lasting_noise, linear_per_srgb
from smokelift.render import render, scene_optics
from smokelift.scene import Background, Camera, DirectionalLight, Domain, Medium, Scene, completed, orbit

QUICK = DensitySettings(fit_iterations=4, descent_iterations=6)
FRONT = Camera.look_at((0, -4, 0.8), (0, 0, 0.8), fov_y_degrees=30, size=(24, 32)).matrix
GRID = Camera("orthographic", FRONT, (24, 32), 20.0, 20.0, 12.0, 16.0)
"""Sees each column of voxels along y in one pixel of its own."""


def noisy_plate(picture: np.ndarray) -> Plate:
    """A background known to one step of 8 bits."""
    rows, columns = picture.shape[:2]
    slope = linear_per_srgb(linear_to_srgb(np.median(picture, axis=(0, 1))))
    return Plate(picture.astype(np.float32), np.ones((rows, columns), np.float32), lasting_noise(1e-3 / slope))


@pytest.mark.parametrize("camera", ["grid", "scene"])
def test_every_voxel_of_the_smoke_is_in_the_hull(plume, small, camera) -> None:
    scene = replace(small, camera=GRID) if camera == "grid" else small
    density = plume.densities[1]
    hull = visual_hull(render(density, scene).max(-1) > 0, project_voxels(scene.camera, scene.domain))
    assert hull[density > 0].all()
    assert hull.mean() < 0.7


# a faint rim


def test_a_faint_rim_fades() -> None:
    """A veil of 6 codes in noise of one fades to nothing beside thick smoke: most of its light stays, without a step in
    it or beads along the hull."""
    camera = Camera("orthographic", FRONT, (72, 32), 20.0, 20.0, 36.0, 16.0)
    scene = Scene(
        camera=camera,
        domain=Domain((-1.2, -0.6, 0), (1.2, 0.6, 1.6), (48, 24, 32)),
        medium=Medium(extinction=8.0),
        lights=(DirectionalLight((0.3, 0.8, -0.4), (12.0, 12.0, 12.0)),),
    )
    columns = np.arange(72)
    codes = np.where(columns < 24, 130 * (columns >= 16), 6 * np.clip((54 - columns) / 30, 0, 1)) * np.ones((32, 1))
    codes[[0, 1, 2, -3, -2, -1]] = 0
    black = srgb_to_linear(np.float32(4 / 255))
    code = float(srgb_to_linear(np.float32(5 / 255)) - black)
    filmed = np.rint(np.random.default_rng(0).normal(4 + codes, 1)).clip(0)[..., None].repeat(3, -1)
    plate = Plate(np.full((32, 72, 3), black, np.float32), np.ones((32, 72), np.float32), EIGHT_BIT_NOISE)
    found = reconstruct_density(srgb_to_linear((filmed / 255).astype(np.float32)), scene, settings=QUICK, plate=plate)
    before = replace(scene, background=Background(color=(float(black),) * 3))
    shown = (render(found.density, before)[5:-5, :, 0] - black).mean(0) / code
    assert 0.75 < shown[25:].sum() / codes[16, 25:].sum() < 1.1
    assert np.abs(np.diff(shown[26:60])).max() < 1.5
    for height in range(8, 24):
        across = np.flatnonzero(found.hull[:, :, height].any(1))
        densest = found.density[:, :, height].max(1)[across]
        assert densest[-3:].max() < np.median(densest[-9:-4])


def test_smoke_fades_where_none_is_expected_in_depth(plume, small) -> None:
    found = reconstruct_density(render(plume.densities[1], small), small, settings=QUICK)
    deep = found.hull.sum(1) >= 8
    first, last = found.hull.argmax(1)[deep], 23 - found.hull[:, ::-1].argmax(1)[deep]
    rays = np.moveaxis(found.density, 1, 2)[deep]
    ends = sum(np.take_along_axis(rays, at[:, None], 1)[:, 0] for at in (first, last))
    assert ends.sum() < 0.002 * rays.sum()


def test_smoke_through_floor_and_ceiling_makes_no_spikes() -> None:
    """A column of density 1 as high as the box is not much denser at its ends, where rays cross few of its voxels."""
    scene = Scene(
        camera=Camera.look_at((0, -7, 1.5), (0, 0, 1.5), fov_y_degrees=30, size=(75, 113)),
        domain=Domain((-1, -1, 0), (1, 1, 3), (32, 32, 48)),
        medium=Medium(extinction=5.0, albedo=0.9),
        lights=(DirectionalLight((-0.6, 0.4, -0.7), (8.0, 8.0, 8.0)),),
    )
    x = (np.arange(32) + 0.5) / 16 - 1
    column = np.repeat(((x[:, None] ** 2 + x**2) < 0.06)[..., None], 48, 2).astype(np.float32)
    layers = reconstruct_density(render(column, scene), scene).density.max((0, 1))
    assert layers.max() < 1.4


# fit and descent


def term_of(scene: Scene, observation: Observation, hull: np.ndarray | None = None) -> Term:
    """A picture before black to be fitted, every pixel counted alike."""
    optics = scene_optics(completed(scene))
    black = noisy_plate(np.zeros_like(observation.image))
    view = ObservedView.of(replace(observation, plate=black), optics)
    renderer = optics.renderer(view.camera, black.image, hull)
    return Term(view, renderer, np.ones(view.mask.shape, np.float32))


def filled(density: np.ndarray) -> _core.MarkedVoxels:
    """The voxels that hold any of it."""
    return _core.MarkedVoxels(density > 0)


@pytest.mark.parametrize("before", [0.5, 2.0])
def test_steps_lead_towards_plausible_smoke(plume, small, before) -> None:
    """Of smoke in two halves in depth, the half that plausible smoke has more of gains more and loses less.

    The picture is fitted all the same.
    """
    truth = plume.densities[1]
    plausible = truth.copy()
    plausible[:, :12] *= 0.5
    plausible[:, 12:] *= 1.5
    term = term_of(small, Observation(small.camera, render(truth, small)))
    even, uneven = (
        fit_multiplicative([term], np.float32(before) * truth, 6, 0.0, filled(truth), each)
        for each in (None, plausible)
    )
    front, back = (
        np.sum([fit.density[:, half] for fit in (even, uneven)], axis=(1, 2, 3))
        for half in (slice(None, 12), slice(12, None))
    )
    assert back[1] / front[1] > 1.15 * back[0] / front[0]
    assert uneven.loss < 1.2 * even.loss


@pytest.mark.parametrize("even", [True, False])
def test_compiled_steps_are_those_of_the_formula(even) -> None:
    domain = Domain((-1, -0.5, -1), (1, 0.5, 1), (40, 20, 40))  # wider than the picture
    random, projection = np.random.default_rng(0), project_voxels(GRID, domain)
    marked = random.random(domain.resolution) > 0.3
    voxels, places = _core.MarkedVoxels(marked), projection.places(marked)
    values, plausible = random.lognormal(size=(2, voxels.count)).astype(np.float32)
    picture, visible = random.normal(size=(32, 24)).astype(np.float32), places.visible
    assert 0 < np.count_nonzero(visible) < voxels.count
    step = np.where(visible, places.read(picture), 0)
    if not even:
        gain = (plausible + 0.1) / (values * np.exp(step) + 0.1)
        step *= np.minimum(np.where(step < 0, 1 / gain, gain), 2)
    found = np.empty_like(values)
    voxels.scale_along_rays(projection.map, values, None if even else plausible, picture, 0.1, 2.0, 0.9, found)
    np.testing.assert_allclose(found, values * np.exp(0.9 * step), rtol=1e-5)
    np.testing.assert_array_equal(found[~visible], values[~visible])


@pytest.mark.parametrize(("scattering", "behind"), [("single", 0.0), ("absorption", 0.5)])
def test_turns_meet_every_picture(plume, small, scattering, behind) -> None:
    """Each round brings both pictures nearer, whether or not smoke scatters light; no round changes nothing."""
    scene = replace(small, scattering=scattering, background=Background(color=(behind,) * 3))
    optics = scene_optics(completed(scene))
    plate = noisy_plate(np.full((42, 30, 3), behind))
    terms = []
    for degrees in (90.0, 0.0):
        camera = orbit(scene.camera, scene.domain, degrees)
        view = ObservedView.of(Observation(camera, render(plume.densities[1], scene, camera), plate), optics)
        terms.append(Term(view, optics.renderer(camera, plate.image), np.ones(view.mask.shape, np.float32)))
        assert terms[-1].renderer.absorbs_only == (scattering == "absorption")
    start = 0.5 * plume.densities[1]

    def losses(density: np.ndarray) -> list[float]:
        return [term.loss(term.renderer.image(density) - term.view.image) for term in terms]

    after, density = [losses(start)], start
    for _ in range(4):
        density = take_turns(terms, density, filled(start))
        after.append(losses(density))
    assert all(b < a for one, two in itertools.pairwise(after) for a, b in zip(one, two, strict=True))
    assert sum(after[-1]) < 0.1 * sum(after[0])


def even_start(density: np.ndarray, scene: Scene) -> tuple[Term, np.ndarray, np.ndarray]:
    """The picture of a density, noiseless, to descend to; its hull; and thin smoke all over that, to start from."""
    target = render(density, scene)
    hull = visual_hull(target.max(-1) > 0.01, project_voxels(scene.camera, scene.domain))
    term = term_of(scene, Observation(scene.camera, target), hull)
    exact = replace(term.view, noise=np.zeros_like(term.view.noise))
    return replace(term, view=exact), _core.MarkedVoxels(hull), np.where(hull, np.float32(0.02), np.float32(0))


def descended(term: Term, hull: _core.MarkedVoxels, start: np.ndarray, steps: int, bound: float = np.inf) -> Fit:
    """So many steps of descent from a start where no prior says anything."""
    return descend([term], start.copy(), hull, steps, 0.0, 2, bound=bound, expected=np.ones_like(start))


@pytest.mark.parametrize("thickness", [1.0, 30.0])
def test_descent_never_raises_the_loss(plume, small, thickness) -> None:
    """Each further step leaves the picture as near or nearer, in thick smoke too, where bare steps overshoot."""
    scene = replace(small, medium=replace(small.medium, extinction=thickness * small.medium.extinction))
    term, hull, start = even_start(plume.densities[1], scene)
    losses = [descended(term, hull, start, steps).loss for steps in range(20)]
    assert all(after <= before for before, after in itertools.pairwise(losses))
    assert losses[-1] < 0.3 * losses[0]


def test_descent_makes_nothing_denser_than_it_may_be(plume, small) -> None:
    term, hull, start = even_start(plume.densities[1], small)
    free = descended(term, hull, start, 20)
    most = 0.5 * float(free.density.max())
    bound = descended(term, hull, start, 20, most)
    assert bound.density.max() == pytest.approx(most)
    assert free.loss < bound.loss < 0.5 * descended(term, hull, start, 0).loss


def test_neighbors_share_a_step() -> None:
    """What one voxel wants reaches its cube, evenly both ways, and what all want alike stays as it is."""
    shape, random = (9, 7, 8), np.random.default_rng(5)
    where = _core.MarkedVoxels(random.random(shape) < 0.7)
    one, other = random.standard_normal((2, where.count)).astype(np.float32)

    def shared(values: np.ndarray) -> np.ndarray:
        result = np.empty_like(values)
        where.smooth_in_cubes(values, BLOCK, SHARED, result)
        return result

    np.testing.assert_allclose(shared(np.ones_like(one)), 1, rtol=1e-6)
    np.testing.assert_allclose(one @ shared(other), shared(one) @ other, rtol=1e-4)
    alone = np.zeros_like(one)
    alone[0] = 1
    assert 1 < np.count_nonzero(shared(alone)) < where.count


def test_the_figures_are_those_of_the_density(plume, small) -> None:
    """The loss is what a render of the result shows, the PSNR that of the pixels that the hull can change."""
    target = render(plume.densities[1], small)
    found = reconstruct_density(target, small, settings=QUICK)
    error = np.square(render(found.density, small) - target, dtype=np.float64)
    assert found.figures["loss"] == pytest.approx(error.sum(), rel=1e-3)
    pixels = error.sum() / 3 * 10 ** (found.figures["psnr"] / 10)
    assert np.count_nonzero(render(found.density, small).any(-1)) <= 1.01 * pixels < error[..., 0].size
    assert found.figures["hull_share"] == pytest.approx(found.hull.mean())


@pytest.mark.parametrize("scattering", ["single", "unshadowed", "absorption"])
def test_every_model_of_scattering_is_met(plume, small, scattering) -> None:
    scene = replace(small, medium=Medium(extinction=4.0), background=Background(color=(0.1, 0.1, 0.1)))
    target = render(plume.densities[1], replace(scene, scattering=scattering))
    found = reconstruct_density(target, replace(scene, scattering=scattering), settings=QUICK)
    assert found.figures["psnr"] >= 35
    assert found.density.sum() == pytest.approx(plume.densities[1].sum(), rel=0.15)


def test_an_initial_density_is_used(plume, small) -> None:
    truth = plume.densities[1]
    target = render(truth, small)
    found = reconstruct_density(target, small, truth, QUICK).density
    assert np.abs(found - truth).max() < 0.1 * truth.max()


def test_an_empty_picture_gives_zeros(small) -> None:
    nothing = np.zeros((42, 30, 3), np.float32)
    full = np.ones(small.domain.resolution, np.float32)
    for initial in (None, full):
        found = reconstruct_density(nothing, small, initial)
        assert not found.density.any()
        assert found.figures["hull_share"] == 0


# several views


def observed(density: np.ndarray, scene: Scene, degrees: float) -> Observation:
    """What a camera sees that was carried around the box."""
    camera = orbit(scene.camera, scene.domain, degrees)
    return Observation(camera, render(density, scene, camera))


def mean_place(density: np.ndarray) -> np.ndarray:
    """Center of mass, in voxels."""
    return np.average(np.indices(density.shape).reshape(3, -1), axis=1, weights=density.ravel())


@pytest.mark.parametrize("degrees", [40.0, 90.0])
def test_a_second_view_tells_the_depth(plume, small, degrees) -> None:
    """Smoke off the middle of the box stands where it stood, which one picture cannot know; all pictures are fitted."""
    truth = np.roll(plume.densities[1], 5, axis=1)  # further away from the camera
    target = render(truth, small)
    alone = reconstruct_density(target, small).density
    found = reconstruct_density(target, small, views=[observed(truth, small, degrees)])
    assert mean_place(alone)[1] < mean_place(truth)[1] - 4
    np.testing.assert_allclose(mean_place(found.density), mean_place(truth), atol=0.5)
    assert min(found.figures["psnr"], found.figures["psnr_view_1"]) > 35
    new = orbit(small.camera, small.domain, degrees / 2)
    assert psnr(render(found.density, small, new), render(truth, small, new)) > 30
    assert np.abs(found.density - truth).sum() < 0.5 * np.abs(alone - truth).sum()


def test_a_view_says_nothing_about_what_it_does_not_show(plume, small) -> None:
    half = replace(GRID, size=(12, 32))
    projections = [project_voxels(camera, plume.scene.domain) for camera in (GRID, half)]
    masks = [np.ones((32, 24), np.bool_), np.zeros((32, 12), np.bool_)]
    hull = common_hull(masks, projections)
    assert not hull[:12].any()
    assert hull[12:].all()
    camera = small.camera.cropped(0, 0, 30, 21)
    upper = Observation(camera, render(plume.densities[1], small, camera))
    found = reconstruct_density(render(plume.densities[1], small), small, views=[upper])
    assert found.figures["psnr"] > 35


def test_what_views_disagree_about_is_not_put_where_only_one_looks(plume, small) -> None:
    """A darker second camera that shows all smoke, but not the box's far side: nothing gathers there."""
    side = orbit(small.camera, small.domain, 90).cropped(0, 0, 23, 42)
    darker = Observation(side, 0.7 * render(plume.densities[1], small, side))
    beside = ~project_voxels(side, small.domain).visible
    assert not plume.densities[1][beside].any()
    found = reconstruct_density(render(plume.densities[1], small), small, views=[darker]).density
    assert found[beside].sum() < 0.01 * found.sum()


# what is refused


def test_a_view_of_another_size_or_that_moves_is_refused(plume, small) -> None:
    target = render(plume.densities[1], small)
    side = observed(plume.densities[1], small, 90)
    with pytest.raises(ValueError, match=r"\(42, 30, 3\)"):
        reconstruct_density(target, small, views=[replace(side, image=side.image[1:])])
    moving = replace(side.camera, matrices=(side.camera.matrix, side.camera.matrix))
    with pytest.raises(ValueError, match="camera"):
        reconstruct_density(target, small, views=[replace(side, camera=moving)])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"image": np.full((42, 30, 3), np.nan)}, "not finite"),
        ({"image": np.zeros((30, 42, 3))}, r"\(42, 30, 3\)"),
        ({"image": np.zeros((42, 30))}, r"\(42, 30, 3\)"),
        ({"initial": np.full((24, 24, 32), -1e-3)}, "holds negative"),
        ({"initial": np.full((24, 24, 32), np.nan)}, "finite"),
        ({"initial": np.zeros((24, 24, 31))}, "shape"),
        ({"camera": None}, "no camera"),
        ({"domain": None}, "no domain"),
        ({"camera": Camera.look_at((0, 0, 0.8), (0, 1, 0.8), fov_y_degrees=30, size=(30, 42))}, "stands inside"),
    ],
)
def test_what_cannot_be_fitted_is_refused(small, change, words) -> None:
    given = {"image": np.zeros((42, 30, 3), np.float32)} | change
    scene = replace(small, **{name: given.pop(name) for name in ("camera", "domain") if name in given})
    with pytest.raises(ValueError, match=words):
        reconstruct_density(scene=scene, **given)


def test_thick_smoke_before_something_as_bright_as_its_lit_side(small) -> None:
    """Its shadow is darker than the background and its light brighter: it was thinned out until nothing was left."""
    x, y, z = small.domain.offsets(small.domain.centre)
    smoke = np.float32(2) * (x**2 + y**2 + z**2 < 0.3**2)
    lit = replace(small, lights=(DirectionalLight((-0.8, 0.4, -0.5), (9, 8, 7)),), medium=Medium(20.0, 0.9))
    alone = render(smoke, replace(lit, background=Background(color=(0, 0, 0))))
    scene = replace(lit, background=Background(color=tuple(np.percentile(alone[alone[..., 0] > 0.01], 90, axis=0))))
    found = reconstruct_density(render(smoke, scene), scene)
    assert found.figures["relative_error"] < 0.3
    assert found.density.sum() > 0.5 * smoke.sum()


@pytest.mark.parametrize("resolution", [(1, 1, 1), (1, 1, 2), (3, 1, 1), (1, 2, 3)])
def test_a_grid_of_a_few_voxels(resolution) -> None:
    domain = Domain((0, 0, 0), tuple(0.5 * n for n in resolution), resolution)
    camera = Camera.look_at((0.2, -4, 0.4), domain.centre, fov_y_degrees=30, size=(24, 24))
    scene = Scene(
        camera=camera,
        domain=domain,
        lights=(DirectionalLight((0, 1, -1), (9, 9, 9)),),
        background=Background(color=(0, 0, 0)),
    )
    smoke = np.full(resolution, 0.5, np.float32)
    picture = render(smoke, scene)
    found = reconstruct_density(picture, scene, settings=QUICK)
    assert np.isfinite(found.density).all()
    assert np.square(render(found.density, scene) - picture).sum() < np.square(picture).sum()
