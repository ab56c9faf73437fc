"""The output directory of a reconstruction: one OpenVDB file a frame and one `sequence.json`.

A frame counts once `sequence.json` lists it, which is written after the frame's files, and every file appears
whole or not at all. So a run that was killed leaves a directory that opens, and that the same run can go on
from: `resume.npz` holds what the coupled loop carries from one frame to the next, at full precision (OpenVDB
files hold 16 bits), and goes away when the run is complete.

Two runs into one directory are kept apart by an operating system lock on `run.lock`. The system frees it
when its process ends, however it ends, so there are no stale locks to judge.
"""

from __future__ import annotations

import errno
import io
import json
import math
import os
import platform
import re
import sys
import zipfile
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from smokelift.output.files import atomic_path
from smokelift.output.images import write_image
from smokelift.output.vdb import read_vdb, vdb_module, write_vdb
from smokelift.scene import Background, Domain, Scene, scene_from_dict, scene_to_dict
from smokelift.transport import Velocity

Array = npt.NDArray[np.float32]
Faces = tuple[Array, Array, Array]

FORMAT = 1
"""Version of `sequence.json`."""

_INDEX, _RESUME, _LOCK = "sequence.json", "resume.npz", "run.lock"
_BACKGROUND = "background.exr"
_OURS = re.compile(r"smoke_\d{4,}\.(vdb|npz)|sequence\.json|background\.exr|resume\.npz|run\.lock")


class SequenceError(ValueError):
    """A directory that cannot be written to or opened, and why."""


@dataclass(frozen=True)
class ResumeState:
    """What a reconstruction carries from one frame to the next.

    Attributes
    ----------
    number
        The last finished frame.
    density
        Its density, shape (nx, ny, nz).
    velocity
        Its velocity on faces, m/s.
    extra
        Further named arrays, as they were given to :meth:`SequenceWriter.write`.
    """

    number: int
    density: Array
    velocity: Faces
    extra: Mapping[str, npt.NDArray[Any]]


