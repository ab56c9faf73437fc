"""``smokelift evaluate``: a sequence beside known volumes and other views, and every way to ask for nonsense."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from smokelift.app.cli import main
from smokelift.footage.images import read_image
from smokelift.output.images import write_image
from smokelift.output.writer import SequenceWriter
from smokelift.render import render
from smokelift.scene import Background, ClipSource, Domain, Scene, orbit
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


def test_the_truth_beside_itself(perfect, truth, capsys) -> None:
    found = evaluate(capsys, perfect, "--truth", truth)
    assert found["frames"] == 5
    assert "views" not in found
    figures = found["truth"]
    assert figures["density_error"] < 1e-3
    assert figures["height_mass_error"] < 1e-3
    assert figures["velocity_error"] < 1e-3
    assert figures["velocity_cosine"] == pytest.approx(1)
    assert figures["warp_error"] == pytest.approx(figures["warp_error_truth"], abs=1e-3)


def test_smoke_that_has_left_the_truths_box(plume, perfect, truth, tmp_path, capsys) -> None:
    """It is compared in that box: what is beyond makes no difference."""
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


def test_a_wrong_sequence_beside_the_truth(plume, truth, tmp_path, capsys) -> None:
    """Smoke that lies too deep and is said to stand still."""
    folder = write(tmp_path / "out", plume.scene, [np.roll(d, 4, 1) for d in plume.densities], speed=0.0)
    figures = evaluate(capsys, folder, "--truth", truth)["truth"]
    assert figures["density_error"] > 0.3
    assert figures["height_mass_error"] < 1e-3
    assert figures["velocity_error"] == pytest.approx(1)
    assert figures["velocity_cosine"] == 0
    assert figures["warp_error"] > 2 * figures["warp_error_truth"]


def test_frames_are_those_of_the_clip(plume, truth, tmp_path, capsys) -> None:
    """A sequence of a part of the clip is compared with that part."""
    scene = replace(plume.scene, clip=replace(plume.scene.clip, frames=(2, 4)))
    part = write(tmp_path / "part", scene, plume.densities[2:])
    assert evaluate(capsys, part, "--truth", truth)["truth"]["density_error"] < 1e-3
    beginning = write(tmp_path / "beginning", plume.scene, plume.densities[2:])
    assert evaluate(capsys, beginning, "--truth", truth)["truth"]["density_error"] > 0.3


def test_another_resolution_of_the_same_box(plume, truth, tmp_path, capsys) -> None:
    domain = plume.scene.domain
    scene = replace(plume.scene, domain=Domain(domain.min, domain.max, (12, 12, 16)))
    coarse = [d.reshape(12, 2, 12, 2, 16, 2).mean((1, 3, 5)) for d in plume.densities]
    figures = evaluate(capsys, write(tmp_path / "out", scene, coarse), "--truth", truth)["truth"]
    assert 0.01 < figures["density_error"] < 0.5
    assert figures["mass_ratio"] == pytest.approx(1, abs=0.02)


def test_the_input_and_another_view(perfect, side, capsys) -> None:
    found = evaluate(capsys, perfect, "--view", *side)
    given, new = found["views"]
    assert (given["name"], new["name"]) == ("input", "camera")
    assert given["size"] == new["size"] == [40, 56]
    assert given["psnr"] is None or given["psnr"] > 50
    assert new["psnr"] is None or new["psnr"] > 50
    assert new["ssim"] > 0.999


def test_smoke_that_lies_too_deep_is_seen_from_the_side_only(plume, side, tmp_path, capsys) -> None:
    moved = write(tmp_path / "out", plume.scene, [np.roll(d, 3, 1) for d in plume.densities])
    given, new = evaluate(capsys, moved, "--view", *side)["views"]
    assert new["psnr"] < given["psnr"] - 3


def test_without_truth_or_view_the_orbit_is_compared_with_the_front(plume, perfect, tmp_path, capsys) -> None:
    """A sequence that is its front picture drawn out in depth has other sides than fronts."""
    drawn_out = [np.repeat(density.mean(1, keepdims=True), density.shape[1], 1) for density in plume.densities]
    folder = write(tmp_path / "out", plume.scene, drawn_out)
    found, other = (evaluate(capsys, sequence) for sequence in (perfect, folder))
    assert [view["name"] for view in found["views"]] == ["input"]
    assert found["orbit"]["reference"] == "front"
    assert found["orbit"]["patches"] < 0.5 * other["orbit"]["patches"]


def test_the_orbit_beside_the_truth_is_on_the_truth_s_grid(plume, perfect, truth, tmp_path, capsys) -> None:
    found = evaluate(capsys, perfect, "--truth", truth)["orbit"]
    assert found["reference"] == "truth"
    assert found["patches"] < 0.01 and found["halo"] < 0.01
    assert found["edges"] == pytest.approx(1, abs=0.01) and found["flicker"] == pytest.approx(1, abs=0.01)
    domain = plume.scene.domain
    scene = replace(plume.scene, domain=Domain(domain.min, domain.max, (12, 12, 16)))
    coarse = [d.reshape(12, 2, 12, 2, 16, 2).mean((1, 3, 5)) for d in plume.densities]
    lacking = evaluate(capsys, write(tmp_path / "out", scene, coarse), "--truth", truth)["orbit"]
    assert lacking["patches"] > 0.05 and lacking["edges"] < 0.95


def test_json_and_picture_as_files(perfect, truth, side, tmp_path, capsys) -> None:
    files = ("--json", tmp_path / "a.json", "--picture", tmp_path / "a.png")
    assert main(["evaluate", *map(str, (perfect, "--truth", truth, "--view", *side, *files))]) == 0
    assert "a.json written" in "".join(capsys.readouterr().out.splitlines())
    found = json.loads((tmp_path / "a.json").read_text())
    assert found["truth"]["density_error"] < 1e-3
    assert len(found["views"]) == 2
    with Image.open(tmp_path / "a.png") as sheet:
        pixels = np.asarray(sheet).astype(int)
    first, second = (pixels[top : top + 240, : pixels.shape[1] // 10] for top in (32, 32 + 240 + 20))
    assert first.max() > 100
    assert np.abs(first - second).max() <= 2  # truth and sequence from the front


def test_progress_as_json(perfect, truth, capsys) -> None:
    found = evaluate(capsys, perfect, "--truth", truth, "--progress", "json")
    assert found["event"] == "done"
    assert found["truth"]["density_error"] < 1e-3


def test_a_missing_input_clip_is_noted(plume, side, tmp_path, capsys) -> None:
    scene = replace(plume.scene, clip=replace(plume.scene.clip, path=tmp_path / "gone.mp4"))
    found = evaluate(capsys, write(tmp_path / "out", scene, plume.densities), "--view", *side)
    assert [view["name"] for view in found["views"]] == ["camera"]
    assert "gone.mp4" in found["notes"][0]


def test_what_a_mask_hides_of_the_input_is_its_background(plume, side, tmp_path, capsys) -> None:
    """A block beside the smoke is no error where a mask hides it."""
    scene = plume.write(tmp_path / "clip", plume.densities)
    for number in range(len(plume.densities)):
        file = tmp_path / "clip" / f"frame_{number:04d}.png"
        picture = read_image(file)
        picture[4 + 8 * number : 14 + 8 * number, 1:7] = 0.3
        write_image(file, picture)
    mask = np.ones((56, 40, 3))
    mask[:, :8] = 0
    write_image(tmp_path / "mask.png", mask)
    masked = replace(scene, clip=replace(scene.clip, mask=tmp_path / "mask.png"))
    hidden = evaluate(capsys, write(tmp_path / "masked", masked, plume.densities), "--view", *side)["views"][0]
    shown = evaluate(capsys, write(tmp_path / "out", scene, plume.densities), "--view", *side)["views"][0]
    assert hidden["ssim"] > 0.99 > shown["ssim"]


def test_a_view_before_a_background_of_its_own(plume, perfect, tmp_path, capsys) -> None:
    """The camera file's background is what stands behind the smoke there."""
    camera = orbit(plume.scene.camera, plume.scene.domain, 60)
    scene = replace(plume.scene, camera=camera, clip=None, background=Background(color=(0.1, 0.2, 0.3)))
    filmed = plume.write(tmp_path / "clip", plume.densities, scene, suffix=".exr")
    Scene(camera=camera, background=scene.background).save(tmp_path / "camera.toml")
    new = evaluate(capsys, perfect, "--view", tmp_path / "camera.toml", filmed.clip.path)["views"][1]
    assert new["psnr"] is None or new["psnr"] > 50


