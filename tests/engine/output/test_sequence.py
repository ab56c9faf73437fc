"""Reading sequences: what was written opens, and renders as it was fitted."""

import json
import math

import numpy as np
import pytest
from small_sequence import SCENE, SETTINGS, frame, names, needs_vdb, write

from smokelift import Sequence, render
from smokelift.output import vdb
from smokelift.output.index import SequenceError
from smokelift.output.writer import SequenceWriter
from smokelift.scene import orbit
from smokelift.transport import Velocity, on_faces


@needs_vdb
def test_a_sequence_opens_as_it_was_written(tmp_path) -> None:
    opened = write(tmp_path / "out", [1, 2, 3])
    assert names(tmp_path / "out") == [
        "sequence.json",
        *(f"smoke_000{n}.{kind}" for n in (1, 2, 3) for kind in ("npz", "vdb")),
    ]
    assert (opened.scene, opened.settings, opened.frames) == (SCENE, SETTINGS, (1, 2, 3))
    assert opened.complete
    assert opened.versions["numpy"] == np.__version__
    rho, faces = frame(2)
    np.testing.assert_array_equal(opened.density(2), rho)
    for found, written in zip(opened.velocity(2).faces, faces, strict=True):
        np.testing.assert_array_equal(found, written)
    assert opened.velocity(2).voxel_size == SCENE.domain.voxel_size
    centers = Velocity(faces, 1.0).centres()
    np.testing.assert_array_equal(opened.velocity_at_centres(2), centers)
    assert opened.figures(2) == {"loss": 0.5}
    grid = vdb.vdb_module().read(str(tmp_path / "out" / "smoke_0002.vdb"), gridname="density")
    assert json.loads(grid.metadata[vdb.SETTINGS]) == SETTINGS
    for n in (1, 2, 3):
        (tmp_path / "out" / f"smoke_000{n}.npz").unlink()
    np.testing.assert_allclose(opened.density(2), rho, rtol=1e-3)
    for found, mean in zip(opened.velocity(2).faces, on_faces(centers), strict=True):
        np.testing.assert_allclose(found, mean, rtol=1e-3, atol=2e-3)
    np.testing.assert_allclose(opened.velocity_at_centres(2), centers, rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("npz", [True, pytest.param(False, marks=needs_vdb)])
def test_a_frame_renders_as_its_scene_says(tmp_path, npz) -> None:
    opened = write(tmp_path, [1, 2], npz=npz)
    for camera in (None, orbit(SCENE.camera, SCENE.domain, 30)):
        expected = render(frame(2)[0], SCENE, camera)
        np.testing.assert_allclose(opened.render(2, camera), expected, atol=2e-3 * expected.max())
    with pytest.raises(SequenceError):
        opened.render(3)


def test_figures_are_json(tmp_path, no_vdb) -> None:
    with SequenceWriter(tmp_path, SCENE, SETTINGS, npz=True) as writer:
        figures = {"loss": np.float32(0.5), "psnr": math.inf, "each": np.array([1, 2]), "note": "thin"}
        writer.write(1, *frame(1), figures)
    assert Sequence.open(tmp_path).figures(1) == {"loss": 0.5, "psnr": None, "each": [1, 2], "note": "thin"}


def test_what_is_no_sequence_is_named(tmp_path, no_vdb) -> None:
    with pytest.raises(SequenceError):
        Sequence.open(tmp_path)
    opened, file = write(tmp_path, [1]), tmp_path / "smoke_0001.npz"
    for read, number, spoil in (
        (opened.density, 2, lambda: None),
        (opened.density, 1, lambda: file.write_bytes(b"half")),
        (opened.velocity, 1, file.unlink),
    ):
        spoil()
        with pytest.raises(SequenceError):
            read(number)
    index = json.loads((tmp_path / "sequence.json").read_text())
    corners = {"min": [0, 0, 0], "max": [1, 1, 1]}
    boxes = 7, {"min": [0, 0, 0]}, {**corners, "resolution": [0, 1, 1]}, {**corners, "resolution": [1, 1, 1]}
    for text in (
        "{",
        "{}",
        "[" * 100_000,
        json.dumps({**index, "frames": 3}),
        *(json.dumps({**index, "frames": frames}) for frames in ({"1": None}, {"one": {}}, {"-1": {}}, {"9" * 30: {}})),
        *(json.dumps({**index, "frames": {"1": {"box": box}}}) for box in boxes),
        *(json.dumps({**index, "start_number": start}) for start in (-1, 1.5, "1", 10**9)),
        json.dumps({**index, "scene": {}}),
        json.dumps({**index, "scene": {**index["scene"], "domain": None}}),
        json.dumps(index).replace("[8, 8, 12]", "[80000, 80000, 120000]"),
        json.dumps({**index, "scene": {"medium": {"albedo": 3}}}),
    ):
        (tmp_path / "sequence.json").write_text(text)
        with pytest.raises(SequenceError):
            Sequence.open(tmp_path)
    least = {**index, "scene": {**index["scene"], "medium": {}}, "settings": {"density": 3}}
    (tmp_path / "sequence.json").write_text(json.dumps(least))
    assert Sequence.open(tmp_path).scene.scattering == "single"


@pytest.mark.parametrize("kind", ["npz", pytest.param("vdb", marks=needs_vdb)])
def test_a_file_that_was_changed_is_refused_before_it_is_read(tmp_path, kind) -> None:
    write(tmp_path, [1, 2], npz=kind == "npz")
    path = tmp_path / f"smoke_0002.{kind}"
    changed = bytearray(path.read_bytes())
    changed[len(changed) // 2] ^= 1
    path.write_bytes(changed)
    opened = Sequence.open(tmp_path)
    for read in (opened.density, opened.velocity, opened.render, opened.files):
        with pytest.raises(SequenceError):
            read(2)
    assert opened.density(1).any()
