"""Writing sequences: nothing is overwritten, a run that was cut off goes on exactly, and frames may have own boxes."""

import errno
import json
import math
import os
from collections.abc import Iterable
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_sequence import BURNING, SCENE, SETTINGS, frame, names, needs_vdb, write

from smokelift import Domain, Sequence
from smokelift.output import vdb
from smokelift.output.archive import VELOCITY, ResumeState
from smokelift.output.export import ExportSettings, export_sequence, write_proxies
from smokelift.output.index import LOCK, PICTURES, SequenceError
from smokelift.output.writer import SequenceWriter, check_directory, count_finished
from smokelift.transport import face_shapes

COARSER, DARK = {**SETTINGS, "density": {"iterations": 13}}, replace(SCENE, lights=())

DOMAIN = SCENE.domain
GROWN = DOMAIN.grown((8, 0, 0), (4, 8, 0))
WHOLE = GROWN.grown((0, 8, 0), (0, 0, 4))


class CutOffError(Exception):
    """A run that ends before its last frame."""


def cut_off(directory: Path, numbers: Iterable[int], *, npz: bool = True, **options: Any) -> None:
    with pytest.raises(CutOffError), SequenceWriter(directory, SCENE, SETTINGS, npz=npz, **options) as writer:
        for number in numbers:
            state = ResumeState(number, *frame(number), {"smooth": frame(number + 1)[0]})
            writer.write(number, *frame(number), state=state)
        raise CutOffError


def test_numpy_files_alone_need_no_vdb_module_and_are_not_overwritten(tmp_path, no_vdb) -> None:
    write(tmp_path / "out", [1], resume=True)
    before = {file.name: file.read_bytes() for file in (tmp_path / "out").iterdir()}
    assert sorted(before) == ["sequence.json", "smoke_0001.npz"]
    with pytest.raises(SequenceError):
        write(tmp_path / "out", [1])
    assert {file.name: file.read_bytes() for file in (tmp_path / "out").iterdir()} == before
    with pytest.raises(SequenceError):
        write(tmp_path / "other", [1], npz=False)
    assert not (tmp_path / "other").exists()


def finished(directory: Path) -> tuple[int, ...]:
    """Frames from which the run goes on; it leaves no lock behind."""
    with SequenceWriter(directory, SCENE, SETTINGS, npz=True, resume=True) as writer:
        return writer.finished


@pytest.mark.parametrize("renames", [0, 1])
def test_a_run_that_ends_before_its_first_frame_goes_on(tmp_path, no_vdb, monkeypatch, renames) -> None:
    out, background = tmp_path / "out", np.full((48, 32, 3), 0.2, np.float32)
    rename, left = Path.replace, renames

    def counted(path: Path, target: Path) -> Path:
        nonlocal left
        left -= 1
        if left < 0:
            raise CutOffError
        return rename(path, target)

    with monkeypatch.context() as patched, pytest.raises(CutOffError):
        patched.setattr(Path, "replace", counted)
        patched.setattr(Path, "unlink", lambda path, missing_ok=False: None)
        write(out, [1], background=background)
    (leftover,) = out.glob(".*.tmp")
    leftover.rename(str(leftover).replace(str(os.getpid()), "77"))  # the process that goes on is another
    write(out, [1], background=background, resume=True)
    assert names(out) == ["background.exr", "sequence.json", "smoke_0001.npz"]


def test_choices_and_provenance_are_kept_and_not_compared(tmp_path, no_vdb) -> None:
    choices, provenance = [{"what": "scattering", "measured": {"error": math.nan}}], [{"origin": "estimated"}]
    cut_off(tmp_path, [1], choices=choices, provenance=provenance)
    begun = Sequence.open(tmp_path)
    assert begun.choices == ({"what": "scattering", "measured": {"error": None}},)
    assert begun.provenance == tuple(provenance)
    other, assumed = ({"what": "scattering", "measured": {"error": 0.2}},), ({"origin": "assumed"},)
    resumed = write(tmp_path, [2], resume=True, choices=other, provenance=assumed)
    assert (resumed.choices, resumed.provenance) == (other, assumed)


@pytest.mark.parametrize("name", ["holiday.jpg", "smoke_0001.vdb", "preview.mp4"])
@pytest.mark.parametrize("resume", [False, True])
def test_a_directory_of_other_files_is_refused(tmp_path, no_vdb, name, resume) -> None:
    (tmp_path / name).write_bytes(b"precious")
    with pytest.raises(SequenceError):
        write(tmp_path, [1], resume=resume)
    assert names(tmp_path) == [name]


