"""Reading archives: a damaged file, or one that lies about its size, ends in one sentence."""

import gc
import io
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from smokelift.output.archive import read_arrays, write_arrays

SHAPE = (4, 5, 6)
DENSITY = np.random.default_rng(1).random(SHAPE).astype(np.float32)


def zipped(path: Path, member: bytes, kind: int = zipfile.ZIP_STORED) -> None:
    with zipfile.ZipFile(path, "w", kind) as archive:
        archive.writestr("density.npy", member)


def header(description: str) -> bytes:
    """The beginning of a .npy with these words in it."""
    text = description.encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text


def saved(values: object) -> bytes:
    file = io.BytesIO()
    np.save(file, values, allow_pickle=True)  # type: ignore[arg-type]  # an object is what must be refused
    return file.getvalue()


@pytest.mark.parametrize(
    "member",
    [
        header("{'descr': '<f4', 'fortran_order': False, 'shape': (100000, 100000, 100000), }"),
        header("{'descr': '<f4', 'fortran_order': False, 'shape': (4, 5, 6), }"),
        header("{'descr': '<f4', 'fortran_order': False, 'shape': (-4, -5, 6), }"),
        header("{'descr': '<f4', 'fortran_order': False, 'shape': (4, 5, 6)"),
        header("{'descr': '<f4', 'shape': (4, 5, 6), }"),
        header("{'descr': 3, 'fortran_order': False, 'shape': 7, }"),
        header("{[\x00"),
        header("(" * 100),
        b"\x93NUMPY\x07\x00" + bytes(130),
        b"",
        saved(np.full(SHAPE, np.inf, np.float32)),
        saved(np.zeros(SHAPE, np.complex64)),
        saved(np.array([{"an": "object"}])),
        saved(np.zeros((4, 5, 7), np.float32)),
    ],
)
def test_a_member_that_is_no_sound_array_is_refused(tmp_path, member) -> None:
    zipped(tmp_path / "a.npz", member)
    with pytest.raises(OSError, match=r"a\.npz: cannot be read: ") as caught:
        read_arrays(tmp_path / "a.npz", {"density": SHAPE})
    assert "\n" not in str(caught.value)


def test_what_is_no_archive_of_ours_is_refused(tmp_path) -> None:
    path = tmp_path / "a.npz"
    with pytest.raises(FileNotFoundError):
        read_arrays(path, {})
    with pytest.raises(FileNotFoundError):
        read_arrays(tmp_path, {})
    for content in (b"", b"PK", saved(DENSITY)):  # the last is a plain .npy
        path.write_bytes(content)
        with pytest.raises(OSError):
            read_arrays(path, {"density": SHAPE})
    write_arrays(path, {"density": DENSITY})
    with pytest.raises(OSError):
        read_arrays(path, {"velocity": None})
    encrypted = bytearray(path.read_bytes())
    for place in (encrypted.index(b"PK\x03\x04") + 6, encrypted.index(b"PK\x01\x02") + 8):
        encrypted[place] |= 1
    path.write_bytes(encrypted)
    with pytest.raises(OSError):
        read_arrays(path, {"density": SHAPE})


@pytest.mark.parametrize("kind", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_any_damage_gives_the_arrays_or_an_error(tmp_path, kind) -> None:
    path = tmp_path / "a.npz"
    zipped(path, saved(DENSITY), kind)
    sound, random = path.read_bytes(), np.random.default_rng(2)
    refused = 0
    for count in (1,) * 150 + (5,) * 50:
        damaged = np.frombuffer(sound, np.uint8).copy()
        damaged[random.integers(len(sound), size=count)] ^= random.integers(1, 256, count).astype(np.uint8)
        path.write_bytes(damaged.tobytes())
        try:
            found = read_arrays(path, {"density": SHAPE})["density"]
        except OSError as error:
            assert str(error).startswith(f"{path}: cannot be read: ")
            refused += 1
        else:
            np.testing.assert_array_equal(found, DENSITY)
    assert refused > 100


def test_an_interrupt_while_writing_is_quiet(tmp_path, monkeypatch) -> None:
    """NumPy's own writer leaves an open zip file, which raises a second error when it is collected."""
    cries: list[object] = []

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(sys, "unraisablehook", cries.append)
    monkeypatch.setattr(np.lib.format, "write_array", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_arrays(tmp_path / "a.npz", {"density": DENSITY})
    gc.collect()
    assert not cries and not list(tmp_path.iterdir())
