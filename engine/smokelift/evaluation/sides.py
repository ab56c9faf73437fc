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


def look_from_sides(sequence: Sequence, truth: Truth | None, filmed: ReferenceView | None, shown: set[int]) -> Sides:
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
    means = {degrees: PictureMeans(found.background(degrees)) for degrees in DEGREES}
    series = {degrees: PictureSeries() for degrees in DEGREES}
    pictures: dict[int, list[Image]] = {}
    for number in sequence.frames:
        density = sequence.density(number)
        ahead = found.front(density) if filmed is None else _filmed_smoke(filmed, number)
        front.add(ahead)
        images = found.look(density, ahead)
        if truth is None or true is None:
            for degrees, image in images.items():
                series[degrees].add(smoke_picture(image, found.background(degrees)))
            tiles = list(images.values())
        else:
            beside = true.look(truth.density(first_frame(sequence) + number - 1), ahead)
            for degrees, image in images.items():
                means[degrees].add(image, beside[degrees])
            tiles = [picture for degrees in DEGREES for picture in (beside[degrees], images[degrees])]
        if number in shown:
            pictures[number] = tiles
    reference = front.statistics()
    views: list[Figures] = []
    for degrees in DEGREES:
        statistics = series[degrees].statistics() if true is None else means[degrees].statistics()[0]
        against_truth = {} if true is None else means[degrees].figures()
        from_front = beside_references(statistics, [reference])
        views.append({"degrees": degrees} | against_truth | _described(statistics) | from_front)
    figures: Figures = {
        "reference": "the sequence's own front" if filmed is None else "the input's pictures",
        "front": _described(reference),
        "views": views,
        **found.figures(),
        **({} if true is None else {f"{name}_truth": value for name, value in true.figures().items()}),
    }
    return Sides(figures, pictures)


class _Densities:
    """Looks at densities (nx, ny, nz) of one scene from the sides, and keeps what is found there."""

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

    def look(self, density: Volume, front: Array) -> dict[int, Image]:
        """Render a frame from all of `DEGREES`, and compare these pictures with the front's."""
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