class SequenceWriter:
    """Writes a sequence frame by frame; a context manager that holds the directory's lock.

    Leaving the block without an exception completes the sequence. After an exception the finished frames stay
    and ``resume=True`` goes on from them.

    Parameters
    ----------
    directory
        Made if missing. It must be empty, or hold the same run unfinished with ``resume``.
    scene
        The complete scene, with its domain; kept in `sequence.json`.
    settings
        All settings that decide the result, as JSON can hold them.
    npz
        Whether to write a NumPy twin of every frame, with velocity on faces.
    resume
        Whether to go on from the finished frames in the directory. An empty directory starts a new run.
    background
        An estimated background of the scene's picture, shape (height, width, 3), kept as `background.exr`.
    choices
        What was chosen for the clip and why, as JSON can hold it. Kept, and not compared when a run goes on: what they
        decided is in the scene and the settings.

    Attributes
    ----------
    finished
        Numbers of the frames that need not be computed again, in order.
    state
        Where to go on from; None before the first frame, and after the last.

    Raises
    ------
    SequenceError
        On entering: another run is at work, the directory holds other files or finished frames or another
        run, or nothing could be written because there is no OpenVDB module.
    """

    def __init__(
        self,
        directory: str | Path,
        scene: Scene,
        settings: Mapping[str, Any],
        *,
        npz: bool = False,
        resume: bool = False,
        background: Array | None = None,
        choices: Iterable[Mapping[str, Any]] = (),
    ) -> None:
        if scene.domain is None:
            raise SequenceError("a sequence needs a scene with a domain")
        self.directory = Path(directory)
        self._domain: Domain = scene.domain
        self._background = background
        self._choices = [_jsonable(choice) for choice in choices]
        if background is not None:
            scene = replace(scene, background=Background(image=self.directory / _BACKGROUND))
        self.finished: tuple[int, ...] = ()
        self.state: ResumeState | None = None
        self._npz = npz
        self._vdb = False
        self._resume = resume
        self._lock = _Lock(self.directory / _LOCK)
        # Through JSON, so that it compares equal to what is read back.
        run = {"scene": scene_to_dict(scene, self.directory.resolve()), "settings": dict(settings)}
        self._run: dict[str, Any] = json.loads(json.dumps(run, allow_nan=False))
        self._frames: dict[int, dict[str, Any]] = {}
        self._complete = False

    def __enter__(self) -> SequenceWriter:
        self._vdb = _vdb_there(required=not self._npz)
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
            self._lock.acquire()
        except OSError as error:
            raise SequenceError(f"{self.directory}: cannot be written to: {error.strerror}") from error
        try:
            self._take_over()
            if self._background is not None:
                write_image(self.directory / _BACKGROUND, self._background)
            self._write_index()
        except OSError as error:
            self._lock.release()
            raise self._failed("sequence.json", error) from error
        except BaseException:
            self._lock.release()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self._complete = True
                self._write_index()
                (self.directory / _RESUME).unlink(missing_ok=True)
        except OSError as failure:
            raise self._failed("sequence.json", failure) from failure
        finally:
            self._lock.release()

    def write(
        self,
        number: int,
        density: npt.ArrayLike,
        velocity_faces: tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike],
        figures: Mapping[str, Any] | None = None,
        extra: Mapping[str, npt.ArrayLike] | None = None,
    ) -> None:
        """Write one frame and make it count.

        Parameters
        ----------
        number
            The frame's number in its file name, the one after the last finished.
        density
            Shape (nx, ny, nz), not negative.
        velocity_faces
            m/s, shapes (nx+1, ny, nz), (nx, ny+1, nz), (nx, ny, nz+1).
        figures
            What is worth knowing about the frame: numbers and text by name. Those that are not finite become
            null.
        extra
            Further arrays that the next frame depends on, for :attr:`state`.

        Raises
        ------
        ValueError
            If a shape does not fit the domain, a value is not finite, a density negative, or the number out
            of order.
        SequenceError
            If the frame cannot be written; the finished ones stay.
        """
        if self._frames and number != max(self._frames) + 1:
            raise ValueError(f"frame {number} cannot follow frame {max(self._frames)}: a sequence has no gaps")
        if number < 0:
            raise ValueError(f"a frame's number must not be negative, as {number} is")
        rho, faces = _checked(density, velocity_faces, self._domain.shape)
        entry = {name: _jsonable(value) for name, value in (figures or {}).items()}
        # The caller may use its arrays again; what is kept here must not change with them.
        state = ResumeState(
            number,
            rho.copy(),
            faces,
            {key: np.asarray(value) for key, value in (extra or {}).items()},
        )
        try:
            if self._npz:
                _save_arrays(
                    _frame_path(self.directory, number, "npz"),
                    {"density": rho, "velocity_x": faces[0], "velocity_y": faces[1], "velocity_z": faces[2]},
                )
            if self._vdb:
                write_vdb(
                    _frame_path(self.directory, number, "vdb"),
                    rho,
                    Velocity(faces, self._domain.voxel_size).centres(),
                    self._domain,
                    self._run["settings"],
                )
            self._frames[number] = entry
            self._write_index()
            # Last: a state without its frame could not be told from a frame that was lost.
            _save_state(self.directory / _RESUME, state)
        except OSError as error:
            raise self._failed(f"frame {number}", error) from error
        self.state = state
        self.finished = tuple(sorted(self._frames))

    def _take_over(self) -> None:
        """Judge what is in the directory, and read what can be gone on from."""
        names = sorted(file.name for file in self.directory.iterdir())
        # What begins with a dot is ours from a killed run, or the file manager's.
        foreign = [name for name in names if not name.startswith(".") and not _OURS.fullmatch(name)]
        has_index = _INDEX in names
        if foreign or (not has_index and any(name != _LOCK and _OURS.fullmatch(name) for name in names)):
            example = foreign[0] if foreign else next(name for name in names if name != _LOCK)
            raise SequenceError(
                f"{self.directory}: holds other files ({example}); nothing was overwritten, choose an empty directory"
            )
        if not has_index:
            return
        index = _read_index(self.directory)
        if not self._resume:
            if index["frames"]:
                raise SequenceError(
                    f"{self.directory}: holds {len(index['frames'])} finished frames; go on with --resume, "
                    "or choose another directory"
                )
            return
        difference = _difference("", {name: index[name] for name in self._run}, self._run)
        if difference:
            raise SequenceError(
                f"{self.directory}: was begun differently and cannot be resumed: {difference}; choose another directory"
            )
        for leftover in self.directory.glob(".*.tmp"):
            leftover.unlink(missing_ok=True)
        frames = {int(number): figures for number, figures in index["frames"].items()}
        self._complete = bool(index["complete"])
        if not self._complete:
            self.state = _load_state(self.directory / _RESUME)
            last = self.state.number if self.state is not None else -1
            frames = {number: figures for number, figures in frames.items() if number <= last}
        frames = self._with_files(frames)
        self._frames = frames
        self.finished = tuple(sorted(frames))

    def _with_files(self, frames: dict[int, dict[str, Any]]) -> dict[int, dict[str, Any]]:
        """Return the frames if all their files are there, and refuse to go on if some were taken away."""
        kinds = [kind for kind, wanted in (("vdb", self._vdb), ("npz", self._npz)) if wanted]
        for number in frames:
            for kind in kinds:
                path = _frame_path(self.directory, number, kind)
                if not path.is_file():
                    raise SequenceError(
                        f"{path}: is missing, so this run cannot be resumed with this output; choose another directory"
                    )
        return frames

    def _write_index(self) -> None:
        index = {
            "format": FORMAT,
            "complete": self._complete,
            "versions": software_versions(),
            **self._run,
            "choices": self._choices,
            "frames": {str(number): self._frames[number] for number in sorted(self._frames)},
        }
        with atomic_path(self.directory / _INDEX) as aside:
            aside.write_text(json.dumps(index, indent=1, allow_nan=False) + "\n", encoding="utf-8")

    def _failed(self, what: str, error: OSError) -> SequenceError:
        reason = "the disk is full" if error.errno in (errno.ENOSPC, errno.EDQUOT) else str(error)
        return SequenceError(
            f"{self.directory}: {what} could not be written: {reason}; "
            f"{len(self.finished)} finished frames stay and --resume goes on from them"
        )


