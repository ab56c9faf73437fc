"""The one way in which the benchmarks reconstruct a clip in this process, and compare it with what is known."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from benchmarks.baked import BLACK, FRONT, Volumes
from smokelift import Camera, Clip, Reconstruction, Scene, Settings, prepare_shot
from smokelift.evaluation.truth import finite_mean, means, picture_figures
from smokelift.pipeline import Frame, compose
from smokelift.render import Image, Volume, scene_renderer
from smokelift.scene import CompleteScene, completed

Figures = dict[str, float | str | None]
"""Figures by their names; None where there is nothing to say. ``refused`` is the sentence of a refusal."""


def reconstructed(
    clip: Clip, scene: Scene, settings: Settings, score: Callable[[CompleteScene, list[Frame]], Figures]
) -> Figures:
    """Return the figures of the scene with what was estimated and of all frames; of a refusal its sentence alone."""
    try:
        shot = prepare_shot(clip, scene, settings)
        frames = list(Reconstruction(shot, compose(shot.settings)))
    except ValueError as error:
        return {"refused": str(error)}
    return score(shot.scene, frames)


def view_figures(
    scene: CompleteScene,
    density: Callable[[int], Volume],
    cameras: Mapping[str, Camera],
    seen: Callable[[str, int], Image],
    frames: Sequence[int],
    background: Image = BLACK,
    gain: float = 1.0,
) -> Figures:
    """Compare densities with what cameras saw.

    Parameters
    ----------
    scene
        The reconstruction's, on the densities' grid.
    density, seen
        Return the volume (nx, ny, nz) of a frame, and a camera's true picture of it, linear (rows, columns, 3).
    cameras
        By their names.
    frames
        Those that count.
    background : (3,)
        Linear radiance behind the smoke in the true pictures.
    gain
        Exposure of the clip beside that of the true pictures.

    Returns
    -------
    ``psnr_VIEW``, means over the frames (dB, 8-bit sRGB values of whole pictures), and ``psnr_new``, the mean over
    the views but `FRONT`.
    """
    found: Figures = {}
    for view, camera in cameras.items():
        renderer = scene_renderer(scene, camera, np.float32(gain) * background)
        pictures = (renderer.image(density(frame)) / np.float32(gain) for frame in frames)
        pairs = zip(pictures, (seen(view, frame) for frame in frames), strict=True)
        found[f"psnr_{view}"] = means([picture_figures(*pair) for pair in pairs])["psnr"]
    new = [float(found[f"psnr_{view}"] or np.nan) for view in cameras if view != FRONT]
    return found | {"psnr_new": finite_mean(new)}


def optical_mass(scene: Scene, densities: Volumes) -> float:
    """Return extinction times volume (m2) of densities (frames, x, y, z) that fill the box of a scene."""
    complete = completed(scene)
    sides = np.array(complete.domain.max) - complete.domain.min
    voxel = float(np.prod(sides / densities.shape[1:]))
    return complete.medium.extinction * voxel * float(densities.sum(dtype=np.float64))
