"""What reconstruct returns: checked and prepared at once, computed when it is iterated over or written."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from smokelift import Clip, Sequence, render
from smokelift.density import GradientFit, NothingCarried, ViewSet
from smokelift.output.images import write_image
from smokelift.output.index import SequenceError
from smokelift.pipeline import Frame, Reconstruction, compose, reconstruct
from smokelift.scene import Background, completed


def test_nothing_is_computed_before_it_is_wanted(plume, smooth, tmp_path) -> None:
    computed = []

    class Counted:
        def fit(self, *given: Any) -> Any:
            computed.append(given)
            return GradientFit().fit(*given)

    with Clip.open(plume.scene.clip) as clip:
        method = replace(compose(smooth), density_fit=Counted())
        run = reconstruct(clip, plume.scene, smooth, method=method)
        assert run.shot.scene == completed(plume.scene)
        assert run.method == method
        (tmp_path / "mine.txt").touch()
        with pytest.raises(SequenceError, match=r"mine\.txt"):
            run.write(tmp_path, npz=True)
        assert computed == []
        frames = iter(run)
        assert next(frames).number == 1
        assert len(computed) == 2  # the first has the second's velocity


def test_frames_in_memory_and_written_are_the_same(plume, smooth, tmp_path) -> None:
    """Each way computes them anew, and density and velocity have one type in memory and from files."""
    scene = plume.scene.with_frames(0, 1)
    with Clip.open(scene.clip) as clip:
        run = reconstruct(clip, scene, smooth)
        sequence, frames = run.write(tmp_path / "out", npz=True), list(run)
    assert isinstance(sequence, Sequence) and sequence.complete
    assert [frame.number for frame in frames] == [1, 2]
    for frame in frames:
        density, velocity = sequence.density(frame.number), sequence.velocity(frame.number)
        assert (type(density), type(velocity)) == (type(frame.density), type(frame.velocity))
        np.testing.assert_array_equal(density, frame.density)
        for found, wanted in zip(velocity.faces, frame.velocity.faces, strict=True):
            np.testing.assert_array_equal(found, wanted)
        assert (velocity.voxel_size, velocity.closed) == (frame.velocity.voxel_size, frame.velocity.closed)


def test_a_run_is_not_resumed_with_other_parts(plume, smooth, tmp_path) -> None:
    scene = plume.scene.with_frames(0, 0)
    with Clip.open(scene.clip) as clip:
        usual = reconstruct(clip, scene, smooth)
        other = Reconstruction(usual.shot, replace(usual.method, temporal_prior=NothingCarried()))
        other.write(tmp_path, npz=True)
        assert other.write(tmp_path, npz=True, resume=True).complete
        with pytest.raises(SequenceError, match=r"settings.*temporal_prior.*NothingCarried"):
            usual.write(tmp_path, npz=True, resume=True)


def test_a_sequence_renders_to_what_its_fit_was_judged_by(plume, smooth, tmp_path) -> None:
    """Also before a picture, where the fit is to the extracted element, which stands before one color."""
    wall = np.kron(np.random.default_rng(0).uniform(0.05, 0.3, (28, 20, 3)), np.ones((2, 2, 1)))
    write_image(tmp_path / "wall.exr", wall)
    before_wall = replace(plume.scene, background=Background(image=tmp_path / "wall.exr"))
    scene = plume.write(tmp_path / "clip", plume.densities[:2], before_wall)
    frames: list[Frame] = []
    with Clip.open(scene.clip) as clip:
        run = reconstruct(clip, scene, smooth)
        sequence = run.write(tmp_path / "out", npz=True, on_frame=frames.append)
        for frame in frames:
            (view,) = ViewSet.of(run.shot.observe(frame.number - 1), run.shot.optics).views
            assert view.image.shape[-1] == 4
            again = sequence.render(frame.number, camera=view.camera)
            color = Background(color=tuple(map(float, view.background[0, 0, :3])))
            over_color = render(frame.density, replace(sequence.scene, background=color), camera=view.camera)
            error = np.square(over_color - view.image[..., :3], dtype=np.float64)[view.influenced].mean()
            assert -10 * np.log10(error) == pytest.approx(frame.figures["psnr_working"], abs=0.1)
            shown = render(sequence.density(frame.number), sequence.scene, camera=view.camera)
            np.testing.assert_array_equal(shown, again)


def test_what_alpha_says_of_the_transmittance_is_fitted(plume, smooth, tmp_path) -> None:
    """Smoke whose left side lies in the shadow of something else is no thinner there."""
    white, black = (replace(plume.scene, background=Background(color=(gray,) * 3)) for gray in (1.0, 0.0))
    density = plume.densities[2]
    sent, clear = render(density, black), (render(density, white) - render(density, black)).mean(-1)
    sent = sent * np.linspace(0.1, 1, sent.shape[1], dtype=np.float32)[:, None]
    for n in range(2):
        write_image(tmp_path / f"a{n}.exr", np.dstack([sent, 1 - clear]))
    with Clip.open(tmp_path / "a#.exr", fps=24) as clip:
        first = next(iter(reconstruct(clip, replace(plume.scene, clip=None, lights=(), background=None), smooth)))
    found = (render(first.density, white) - render(first.density, black)).mean(-1)
    wrong = (found - clear)[clear < 0.97]
    assert np.sqrt(np.square(wrong).mean()) < 0.05
