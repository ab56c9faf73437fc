"""Writes a sequence: one OpenVDB file per frame, of a large one a coarse copy beside it, and one `sequence.json`.

A frame counts once `sequence.json` lists it, which is written after the frame's files. Every file appears whole or not
at all. So a killed run leaves a directory that opens, and the same run can go on from it.
"""

import json
import math
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy.typing as npt

from smokelift.checks import counted, densities
from smokelift.checks.whole_files import atomic_path
from smokelift.output.archive import FLAME, VELOCITY, ResumeState, write_arrays
from smokelift.output.images import write_image
from smokelift.output.index import (
    BACKGROUND,
    BOX,
    DISK_FULL,
    INDEX,
    LOCK,
    MAX_START_NUMBER,
    RESUME,
    DirectoryBusyError,
    Index,
    Lock,
    SequenceError,
    checksum,
    first_change,
    frame_path,
    is_foreign,
    json_value,
    other_program,
    proxy_path,
)
from smokelift.output.vdb import MIN_PROXY_VOXELS, VdbUnavailable, vdb_module, write_proxy, write_vdb
from smokelift.scene import Background, CompleteScene, Domain, scene_to_dict
from smokelift.transport import Array, Faces, Velocity, require_same_shape


class SequenceWriter:
    """Writes a sequence frame by frame; a context manager that holds the directory's lock.

    Leaving the block without an exception completes the sequence. After an exception the finished frames stay
    and ``resume=True`` goes on from them.

    The directory is made if it is missing. It must be empty, or hold the same run unfinished with ``resume``. Scene,
    settings (all that decide the result), choices, provenance and sources are kept in `sequence.json` as JSON can hold
    them: see `smokelift.output.index.Index`. With ``npz`` every frame has a NumPy twin, with velocity on faces. A
    ``background`` (rows, columns, 3) of the scene's picture that was found in the clip is kept as `background.exr`.
    The files of frame 1 have the ``start_number`` in their names, from 0 to `MAX_START_NUMBER`.

    Entering is a SequenceError if another run is at work, the directory holds other files or finished frames or another
    run, or nothing could be written because there is no OpenVDB module.
    """

    def __init__(
        self,
        directory: str | Path,
        scene: CompleteScene,
        settings: Mapping[str, Any],
        *,
        npz: bool = False,
        resume: bool = False,
        background: Array | None = None,
        start_number: int = 1,
        choices: Sequence[Mapping[str, Any]] = (),
        provenance: Sequence[Mapping[str, Any]] = (),
        sources: Mapping[str, Any] | None = None,
    ) -> None:
        self.directory = Path(directory)
        self.state: ResumeState | None = None
        """Where a run that is resumed goes on from, until it writes; None if there is nothing to go on from."""
        self._domain = scene.domain
        self._background = background
        if background is not None:
            scene = replace(scene, background=Background(image=self.directory.resolve() / BACKGROUND))
        # Through JSON, so that it compares equal to what is read back.
        run = {"scene": scene_to_dict(scene, self.directory.resolve()), "settings": dict(settings)}
        origins = json_value({"choices": choices, "provenance": provenance, "sources": sources or {}})
        if not 0 <= start_number <= MAX_START_NUMBER:
            raise ValueError(f"start_number must be from 0 to {MAX_START_NUMBER}, not {start_number}")
        self._index = Index(**json.loads(json.dumps(run, allow_nan=False)), **origins, start_number=start_number)
        self._npz = npz
        self._kinds: tuple[str, ...] = ()
        self._resume = resume
        self._lock = Lock(self.directory / LOCK)

    @property
    def finished(self) -> tuple[int, ...]:
        """Numbers of the frames that need not be computed again, in order."""
        return self._index.numbers

    def box(self, number: int) -> Domain:
        """The box of a finished frame."""
        return self._index.box(number, self._domain)

    def __enter__(self) -> "SequenceWriter":
        self._kinds = written_kinds(self._npz)
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
            if not self._lock.acquire():
                raise DirectoryBusyError(
                    f"{self.directory}: another run is writing into this directory; wait for its end, or choose another"
                )
        except OSError as error:
            raise SequenceError(f"{self.directory}: cannot be written to: {error.strerror}") from error
        try:
            self._take_over()
            self._index.write(self.directory)  # first: without it a run that goes on takes all else for another's
            if self._background is not None:
                write_image(self.directory / BACKGROUND, self._background)
        except OSError as error:
            self._lock.release()
            raise self._write_error(INDEX, error) from error
        except BaseException:
            self._lock.release()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self._check_files()
                self._index = replace(self._index, complete=True)
                self._index.write(self.directory)
                (self.directory / RESUME).unlink(missing_ok=True)
        except OSError as failure:
            raise self._write_error(INDEX, failure) from failure
        finally:
            self._lock.release()

    def write(
        self,
        number: int,
        density: npt.ArrayLike,
        velocity_faces: Faces,
        figures: Mapping[str, Any] | None = None,
        *,
        flame: npt.ArrayLike | None = None,
        box: Domain | None = None,
        ready: Mapping[str, Path] | None = None,
        state: ResumeState | None = None,
    ) -> None:
        """Write one frame and make it count.

        Its number is the one after the last finished. Density and flame (nx, ny, nz), the latter the emission of fire
        in radiance per meter, are not negative; there is none where there can be no fire. The velocity on faces, in
        m/s, has the shapes (nx+1, ny, nz), (nx, ny+1, nz), (nx, ny, nz+1). Figures are numbers and text about the frame
        by name; numbers that are not finite become null. The frame's box, which they keep, has voxels in line with the
        scene's domain; by default it is that. Files that are ``ready``, by their kind ``"vdb"`` or ``"npz"``, hold this
        frame already and are copied. The state is what the next frame depends on; by default density and velocity.

        It raises ValueError if a shape, a value or the number does not fit, and SequenceError if the frame cannot be
        written; the finished ones stay.
        """
        if self.finished and number != self.finished[-1] + 1:
            raise ValueError(f"frame {number} cannot follow frame {self.finished[-1]}: a sequence has no gaps")
        if min(number, self._index.file_number(number)) < 0:
            raise ValueError(f"a frame's number, and that of its file, must not be negative, as of {number}")
        box = box or self._domain
        rho = densities(density, "density", box.shape, math.inf)
        velocity = Velocity(velocity_faces, self._domain.voxel_size)
        require_same_shape("the velocity", velocity.shape, box.shape)
        fire = None if flame is None else densities(flame, FLAME, box.shape, math.inf)
        own_box = {} if box == self._domain else {BOX: {"min": box.min, "max": box.max, "resolution": box.resolution}}
        self.state = None  # a run has gone on by now, and the arrays are large
        state = state or ResumeState(number, rho, velocity.faces)
        try:
            paths = [self._path(number, kind) for kind in self._kinds]
            for kind, path in zip(self._kinds, paths, strict=True):
                if ready is not None and kind in ready:
                    with atomic_path(path) as temporary:
                        shutil.copyfile(ready[kind], temporary)
                elif kind == "vdb":
                    write_vdb(path, rho, velocity, box, self._index.settings, fire, lattice=self._domain)
                else:
                    arrays = {"density": rho, **dict(zip(VELOCITY, velocity.faces, strict=True))}
                    write_arrays(path, arrays if fire is None else {**arrays, FLAME: fire})
            if "vdb" in self._kinds and math.prod(self._domain.shape) >= MIN_PROXY_VOXELS:  # of all frames or of none
                proxy = proxy_path(self.directory, self._index.file_number(number))
                write_proxy(proxy, rho, box, flame=fire, lattice=self._domain)
            frames = {**self._index.frames, str(number): json_value({**(figures or {}), **own_box})}
            checksums = {**self._index.checksums, **{path.name: checksum([path]) for path in paths}}
            grown = replace(self._index, frames=frames, checksums=checksums)
            grown.write(self.directory)
            # Last: a state without its frame would pass for a frame that was lost.
            state.write(self.directory / RESUME)
            self._index = grown  # only now: a run that goes on drops a frame without its state
        except OSError as error:
            raise self._write_error(f"frame {number}", error) from error

    def _path(self, number: int, kind: str) -> Path:
        return frame_path(self.directory, self._index.file_number(number), kind)

    def _take_over(self) -> None:
        """Judge what is in the directory, and read what can be gone on from."""
        there = _earlier_run(self.directory, self._resume)
        if there is None:
            self._clear(INDEX)  # nothing else is written before it
            return
        if what := first_change(there, self._index):
            raise SequenceError(
                f"{self.directory}: was begun differently and cannot be resumed: {what}; choose another directory"
            )
        self._clear("*")
        if not there.complete:
            self.state = self._last_state(there)
        frames = _kept(there, None if self.state is None else self.state.number)
        written = {self._path(int(number), kind).name for number in frames for kind in ("vdb", "npz")}
        checksums = {name: digits for name, digits in there.checksums.items() if name in written}
        self._index = replace(self._index, frames=frames, checksums=checksums, complete=there.complete)
        self._check_files()

    def _clear(self, name: str) -> None:
        """Delete what a killed run has left of a file that it had not finished."""
        for leftover in self.directory.glob(f".{name}.*.tmp"):
            leftover.unlink(missing_ok=True)

    def _last_state(self, there: Index) -> ResumeState | None:
        path = self.directory / RESUME
        try:
            last = ResumeState.last_number(path)
            if last is None:
                return None
            box = there.box(last, self._domain) if str(last) in there.frames else self._domain
            return ResumeState.read(path, box.shape)
        except OSError as error:
            raise _not_resumable(error) from error

    def _check_files(self) -> None:
        """Refuse to go on, or to call the sequence complete, if files of finished frames were taken away."""
        for path in (self._path(number, kind) for number in self.finished for kind in self._kinds):
            if not path.is_file():
                raise SequenceError(
                    f"{path}: is missing, so this run cannot go on with this output; choose another directory"
                )

    def _write_error(self, what: str, error: OSError) -> SequenceError:
        reason = "the disk is full" if error.errno in DISK_FULL else str(error)
        return SequenceError(
            f"{self.directory}: {what} could not be written: {reason}; "
            f"finished frames stay ({len(self.finished)}), and a resumed run goes on from them"
        )


