"""``smokelift evaluate``: a sequence beside known volumes and other views, and every way to ask for nonsense."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from smokelift.app.cli import main
from smokelift.output.images import write_image
from smokelift.output.writer import SequenceWriter
from smokelift.render import render
from smokelift.scene import Background, Scene, orbit
from smokelift.transport import Velocity

RISE = 1.5
"""Voxels a frame of the tiny plume."""


def write(folder: Path, scene: Scene, densities, speed: float = 1.0) -> Path:
    """A sequence of volumes that rise as fast as the truth, or by another speed."""
    faces = Velocity.zero(scene.domain.resolution, scene.domain.voxel_size).faces
    faces[2][:] = speed * RISE * scene.domain.voxel_size * 24
    with SequenceWriter(folder, scene, {"density": {"scattering": "single"}}, npz=True) as writer:
        for number, density in enumerate(densities, 1):
            writer.write(number, density, faces)
    return folder


def write_truth(path: Path, scene: Scene, densities, **changes) -> Path:
    """The tiny plume in the format of baked scenes."""
    shape, count = scene.domain.resolution, len(densities)
    faces = Velocity.zero(shape, scene.domain.voxel_size).faces
    faces[2][:] = RISE * scene.domain.voxel_size * 24
    arrays = {
        "density": np.stack(densities).astype(np.float16),
        **{
            f"velocity_{axis}": np.stack([face] * count).astype(np.float16)
            for axis, face in zip("xyz", faces, strict=True)
        },
        "inflow_packed": np.zeros((count, int(np.prod(shape)) // 8), np.uint8),
        "voxel_size": scene.domain.voxel_size,
        "fps": 24,
        "closed": np.array([], dtype="U2"),
    } | changes
    np.savez(path, **{name: value for name, value in arrays.items() if value is not None})
    return path


@pytest.fixture(scope="module")
def truth(plume, tmp_path_factory) -> Path:
    return write_truth(tmp_path_factory.mktemp("truth") / "truth.npz", plume.scene, plume.densities)


@pytest.fixture(scope="module")
def perfect(plume, tmp_path_factory) -> Path:
    """The true volumes as a sequence."""
    return write(tmp_path_factory.mktemp("perfect") / "out", plume.scene, plume.densities)


@pytest.fixture(scope="module")
def side(plume, tmp_path_factory) -> tuple[Path, Path]:
    """Another camera's file and what it saw."""
    folder = tmp_path_factory.mktemp("side")
    scene = replace(plume.scene, camera=orbit(plume.scene.camera, plume.scene.domain, 60), clip=None)
    filmed = plume.write(folder / "clip", plume.densities, scene, suffix=".exr")
    Scene(camera=scene.camera).save(folder / "camera.toml")
    return folder / "camera.toml", filmed.clip.path


