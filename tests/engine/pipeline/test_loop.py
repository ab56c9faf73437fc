"""The whole loop on a tiny plume: it fits its footage, moves upward, and can be cut off and gone on with."""

import weakref
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from threadpoolctl import ThreadpoolController, threadpool_limits

from smokelift import Clip, Sequence, Settings, Velocity, prepare_shot
from smokelift.baselines.paper_method import FixedRateDescent
from smokelift.density import GradientFit, Start, ViewSet
from smokelift.density.hull import project_voxels
from smokelift.evaluation.metrics import psnr
from smokelift.footage.image_files import read_image
from smokelift.output.images import write_image
from smokelift.output.index import SequenceError
from smokelift.pipeline import Frame, Method, Reconstruction, compose, reconstruct
from smokelift.pipeline.reconstruction import sources
from smokelift.render import render, scene_renderer
from smokelift.scene import Background, ClipSource, DirectionalLight, Inlet, Scene, completed, look_at_matrix
from smokelift.velocity import CoarseToFine, DensityPair
from tests.engine.setup.shots import burning


def frames_of(scene: Scene, settings: Settings, method: Method | None = None, count: int | None = None) -> list[Frame]:
    """The frames of a run, or the first of them."""
    with Clip.open(scene.clip) as clip:
        return list(islice(reconstruct(clip, scene, settings, method=method), count))


def frames_written(scene: Scene, settings: Settings, out: Path, resume: bool = False) -> list[Frame]:
    """The frames that a run writes."""
    frames: list[Frame] = []
    with Clip.open(scene.clip) as clip:
        reconstruct(clip, scene, settings).write(out, npz=True, resume=resume, on_frame=frames.append)
    return frames


def cut_off(scene: Scene, settings: Settings, out: Path, count: int) -> None:
    """A run that ends after so many frames."""

    def cancel(frame: Frame) -> None:
        if frame.number == count:
            raise KeyboardInterrupt

    with Clip.open(scene.clip) as clip, pytest.raises(KeyboardInterrupt):
        reconstruct(clip, scene, settings).write(out, npz=True, on_frame=cancel)


def saved(directory: Path) -> dict[str, np.ndarray]:
    """Every array of every NumPy file, by name."""
    files = {path.name: dict(np.load(path)) for path in sorted(directory.glob("*.npz"))}
    return {f"{file}/{name}": array for file, arrays in files.items() for name, array in arrays.items()}


def goes_on_exactly(scene: Scene, settings: Settings, out: Path, count: int, uninterrupted: Path) -> None:
    """Cut a run off after so many frames and go on with it; fails unless it writes what another did in one go."""
    cut_off(scene, settings, out, count)
    assert Sequence.open(out).frames == tuple(range(1, count + 1))
    assert not Sequence.open(out).complete
    rest = frames_written(scene, settings, out, resume=True)
    whole = Sequence.open(uninterrupted).frames
    assert [frame.number for frame in rest] == list(whole[count:])
    wanted, found = saved(uninterrupted), saved(out)
    assert found.keys() == wanted.keys()
    for name, value in wanted.items():
        np.testing.assert_array_equal(found[name], value, err_msg=name)


@pytest.fixture(scope="module")
def run(plume, draft, tmp_path_factory) -> tuple[list[Frame], Path]:
    """An uninterrupted run: its frames, and where they were written."""
    out = tmp_path_factory.mktemp("run") / "out"
    return frames_written(plume.scene, draft, out), out


@pytest.fixture(scope="module")
def along_the_path(tracked, draft, tmp_path_factory) -> tuple[list[Frame], Path]:
    """The frames from a camera that moves, and where they were written."""
    out = tmp_path_factory.mktemp("path") / "out"
    return frames_written(tracked, draft, out), out


@pytest.fixture(scope="module")
def coarse(plume) -> Scene:
    """The plume on a grid half as fine, for what asks nothing of its figures."""
    return replace(plume.scene, domain=replace(plume.scene.domain, resolution=(12, 12, 16)))


