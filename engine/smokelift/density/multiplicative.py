"""The multiplicative front fit: every ray's smoke is scaled until the picture is right, its depth profile kept.

For one ray with scattered radiance S and transmittance T the effective source is J = S / (1 - T). If all smoke on the
ray is scaled by s, the picture becomes J (1 - T^s) + T^s B. The transmittance that explains the target I best is

    t = <I - J, B - J> / <B - J, B - J>,   s = ln t / ln T.

Where shadows or thickness make the picture insensitive to s, the step is damped by the true sensitivity dL / d ln s of
the start: it hardly changes with the density, and to measure it takes another picture
(docs/experiments/memory-and-time.md).
Where smoke and background look alike the picture says little, so the neighbors' step counts instead.

Where detail in depth is made up, what a picture adds or takes is detail as well, about as deep as it is wide. Scaled
evenly, all of a ray would share it: from the side a layer along the rays. So a step that would scale smoke to rho is
itself scaled, by p / rho where it adds smoke and by rho / p where it takes some, for a plausible smoke p. It adds most
where p is denser, and takes most where p is thinner.

Several pictures take turns, so that the density becomes the one nearest to the start that all agree with:
multiplicative algebraic reconstruction (Gordon, Bender and Herman 1970).
"""

from collections.abc import Sequence

import numpy as np
from scipy import ndimage

import smokelift._core as _core
from smokelift.checks import Array
from smokelift.density.objective import Fit, Term, noise_floor, objective
from smokelift.render import Image, Volume

STEP_RANGE = (0.4, 2.5)
"""Smallest and largest factor on a ray's smoke in one iteration."""

RELAXATION = 0.9
"""Fraction of a step that is made."""

MAX_UNEVENNESS = 2.0
"""Largest factor by which the plausible smoke scales a step. With `RELAXATION`, less than twice the step that a ray
asks for is made, so that the iterations converge (docs/experiments/every-view.md)."""

DAMPING = 0.4
"""Relative sensitivity at which the step is halved."""

MIN_PLAUSIBLE = 1e-6
"""Fraction of the plausible smoke's largest density below which voxels count alike."""

MIN_SCALE = 1e-30
"""Lower bound of that density, so that empty smoke is no division by zero."""

STEP_BLUR = 0.7
"""Standard deviation (pixels) of the Gaussian that smooths steps: one pixel's blur keeps neighboring rays from fighting
over the voxels that they share."""

MIN_TRUST = 1e-3
"""Trust (1 where a pixel's contrast is far above its noise) at which the steps of a neighborhood are halved: where the
picture says less, a ray keeps its smoke."""

PROBE = 1.05
"""Factor on the density for the difference quotient dL / d ln s."""


def fit_multiplicative(
    terms: Sequence[Term],
    density: Volume,
    iterations: int,
    tolerance: float,
    where: _core.MarkedVoxels,
    plausible: Volume | None = None,
) -> Fit:
    """Scale the smoke of every ray until the pictures match, and return the best density.

    In each iteration every term has a turn; where a pixel counts less, its steps are shorter. Voxels of the start
    (nx, ny, nz) at zero stay there, and it is zero outside ``where``. It stops when an iteration lowers the objective
    by less than the fraction ``tolerance``. The steps lead towards the distribution of ``plausible`` (nx, ny, nz) along
    the rays; without it they are even.
    """
    smoke, enough = _Smoke(density, where, plausible), noise_floor(terms)
    current = best = smoke.values
    spare = np.empty_like(current)  # the best is kept, the others are overwritten: new memory takes as long
    least, done = np.inf, 0
    left: tuple[Image, ...] = ()
    for done in range(iterations + 1):
        volume = smoke.volume_of(current)
        images = [term.renderer.image(volume) for term in terms]
        residuals = tuple(image - term.view.image for term, image in zip(terms, images, strict=True))
        loss = objective(terms, residuals)
        gained = least - loss
        if loss < least:
            if best is not current:
                spare = best
            best, least, left = current, loss, residuals
        if done == iterations or loss <= enough or (done > 2 and gained < tolerance * loss):
            break
        for turn, term in enumerate(terms):
            image = images[0] if turn == 0 else term.renderer.image(smoke.volume_of(current))
            current = smoke.scaled(current, turn, term, image, spare if current is best else current)
    return Fit(smoke.volume_of(best), least, left, done)