def evaluate(capsys, *words: object) -> dict:
    """What is written on standard output, which is JSON and nothing else."""
    capsys.readouterr()
    assert main(["evaluate", *map(str, words)]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    return json.loads(captured.out)


def refused(capsys, *words: object) -> str:
    capsys.readouterr()
    assert main(["evaluate", *map(str, words)]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1, lines
    return lines[0]


def test_smoke_that_has_left_the_truths_box(plume, perfect, truth, tmp_path, capsys) -> None:
    domain = plume.scene.domain
    larger = domain.grown((8, 0, 0), (0, 0, 8))
    with SequenceWriter(tmp_path / "out", plume.scene, {"density": {"scattering": "single"}}, npz=True) as writer:
        for number, density in enumerate(plume.densities, 1):
            box = domain if number == 1 else larger
            faces = Velocity.zero(box.resolution, box.voxel_size).faces
            faces[2][:] = RISE * box.voxel_size * 24
            whole = np.full(box.shape, 0.5, np.float32)
            whole[domain.slices_in(box)] = density
            writer.write(number, whole, faces, box=box)
    figures = evaluate(capsys, tmp_path / "out", "--truth", truth)["truth"]
    assert figures["density_error"] < 1e-3


def test_frames_are_those_of_the_clip(plume, truth, tmp_path, capsys) -> None:
    scene = replace(plume.scene, clip=replace(plume.scene.clip, frames=(2, 4)))
    part = write(tmp_path / "part", scene, plume.densities[2:])
    assert evaluate(capsys, part, "--truth", truth)["truth"]["density_error"] < 1e-3
    beginning = write(tmp_path / "beginning", plume.scene, plume.densities[2:])
    assert evaluate(capsys, beginning, "--truth", truth)["truth"]["density_error"] > 0.3


def test_without_truth_or_view_the_orbit_is_compared_with_the_front(plume, perfect, tmp_path, capsys) -> None:
    drawn_out = [np.repeat(density.mean(1, keepdims=True), density.shape[1], 1) for density in plume.densities]
    folder = write(tmp_path / "out", plume.scene, drawn_out)
    found, other = (evaluate(capsys, sequence) for sequence in (perfect, folder))
    assert [view["name"] for view in found["views"]] == ["input"]
    assert found["orbit"]["reference"] == "front"
    assert found["orbit"]["patches"] < 0.5 * other["orbit"]["patches"]


def test_the_truth_beside_itself_with_another_view(perfect, truth, side, tmp_path, capsys) -> None:
    files = ("--json", tmp_path / "a.json", "--picture", tmp_path / "a.png")
    assert main(["evaluate", *map(str, (perfect, "--truth", truth, "--view", *side, *files))]) == 0
    assert "a.json written" in "".join(capsys.readouterr().out.splitlines())
    found = json.loads((tmp_path / "a.json").read_text())
    assert found["frames"] == 5
    figures = found["truth"]
    assert max(figures[f"{name}_error"] for name in ("density", "height_mass", "velocity")) < 1e-3
    assert figures["velocity_cosine"] == pytest.approx(1)
    assert figures["warp_error"] == pytest.approx(figures["warp_error_truth"], abs=1e-3)
    assert [(view["name"], view["size"]) for view in found["views"]] == [("input", [40, 56]), ("camera", [40, 56])]
    assert all(view["psnr"] is None or view["psnr"] > 50 for view in found["views"])
    assert found["views"][1]["ssim"] > 0.999
    with Image.open(tmp_path / "a.png") as sheet:
        pixels = np.asarray(sheet).astype(int)
    first, second = (pixels[top : top + 240, : pixels.shape[1] // 10] for top in (32, 32 + 240 + 20))
    assert first.max() > 100
    assert np.abs(first - second).max() <= 2  # truth and sequence from the front


def test_an_input_before_a_changing_background_is_left_out(plume, side, tmp_path, capsys) -> None:
    for frame in range(5):
        write_image(tmp_path / f"plate_{frame}.exr", np.zeros((56, 40, 3), np.float32))
    scene = replace(plume.scene, background=Background(image=tmp_path / "plate_#.exr"))
    Scene(camera=Scene.load(side[0]).camera, background=plume.scene.background).save(tmp_path / "camera.toml")
    found = evaluate(
        capsys, write(tmp_path / "out", scene, plume.densities), "--view", tmp_path / "camera.toml", side[1]
    )
    assert [view["name"] for view in found["views"]] == ["camera"]
    assert "changes" in found["notes"][0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"velocity_x": None}, "velocity_x"),
        ({"velocity_y": np.zeros((5, 24, 24, 32), np.float16)}, "velocity on faces"),
        ({"density": np.zeros((24, 24, 32), np.float16)}, "frame, x, y, z"),
        ({"fps": 0}, "positive"),
        ({"fps": 30}, "30 frames per second"),
        ({"voxel_size": 0.06}, "box"),
    ],
)
def test_a_truth_that_does_not_fit(plume, perfect, tmp_path, capsys, change, said) -> None:
    path = write_truth(tmp_path / "truth.npz", plume.scene, plume.densities, **change)
    sentence = refused(capsys, perfect, "--truth", path)
    assert str(path) in sentence
    assert said in sentence


def test_views_that_do_not_fit(plume, perfect, side, tmp_path, capsys) -> None:
    camera, clip = side
    assert "No such" in refused(capsys, perfect, "--view", tmp_path / "camera.toml", clip)
    assert "no such" in refused(capsys, perfect, "--view", camera, tmp_path / "clip.mp4")
    Scene(background=Background(color=(0.0, 0.0, 0.0))).save(tmp_path / "nothing.toml")
    assert "[camera]" in refused(capsys, perfect, "--view", tmp_path / "nothing.toml", clip)
    Scene(camera=plume.scene.camera.resized(40, 40)).save(tmp_path / "square.toml")
    assert "40 x 56" in refused(capsys, perfect, "--view", tmp_path / "square.toml", clip)
    for number in range(3):
        write_image(tmp_path / f"short_{number}.exr", render(plume.densities[0], plume.scene))
    assert "has 3 frames" in refused(capsys, perfect, "--view", camera, tmp_path / "short_#.exr")
