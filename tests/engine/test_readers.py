"""Every reader of a user's files: whatever these hold, there is a value or the one error that the reader promises."""

import json
import tomllib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy
from PIL import Image

from smokelift import Background, Camera, Clip, ClipSource, DirectionalLight, Domain, Sequence
from smokelift.evaluation.truth import Truth, TruthError
from smokelift.footage.frame_source import ClipError
from smokelift.footage.image_files import ImageError, read_image
from smokelift.output.archive import VELOCITY, ResumeState, read_arrays, write_arrays
from smokelift.output.images import write_image
from smokelift.output.index import INDEX, Index, SequenceError
from smokelift.render.environment import EnvironmentCells
from smokelift.scene import EnvironmentLight, Inlet, Medium, Scene, SceneError, View, scene_to_dict
from smokelift.transport import face_shapes
from tests.engine.films import encode

SHAPE = (3, 2, 4)
"""Voxels of the grids in sound files."""

_CAMERA = Camera.look_at((0.3, -4, 0.2), (0.3, 0.2, 0.2), fov_y_degrees=27, size=(6, 8))
_SCENE = Scene(
    clip=ClipSource(Path("clip.mp4"), 24.0, (0, 4)),
    camera=_CAMERA,
    domain=Domain((0, 0, 0), (0.6, 0.4, 0.8), SHAPE),
    closed=("z-",),
    inlets=(Inlet((0.1, 0.1, 0.1), 0.2),),
    medium=Medium(extinction=8.0),
    scattering="single",
    lights=(DirectionalLight((0.3, 0.5, -0.8), (12.0, 11.0, 10.0)),),
    background=Background(color=(0, 0, 0)),
    views=(View(_CAMERA, ClipSource(Path("side_####.png"))),),
)


class Reader(NamedTuple):
    """The name of a file, what writes a sound one and what reads it, and the one error that reading may raise."""

    name: str
    write: Callable[[Path], object]
    read: Callable[[Path], object]
    error: type[Exception]


VOLUME = np.linspace(0, 1, 24, dtype=np.float32).reshape(SHAPE)
X, Y, Z = FACES = tuple(np.full(shape, 0.25, np.float32) for shape in face_shapes(SHAPE))
PICTURE = np.random.default_rng(1).random((5, 7, 3)).astype(np.float32)
TWIN = {"density": VOLUME, **dict(zip(VELOCITY, FACES, strict=True))}


def _write_index(path: Path) -> None:
    index = Index(
        scene_to_dict(_SCENE, path.parent), {"density": {"scattering": "single"}}, frames={"1": {"psnr": 40.0}}
    )
    index.write(path.parent)


def _write_truth(path: Path) -> None:
    moments = {name: array[None] for name, array in TWIN.items()}
    whole = {"closed": np.array(["z-"]), "voxel_size": np.array(0.2), "fps": np.array(24.0)}
    write_arrays(path, {**moments, "inflow_packed": np.zeros((1, 3), np.uint8), **whole})


def _write_by_pillow(path: Path) -> None:
    Image.fromarray((255 * PICTURE).astype(np.uint8)).save(path)


def _write_exr_or_png(path: Path) -> None:
    write_image(path, PICTURE)


def _write_hdr(path: Path) -> None:
    head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 5 +X 7\n"
    path.write_bytes(head + bytes(range(1, 1 + 4 * 5 * 7)))


def _write_dpx(path: Path) -> None:
    encode(path, [(65535 * PICTURE).astype(np.uint16)], "dpx", "gbrp10le")


PICTURES = {
    "EXR": ("plate.exr", _write_exr_or_png),
    "PNG": ("plate.png", _write_exr_or_png),
    "JPEG": ("plate.jpg", _write_by_pillow),
    "TIFF": ("plate.tif", _write_by_pillow),
    "DPX": ("plate.dpx", _write_dpx),
    "HDR": ("plate.hdr", _write_hdr),
}


READERS = {
    "scene": Reader("scene.toml", _SCENE.save, Scene.load, SceneError),
    "index": Reader(INDEX, _write_index, lambda path: Sequence.open(path.parent), SequenceError),
    "state": Reader(
        "resume.npz",
        lambda path: ResumeState(1, VOLUME, (X, Y, Z), {"smooth": VOLUME}).write(path),
        lambda path: ResumeState.read(path, SHAPE),
        OSError,
    ),
    "twin": Reader(
        "smoke_0001.npz",
        lambda path: write_arrays(path, TWIN),
        lambda path: read_arrays(path, {name: array.shape for name, array in TWIN.items()}),
        OSError,
    ),
    "truth": Reader("truth.npz", _write_truth, Truth.load, TruthError),
    **{kind: Reader(name, write, read_image, ImageError) for kind, (name, write) in PICTURES.items()},
    "environment": Reader(
        "sky.exr", _write_exr_or_png, lambda path: EnvironmentCells(EnvironmentLight(path)).lights(4), ImageError
    ),
}
"""Readers by a word for what they read."""

TRIES = settings(
    max_examples=60, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)