def take_turns(terms: Sequence[Term], density: Volume, where: _core.MarkedVoxels) -> Volume:
    """Scale the smoke of every ray towards each picture in turn, whatever the others lose by it.

    Each term has one turn; the last one is fitted best. Only voxels of ``where`` that are not zero at the start
    (nx, ny, nz) change.
    """
    smoke = _Smoke(density, where)
    values = smoke.values
    for turn, term in enumerate(terms):
        values = smoke.scaled(values, turn, term, term.renderer.image(smoke.volume_of(values)), values)
    return smoke.volume_of(values)


class _Smoke:
    """The voxels of a density that may hold smoke; the others stay at zero.

    Their `values` (n,) are what is computed with. One volume is filled with them again and again for the renderers. The
    sensitivities of the terms' pictures are measured once.
    """

    def __init__(self, density: Volume, where: _core.MarkedVoxels, plausible: Volume | None = None) -> None:
        self._where, self.values = where, where.take(density)
        self._volume = np.zeros(density.shape, np.float32)
        self._sensitivities: dict[int, Array] = {}
        self._plausible = None if plausible is None else where.take(plausible)
        densest = 0.0 if self._plausible is None else float(self._plausible.max(initial=MIN_SCALE))
        self._faint = MIN_PLAUSIBLE * densest

    def volume_of(self, values: Array, factor: float = 1.0) -> Volume:
        """The volume (nx, ny, nz) with these values, times a factor; valid until the next call."""
        self._where.put(values, self._volume, factor)
        return self._volume

    def scaled(self, values: Array, turn: int, term: Term, image: Image, out: Array) -> Array:
        """Values whose picture is nearer to that of the term whose turn it is, from those that render to `image`.

        They are scaled along the term's rays by a fraction (`RELAXATION`) of the steps that its pixels ask for.
        """
        transmittance = term.renderer.transmittance
        if turn not in self._sensitivities:
            self._sensitivities[turn] = self._sensitivity(values, term, image, transmittance)
        steps = _log_scale(image, transmittance, self._sensitivities[turn], term)
        rays = term.view.projection.map
        self._where.scale_along_rays(rays, values, self._plausible, steps, self._faint, MAX_UNEVENNESS, RELAXATION, out)
        return out

    def _sensitivity(self, values: Array, term: Term, image: Image, transmittance: Image) -> Array:
        """|dL / d ln s| / |L - B| (rows, columns) of a density, whose image and transmittance are given."""
        if term.renderer.absorbs_only:  # L = T B and ln T is proportional to s
            slope = image * np.log(np.maximum(transmittance, 1e-30))[..., None]
        else:
            slope = (term.renderer.image(self.volume_of(values, PROBE)) - image) / np.log(PROBE)
        change = image - term.view.background
        scale = np.maximum(np.sqrt(_over_channels(change, change)), 1e-6)
        return np.asarray(np.sqrt(_over_channels(slope, slope)) / scale)


def _log_scale(image: Image, transmittance: Image, sensitivity: Array, term: Term) -> Array:
    """Logarithm (rows, columns) of each pixel's scale, damped and smoothed."""
    background, weight = term.view.background, np.sqrt(term.weight)
    clear = transmittance[..., None]
    solid = np.maximum(1 - clear, 1e-6)
    source = (image - clear * background) / solid
    contrast = background - source
    power = _over_channels(contrast, contrast)
    floor = _over_channels(term.view.noise, term.view.noise) / term.view.noise.shape[-1]
    explained = _over_channels(term.view.image - source, contrast) / (power + 1e-20)
    wanted = np.clip(explained, 1e-4, 1.0)
    scale = np.log(wanted) / np.minimum(np.log(np.maximum(transmittance, 1e-30)), -1e-6)
    gain = weight * sensitivity**2 / (sensitivity**2 + DAMPING**2)
    step = gain * np.log(np.clip(scale, *STEP_RANGE))
    trust = weight * power / (power + floor)
    steps, trusts = (ndimage.gaussian_filter(each, STEP_BLUR) for each in (trust * step, trust))
    return np.asarray(steps / (trusts + MIN_TRUST), np.float32)


def _over_channels(a: Image, b: Image) -> Image:
    """Sum of the channels' products (rows, columns)."""
    return np.asarray(np.einsum("...c,...c", a, b))