def test_pictures_of_the_run_and_hidden_files_are_in_nobodys_way(tmp_path, no_vdb) -> None:
    (tmp_path / ".DS_Store").write_bytes(b"the file manager's")
    cut_off(tmp_path, [1])
    for name in PICTURES:
        (tmp_path / name).write_bytes(b"of frame 1")
    assert write(tmp_path, [2], resume=True).frames == (1, 2)


def test_files_are_numbered_from_another_start_and_frames_are_not(tmp_path, no_vdb) -> None:
    cut_off(tmp_path, [1, 2], start_number=1001)
    sequence = write(tmp_path, [3], resume=True, start_number=1001)
    assert names(tmp_path) == ["sequence.json", *(f"smoke_{n}.npz" for n in (1001, 1002, 1003))]
    assert (sequence.frames, sequence.start_number, sequence.file_number(3)) == ((1, 2, 3), 1001, 1003)
    for number in sequence.frames:
        np.testing.assert_array_equal(sequence.density(number), frame(number)[0])
    assert sequence.files(2) == {"npz": tmp_path / "smoke_1002.npz"}
    for start in (-1, 10**7):
        with pytest.raises(ValueError):
            SequenceWriter(tmp_path, SCENE, SETTINGS, start_number=start)
    index = json.loads((tmp_path / "sequence.json").read_text())
    del index["start_number"]  # version 1.0.0 wrote none
    (tmp_path / "sequence.json").write_text(json.dumps(index))
    assert Sequence.open(tmp_path).start_number == 1


def test_a_frame_without_its_state_is_made_again(tmp_path, no_vdb) -> None:
    cut_off(tmp_path, [1, 2])
    older = (tmp_path / "resume.npz").read_bytes()
    (tmp_path / ".smoke_0003.npz.77.tmp").write_bytes(b"half a fra")
    with pytest.raises(CutOffError), SequenceWriter(tmp_path, SCENE, SETTINGS, npz=True, resume=True) as writer:
        assert ".smoke_0003.npz.77.tmp" not in names(tmp_path)
        writer.write(3, *frame(3))
        raise CutOffError
    (tmp_path / "resume.npz").write_bytes(older)
    assert Sequence.open(tmp_path).frames == (1, 2, 3) and count_finished(tmp_path) == 2
    with SequenceWriter(tmp_path, SCENE, SETTINGS, npz=True, resume=True) as writer:
        assert writer.finished == (1, 2)
        assert writer.state.number == 2
        writer.write(3, *frame(3))
    assert Sequence.open(tmp_path).frames == (1, 2, 3) and count_finished(tmp_path) == 3


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"settings": COARSER}, r"settings\.density\.iterations\b.* 12 .* 13"),
        ({"scene": DARK}, r"scene\.lights"),
        ({"scene": DARK, "settings": {**COARSER, "quality": "fine"}}, r"settings\.quality"),  # whence the other scene
        ({"sources": {"clip": {"bytes": 9, "sha256": "cd"}}}, r"sources\.clip\.sha256"),
        ({"start_number": 2}, "start_number"),
    ],
)
def test_another_run_is_not_resumed(tmp_path, no_vdb, change, words) -> None:
    run: dict[str, Any] = {"scene": SCENE, "settings": SETTINGS, "sources": {"clip": {"bytes": 9, "sha256": "ab"}}}
    with pytest.raises(CutOffError), SequenceWriter(tmp_path, **run, npz=True) as writer:
        writer.write(1, *frame(1))
        raise CutOffError
    with pytest.raises(SequenceError, match=words):
        SequenceWriter(tmp_path, **{**run, **change}, npz=True, resume=True).__enter__()
    with SequenceWriter(tmp_path, **run, npz=True, resume=True) as writer:
        assert writer.finished == (1,)


def test_another_version_of_what_computes_is_not_resumed(tmp_path, no_vdb) -> None:
    """Nor another state of the same version, before anything is computed. A patch of Python computes the same."""
    cut_off(tmp_path, [1])
    index = json.loads((tmp_path / "sequence.json").read_text())
    for name, said in (("numpy", r"versions\.numpy"), ("code", "code"), ("python", "")):
        other = {**index, "versions": {**index["versions"], name: "1.0"}}
        (tmp_path / "sequence.json").write_text(json.dumps(other))
        with pytest.raises(SequenceError, match=said) if said else nullcontext():
            check_directory(tmp_path, resume=True)
        assert Sequence.open(tmp_path).frames == (1,)
    write(tmp_path, [2], resume=True)


