"""What a sequence renders to again is what its fit was judged by."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from smokelift import Background, Clip, Scene, Settings, reconstruct, render
from smokelift.density import ViewSet

EXAMPLE = Path(__file__).parents[3] / "examples" / "plume" / "scene.toml"


def test_a_sequence_renders_to_its_fits_own_figure(tmp_path) -> None:
    scene = Scene.load(EXAMPLE).with_frames(20, 21)
    with Clip.open(scene.clip) as clip:
        run, frames = reconstruct(clip, scene, Settings.preset("draft")), []
        shot, sequence = run.shot, run.write(tmp_path / "out", npz=True, on_frame=frames.append)
        for frame in frames:
            (view,) = ViewSet.of(shot.observe(frame.number - 1), shot.optics).views
            again = sequence.render(frame.number, camera=view.camera)
            # the fit is to the extracted element, which stands before one color
            before = replace(sequence.scene, background=Background(color=tuple(map(float, view.background[0, 0, :3]))))
            over_color = render(sequence.density(frame.number), before, camera=view.camera)
            error = np.square(over_color - view.image[..., :3], dtype=np.float64)[view.counted].mean()
            assert -10 * np.log10(error) == pytest.approx(frame.figures["psnr_working"], abs=0.1)
            shown = render(sequence.density(frame.number), sequence.scene, camera=view.camera)
            np.testing.assert_array_equal(shown, again)
