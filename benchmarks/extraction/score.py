"""The figures of an element or of a reconstruction beside the true element of its clip."""

from collections.abc import Callable, Iterable

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from benchmarks.baked import BLACK, FRONT, Baked
from benchmarks.extraction.compose import Composed
from benchmarks.measure import Figures, optical_mass, view_figures
from smokelift.evaluation.truth import finite_mean
from smokelift.footage.images import Picture
from smokelift.render import Volume, scene_renderer
from smokelift.scene import CompleteScene

SMOKE = 0.97
"""Transmittance below which a pixel shows smoke."""

TAIL = (0.9, 0.98)
"""Transmittances of the faint tail, which a threshold would cut off."""

THIN = 3.0
"""Optical depth up to which the amount of smoke shows: 5 % of the plate's light passes there, and less farther in."""

DEPTH_CAP = 2 * THIN
"""Optical depth that is counted at most: what is opaque in place of `THIN` then counts as twice as much."""

DETAIL = 6 / 256
"""Standard deviation of the Gaussian that detail is finer than, a fraction of the picture's width."""

FLAT = 1 / 255
"""Detail of a plate (root mean square) above which it stands out from the rounding of an 8-bit file."""

SCORED = range(8, 1_000_000, 6)
"""Frames of a clip whose elements are compared: past those that have hardly any before them, a quarter second apart."""

VIEWED = (14, 20, 26)
"""Frames of a clip that are compared in new views."""


def scored_frames(count: int) -> list[int]:
    """Return the frames of a clip of so many that are compared: of `SCORED`, or the last if none of those is there."""
    return [frame for frame in SCORED if frame < count] if count > SCORED.start else [count - 1]


def score_element(transmittance: npt.ArrayLike, radiance: npt.ArrayLike, truth: Composed) -> Figures:
    """Compare an element with the true one, before anything is fitted to it.

    Parameters
    ----------
    transmittance : (frames, rows, columns) or (frames, rows, columns, 3)
        The fraction of the plate's light that passes, of each frame of the truth. The mean over channels counts.
    radiance : (frames, rows, columns) or (frames, rows, columns, 3)
        What the smoke sends, linear.
    truth
        The same frames, rows and columns.

    Returns
    -------
    Means over the frames; None where there is nothing to say.

    ``transmittance_error``: root mean square over pixels of smoke. ``radiance_error``: the same of S, linear.
    ``imprint``: |correlation| of the error's detail in T with the plate's detail over pixels of smoke; 1 if the plate
    is printed on the smoke. ``thin_mass``: optical depth, summed over the pixels where the true one is at most `THIN`,
    over the true sum. ``tail``: the fraction of the opacity of the faint tail that is found; what is too much counts
    as none. ``psnr``: of S + T B beside the truth in pixels of smoke (dB, linear, peak 1).
    """
    clear, light = np.asarray(transmittance, np.float32), np.asarray(radiance, np.float32)
    clear = clear.mean(-1) if clear.ndim == 4 else clear
    light = light if light.ndim == 4 else np.repeat(light[..., None], 3, -1)
    true_clear = truth.seen.transmittance
    if clear.shape != light.shape[:3] or clear.shape != true_clear.shape:
        raise ValueError(
            f"T {clear.shape}, S {light.shape} and the truth's {true_clear.shape} must have the same frames, "
            "rows and columns."
        )
    plate, pictures = _detail(truth.plate.mean(-1)), truth.pictures()
    frames: list[dict[str, float | None]] = []
    for number, (t, s, true) in enumerate(zip(clear, light, truth.seen.transmittance, strict=True)):
        smoke, wrong = true < SMOKE, t - true
        tail, thin = (true > TAIL[0]) & (true < TAIL[1]), true >= np.exp(-THIN)
        shown = (s + t[..., None] * truth.plate - pictures[number])[smoke]
        frames.append(
            {
                "transmittance_error": _rms(wrong[smoke]),
                "radiance_error": _rms((s - truth.seen.radiance[number][..., None])[smoke]),
                "imprint": _correlation(_detail(wrong)[smoke], plate[smoke]),
                "thin_mass": _ratio(_depth(t)[thin].sum(), _depth(true)[thin].sum()),
                "tail": _ratio(np.minimum(np.clip(1 - t, 0, 1), 1 - true)[tail].sum(), (1 - true)[tail].sum()),
                "psnr": float(-10 * np.log10(max(np.square(shown).mean(), 1e-12))) if smoke.any() else None,
            }
        )
    figures: Figures = {name: finite_mean(frame[name] for frame in frames) for name in frames[0]}
    for name in ("transmittance_error", "radiance_error"):  # root mean squares over all frames
        squares = finite_mean(None if (value := frame[name]) is None else value**2 for frame in frames)
        figures[name] = None if squares is None else squares**0.5
    return figures


