"""Reading sequences: what was written opens, and renders as it was fitted, from where and before what is asked for."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from small_sequence import SCENE, SETTINGS, frame, names, needs_vdb, write

from smokelift import Sequence, render
from smokelift.footage.images import area_average
from smokelift.output import vdb
from smokelift.output.images import write_image
from smokelift.output.index import SequenceError
from smokelift.output.sequence import Viewer
from smokelift.output.writer import SequenceWriter
from smokelift.scene import Background, completed, orbit
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


def test_the_front_is_the_scenes_own_view(plume) -> None:
    image = Viewer(completed(plume.scene)).image(3, plume.densities[2])
    np.testing.assert_allclose(image, render(plume.densities[2], plume.scene), atol=1e-6)


def test_a_clean_plate_stands_behind_what_the_camera_itself_shows(plume, tmp_path) -> None:
    plate = np.zeros((56, 40, 3), np.float32)
    plate[:, :20] = 0.5
    write_image(tmp_path / "plate.exr", plate)
    scene = completed(replace(plume.scene, background=Background(image=tmp_path / "plate.exr")))
    nothing = np.zeros_like(plume.densities[0])
    part = scene.camera.cropped(10, 8, 30, 40).resized(15, 20)
    for camera, expected in (
        (None, plate),
        (scene.camera.resized(20, 28), area_average(plate, 20, 28)),
        (part, area_average(plate[8:48, 10:40], 15, 20)),
        (scene.camera.cropped(-10, 0, 40, 56), 0.25),
        (orbit(scene.camera, scene.domain, 45), 0.25),
    ):
        viewer = Viewer(scene, camera)
        np.testing.assert_allclose(viewer.image(1, nothing) - expected, 0, atol=1e-3)
        np.testing.assert_allclose(viewer.background(1) - expected, 0, atol=1e-3)


def test_a_moving_camera_is_followed(plume, tracked, tmp_path) -> None:
    scene = replace(tracked, background=Background(image=tmp_path / "plate_#.exr"))
    for n in range(5):
        write_image(tmp_path / f"plate_{n}.exr", np.full((56, 40, 3), 0.1 * n, np.float32))
    scene = completed(scene)
    front, turned = Viewer(scene), Viewer(scene, orbit(scene.camera, scene.domain, 30))
    for number in (1, 4, 2):
        density, camera = plume.densities[number - 1], tracked.camera.at(number - 1)
        before = replace(tracked, background=Background(color=[0.1 * (number - 1)] * 3))
        np.testing.assert_allclose(front.image(number, density), render(density, before, camera), atol=1e-3)
        beside = orbit(camera, scene.domain, 30)
        np.testing.assert_allclose(turned.image(number, density), render(density, tracked, beside), atol=1e-3)


def test_a_flame_adds_its_light(plume) -> None:
    scene = completed(replace(plume.scene, medium=replace(plume.scene.medium, flame_color=(1.0, 0.5, 0.0))))
    flame = 4 * np.roll(plume.densities[2], -4, 2)
    dark, lit = (Viewer(scene).image(3, plume.densities[2], each) for each in (None, flame))
    red, green, blue = np.moveaxis(lit - dark, -1, 0)
    assert red.max() > 0.05 and not blue.any()
    np.testing.assert_allclose(green, red / 2, atol=1e-6)
    np.testing.assert_array_equal(Viewer(completed(plume.scene)).image(3, plume.densities[2], flame), dark)
