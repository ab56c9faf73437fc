"""Detail in depth: smoke that looks like the clip from every side.

The smooth density of `RoundDepth` is the mean of all smokes that show one picture: from the side, a spindle without
detail. A plausible smoke shows from every side what the clip shows from the front: not one of its pictures, but the
distribution of their patches (`texture`). Noise breaks the spindle's symmetry (`lattice_noise`). Then, from coarse
to fine, pictures of the smoke from many azimuths are moved towards that distribution, and the smoke is scaled along
their rays to follow. The rows of every picture keep the amounts of the smooth density. After each round the smoke is
sharpened, by as much as its sides lack of the clip's finest detail, and the cameras' pictures have their turn. Smoke
carried on from the frame before has the clip's statistics already: one round is enough.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy import ndimage

from smokelift.density.depth_prior import DepthEstimate, RoundDepth
from smokelift.density.lattice_noise import SMALLEST_BLUR, Wander, stretched_noise
from smokelift.density.multiplicative import fit_multiplicative, take_turns
from smokelift.density.objective import FAINT, TINY, Level
from smokelift.density.observation import ObservedClip, ViewSet
from smokelift.density.texture import ClipTexture, Exemplar, enlarged, fine_energy
from smokelift.density.turntable import DepthMap, Turntable, UprightSmoke
from smokelift.render import Volume
from smokelift.scene import Camera
from smokelift.scene.domain import box_around
from smokelift.transport import block_means

SMOOTH_ITERATIONS = 4
"""Multiplicative iterations for the smooth density, whose amounts the sides' rows keep."""

SMOOTH_TOLERANCE = 0.02
"""Fraction of the objective that each has to gain for another to follow, as in the fit."""

LOW_PASS = 0.75
"""Standard deviation of a blur, in those of the smoke's width. Noisy and carried smoke, blurred, is the smooth density,
blurred: lobes are made up, on any grid, and the smoke of each stays where it is
(docs/experiments/temporal-prior.md, docs/experiments/made-up-detail.md)."""

MAX_NOISE_GAIN = 5.0
"""Bound of the factor that gives noisy smoke the smooth density's low pass."""

FRESH_ROUNDS = 4
"""Rounds on each scale for smoke that carries nothing on."""

AZIMUTHS = 5
"""Azimuths in a round (docs/experiments/every-view.md)."""

OWN_PICTURE_DEGREES = 10.0
"""Degrees from a camera within which its own picture decides."""

FRESH_STEP, CARRIED_STEP = 0.6, 0.5
"""Fractions of a step towards a picture that are made, for fresh smoke and for carried smoke: more of the second
flickers (docs/experiments/every-view.md)."""

GAIN = (np.pi / 2) ** 0.5
"""1/sqrt(mean sine over all angles): the filter keeps the energy of isotropic detail
(docs/experiments/every-view.md)."""

STEP_RANGE = (0.3, 3.0)
"""Smallest and largest factor on a ray's smoke in one step."""

SHARPENING = 2.0
"""Exponent of the smoke's finest octave, over the fraction that its sides lack of the clip's: with 1 they lack more of
it (docs/experiments/every-view.md)."""

DETAIL_RANGE = (0.5, 2.0)
"""Smallest and largest detail of the clip, over that of the sides, that is taken for true."""

ROW_RANGE = (0.5, 2.0)
"""Smallest and largest factor that gives a row of a picture the smooth density's amount
(docs/experiments/made-up-detail.md)."""

OUTLINE = 0.02
"""Fraction of the largest optical depth of the smooth density, blurred, below which a picture's smoke fades. So it
stays within the outline that the smooth density has from there (docs/experiments/made-up-detail.md)."""

OUTLINE_BLUR = 3.0
"""Standard deviation (voxels) of the blur that `OUTLINE` is measured on."""