def test_cameras_that_move(plume, tmp_path, capsys) -> None:
    """Each frame is rendered from where its camera was."""
    still, domain = plume.scene.camera, plume.scene.domain
    cameras = [orbit(still, domain, 8 * frame) for frame in range(5)]
    for frame, (camera, density) in enumerate(zip(cameras, plume.densities, strict=True)):
        write_image(tmp_path / f"seen_{frame}.exr", render(density, plume.scene, camera))
    moving = replace(still, matrices=tuple(camera.matrix for camera in cameras))
    scene = replace(plume.scene, camera=moving, clip=ClipSource(tmp_path / "seen_#.exr", fps=24.0))
    Scene(camera=moving).save(tmp_path / "camera.toml")
    sequence = write(tmp_path / "out", scene, plume.densities)
    for view in evaluate(capsys, sequence, "--view", tmp_path / "camera.toml", scene.clip.path)["views"]:
        assert view["psnr"] is None or view["psnr"] > 50


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


# refusals


def test_no_sequence_there(tmp_path, truth, capsys) -> None:
    assert "holds no sequence" in refused(capsys, tmp_path, "--truth", truth)
    assert "clip of another camera goes with --view" in refused(capsys, tmp_path, "--truth", tmp_path / "clip.mp4")


def test_a_sequence_without_frames(plume, truth, tmp_path, capsys) -> None:
    assert "no finished frames" in refused(capsys, write(tmp_path / "out", plume.scene, []), "--truth", truth)