@dataclass(frozen=True)
class Sequence:
    """A finished or growing sequence on disk; made by :meth:`open`.

    Attributes
    ----------
    directory
        Where it lies.
    scene, settings
        What it was made from.
    versions
        Of the software that made it.
    frames
        Numbers of its frames, in order.
    complete
        Whether the run that made it came to its end.
    choices
        What was chosen for the clip: ``what``, ``chosen``, ``reason``, ``measured``, ``tolerance`` and ``by_hand`` of
        each (see `smokelift.setup`).
    """

    directory: Path
    scene: Scene
    settings: Mapping[str, Any]
    versions: Mapping[str, str]
    frames: tuple[int, ...]
    complete: bool
    choices: tuple[Mapping[str, Any], ...]
    _figures: Mapping[str, Mapping[str, Any]]

    @classmethod
    def open(cls, directory: str | Path) -> Sequence:
        """Open a directory that a reconstruction wrote.

        Raises
        ------
        SequenceError
            If there is no sequence, or it is damaged.
        """
        directory = Path(directory)
        index = _read_index(directory)
        try:
            scene = scene_from_dict(index["scene"], str(directory / _INDEX), directory)
        except ValueError as error:
            raise SequenceError(str(error)) from error
        frames = tuple(sorted(int(number) for number in index["frames"]))
        choices = tuple(index.get("choices", ()))  # early versions made none
        return cls(
            directory, scene, index["settings"], index["versions"], frames, index["complete"], choices, index["frames"]
        )

    def density(self, number: int) -> Array:
        """Return the density of a frame, shape (nx, ny, nz): the NumPy twin's if there is one.

        Raises
        ------
        SequenceError
            If there is no such frame, or its file is missing or damaged.
        """
        path = self._path(number)
        if path.suffix == ".npz":
            return _load_arrays(path, ("density",))[0]
        return self._read_vdb(path)[0]

    def velocity(self, number: int) -> Array:
        """Return the velocity of a frame in m/s at voxel centres, shape (nx, ny, nz, 3).

        From an OpenVDB file it is zero further than two voxels from smoke.

        Raises
        ------
        SequenceError
            If there is no such frame, or its file is missing or damaged.
        """
        path = self._path(number)
        if path.suffix == ".npz":
            x, y, z = _load_arrays(path, ("velocity_x", "velocity_y", "velocity_z"))
            assert self.scene.domain is not None
            return Velocity((x, y, z), self.scene.domain.voxel_size).centres()
        return self._read_vdb(path)[1]

    def figures(self, number: int) -> Mapping[str, Any]:
        """Return what was noted about a frame.

        Raises
        ------
        SequenceError
            If there is no such frame.
        """
        self._check(number)
        return self._figures[str(number)]

    def _check(self, number: int) -> None:
        if number not in self.frames:
            span = f"it has {self.frames[0]} to {self.frames[-1]}" if self.frames else "it has none"
            raise SequenceError(f"{self.directory}: there is no frame {number}; {span}")

    def _path(self, number: int) -> Path:
        self._check(number)
        for kind in ("npz", "vdb"):
            path = _frame_path(self.directory, number, kind)
            if path.is_file():
                return path
        raise SequenceError(f"{path}: is missing")

    def _read_vdb(self, path: Path) -> tuple[Array, Array]:
        domain = self.scene.domain
        if domain is None:
            raise SequenceError(f"{self.directory / _INDEX}: is damaged: its scene has no domain")
        try:
            return read_vdb(path, domain.shape)
        except OSError as error:
            raise SequenceError(str(error)) from error