@pytest.mark.parametrize(
    "change",
    [
        None,
        "half",
        {"density": np.full(768, np.inf, np.float32)},
        {"density": np.full(768, -1, np.float32)},
        {"density": np.ones(769, np.float32)},
        {"density": np.ones(700, np.float32)},
        {"density": np.ones(768, np.complex64)},
        {"density_voxels": np.zeros(96, np.uint8)},
        {"density_voxels": np.ones(96)},
        {"velocity_x": np.ones((8, 8, 12), np.float32)},
        dict(zip(VELOCITY, map(np.zeros, face_shapes((4, 4, 5))), strict=True)),
        {"number": np.array(-1)},
        {"number": np.array(1.5)},
        {"extra_smooth": np.zeros(7, np.float32)},
        {"extra_smooth": np.full(768, np.nan, np.float32)},
    ],
)
def test_a_damaged_state_or_a_lost_frame_is_not_resumed(tmp_path, no_vdb, change) -> None:
    cut_off(tmp_path, [1])
    if change is None:
        (tmp_path / "smoke_0001.npz").unlink()
    elif change == "half":
        (tmp_path / "resume.npz").write_bytes((tmp_path / "resume.npz").read_bytes()[:100])
    else:
        with np.load(tmp_path / "resume.npz") as state:
            arrays = dict(state)
        np.savez(tmp_path / "resume.npz", **{**arrays, **change})
    with pytest.raises(SequenceError):
        write(tmp_path, [2], resume=True)


def test_files_reach_the_disk_before_they_get_their_names(tmp_path, no_vdb, monkeypatch) -> None:
    synced: set[int] = set()
    sync, rename = os.fsync, Path.replace

    def recorded(file: int) -> None:
        sync(file)
        synced.add(os.fstat(file).st_ino)

    def checked(path: Path, target: Path) -> Path:
        assert path.stat().st_ino in synced
        return rename(path, target)

    monkeypatch.setattr(os, "fsync", recorded)
    monkeypatch.setattr(Path, "replace", checked)
    write(tmp_path, [1])
    assert synced


def test_a_directory_has_one_run_and_the_lock_of_a_killed_one_is_none(tmp_path, no_vdb) -> None:
    with pytest.raises(CutOffError), SequenceWriter(tmp_path, SCENE, SETTINGS, npz=True) as writer:
        writer.write(1, *frame(1))
        for resume in (False, True):
            with pytest.raises(SequenceError):
                write(tmp_path, [2], resume=resume)
        raise CutOffError
    assert Sequence.open(tmp_path).frames == (1,) and LOCK not in names(tmp_path)
    (tmp_path / LOCK).touch()
    assert finished(tmp_path) == (1,) and LOCK not in names(tmp_path)


@pytest.mark.parametrize("name", ["smoke_0002.npz", "sequence.json", "resume.npz"])
def test_a_full_disk_counts_the_frames_that_stay(tmp_path, no_vdb, monkeypatch, name) -> None:
    rename = Path.replace

    def full(path: Path, target: Path) -> Path:
        if Path(target).name == name:
            raise OSError(errno.ENOSPC, "No space left on device")
        return rename(path, target)

    with (
        monkeypatch.context() as patch,
        pytest.raises(SequenceError) as stopped,
        SequenceWriter(tmp_path, SCENE, SETTINGS, npz=True) as writer,
    ):
        writer.write(1, *frame(1))
        patch.setattr(Path, "replace", full)
        writer.write(2, *frame(2))
    assert getattr(stopped.value.__cause__, "errno", None) == errno.ENOSPC
    assert finished(tmp_path) == (1,)


def test_frames_must_fit_and_follow(tmp_path, no_vdb) -> None:
    rho, (x, y, z) = frame(1)
    with SequenceWriter(tmp_path, SCENE, SETTINGS, npz=True) as writer:
        writer.write(5, rho, (x, y, z))
        for bad in (
            (7, rho, (x, y, z)),
            (5, rho, (x, y, z)),
            (6, -rho, (x, y, z)),
            (6, rho * np.nan, (x, y, z)),
            (6, rho, (x * np.inf, y, z)),
            (6, rho[1:], (x, y, z)),
            (6, rho, (y, x, z)),
        ):
            with pytest.raises(ValueError):
                writer.write(*bad)
    assert Sequence.open(tmp_path).frames == (5,)