def check_directory(directory: Path, *, resume: bool) -> None:
    """Refuse, before anything is computed or written, a directory that a `SequenceWriter` would refuse for itself."""
    if directory.is_dir():
        _earlier_run(directory, resume)
    nearest = next(folder for folder in (directory, *directory.absolute().parents) if folder.exists())
    if not nearest.is_dir() or not os.access(nearest, os.W_OK | os.X_OK):
        raise SequenceError(f"{directory}: cannot be written to: {nearest} is no folder, or may not be changed")


def count_finished(directory: Path) -> int:
    """Return how many frames of a directory a `SequenceWriter` that resumes its run would keep."""
    if not (directory / INDEX).is_file():
        return 0
    try:
        return len(_kept(Index.read(directory), ResumeState.last_number(directory / RESUME)))
    except OSError as error:
        raise _not_resumable(error) from error


def _kept(there: Index, last: int | None) -> dict[str, Mapping[str, Any]]:
    """The frames of an earlier run that need not be computed again; ``last`` is the one that its state is of."""
    # a frame counts in the index before its state is written, so that a killed run may have one more
    return {
        number: figures
        for number, figures in there.frames.items()
        if there.complete or (last is not None and int(number) <= last)
    }


def _not_resumable(error: OSError) -> SequenceError:
    return SequenceError(f"{error}; this run cannot be resumed, choose another directory")