NUMBERS = st.one_of(
    st.integers(), st.floats(), st.sampled_from([0, -1, 2**31, 10**400, 1e-45, 1e38, 1e300, -0.0, 10**9, 1e-9])
)
TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=5)
"""Of all that a file can hold, which Hypothesis finds in seconds if it is left to itself."""

PLACES = st.sampled_from(["/dev/zero", "http://a/b.mp4", "..", "#", "\0"])
ANYTHING = st.recursive(
    NUMBERS | st.booleans() | TEXT | PLACES,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXT, inner, max_size=3),
    max_leaves=8,
)


def ends_well(reader: Reader, path: Path) -> None:
    """Read a file; fails unless that gives a value, or the promised error in one line."""
    try:
        reader.read(path)
    except reader.error as error:
        assert str(error)
        assert "\n" not in str(error)


@st.composite
def changed_bytes(draw: st.DrawFn, content: bytes) -> bytes:
    """A file in which a few stretches of bytes are replaced by others, longer or shorter."""
    data = content
    for _ in range(draw(st.integers(1, 4))):
        place = draw(st.integers(0, len(data)))
        end = draw(st.integers(place, min(place + 8, len(data)))) if draw(st.booleans()) else len(data)
        data = data[:place] + draw(st.binary(max_size=8)) + data[end:]
    return data


@st.composite
def changed_values(draw: st.DrawFn, tables: dict[str, Any]) -> Any:
    """Nested tables in which a few values are replaced, taken out or added, wherever they stand."""
    data = json.loads(json.dumps(tables))
    for _ in range(draw(st.integers(1, 3))):
        holder = data
        while True:
            keys = sorted(holder) if isinstance(holder, dict) else range(len(holder))
            if not keys:
                break
            key = draw(st.sampled_from(list(keys)))
            if not isinstance(holder[key], dict | list) or draw(st.booleans()):
                if draw(st.integers(0, 4)):
                    holder[key] = draw(ANYTHING)
                else:
                    del holder[key]
                break
            holder = holder[key]
        if isinstance(holder, dict) and draw(st.integers(0, 4)) == 0:
            holder[draw(TEXT)] = draw(ANYTHING)
    return data


@pytest.fixture(scope="module", params=READERS)
def reader(request) -> Reader:
    return READERS[request.param]


@pytest.fixture(scope="module")
def sound(reader, tmp_path_factory) -> Path:
    """A sound file."""
    path = tmp_path_factory.mktemp("sound") / reader.name
    reader.write(path)
    return path


def test_a_sound_file_is_read(reader, sound) -> None:
    assert reader.read(sound) is not None


@TRIES
@given(data=st.data())
def test_other_bytes_end_well(reader, sound, tmp_path, data) -> None:
    """Changed in places, or any others."""
    path = tmp_path / reader.name
    path.write_bytes(data.draw(changed_bytes(sound.read_bytes()) | st.binary(max_size=64)))
    ends_well(reader, path)


@TRIES
@given(data=st.data())
@pytest.mark.parametrize(
    ("reader", "loads", "dumps"),
    [("scene", tomllib.loads, tomli_w.dumps), ("index", json.loads, json.dumps)],
    indirect=["reader"],
)
def test_changed_values_end_well(reader, loads, dumps, sound, tmp_path, data) -> None:
    path = tmp_path / reader.name
    path.write_text(dumps(data.draw(changed_values(loads(sound.read_text())))))
    ends_well(reader, path)


@pytest.mark.parametrize("reader", ["state", "twin", "truth"], indirect=True)
@settings(TRIES, max_examples=40)
@given(data=st.data())
def test_other_arrays_end_well(reader, sound, tmp_path, data) -> None:
    path = tmp_path / reader.name
    with np.load(sound) as file:
        arrays = dict(file)
    changed = data.draw(st.lists(st.sampled_from(sorted(arrays)), min_size=1, max_size=2))
    for each in changed:
        kinds = st.just(arrays[each].dtype) | st_numpy.scalar_dtypes() | st_numpy.unicode_string_dtypes(max_len=4)
        shapes = st.just(arrays[each].shape) | st_numpy.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=4)
        arrays[each] = data.draw(st_numpy.arrays(data.draw(kinds), data.draw(shapes)))
    if data.draw(st.integers(0, 5)) == 0:
        del arrays[changed[0]]
    np.savez(path, **arrays)
    ends_well(reader, path)


@TRIES
@given(
    pattern=st.text("#%[]*?01ab._-", min_size=1, max_size=8),
    names=st.lists(st.text("01ab._-", min_size=1, max_size=6), max_size=4),
)
def test_any_name_of_a_clip_ends_well(tmp_path, pattern, names) -> None:
    for name in names:
        with suppress(IsADirectoryError):  # "." and ".."
            (tmp_path / f"{name}.png").write_bytes(b"no picture")
    with pytest.raises(ClipError) as caught:
        Clip.open(tmp_path / f"{pattern}.png")
    assert "\n" not in str(caught.value)