def software_versions() -> dict[str, str]:
    """Return the versions of what a result depends on."""
    versions = {"python": platform.python_version()}
    for name in ("smokelift", "numpy", "scipy", "taichi", "av"):
        with suppress(PackageNotFoundError):
            versions[name] = version(name)
    return versions


def _vdb_there(*, required: bool) -> bool:
    try:
        vdb_module()
    except RuntimeError as error:
        if required:
            raise SequenceError(str(error)) from error
        return False
    return True


def _frame_path(directory: Path, number: int, kind: str) -> Path:
    return directory / f"smoke_{number:04d}.{kind}"


def _checked(density: npt.ArrayLike, faces: Any, shape: tuple[int, int, int]) -> tuple[Array, Faces]:
    nx, ny, nz = shape
    rho = np.ascontiguousarray(density, np.float32)
    arrays = [np.ascontiguousarray(face, np.float32) for face in faces]
    wanted = [shape, (nx + 1, ny, nz), (nx, ny + 1, nz), (nx, ny, nz + 1)]
    if [rho.shape, *(array.shape for array in arrays)] != wanted:
        found = ", ".join(str(array.shape) for array in (rho, *arrays))
        raise ValueError(f"density and velocity on faces must have shapes {wanted}, not {found}")
    if not all(np.isfinite(array).all() for array in (rho, *arrays)):
        raise ValueError("density and velocity must be finite")
    if rho.min() < 0.0:
        raise ValueError("density must not be negative")
    return rho, (arrays[0], arrays[1], arrays[2])


