"""Reads a sequence: the scene, settings and frames that a reconstruction wrote, and what cameras see of them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from smokelift.checks import require_kind, shown
from smokelift.extraction.given_background import background_picture, behind, open_plates
from smokelift.footage.frame_source import DEFAULT_FPS
from smokelift.output.archive import FLAME, VELOCITY, read_arrays
from smokelift.output.index import INDEX, Index, SequenceError, checksum, directory_path, frame_path
from smokelift.output.vdb import read_grid
from smokelift.render import Image, Renderer, Volume, scene_optics
from smokelift.render.emission import emitted
from smokelift.scene import Camera, CompleteScene, Domain, completed, scene_from_dict, shared_part
from smokelift.transport import Array, Velocity, at_centres, face_shapes, on_faces


@dataclass(frozen=True)
class Sequence:
    """A finished or growing sequence on disk; made by :meth:`open`.

    Its methods raise a SequenceError if there is no frame of a number, or its file is missing, damaged, or not the one
    that was written.

    Attributes
    ----------
    directory
        Where it lies.
    scene, settings
        What it was made from. Its domain holds the boxes of all frames.
    versions
        Of the software that made it.
    frames
        Numbers of its frames, in order; frame 1 is the first that was used of the clip.
    complete
        Whether the run that made it came to its end.
    choices
        What was chosen for the clip: ``what``, ``chosen``, ``kind``, ``reason``, ``measured``, ``tolerance`` and
        ``by_hand`` of each (see `smokelift.report`).
    provenance
        What of the result is measured, estimated, assumed and made up: ``what``, ``origin``, ``how``, ``kind``,
        ``figures`` and ``settings`` of each part (see `smokelift.report`).
    start_number
        Number in the names of the files of frame 1.
    """

    directory: Path
    scene: CompleteScene
    settings: Mapping[str, Any]
    versions: Mapping[str, str]
    frames: tuple[int, ...]
    complete: bool
    choices: tuple[Mapping[str, Any], ...]
    provenance: tuple[Mapping[str, Any], ...]
    start_number: int
    _boxes: Mapping[int, Domain]
    _index: Index

    @classmethod
    def open(cls, directory: str | Path) -> "Sequence":
        """Open a directory that a reconstruction wrote.

        Raises
        ------
        SequenceError
            If there is no sequence, or it is damaged.
        """
        directory = directory_path(directory)
        if directory.is_file():
            raise SequenceError(f"{directory}: is a file; give the directory of the sequence")
        index = Index.read(directory)
        try:
            scene = completed(scene_from_dict(index.scene, str(directory / INDEX), directory))
            boxes = {number: index.box(number, scene.domain) for number in index.numbers}
        except ValueError as error:
            raise SequenceError(str(error)) from error
        return cls(
            directory,
            replace(scene, domain=box_around_all(scene.domain, boxes.values())),
            index.settings,
            index.versions,
            index.numbers,
            index.complete,
            tuple(index.choices),
            tuple(index.provenance),
            index.start_number,
            boxes,
            index,
        )

    @property
    def fps(self) -> float:
        """Frames per second: those of the clip, or `DEFAULT_FPS` where the scene does not say them."""
        clip = self.scene.clip
        return (clip.fps if clip is not None else None) or DEFAULT_FPS

    def file_number(self, number: int) -> int:
        """Return the number in the names of a frame's files."""
        return self._index.file_number(number)

    def box(self, number: int) -> Domain:
        """Return the box of a frame's files. Beyond it, in the scene's domain, there is nothing."""
        self._check(number)
        return self._boxes[int(number)]

    def within(self, box: Domain) -> "Sequence":
        """Return the sequence as it is in a box, with voxels in line with its own; what is outside is left out."""
        return replace(self, scene=replace(self.scene, domain=box))

    def density(self, number: int) -> Array:
        """Return the density of a frame, shape (nx, ny, nz): the NumPy twin's if there is one."""
        (density,) = self._read(number, "density")
        if density.min() < 0:
            raise SequenceError(f"{self.directory}: frame {number} holds negative densities; write it again")
        return density

    def flame(self, number: int) -> Array | None:
        """Return the emission of fire in a frame, shape (nx, ny, nz); None where the clip or the file has none.

        It is radiance per meter, of the color ``scene.medium.flame_color``.
        """
        self._check(number)
        if self.scene.medium.flame_color is None:  # the clip shows no fire: the file need not be read again
            return None
        flame = next(iter(self._read(number, FLAME)), None)
        if flame is not None and flame.min() < 0:
            raise SequenceError(f"{self.directory}: frame {number} holds a negative emission")
        return flame

    def velocity(self, number: int) -> Velocity:
        """Return the velocity of a frame in m/s, with the walls of the scene.

        It is the NumPy twin's; from an OpenVDB file it is the mean of the values at the centers beside a face, zero
        further than two voxels from smoke and not free of divergence.
        """
        found = self._read(number, "velocity")
        x, y, z = found if len(found) == 3 else on_faces(*found)
        return Velocity((x, y, z), self.scene.domain.voxel_size, self.scene.closed)

    def velocity_at_centres(self, number: int) -> Array:
        """Return the velocity of a frame in m/s at voxel centers, shape (nx, ny, nz, 3).

        These are the values of an OpenVDB file as it holds them; those of :meth:`velocity` are smoothed by the way to
        faces and back.
        """
        found = self._read(number, "velocity")
        return found[0] if len(found) == 1 else np.stack(at_centres((found[0], found[1], found[2])), -1)

    def files(self, number: int) -> Mapping[str, Path]:
        """Return the files of a frame by their kind, ``"vdb"`` or ``"npz"``."""
        self._check(number)
        paths = {kind: frame_path(self.directory, self.file_number(number), kind) for kind in ("vdb", "npz")}
        there = {kind: path for kind, path in paths.items() if path.is_file()}
        for path in there.values():
            self._check_sum(path)
        return there

    def render(self, number: int, camera: Camera | None = None) -> Image:
        """Render a frame as the scene's own camera sees it, or another.

        Use a `Viewer` for many frames of one camera: it sets up its renderer once.

        Parameters
        ----------
        number
            One of :attr:`frames`.
        camera
            By default the scene's own, as it stands in that frame. A moving camera has a matrix for every frame.

        Returns
        -------
        (rows, columns, 3) float32
            Linear radiance before the background that :class:`Viewer` describes.
        """
        return Viewer(self.scene, camera).image(number, self.density(number), self.flame(number))

    def figures(self, number: int) -> Mapping[str, Any]:
        """Return what was noted about a frame."""
        self._check(number)
        return dict(self._index.frames[str(number)])

    def _check(self, number: int) -> None:
        if number not in self.frames or not isinstance(number, int | np.integer):
            span = f"it has {self.frames[0]} to {self.frames[-1]}" if self.frames else "it has none"
            raise SequenceError(f"{self.directory}: there is no frame {shown(number)}; {span}")

    def _check_sum(self, path: Path) -> None:
        written = self._index.checksums.get(path.name)
        if written is not None and checksum([path]) != written:
            raise SequenceError(
                f"{path}: is not the file that was written: it is damaged, or was changed since; copy or make it again"
            )

    def _read(self, number: int, name: str) -> list[Array]:
        """The grid of that name, empty if it is of an emission that is not there; a NumPy twin's velocity on faces."""
        self._check(number)
        twin, grids = (frame_path(self.directory, self.file_number(number), kind) for kind in ("npz", "vdb"))
        whole, box = self.scene.domain, self._boxes[int(number)]
        path = twin if twin.is_file() else grids
        if not path.is_file():
            raise SequenceError(f"{path}: is missing")
        try:
            self._check_sum(path)
            if path is twin:
                if name == "velocity":
                    arrays = read_arrays(path, dict(zip(VELOCITY, face_shapes(box.shape), strict=True)))
                elif name == FLAME:
                    arrays = read_arrays(path, {}, others={FLAME: box.shape})
                else:
                    arrays = read_arrays(path, {name: box.shape})
                return [_placed(values, box, whole) for values in arrays.values()]
            values = read_grid(path, name, whole)
        except OSError as error:
            raise SequenceError(str(error)) from error
        if values is None and name != FLAME:
            raise SequenceError(f"{path}: lacks {name}")
        return [] if values is None else [values]


