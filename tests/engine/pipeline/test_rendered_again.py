"""What a sequence renders to again is what its fit was judged by."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from smokelift import Clip, Scene, Settings, reconstruct, render
from smokelift.density import ViewSet

ROOT = Path(__file__).parents[3]
CLIPS = {
    "example": (ROOT / "examples" / "plume" / "scene.toml", 20),
    "scalar_real": (ROOT.parent / "shared" / "data" / "scalar_real" / "scene.toml", 60),
}
"""Scene file and first frame."""


def decibels(image: np.ndarray, seen: np.ndarray, counted: np.ndarray) -> float:
    """PSNR over some pixels, peak 1."""
    return float(-10 * np.log10(np.square(image - seen, dtype=np.float64)[counted].mean()))


@pytest.mark.parametrize("name", CLIPS)
def test_a_sequence_renders_to_its_fits_own_figure(name, tmp_path) -> None:
    """By `Sequence.render` and by `render` with the sequence's scene, to 0.1 dB, by any model of scattering."""
    path, first = CLIPS[name]
    if not path.is_file():
        pytest.skip("needs the development data")
    scene = Scene.load(path).with_frames(first, first + 1)
    settings = Settings.preset("draft")
    with Clip.open(scene.clip) as clip:
        run, frames = reconstruct(clip, scene, settings), []
        shot, sequence = run.shot, run.write(tmp_path / "out", npz=True, on_frame=frames.append)
        for frame in frames:
            (view,) = ViewSet.of(shot.observe(frame.number - 1), shot.optics).views
            again = sequence.render(frame.number, camera=view.camera)
            assert decibels(again, view.image, view.counted) == pytest.approx(frame.figures["psnr_working"], abs=0.1)
            np.testing.assert_array_equal(
                render(sequence.density(frame.number), sequence.scene, camera=view.camera), again
            )
    last = sequence.frames[-1]
    own = sequence.render(last)
    np.testing.assert_array_equal(render(sequence.density(last), sequence.scene), own)
    assert own.shape[1::-1] == sequence.scene.camera.size
