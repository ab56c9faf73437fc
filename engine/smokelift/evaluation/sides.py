"""Whether a sequence looks and moves like smoke from sides that no camera filmed, with or without the truth."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from smokelift.evaluation import metrics
from smokelift.evaluation.copies import SideCopies
from smokelift.evaluation.frame_means import Figures, PictureMeans, smoke_picture
from smokelift.evaluation.picture_statistics import PictureSeries, PictureStatistics, beside_references
from smokelift.evaluation.reference_view import ReferenceView, at_most, first_frame
from smokelift.evaluation.series import finite_mean
from smokelift.evaluation.truth import Truth
from smokelift.output.sequence import Sequence
from smokelift.output.viewer import Viewer
from smokelift.render import Image, Volume
from smokelift.scene import CompleteScene, orbit
from smokelift.transport import Array

BETWEEN, SIDE = 45, 90
DEGREES = (BETWEEN, SIDE, 135)
"""By which the input's camera is carried around the smoke."""


@dataclass(frozen=True, eq=False)
class Sides:
    """What was found.

    Attributes
    ----------
    figures
        Nested plain values, as JSON holds them.
    pictures
        Of the frames that were asked for, by number: for each of `DEGREES` the true picture, if the truth is known, and
        the sequence's; linear radiance (rows, columns, 3).
    """

    figures: Figures
    pictures: dict[int, list[Image]]


def evaluate_sides(sequence: Sequence, truth: Truth | None, filmed: ReferenceView | None, shown: set[int]) -> Sides:
    """Render a sequence from the sides, and the truth beside it, and compare both with the front in their statistics.

    Parameters
    ----------
    sequence
        With at least one frame.
    truth
        Of the sequence's box, if it is known; it is rendered with the sequence's medium and lights.
    filmed
        The input: what smoke looks like. Without it the sequence's own front has to do.
    shown
        Frames whose pictures are kept.
    """
    found = _Densities(sequence.scene)
    true = None if truth is None else _Densities(_on_grid(sequence.scene, truth.shape))
    front = PictureSeries()
    views = {degrees: _View(found.background(degrees)) for degrees in DEGREES}
    pictures: dict[int, list[Image]] = {}
    for number in sequence.frames:
        density = sequence.density(number)
        ahead = found.front(density) if filmed is None else _filmed_smoke(filmed, number)
        front.add(ahead)
        images = found.render(density, ahead)
        true_images: dict[int, Image] = {}
        if truth is not None and true is not None:
            true_images = true.render(truth.density(first_frame(sequence) + number - 1), ahead)
        for degrees, view in views.items():
            view.add(images[degrees], true_images.get(degrees))
        if number in shown:
            pairs = ((true_images.get(degrees), images[degrees]) for degrees in DEGREES)
            pictures[number] = [picture for pair in pairs for picture in pair if picture is not None]
    reference = front.statistics()
    figures: Figures = {
        "reference": "the sequence's own front" if filmed is None else "the input's pictures",
        "front": _described(reference),
        "views": [{"degrees": degrees} | view.figures(reference) for degrees, view in views.items()],
        **found.figures(),
        **({} if true is None else {f"{name}_truth": value for name, value in true.figures().items()}),
    }
    return Sides(figures, pictures)


class _View:
    """Gathers what a sequence shows at one angle, beside the truth where that is known.

    Parameters
    ----------
    background : (rows, columns, 3) or (3,)
        Linear radiance behind the smoke.
    """

    def __init__(self, background: Image) -> None:
        self._background = background
        self._alone = PictureSeries()
        self._beside_truth: PictureMeans | None = None

    def add(self, image: Image, true: Image | None) -> None:
        """Add a frame's picture, and the true one if it is known: in all frames or in none."""
        if true is None:
            self._alone.add(smoke_picture(image, self._background))
            return
        if self._beside_truth is None:
            self._beside_truth = PictureMeans(self._background)
        self._beside_truth.add(image, true)

    def figures(self, reference: PictureStatistics) -> Figures:
        """Return what the pictures look like, against the truth and beside a reference."""
        if self._beside_truth is None:
            found, against_truth = self._alone.statistics(), {}
        else:
            found, against_truth = self._beside_truth.statistics()[0], self._beside_truth.figures()
        return against_truth | _described(found) | beside_references(found, [reference])


class _Densities:
    """Renders densities (nx, ny, nz) of one scene from the sides, and keeps what is found there."""

    def __init__(self, scene: CompleteScene) -> None:
        camera = at_most(scene.camera.at(0))
        self._along_rays = int(np.argmax(np.abs(np.array(camera.matrix)[:3, 2])))
        self._viewers = {degrees: Viewer(scene, orbit(camera, scene.domain, degrees)) for degrees in (0, *DEGREES)}
        self._copies = SideCopies()
        self._anisotropy: list[float] = []

    def background(self, degrees: int) -> Image:
        return self._viewers[degrees].background(1)

    def front(self, density: Volume) -> Array:
        return self._smoke(0, self._viewers[0].image(1, density))

    def render(self, density: Volume, front: Array) -> dict[int, Image]:
        """Render a frame from all of `DEGREES`, (rows, columns, 3) each, and compare these with the front's smoke."""
        images = {degrees: self._viewers[degrees].image(1, density) for degrees in DEGREES}
        self._copies.add(front, *(self._smoke(degrees, images[degrees]) for degrees in (BETWEEN, SIDE)))
        self._anisotropy.append(metrics.depth_anisotropy(density, self._along_rays))
        return images

    def figures(self) -> Figures:
        return self._copies.figures() | {"depth_anisotropy": finite_mean(self._anisotropy)}

    def _smoke(self, degrees: int, image: Image) -> Array:
        return smoke_picture(image, self.background(degrees))


def _described(found: PictureStatistics) -> Figures:
    shares = metrics.octave_shares(found.power).tolist() if found.power.sum() > 0 else None
    return {**found.figures, "octave_shares": shares}


def _filmed_smoke(view: ReferenceView, number: int) -> Array:
    return smoke_picture(view.picture(number), view.background)


def _on_grid(scene: CompleteScene, shape: tuple[int, int, int]) -> CompleteScene:
    return replace(scene, domain=replace(scene.domain, resolution=shape))