def _jsonable(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _jsonable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_jsonable(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _difference(where: str, there: Any, now: Any) -> str:
    """Return the first difference between two JSON values as words, or an empty string."""
    if isinstance(there, dict) and isinstance(now, dict):
        for key in [*there, *(key for key in now if key not in there)]:
            inner = _difference(f"{where}.{key}" if where else key, there.get(key), now.get(key))
            if inner:
                return inner
        return ""
    if isinstance(there, list) and isinstance(now, list) and len(there) == len(now):
        parts = (_difference(f"{where}[{n}]", *pair) for n, pair in enumerate(zip(there, now, strict=True)))
        return next(filter(None, parts), "")
    if there == now:
        return ""
    was, is_now = (text if len(text) <= 60 else f"{text[:57]}..." for text in map(json.dumps, (there, now)))
    return f"{where} was {was} and is now {is_now}"


def _read_index(directory: Path) -> dict[str, Any]:
    path = directory / _INDEX
    try:
        index = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise SequenceError(f"{directory}: holds no sequence ({_INDEX} is missing)") from None
    except (OSError, ValueError) as error:
        raise SequenceError(f"{path}: cannot be read: {error}") from error
    if not isinstance(index, dict) or index.get("format") != FORMAT:
        raise SequenceError(f"{path}: is not a sequence of format {FORMAT}, which this version reads")
    kinds = {"scene": dict, "settings": dict, "versions": dict, "frames": dict, "complete": bool}
    for key, kind in kinds.items():
        if not isinstance(index.get(key), kind):
            raise SequenceError(f"{path}: is damaged: {key} is missing or of another type")
    return index


def _save_arrays(path: Path, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
    _write_archive(path, arrays, np.savez_compressed)


def _load_arrays(path: Path, names: tuple[str, ...]) -> list[Array]:
    try:
        with path.open("rb") as file, np.load(file) as data:
            return [data[name] for name in names]
    except (OSError, ValueError, LookupError, EOFError, zipfile.BadZipFile) as error:
        raise SequenceError(f"{path}: cannot be read: {error}") from error


def _save_state(path: Path, state: ResumeState) -> None:
    arrays: dict[str, npt.NDArray[Any]] = {
        "number": np.array(state.number),
        "density": state.density,
        **{f"velocity_{axis}": face for axis, face in zip("xyz", state.velocity, strict=True)},
        **{f"extra_{name}": value for name, value in state.extra.items()},
    }
    _write_archive(path, arrays, np.savez)


def _write_archive(path: Path, arrays: Mapping[str, npt.NDArray[Any]], save: Callable[..., None]) -> None:
    # An interrupt in the middle of a zip file that is open on disk would be complained about once more at its end.
    buffer = io.BytesIO()
    save(buffer, **arrays)
    with atomic_path(path) as aside:
        aside.write_bytes(buffer.getbuffer())


def _load_state(path: Path) -> ResumeState | None:
    """Return the state of an unfinished run, or None if it never finished a frame."""
    if not path.is_file():
        return None
    try:
        with path.open("rb") as file, np.load(file) as data:
            extra = {name[6:]: data[name] for name in data.files if name.startswith("extra_")}
            velocity = data["velocity_x"], data["velocity_y"], data["velocity_z"]
            return ResumeState(int(data["number"]), data["density"], velocity, extra)
    except (OSError, ValueError, LookupError, EOFError, zipfile.BadZipFile) as error:
        raise SequenceError(f"{path}: is damaged, so this run cannot be resumed: {error}") from error


class _Lock:
    """An exclusive lock on a file, freed by the system when the process ends."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: int | None = None

    def acquire(self) -> None:
        """Take the lock; SequenceError if a running process has it, OSError if there can be none."""
        while True:
            file = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o644)
            try:
                free = _try_lock(file)
            except OSError:  # a file system without locks
                os.close(file)
                raise
            if not free:
                os.close(file)
                raise SequenceError(f"{self._path.parent}: another run is writing into this directory")
            # The run that had it before may have deleted the file between our opening and our locking.
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(file), self._path.stat()):
                    self._file = file
                    return
            os.close(file)

    def release(self) -> None:
        """Free the lock and take its file away."""
        if self._file is None:
            return
        if sys.platform == "win32":
            os.close(self._file)  # an open file cannot be deleted there
            with suppress(OSError):
                self._path.unlink()
        else:
            self._path.unlink(missing_ok=True)
            os.close(self._file)
        self._file = None


def _try_lock(file: int) -> bool:
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):  # what Linux and macOS, and Windows, call it
        return False
    return True