def test_density_is_carried_from_the_third_frame_on(run, plume, draft) -> None:
    """It is most of the start, since detail is made up once, and a frame says how much it took over."""
    alone = frames_of(plume.scene, replace(draft, transport=0.0), count=3)
    for one, carried in zip(alone, run[0][:3], strict=True):
        assert np.array_equal(one.density, carried.density) == (one.number <= 2)
    taken = [frame.figures["transport"] for frame in run[0]]
    assert taken[:2] == [{}, {}]
    assert all(0.5 < figures["share"] < 1 for figures in taken[2:])


def test_picture_mass_and_motion_are_about_right(run, plume) -> None:
    """One picture bounds the smoke's mass within a factor of two, and the figure says the volume's."""
    cell = plume.scene.domain.voxel_size**3
    with Clip.open(plume.scene.clip) as clip:
        speed = 0.075 * clip.fps
        for frame, truth in zip(run[0], plume.densities, strict=True):
            assert psnr(render(frame.density, plume.scene), clip.frame(frame.number - 1)) >= 35
            assert frame.figures["psnr"] >= 35
            assert frame.density.sum() == pytest.approx(truth.sum(), rel=0.5)
            assert frame.figures["mass"] == pytest.approx(float(frame.density.sum()) * cell, rel=1e-4)
            mean = np.average(frame.velocity.centres().reshape(-1, 3), axis=0, weights=frame.density.ravel())
            assert 0.5 * speed < mean[2] < 1.5 * speed
            assert np.abs(mean[:2]).max() < 0.3 * speed


def test_walls_and_inlets_of_the_scene_are_kept(coarse, draft, tmp_path) -> None:
    """And a run that is complete is not computed again."""
    inflows, estimated = [], []

    class Watched(CoarseToFine):
        def estimate(self, pair: DensityPair, *given: Any) -> Velocity:
            inflows.append(pair.inflow)
            estimated.append(super().estimate(pair, *given))
            return estimated[-1]

    scene = replace(coarse.with_frames(0, 2), closed=("z-",), inlets=(Inlet((0, 0, 0.3), 0.2),))
    frames: list[Frame] = []
    with Clip.open(scene.clip) as clip:
        shot = prepare_shot(clip, scene, draft)
        method = replace(compose(shot.settings), velocity_estimator=Watched(shot.settings.velocity))
        for resume in (False, True):
            sequence = Reconstruction(shot, method).write(
                tmp_path / "out", npz=True, resume=resume, on_frame=frames.append
            )
    assert len(frames) == 3 and len(inflows) == 2
    for frame in frames:
        assert not frame.velocity.faces[2][:, :, 0].any()
    assert all(velocity.faces[2][:, :, -1].any() for velocity in estimated)
    for inflow in inflows:
        np.testing.assert_array_equal(inflow, shot.scene.inflow())
    assert (sequence.scene.closed, sequence.scene.inlets) == (scene.closed, scene.inlets)


def test_what_a_mask_hides_is_no_smoke(run, plume, draft, tmp_path) -> None:
    """A block that falls beside the plume is smoke without the mask; with it the smoke is as if there were no block."""
    scene, beside = plume.write(tmp_path, plume.densities[:2]), np.s_[:, :8]
    for number in range(2):
        file = tmp_path / f"frame_{number:04d}.png"
        picture = read_image(file)
        picture[4 + 8 * number : 14 + 8 * number, 1:7] = (0.2, 0.3, 0.25)
        write_image(file, picture)
    mask = np.ones((56, 40, 3))
    mask[beside] = 0
    write_image(tmp_path / "mask.png", mask)
    hidden = project_voxels(scene.camera, scene.domain).shown((mask == 0).all(-1))
    masked = replace(scene, clip=replace(scene.clip, mask=tmp_path / "mask.png"))
    for shown, frame, wanted in zip(frames_of(scene, draft), frames_of(masked, draft), run[0][:2], strict=True):
        assert shown.density[hidden].max() > 0.1 * shown.density.max()
        assert frame.density[hidden].max() <= 1e-3 * frame.density.max()
        assert frame.density.sum() == pytest.approx(wanted.density.sum(), rel=0.02)
        assert frame.figures["psnr"] == pytest.approx(wanted.figures["psnr"], abs=0.5)


def test_a_run_that_was_cut_off_goes_on_exactly(run, plume, draft, tmp_path) -> None:
    goes_on_exactly(plume.scene, draft, tmp_path / "out", 3, run[1])