@dataclass(frozen=True, eq=False)
class DetailedDepth:
    """Round smoke with detail; see the module.

    `smooth` is the prior of the smooth density, `detail` the strength, above 0 and up to 1. Another `seed` makes
    another plausible smoke of the same clip. Without a `texture` there is no detail.
    """

    smooth: RoundDepth
    detail: float = 1.0
    seed: int = 0
    texture: ClipTexture | None = None

    def of_clip(self, clip: ObservedClip) -> DetailedDepth:
        """Measure a clip's texture."""
        texture, smooth = ClipTexture.of(clip), self.smooth.of_clip(clip)
        if texture is not None:
            texture = replace(texture, roughness=tuple(self.detail * each for each in texture.roughness))
            velocity = texture.drift * texture.turntable.height
            smooth = replace(smooth, wander=Wander(velocity, texture.width, texture.roughness, self.seed))
        return replace(self, smooth=smooth, texture=texture)

    def estimate(self, views: ViewSet) -> DepthEstimate:
        """The smooth density with noise, and the detail that gives it the clip's texture."""
        estimate = self.smooth.estimate(views)
        level = Level(estimate.views, estimate.inside_fraction)
        if self.texture is None or not level.views.hull.any():
            return estimate
        if not unseen_sides(self.texture.turntable, [view.camera for view in views.views]):
            return estimate
        smooth = _smooth_density(level, estimate.density)
        return replace(
            estimate,
            density=self._noisy(smooth, level, self.texture),
            detail=EveryView(self.texture, level, smooth, self.detail),
        )

    def _noisy(self, smooth: Volume, level: Level, texture: ClipTexture) -> Volume:
        """The smooth density with noise that travels with the smoke; its low pass stays."""
        moved = texture.turntable.height * texture.drift * level.views.frame
        values = stretched_noise(level, moved, texture.width, texture.roughness, self.seed)
        np.exp(values, out=values)
        values *= level.views.where.take(smooth)
        noisy = level.views.volume(values)
        gain, now = (level.blurred(each, LOW_PASS * texture.width) for each in (smooth, noisy))
        gain += TINY
        now += TINY
        gain /= now
        values *= np.minimum(gain, np.float32(MAX_NOISE_GAIN), out=gain)
        level.views.where.put(values, noisy)
        return noisy


def _smooth_density(level: Level, density: Volume) -> Volume:
    """A density in the amounts that the cameras' pictures show, found on the coarsest grid."""
    coarser = level.coarser
    if coarser is None:
        fitted = fit_multiplicative(level.terms(), density, SMOOTH_ITERATIONS, SMOOTH_TOLERANCE, level.views.where)
        return fitted.density
    return level.changed_on_coarser(density, lambda means: _smooth_density(coarser, means))


@dataclass(frozen=True, eq=False)
class EveryView:
    """Makes the smoke of a moment look like the clip from every side, from a smooth density (nx, ny, nz).

    `strength` is from 0 to 1.
    """

    texture: ClipTexture
    level: Level
    smooth_density: Volume
    strength: float

    @cached_property
    def coarser(self) -> EveryView | None:
        """The detail on a grid half as fine, with the scales that it holds; None where smoke has few voxels."""
        coarser, texture = self.level.coarser, self.texture
        if coarser is None or len(texture.exemplars) == 1:
            return None
        texture = texture.halved(coarser.views.optics.domain)
        return EveryView(texture, coarser, self.level.coarse_means(self.smooth_density), self.strength)

    def added(self, density: Volume, *, fresh: bool) -> Volume:
        """Scale a density towards the clip's texture and the cameras' pictures in turn; see `Detail`."""
        return self._rounds(density, self.azimuths(), fresh)

    def low_pass(self, density: Volume) -> NDArray[np.float32]:
        """The density (n,) blurred over lobes of smoke; see `Detail`."""
        return self.level.blurred(density, LOW_PASS * self.texture.width)

    def _rounds(self, density: Volume, azimuths: Iterator[tuple[int, float]], fresh: bool) -> Volume:
        """The rounds of all scales; those that a coarser grid holds are done there, with the first of the azimuths."""
        coarser, exemplars = self.coarser, self.texture.exemplars
        if coarser is not None:
            density = self.level.changed_on_coarser(density, lambda means: coarser._rounds(means, azimuths, fresh))
            exemplars = tuple(exemplar for exemplar in exemplars if exemplar.scale == 1)
        if not exemplars:
            return density
        cameras, table, hull = self.level.terms(), self.texture.turntable, self.level.views.hull
        box = list(box_around(hull, 0))
        box[table.axis] = slice(None)  # rays turn about the axis, along which all of the grid stays
        part = tuple(box)
        first, second = (span.start for span in part if span != slice(None))
        smooth = UprightSmoke.of(table, table.upright(self.smooth_density[part]), (first, second))
        relaxation = self.strength * (FRESH_STEP if fresh else CARRIED_STEP)
        for exemplar in exemplars:
            for _ in range(FRESH_ROUNDS if fresh else 1):
                turned = UprightSmoke.of(table, table.upright(density[part]), (first, second))
                seen = [self._step(turned, smooth, exemplar, next(azimuths), relaxation) for _ in range(AZIMUTHS)]
                changed = np.zeros(hull.shape, np.float32)
                np.copyto(changed[part], table.lying(turned.values), where=hull[part])
                if exemplar.scale == 1:
                    changed = self._sharpened(changed, exemplar, seen)
                density = take_turns(cameras, changed, self.level.views.where)
        return density

    def _sharpened(self, density: Volume, exemplar: Exemplar, sides: Sequence[DepthMap]) -> Volume:
        """A density whose finest octave is stronger, or weaker, by what its sides lack of the clip's detail.

        Steps along whole rays hardly reach it, and advection smooths it.
        """
        energy = fine_energy(sides)
        if energy == 0:
            return density
        lack = float(np.clip(np.sqrt(exemplar.fine_energy / energy), *DETAIL_RANGE)) - 1
        fine, coarse = (self.level.blurred(density, blur) + TINY for blur in (SMALLEST_BLUR / 2, SMALLEST_BLUR))
        octave = (fine / coarse) ** np.float32(SHARPENING * self.strength * lack)
        return self.level.views.volume(octave * self.level.views.where.take(density))

    def _step(
        self,
        now: UprightSmoke,
        smooth: UprightSmoke,
        exemplar: Exemplar,
        azimuth: tuple[int, float],
        relaxation: float,
    ) -> DepthMap:
        """Scale smoke (upright, a part of the domain) along the rays of one azimuth towards the clip's texture.

        Its picture before that is returned.
        """
        table, scale = self.texture.turntable, exemplar.scale
        thickness = np.float32(self.level.views.optics.medium.extinction * table.domain.voxel_size)
        turn, degrees = azimuth
        whole, expected = (each.picture(degrees) for each in (now, smooth))
        shown, known = (block_means(thickness * picture, scale) for picture in (whole, expected))
        if not shown.any():
            return shown
        wanted = exemplar.towards(shown, turn)
        outline = ndimage.gaussian_filter(known, OUTLINE_BLUR / (scale * self.level.coarseness))
        wanted *= np.clip(outline / (OUTLINE * outline.max()) - 0.5, 0, 1)
        row_sums, have = (ndimage.gaussian_filter1d(picture.sum(0), 1) for picture in (known, wanted))
        wanted *= np.clip(row_sums / np.maximum(have, 1e-9), *ROW_RANGE)
        faint = FAINT * wanted.max()
        step = np.log(np.clip((wanted + faint) / (shown + faint), *STEP_RANGE))
        step = np.float32(relaxation) * isotropic_filter(step)
        now.scale(enlarged(step, scale, table.shape), degrees)
        return shown

    def azimuths(self) -> Iterator[tuple[int, float]]:
        """Numbers and degrees of azimuths that no camera is near to, spread evenly over all frames."""
        cameras = [self.texture.turntable.degrees(view.camera) for view in self.level.views.views]
        golden = (np.sqrt(5) - 1) / 2  # its multiples, less their whole parts, are spread evenly
        # a frame never takes as many, and 997 is prime to the number of the bases
        turn = 997 * self.level.views.frame
        while True:
            turn += 1
            degrees = 180 * (golden * turn % 1)
            if _unseen(degrees, cameras):
                yield turn, degrees


