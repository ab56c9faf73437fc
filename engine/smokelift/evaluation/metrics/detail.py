"""The detail of pictures of smoke, wherever it is in the picture."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import fft, ndimage

from smokelift.evaluation.metrics.checks import Array, Mask, finite, pair, relative

OCTAVES = ((2.0, 4.0), (4.0, 8.0), (8.0, 16.0), (16.0, 32.0))
"""Bands of `octave_power` in cycles across the longer side: from the shape of the smoke to what 64 voxels hold."""

DETAIL = 4.0
"""Standard deviation (pixels) of the blur that takes fine detail away."""

SMOKE = 0.05
"""Share of a picture's largest difference from the background above which a pixel shows smoke."""


def octave_power(picture: npt.ArrayLike) -> Array:
    """Return the power of a picture in each of `OCTAVES`, whatever the direction.

    Parameters
    ----------
    picture
        Shape (rows, columns), at least 64 pixels on the longer side for the last band: the smoke alone, as its
        difference from the background. It is faded out over an eighth at each edge, which smoke may cross.

    Raises
    ------
    ValueError
        If a value is not finite or the picture has not two axes.
    """
    values = finite(picture)
    if values.ndim != 2:
        raise ValueError(f"the power of octaves needs a picture (rows, columns), not one of shape {values.shape}")
    rows, columns = values.shape
    longer = max(rows, columns)
    power = np.abs(fft.fft2(values * np.outer(_faded(rows), _faded(columns)))) ** 2
    cycles = longer * np.hypot(fft.fftfreq(rows)[:, None], fft.fftfreq(columns))
    return np.array([power[(low <= cycles) & (cycles < high)].sum() for low, high in OCTAVES])


def octave_shares(power: npt.ArrayLike) -> Array:
    """Return each octave's share of a power spectrum, in dB of the whole: what detail is like, however bright.

    Parameters
    ----------
    power
        A sum of `octave_power`. A millionth of its total is added to each octave, so that nothing is infinite.

    Raises
    ------
    ValueError
        If a value is not finite, or there is no power at all.
    """
    values = finite(power)
    total = float(values.sum())
    if total <= 0:
        raise ValueError("the pictures show nothing: there is no spectrum")
    return np.asarray(10 * np.log10(values / total + 1e-6))


def spectrum_distance(power: npt.ArrayLike, truth: npt.ArrayLike) -> tuple[float, Array]:
    """Return how much stronger or weaker detail is than the truth's, wherever it is.

    Parameters
    ----------
    power, truth
        Sums of `octave_power` over the same frames.

    Returns
    -------
    The root mean square over the octaves, in dB, and each octave's 10 log10(power / truth): negative where the
    picture is smoother than the truth. A millionth of the truth's total is added to both, so that nothing is
    infinite.

    Raises
    ------
    ValueError
        If the shapes differ, a value is not finite, or the truth has no power at all.
    """
    found, true = pair(power, truth)
    floor = 1e-6 * float(true.sum())
    if floor <= 0:
        raise ValueError("the truth's pictures show nothing: there is no spectrum to compare with")
    ratios = 10 * np.log10((found + floor) / (true + floor))
    return float(np.sqrt(np.mean(ratios**2))), np.asarray(ratios, np.float64)


def row_constant_detail(picture: npt.ArrayLike) -> float:
    """Return the share of a picture's fine detail that is constant along rows: smoke turned on a lathe.

    Parameters
    ----------
    picture
        Shape (rows, columns): the smoke alone, as its difference from the background.

    Returns
    -------
    0 to 1. Detail is what a blur of `DETAIL` pixels takes away, where the picture shows smoke. A row of
    n pixels of mere noise has 1/n.

    Raises
    ------
    ValueError
        If a value is not finite.
    """
    values = finite(picture)
    smoke = smoke_pixels(values)
    detail = np.where(smoke, fine_detail(values), 0.0)
    counts = np.maximum(smoke.sum(1), 1)
    return relative(float(np.sum(detail.sum(1) ** 2 / counts)), float(np.sum(detail**2)))


def detail_correlation(a: npt.ArrayLike, b: npt.ArrayLike) -> float:
    """Return the correlation of two pictures' fine details: near 1 where one view shows what another does.

    Parameters
    ----------
    a, b
        Shape (rows, columns): the smoke alone. Detail is as in `row_constant_detail`, where either picture shows smoke.

    Raises
    ------
    ValueError
        If the shapes differ or a value is not finite.
    """
    first, second = pair(a, b)
    smoke = smoke_pixels(first) | smoke_pixels(second)
    if not smoke.any():
        return 0.0
    one, other = (fine_detail(values)[smoke] for values in (first, second))
    one, other = one - one.mean(), other - other.mean()
    norm = float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(one @ other) / norm if norm > 0 else 0.0


def smoke_pixels(picture: Array) -> Mask:
    """Return where a picture, a difference from its background, shows smoke."""
    strength = np.abs(picture)
    return np.asarray(strength > SMOKE * strength.max(initial=0.0))


def fine_detail(values: Array) -> Array:
    """Return what a blur of `DETAIL` pixels takes away from a picture (rows, columns)."""
    return np.asarray(values - ndimage.gaussian_filter(values, DETAIL))


def _faded(count: int) -> Array:
    """Ones with an eighth at both ends that rises from zero (Tukey's window)."""
    inward = np.minimum(np.arange(count), np.arange(count)[::-1]) + 0.5
    return np.asarray(np.sin(np.pi / 2 * np.minimum(1.0, 8 * inward / count)) ** 2)