def test_a_flame_is_kept_and_read(tmp_path, no_vdb) -> None:
    flame = frame(5)[0]
    with SequenceWriter(tmp_path, BURNING, SETTINGS, npz=True) as writer:
        writer.write(1, *frame(1), flame=flame)
        writer.write(2, *frame(2))
        for bad in (flame[1:], -flame, flame * np.nan):
            with pytest.raises(ValueError):
                writer.write(3, *frame(3), flame=bad)
    sequence = Sequence.open(tmp_path)
    np.testing.assert_array_equal(sequence.flame(1), flame)
    assert sequence.flame(2) is None
    np.testing.assert_array_equal(sequence.density(1), frame(1)[0])
    with np.load(tmp_path / "smoke_0001.npz") as written:
        arrays = {**written, "flame": -flame}
    np.savez(tmp_path / "smoke_0001.npz", **arrays)
    index = json.loads((tmp_path / "sequence.json").read_text())
    (tmp_path / "sequence.json").write_text(json.dumps({**index, "checksums": {}}))
    with pytest.raises(SequenceError):
        Sequence.open(tmp_path).flame(1)


def filled(domain: Domain) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """Smoke on both ends of a box, at places that differ, and a velocity of 1, 2 and 3 m/s."""
    density = np.zeros(domain.shape, np.float32)
    density[0, 0, 0], density[-1, -2, -3] = 1.0, 2.0
    faces = tuple(np.full(n, axis + 1, np.float32) for axis, n in enumerate(face_shapes(domain.shape)))
    return density, faces


def written(directory, boxes, npz=False) -> Sequence:
    with SequenceWriter(directory, SCENE, {}, npz=npz) as writer:
        for number, box in enumerate(boxes, 1):
            writer.write(number, *filled(box), {"mass": 1.0}, box=box)
    return Sequence.open(directory)


@pytest.mark.parametrize("npz", [True, pytest.param(False, marks=needs_vdb)])
def test_every_frame_is_where_it_was(tmp_path, npz):
    made = written(tmp_path / "out", [DOMAIN, GROWN, WHOLE], npz)
    assert [made.box(number) for number in (1, 2, 3)] == [DOMAIN, GROWN, WHOLE]
    assert made.scene.domain == WHOLE
    assert "box" not in made.figures(1)
    for number, box in ((1, DOMAIN), (2, GROWN), (3, WHOLE)):
        part = box.slices_in(WHOLE)
        density = made.density(number)
        assert density.shape == WHOLE.shape
        np.testing.assert_array_equal(density[part], filled(box)[0])
        assert density.sum() == 3.0
        velocity = made.velocity(number)
        assert velocity.shape == WHOLE.shape
        inner = made.within(DOMAIN).density(number)
        np.testing.assert_array_equal(inner, density[DOMAIN.slices_in(WHOLE)])
        assert made.within(DOMAIN).velocity(number).shape == DOMAIN.shape
        np.testing.assert_allclose(velocity.centres()[part][0, 0, 0], (1, 2, 3), atol=1.6)
    assert made.velocity_at_centres(2)[GROWN.slices_in(WHOLE)][0, 0, 0].tolist() == [1, 2, 3]


@needs_vdb
def test_files_share_one_transform_and_proxies_and_exports_one_box(tmp_path):
    made = written(tmp_path / "out", [DOMAIN, GROWN])
    grids = [vdb.vdb_module().read(str(tmp_path / "out" / f"smoke_000{n}.vdb"), "density") for n in (1, 2)]
    assert grids[0].transform == grids[1].transform
    assert grids[1].evalActiveVoxelBoundingBox()[0] == (-8, 0, 0)
    assert list(write_proxies(made)) == [1, 2]
    coarse = [vdb.vdb_module().read(str(tmp_path / "out" / f"proxy_000{n}.vdb"), "density") for n in (1, 2)]
    assert coarse[0].transform == coarse[1].transform
    assert coarse[0].evalActiveVoxelBoundingBox()[0] == (8 // vdb.PROXY_TIMES, 0, 0)
    list(export_sequence(made, tmp_path / "export", ExportSettings()))
    rho = vdb.read_grid(tmp_path / "export" / "smoke_0001.vdb", "density", GROWN)
    np.testing.assert_array_equal(rho[DOMAIN.slices_in(GROWN)], filled(DOMAIN)[0])


def test_a_run_goes_on_from_a_state_in_its_own_box(tmp_path):
    with pytest.raises(KeyboardInterrupt), SequenceWriter(tmp_path / "out", SCENE, {}, npz=True) as writer:
        density, faces = filled(GROWN)
        writer.write(1, *filled(DOMAIN))
        writer.write(2, density, faces, box=GROWN, state=ResumeState(2, density, faces))
        raise KeyboardInterrupt
    with SequenceWriter(tmp_path / "out", SCENE, {}, npz=True, resume=True) as writer:
        assert writer.box(writer.state.number) == GROWN
        np.testing.assert_array_equal(writer.state.density, density)