def box_around_all(domain: Domain, boxes: Iterable[Domain]) -> Domain:
    """Return a domain, grown until it holds all boxes, whose voxels are in line with its own."""
    below, above = [0, 0, 0], [0, 0, 0]
    for box in boxes:
        for axis, part in enumerate(box.slices_in(domain)):
            below[axis] = max(below[axis], -part.start)
            above[axis] = max(above[axis], part.stop - domain.resolution[axis])
    return domain.grown(tuple(below), tuple(above)) if any(below + above) else domain


def _placed(values: Array, box: Domain, whole: Domain) -> Array:
    """The values of a box's voxels, or of its faces, in another domain; zero where the box has none."""
    if box == whole:
        return values
    missing, inside = [], []
    for start, count, own, room in zip(box.first_in(whole), values.shape, box.shape, whole.shape, strict=True):
        wanted = room + count - own  # one more along the axis of faces
        missing.append((max(start, 0), max(wanted - start - count, 0)))
        inside.append(slice(max(-start, 0), max(-start, 0) + wanted))
    return np.ascontiguousarray(np.pad(values, missing)[tuple(inside)], np.float32)


class Viewer:
    """Renders the frames of a sequence for one camera; where nothing moves, one renderer serves all of them.

    By default that is the scene's own camera, before the scene's background;
    `smokelift.extraction.given_background.behind` says what another camera sees of a clean plate. A background that is
    given, (rows, columns, 3) or (3,), is linear radiance.
    """

    def __init__(self, scene: CompleteScene, camera: Camera | None = None, background: Image | None = None) -> None:
        require_kind(camera, Camera | None, "camera", "a Camera")
        self._scene, self._camera = scene, camera or scene.camera
        self._optics = scene_optics(scene)
        self._plates = open_plates(scene.background, scene.camera) if background is None else None
        self._first = scene.clip.first if scene.clip is not None else 0
        self._given = background
        self._moves = self._plates is not None or scene.camera.moves or self._camera.moves
        self._renderers: dict[int, Renderer] = {}

    def image(self, number: int, density: Volume, flame: Volume | None = None) -> Image:
        """Render a density (nx, ny, nz) as a frame, from 1; linear radiance (rows, columns, 3).

        The light of a flame (nx, ny, nz), radiance per meter, is added; that the smoke is lit by it is not shown.
        """
        frame = number - 1 if self._moves else 0
        if frame not in self._renderers:
            renderer = self._optics.renderer(self._camera.at(frame), self.background(frame + 1))
            self._renderers = {frame: renderer}
        image = self._renderers[frame].image(density)
        color = self._scene.medium.flame_color
        if flame is None or color is None:
            return image
        light = emitted(flame, density, self._camera.at(frame), self._optics)
        return np.asarray(image + light[..., None] * np.array(color, np.float32))

    def background(self, number: int) -> Image:
        """What is behind the smoke in a frame, from 1; linear radiance (rows, columns, 3) or (3,)."""
        if self._given is not None:
            return self._given
        frame = number - 1
        own, camera = self._scene.camera.at(frame), self._camera.at(frame)
        if self._plates is None or shared_part(own, camera) is None:
            return self._steady
        return behind(self._plates.frame(self._first + frame), own, camera)

    @cached_property
    def _steady(self) -> Image:
        """What is behind the smoke in all frames where the frame's own plate is not seen."""
        return background_picture(self._scene, self._camera.at(0))
