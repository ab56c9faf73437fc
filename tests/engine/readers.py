"""The functions that read a file that a user has: what each may raise, and a sound file to begin with."""

import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
from PIL import Image

from smokelift.evaluation.truth import Truth, TruthError
from smokelift.footage.images import ImageError, read_image
from smokelift.output.archive import VELOCITY, read_arrays, write_arrays
from smokelift.output.files import INDEX
from smokelift.output.images import write_image
from smokelift.output.index import Index, SequenceError
from smokelift.output.resume import ResumeState
from smokelift.output.sequence import Sequence
from smokelift.render.environment import environment_lights
from smokelift.scene import (
    Background,
    Camera,
    ClipSource,
    DirectionalLight,
    Domain,
    EnvironmentLight,
    Inlet,
    Medium,
    Scene,
    SceneError,
    View,
    scene_to_dict,
)
from smokelift.transport import Array, Faces, face_shapes

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


@dataclass(frozen=True)
class Reader:
    """A function that reads a file.

    Attributes
    ----------
    name
        Of the file.
    write
        Writes a sound one.
    read
        Reads it.
    error
        The one error that it may raise.
    """

    name: str
    write: Callable[[Path], object]
    read: Callable[[Path], object]
    error: type[Exception]


def _volume() -> Array:
    return np.linspace(0, 1, 24, dtype=np.float32).reshape(SHAPE)


def _faces() -> Faces:
    x, y, z = (np.full(shape, 0.25, np.float32) for shape in face_shapes(SHAPE))
    return x, y, z


def _write_index(path: Path) -> None:
    index = Index(
        scene_to_dict(_SCENE, path.parent), {"density": {"scattering": "single"}}, frames={"1": {"psnr": 40.0}}
    )
    index.write(path.parent)


def _write_twin(path: Path) -> None:
    write_arrays(path, {"density": _volume(), **dict(zip(VELOCITY, _faces(), strict=True))})


def _read_twin(path: Path) -> object:
    shapes = {"density": SHAPE, **dict(zip(VELOCITY, face_shapes(SHAPE), strict=True))}
    return read_arrays(path, shapes)


def _write_member(path: Path) -> None:
    np.save(path, _volume())


def _read_member(path: Path) -> object:
    """Read it as an archive holds it, whose own checksum would hide what is damaged."""
    archive = path.with_suffix(".npz")
    with zipfile.ZipFile(archive, "w") as file:
        file.write(path, path.name)
    return read_arrays(archive, {"density": SHAPE})


def _write_truth(path: Path) -> None:
    arrays: dict[str, npt.NDArray[Any]] = {
        "density": _volume()[None],
        **{name: face[None] for name, face in zip(VELOCITY, _faces(), strict=True)},
        "inflow_packed": np.zeros((1, 3), np.uint8),
        "closed": np.array(["z-"]),
        "voxel_size": np.array(0.2),
        "fps": np.array(24.0),
    }
    write_arrays(path, arrays)


def _picture() -> Array:
    return np.random.default_rng(1).random((5, 7, 3)).astype(np.float32)


def _write_by_pillow(path: Path) -> None:
    Image.fromarray((255 * _picture()).astype(np.uint8)).save(path)


def _write_dpx(path: Path) -> None:
    with av.open(str(path), "w", format="image2", options={"update": "1"}) as out:
        stream = out.add_stream("dpx", rate=1)
        stream.height, stream.width, stream.pix_fmt = 5, 7, "gbrp10le"
        codes = (65535 * _picture()).astype(np.uint16)
        out.mux(stream.encode(av.VideoFrame.from_ndarray(codes, "rgb48le").reformat(format="gbrp10le")))
        out.mux(stream.encode())


def _write_hdr(path: Path) -> None:
    rows, columns = 5, 7
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {rows} +X {columns}\n".encode()
    path.write_bytes(head + bytes(range(1, 1 + 4 * rows * columns)))


READERS: Mapping[str, Reader] = {
    "scene": Reader("scene.toml", _SCENE.save, Scene.load, SceneError),
    "index": Reader(INDEX, _write_index, lambda path: Sequence.open(path.parent), SequenceError),
    "state": Reader(
        "resume.npz",
        lambda path: ResumeState(1, _volume(), _faces(), {"smooth": _volume()}).write(path),
        lambda path: ResumeState.read(path, lambda _: SHAPE),
        OSError,
    ),
    "twin": Reader("smoke_0001.npz", _write_twin, _read_twin, OSError),
    "array": Reader("density.npy", _write_member, _read_member, OSError),
    "truth": Reader("truth.npz", _write_truth, Truth.load, TruthError),
    "EXR": Reader("plate.exr", lambda path: write_image(path, _picture()), read_image, ImageError),
    "PNG": Reader("plate.png", lambda path: write_image(path, _picture()), read_image, ImageError),
    "JPEG": Reader("plate.jpg", _write_by_pillow, read_image, ImageError),
    "TIFF": Reader("plate.tif", _write_by_pillow, read_image, ImageError),
    "DPX": Reader("plate.dpx", _write_dpx, read_image, ImageError),
    "HDR": Reader("plate.hdr", _write_hdr, read_image, ImageError),
    "environment": Reader(
        "sky.exr",
        lambda path: write_image(path, _picture()),
        lambda path: environment_lights(EnvironmentLight(path), 4),
        ImageError,
    ),
}
"""Readers by a word for what they read."""