def test_a_file_that_was_replaced_under_its_name_is_not_mixed_in(plume, draft, tmp_path) -> None:
    scene = plume.write(tmp_path / "clip", plume.densities[:2])
    behind = np.zeros((56, 40, 3))
    write_image(tmp_path / "plate.png", behind)
    write_image(tmp_path / "mask.png", np.ones((56, 40, 3)))
    behind[:4, :4, 2] = 1
    write_image(tmp_path / "strokes.png", behind)
    clip = replace(scene.clip, mask=tmp_path / "mask.png")
    background = Background(image=tmp_path / "plate.png", strokes=tmp_path / "strokes.png")
    with Clip.open(clip) as opened:
        shot = prepare_shot(opened, replace(scene, clip=clip, background=background), draft)
        before = sources(shot)
        for replaced, name in (
            ("clip", "clip/frame_0001.png"),
            ("background", "plate.png"),
            ("mask", "mask.png"),
            ("strokes", "strokes.png"),
        ):
            picture = read_image(tmp_path / name)
            picture[0, 0] = 0.01
            write_image(tmp_path / name, picture)
            after = sources(shot)
            assert {each for each in before if after[each] != before[each]} == {replaced}
            before = after


def test_an_estimated_background_resumes_and_moves(plume, draft, tmp_path) -> None:
    """What was estimated is kept with the sequence: the run goes on, and the directory can be moved."""
    heights = np.linspace(-0.3, 1.9, 8)
    filmed = plume.write(tmp_path / "clip", [plume.blob(plume.scene, height) for height in heights])
    scene = Scene(clip=filmed.clip).with_frames(3, 4)
    settings = replace(draft, resolution=(16, 16, 24))
    frames_written(scene, settings, tmp_path / "whole")
    goes_on_exactly(scene, settings, tmp_path / "out", 1, tmp_path / "whole")
    (tmp_path / "out").rename(tmp_path / "moved")
    sequence = Sequence.open(tmp_path / "moved")
    assert render(sequence.density(2), sequence.scene).shape == (56, 40, 3)


def test_frames_that_are_the_background_are_kept_as_its_picture(plume, draft, tmp_path) -> None:
    """The sequence shows it, and goes on with no other frames."""
    clear = np.zeros_like(plume.densities[0])
    scene = plume.write(tmp_path / "clip", [clear, clear, *plume.densities])
    scene = replace(scene, background=Background(frame=0))
    cut_off(scene, draft, tmp_path / "out", 2)
    sequence = Sequence.open(tmp_path / "out")
    assert sequence.scene.background == Background(image=tmp_path / "out" / "background.exr")
    with Clip.open(scene.clip) as opened:
        np.testing.assert_allclose(read_image(sequence.scene.background.image), opened.frame(0), atol=1e-3)
    with pytest.raises(SequenceError, match=r"sources\.background\.frame\[0\]"):
        frames_written(replace(scene, background=Background(frame=1)), draft, tmp_path / "out", resume=True)


def centroid(density: np.ndarray, scene: Scene) -> np.ndarray:
    """Where the smoke is, in meters."""
    places = np.broadcast_arrays(*scene.domain.offsets((0, 0, 0)))
    return np.array([np.average(place, weights=density) for place in places])


def test_further_views_put_the_smoke_in_its_place(plume, two_views, draft, tmp_path) -> None:
    """From the front alone the blob stands in the middle of the box; with the side where it stood, in every frame."""
    two_views, voxel = two_views.with_frames(0, 2), two_views.domain.voxel_size
    truth = [centroid(np.roll(density, 5, axis=1), two_views) for density in plume.densities]
    alone = frames_of(replace(two_views, views=()).with_frames(0, 1), draft)
    both = frames_written(two_views, draft, tmp_path / "out")
    for frames, near in ((alone, False), (both, True)):
        off = [np.linalg.norm(centroid(f.density, two_views) - truth[f.number - 1]) / voxel for f in frames]
        assert max(off) < 0.7 if near else min(off) > 3
    sequence = Sequence.open(tmp_path / "out")
    assert sequence.scene == completed(two_views)
    for number in sequence.frames:
        assert min(sequence.figures(number)["psnr"], sequence.figures(number)["psnr_view_1"]) > 35


