"""A clip's smoke as an element: with alpha, apart from what is behind it, before anything is reconstructed."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from smokelift.checks import Finding, require_kind
from smokelift.extraction.element import Element, clip_element, evenly_lit_element
from smokelift.extraction.matte import without_fire
from smokelift.extraction.plate import Plate
from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import is_pattern
from smokelift.footage.images import Picture
from smokelift.output.images import write_image
from smokelift.scene import Scene
from smokelift.setup.first_estimate import MAJORITY, first_estimate, first_findings, is_given, sample_smoke
from smokelift.setup.illumination import source_radiance

PATTERN = "element_####.exr"
"""Names of the pictures in a directory."""

ELEMENT_KINDS = (".exr", ".png")
"""Suffixes of pictures that hold an element."""


@dataclass(frozen=True, eq=False)
class Extraction:
    """The elements of a clip. Its clip has to stay open while they are computed.

    Iterating over it yields the `Element` of each frame at the clip's own pixels, in its order; every time anew.

    Attributes
    ----------
    clip
        The footage at its plate's exposure.
    behind
        What is behind the smoke.
    source : (3,)
        The smoke's usual source radiance.
    measured
        Whether the clip has alpha, which is taken as it is, or what is behind the smoke shows it. Black and the smoke's
        own color do not: there the smoke is taken to be evenly lit, and the thickest opaque.
    findings
        What was measured, assumed and noticed of the clip and what is behind the smoke, with the doubts.
    """

    clip: Clip
    behind: Plate
    source: Picture
    measured: bool = True
    findings: tuple[Finding, ...] = ()

    @property
    def plate(self) -> Picture:
        """The clean plate (rows, columns, 3) of the first frame, linear."""
        return self.behind.at(0).image

    def __len__(self) -> int:
        return len(self.clip)

    def __iter__(self) -> Iterator[Element]:
        return (self.element(frame) for frame in range(len(self)))

    def element(self, frame: int) -> Element:
        """Return the element of a frame, counted from 0."""
        if self.measured:
            return clip_element(self.clip, frame, self.behind, self.source, self.clip.size)
        return evenly_lit_element(self.clip.frame(frame), self.behind.at(frame), self.source)

    def write(self, path: str | Path) -> Iterator[Path]:
        """Write the elements as premultiplied linear RGBA (EXR, half) or straight sRGB (PNG, 8 bit); yield each file.

        Parameters
        ----------
        path
            A directory, or a pattern ``element_####.exr`` whose # stand for the frame's number in the clip's file.

        Raises
        ------
        ValueError
            If the pattern ends in neither .exr nor .png.
        OSError
            If a file cannot be written.
        """
        pattern = Path(path)
        if not is_pattern(pattern):
            pattern = pattern / PATTERN
        if pattern.suffix.lower() not in ELEMENT_KINDS:
            raise ValueError(f"{pattern}: elements are written as {' or '.join(ELEMENT_KINDS)}.")
        pattern.parent.mkdir(parents=True, exist_ok=True)
        return self._written(pattern)

    def _written(self, pattern: Path) -> Iterator[Path]:
        digits = pattern.name.count("#")
        before, after = pattern.name.split("#" * digits)
        for frame, element in enumerate(self):
            file = pattern.with_name(f"{before}{self.clip.numbers[frame]:0{digits}d}{after}")
            write_image(file, element.rgba())
            yield file


def extract(clip: Clip, scene: Scene) -> Extraction:
    """Separate a clip's smoke from what is behind it: I = S + T B.

    Parameters
    ----------
    clip
        The footage; it has to stay open while elements are computed.
    scene
        Whatever is known of the shot; its background counts.

    Returns
    -------
    Extraction
        Iterate over it for elements in memory, or `Extraction.write` pictures.

    Raises
    ------
    ValueError
        For bad input (`SceneError` and `ClipError` are ValueErrors too), or if the camera moves and no background is
        given.

    Examples
    --------
    >>> import smokelift
    >>> scene = smokelift.Scene.load("examples/plume/scene.toml")
    >>> with smokelift.Clip.open(scene.clip, frames=(30, 30)) as clip:
    ...     (element,) = smokelift.extract(clip, scene)
    >>> bool(element.transmittance.min() < 0.7 and element.transmittance.max() > 0.95)
    True
    """
    require_kind(clip, Clip, "clip", 'a Clip (Clip.open("clip.mp4") opens one)')
    require_kind(scene, Scene, "scene", "a Scene (Scene() leaves all open, Scene.load reads a file)")
    estimate = first_estimate(clip, scene.camera, scene.background, by_hue=True, with_fire=True)
    findings = [*clip.findings(), *first_findings(estimate, is_given(scene.background, estimate.found))]
    source, measured = estimate.source, estimate.source is not None or estimate.found.kind == "alpha"
    if source is None:
        samples = estimate.samples
        if estimate.hot.burn:
            doused = sample_smoke(without_fire(estimate.clip, estimate.plate), estimate.plate)
            # where most of the light goes with the fire, the smoke is not told apart from it
            samples = doused if doused.change > MAJORITY * samples.change else samples
        source = source_radiance(samples).astype(np.float32)
        if estimate.samples.smoky and not measured:
            findings.append(Finding("alpha of evenly lit smoke", about="alpha", source="assumed"))
    return Extraction(estimate.clip, estimate.plate, source, measured, tuple(findings))