def isotropic_filter(picture: DepthMap) -> DepthMap:
    """Filter what is laid along the rays of one azimuth, so that the sum over many has no level layers.

    What changes smoke alike along level rays has no detail along them: its Fourier transform lies in the plane through
    the vertical that faces these rays. The planes of all azimuths share the vertical. So the energy of independent
    changes adds up as 1 / k at a wave number k across the vertical, and smoke is drawn up in level layers
    (backprojection without its ramp filter: Kak and Slaney, "Principles of Computerized Tomographic Imaging", 1988,
    ch. 3). Here every wave of a picture (columns, voxels along the axis) is weighed by the root of the sine of its
    angle with the vertical. That undoes the layers and keeps how much of each size there is. What is constant across
    counts as half a wave in twice the columns.
    """
    waves = scipy.fft.dctn(picture)
    across, along = (np.arange(count, dtype=np.float32) / count for count in picture.shape)
    across[0] = 0.5 / picture.shape[0]
    waves *= np.float32(GAIN) * np.sqrt(across[:, None] / np.hypot(across[:, None], along))
    return np.asarray(scipy.fft.idctn(waves, overwrite_x=True), np.float32)


def unseen_sides(turntable: Turntable, cameras: Sequence[Camera]) -> bool:
    """Whether no camera is near to some sides, over a degree at least: azimuths hardly ever fall into less."""
    seen_from = [turntable.degrees(camera) for camera in cameras]
    return any(_unseen(degrees, seen_from, OWN_PICTURE_DEGREES + 0.5) for degrees in range(180))


def _unseen(degrees: float, cameras: Sequence[float], near: float = OWN_PICTURE_DEGREES) -> bool:
    """Whether no camera (degrees) is near to an azimuth."""
    # the back shows what the front shows
    return all(abs((degrees - camera + 90) % 180 - 90) >= near for camera in cameras)