def test_the_papers_loop_takes_all(coarse) -> None:
    paper = Settings.preset("draft", "paper")
    starts, density_fit = [], FixedRateDescent(iterations=1)

    class Watched:
        def fit(self, views: ViewSet, depth: Any, initial: np.ndarray | None) -> Any:
            starts.append(initial)
            return density_fit.fit(views, depth, initial)

    method = replace(compose(paper), density_fit=Watched())
    frames = frames_of(coarse, paper, method, count=3)
    assert [start is None for start in starts] == [True, True, False]
    assert all(frame.figures["transport"] == {} for frame in frames)


def test_smoke_from_a_moving_camera_stands_where_it_stood(plume, tracked, draft, along_the_path) -> None:
    """The pictures are fitted, the smoke is in its place to half a voxel; a still camera's would drift off."""
    still = frames_of(replace(tracked, camera=tracked.camera.at(0)).with_frames(4, 4), draft)

    def off(frame: Frame, truth: np.ndarray) -> float:
        way = centroid(frame.density, tracked) - centroid(truth, tracked)
        return float(np.linalg.norm(way)) / tracked.domain.voxel_size

    assert max(map(off, along_the_path[0], plume.densities)) < 0.5 and off(still[0], plume.densities[4]) > 4
    with Clip.open(tracked.clip) as clip:
        for index, frame in enumerate(along_the_path[0]):
            assert psnr(render(frame.density, tracked, tracked.camera.at(index)), clip.frame(index)) >= 40


def test_a_moving_camera_resumes_on_its_own_path_only(tracked, draft, along_the_path, tmp_path) -> None:
    """The path is kept with the sequence: the rest is the same to the bit, and another path is refused."""
    out = tmp_path / "out"
    goes_on_exactly(tracked, draft, out, 3, along_the_path[1])
    assert Sequence.open(out).scene == completed(tracked)
    poses = tracked.camera.matrices
    other = replace(tracked.camera, matrices=(*poses[:-1], poses[0]))
    with pytest.raises(SequenceError, match=r"scene\.camera\.matrices\[4\]\[0\]\[0\]"):
        frames_written(replace(tracked, camera=other), draft, out, resume=True)


@pytest.mark.parametrize("target", [(0, -9, 0.8), (1.1, 0, 0.8)], ids=["away", "aside"])
def test_smoke_that_a_moving_camera_loses_goes_on(plume, tracked, draft, tmp_path, target) -> None:
    """What is not in the picture is carried along, also if part of the box is: it keeps its mass and goes on rising."""
    poses = (*tracked.camera.matrices[:4], look_at_matrix((0, -4, 0.8), target, (0, 0, 1)))
    scene = plume.write(tmp_path, plume.densities, replace(tracked, camera=replace(tracked.camera, matrices=poses)))
    frames = frames_of(scene, draft)
    assert frames[4].figures["hull_share"] == 0
    assert frames[4].density.sum() == pytest.approx(frames[3].density.sum(), rel=1e-3)
    assert centroid(frames[4].density, tracked)[2] > centroid(frames[3].density, tracked)[2] + 0.02