@pytest.mark.parametrize("content", [None, b"", b"text " * 100, b"PK\x03\x04" + b"0" * 200])
def test_a_truth_that_cannot_be_read(perfect, tmp_path, capsys, content) -> None:
    path = tmp_path / "truth.npz"
    if content is not None:
        path.write_bytes(content)
    assert str(path) in refused(capsys, perfect, "--truth", path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"velocity_x": None}, "velocity_x"),
        ({"velocity_y": np.zeros((5, 24, 24, 32), np.float16)}, "velocity on faces"),
        ({"density": np.zeros((24, 24, 32), np.float16)}, "frame, x, y, z"),
        ({"fps": 0}, "positive"),
        ({"fps": 30}, "30 frames a second"),
        ({"voxel_size": 0.06}, "box"),
    ],
)
def test_a_truth_that_does_not_fit(plume, perfect, tmp_path, capsys, change, said) -> None:
    path = write_truth(tmp_path / "truth.npz", plume.scene, plume.densities, **change)
    sentence = refused(capsys, perfect, "--truth", path)
    assert str(path) in sentence
    assert said in sentence


def test_a_truth_with_too_few_frames(plume, perfect, tmp_path, capsys) -> None:
    path = write_truth(tmp_path / "truth.npz", plume.scene, plume.densities[:3])
    assert "holds 3 frames" in refused(capsys, perfect, "--truth", path)


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


def test_folders_that_do_not_exist(perfect, truth, tmp_path, capsys) -> None:
    for option, name in (("--json", "a.json"), ("--picture", "a.png")):
        sentence = refused(capsys, perfect, "--truth", truth, option, tmp_path / "no" / name)
        assert "does not exist" in sentence
    assert ".png" in refused(capsys, perfect, "--truth", truth, "--picture", tmp_path / "a.jpg")