def score_densities(
    scene: CompleteScene, density: Callable[[int], Volume], smoke: Baked, composed: Composed
) -> Figures:
    """Compare a reconstruction with the true element, the true volumes, and new views.

    Parameters
    ----------
    scene
        That the reconstruction was made for, on its grid, with what was estimated.
    density
        Returns the volume (nx, ny, nz) of a frame of the clip, from 0.
    smoke
        What the clip shows.
    composed
        The clip's true element.

    Returns
    -------
    Those of `score_element` for what the volumes show to the clip's camera; ``mass``, extinction times volume over the
    truth's; ``psnr_20``, ``psnr_45`` and ``psnr_90`` of new views before black (dB, 8-bit sRGB values of whole
    pictures).
    """
    numbers = scored_frames(len(smoke))
    shown = seen_element(scene, [density(number) for number in numbers])
    found = sum(optical_mass(scene, density(number)[None]) for number in numbers)
    true = optical_mass(smoke.scene, smoke.densities[numbers])
    figures = score_element(*shown, composed.at(numbers)) | {"mass": _ratio(found, true)}
    viewed = [number for number in VIEWED if number < len(smoke)] or numbers[-1:]
    new = {view: camera for view, camera in smoke.cameras.items() if view != FRONT}

    def seen(view: str, number: int) -> Picture:
        return np.repeat(smoke.views[view].radiance[number][..., None], 3, -1)

    return figures | view_figures(scene, density, new, seen, viewed)


def seen_element(scene: CompleteScene, densities: Iterable[Volume]) -> tuple[Picture, Picture]:
    """Return what a scene's camera sees of volumes (nx, ny, nz): T (frames, rows, columns) and S, the same by 3."""
    renderer = scene_renderer(scene, None, BLACK)
    shown = [(renderer.image(density), renderer.transmittance) for density in densities]
    light, clear = (np.stack(pictures) for pictures in zip(*shown, strict=True))
    return clear, light


def _detail(picture: Picture) -> Picture:
    """Return what of a picture (rows, columns) is finer than `DETAIL`."""
    return picture - np.asarray(ndimage.gaussian_filter(picture, DETAIL * picture.shape[1]), np.float32)


def _depth(transmittance: Picture) -> Picture:
    """Return the optical depth of pixels, at most `DEPTH_CAP`; noise about clear air has both signs."""
    return np.asarray(-np.log(np.maximum(transmittance, np.exp(-DEPTH_CAP))), np.float32)


def _rms(values: Picture) -> float | None:
    return float(np.sqrt(np.square(values, dtype=np.float64).mean())) if values.size else None


def _ratio(value: float, reference: float) -> float | None:
    return float(value / reference) if reference > 0 else None


def _correlation(wrong: Picture, plate: Picture) -> float | None:
    """Return |correlation| of details; None if the plate has none, 0 if nothing is wrong."""
    if plate.size < 2 or np.std(plate) < FLAT:
        return None
    return abs(float(np.corrcoef(wrong, plate)[0, 1])) if np.std(wrong) > 0 else 0.0