def test_a_clean_plate_for_every_frame(plume, tracked, draft, tmp_path) -> None:
    columns, rows = (3 * side for side in tracked.camera.size)
    camera = replace(tracked.camera.resized(columns, rows), matrices=tracked.camera.matrices[:3])
    tracked = replace(tracked, camera=camera)
    blocks = np.random.default_rng(0).uniform(0.05, 0.2, (rows // 8, columns // 8 + 4, 3)).astype(np.float32)
    wide = np.kron(blocks, np.ones((8, 8, 1), np.float32))
    for n, density in enumerate(plume.densities[:3]):
        plate = np.ascontiguousarray(wide[:rows, 3 * n : 3 * n + columns])
        write_image(tmp_path / f"plate_{n}.exr", plate)
        renderer = scene_renderer(completed(tracked), tracked.camera.at(n), plate)
        write_image(tmp_path / f"frame_{n}.exr", renderer.image(density))
    clip = ClipSource(tmp_path / "frame_#.exr", fps=24)
    scene = replace(tracked, clip=clip, background=Background(image=tmp_path / "plate_#.exr"))
    frames = frames_written(scene, draft, tmp_path / "out")
    assert all(frame.figures["psnr"] >= 35 for frame in frames)
    assert all(frame.figures["hull_share"] < 0.5 for frame in frames)
    assert Sequence.open(tmp_path / "out").scene == completed(scene)


@pytest.mark.parametrize("detail", [0.0, 1.0])
def test_frames_without_smoke_are_empty(plume, draft, tmp_path, detail) -> None:
    draft, nothing = replace(draft, detail=detail), np.zeros_like(plume.densities[0])
    clip = [nothing, nothing, plume.densities[0], nothing, nothing, plume.densities[1], plume.densities[2]]
    frames = frames_written(plume.write(tmp_path / "clip", clip), draft, tmp_path / "out")
    assert [bool(frame.density.any()) for frame in frames] == [bool(density.any()) for density in clip]
    for frame in frames:
        assert all(np.isfinite(face).all() for face in frame.velocity.faces)
        assert (frame.figures["hull_share"] > 0) == bool(clip[frame.number - 1].any())


def test_every_part_of_a_method_can_be_exchanged(coarse, draft) -> None:
    """The loop asks each part for what it is for: here the temporal prior, which starts every frame alike.

    Parts compute on one thread of BLAS.
    """
    always, threads = np.full(coarse.domain.resolution, 0.5, np.float32), []

    class Stubborn:
        def start(self, depth: Any, carried: np.ndarray, smooth: np.ndarray) -> Start:
            return Start(always, {"stubborn": 1.0})

    class Idle:
        def fit(self, views: ViewSet, depth: Any, initial: np.ndarray | None) -> Any:
            threads.append(blas_threads())
            found = GradientFit(draft.density).fit(views, depth, initial)
            return found if initial is None else replace(found, density=initial)

    default = compose(draft)
    method = Method(Idle(), default.depth_prior, default.velocity_estimator, Stubborn())
    with threadpool_limits(2, user_api="blas"):
        before = blas_threads()
        frames = frames_of(coarse, draft, method, count=3)
        assert blas_threads() == before
    assert all(number == {1} for number in threads)
    assert frames[1].figures["transport"] == {}
    for frame in frames[2:]:
        assert frame.figures["transport"] == {"stubborn": 1.0}
        np.testing.assert_array_equal(frame.density, always)


def test_a_frame_that_is_let_go_takes_no_memory(coarse, draft, tmp_path) -> None:
    """While a frame is computed nothing holds the ones before: at large grids they would not fit together."""
    given: list[weakref.ref[Frame]] = []
    alive = []

    class Watched(CoarseToFine):
        def predict(self, velocity: Velocity, dt: float) -> Velocity:
            alive.append(sum(frame() is not None for frame in given))
            return super().predict(velocity, dt)

    with Clip.open(coarse.clip) as clip:
        shot = prepare_shot(clip.part(0, 3), coarse.with_frames(0, 3), draft)
        method = replace(compose(shot.settings), velocity_estimator=Watched(shot.settings.velocity))
        run = Reconstruction(shot, method)
        run.write(tmp_path / "out", npz=True, on_frame=lambda frame: given.append(weakref.ref(frame)))
    assert len(given) == 4
    assert alive == [0, 0]


def test_fire_is_a_second_grid(plume, draft, tmp_path) -> None:
    dim = replace(plume.scene, lights=(DirectionalLight((0.3, 0.5, -0.8), (0.6, 0.6, 0.6)),))
    scene = replace(plume.write(tmp_path / "clip", plume.densities[:2], dim), lights=())
    with Clip.open(scene.clip) as clip:
        burnt = clip.changed(burning)
        frames: list[Frame] = []
        sequence = reconstruct(burnt, scene, draft).write(tmp_path / "out", npz=True, on_frame=frames.append)
        for frame in frames:
            np.testing.assert_array_equal(sequence.flame(frame.number), frame.flame)
            fire = burnt.frame(frame.number - 1)[..., 0] > 0.5
            error = np.abs(sequence.render(frame.number) - burnt.frame(frame.number - 1))[fire]
            assert error.mean() < 0.1 * burnt.frame(frame.number - 1)[fire].mean()
        assert all(part.flame is None for part in reconstruct(clip, scene, draft))
    assert any(part["what"] == "emission of fire" for part in sequence.provenance)


def blas_threads() -> set[int]:
    return {library["num_threads"] for library in ThreadpoolController().select(user_api="blas").info()}