def written_kinds(npz: bool) -> tuple[str, ...]:
    """Return the kinds of files of a frame: without an OpenVDB module the NumPy twin alone, if twins are asked for.

    It raises SequenceError if nothing could be written.
    """
    try:
        vdb_module()
    except VdbUnavailable as error:
        if not npz:
            raise SequenceError(f"{error}, or write NumPy files only with --npz") from error
        return ("npz",)
    return ("vdb", "npz") if npz else ("vdb",)


def _earlier_run(directory: Path, resume: bool) -> Index | None:
    """The run in a directory that can be gone on with, or None if there is nothing; SequenceError for all else."""
    names = sorted(file.name for file in directory.iterdir() if not file.name.startswith("."))
    has_index = INDEX in names
    # Without an index nothing here was written by a run, whatever it is called.
    foreign = [name for name in names if is_foreign(name) or not (has_index or name == LOCK)]
    if foreign:
        raise SequenceError(
            f"{directory}: holds other files ({foreign[0]}); nothing was overwritten, choose an empty directory"
        )
    there = Index.read(directory) if has_index else None
    if there is not None and resume and not there.complete and (what := other_program(there)):
        raise SequenceError(
            f"{directory}: was begun by another version of Smokelift or of a library ({what}), so new frames would not "
            "fit the finished ones, which stay; go on with that version, or begin anew under another name"
        )
    if there is None or resume:
        return there
    if there.frames:
        count = counted(len(there.frames), "finished frame")
        raise SequenceError(f"{directory}: holds {count}; resume the run, or choose another directory")
    return None
