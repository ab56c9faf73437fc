"""``smokelift evaluate``: a sequence beside known volumes and other views, and every way to ask for nonsense."""

import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from smokelift import Velocity, render
from smokelift.output.archive import VELOCITY
from smokelift.output.images import write_image
from smokelift.output.writer import SequenceWriter
from smokelift.scene import Background, Domain, Scene, orbit
from tests.engine.app.command_line import command, refused

RISE = 1.5
"""Voxels a frame of the tiny plume."""


def rising(domain: Domain) -> tuple[np.ndarray, ...]:
    """A velocity as fast as the truth's."""
    faces = Velocity.zero(domain.resolution, domain.voxel_size).faces
    faces[2][:] = RISE * domain.voxel_size * 24
    return faces


def write(folder: Path, scene: Scene, densities, boxes: Iterable[Domain] | None = None) -> Path:
    """A sequence of volumes that rise as fast as the truth, in the scene's box or in boxes of their own."""
    boxes = boxes or [scene.domain] * len(densities)
    with SequenceWriter(folder, scene, {"density": {"scattering": "single"}}, npz=True) as writer:
        for number, (density, box) in enumerate(zip(densities, boxes, strict=True), 1):
            writer.write(number, density, rising(box), box=box)
    return folder


def write_truth(path: Path, scene: Scene, densities, **changes) -> Path:
    """The tiny plume in the format of baked scenes."""
    count = len(densities)
    faces = {name: np.stack([face] * count) for name, face in zip(VELOCITY, rising(scene.domain), strict=True)}
    arrays = {
        "density": np.stack(densities).astype(np.float16),
        **{name: face.astype(np.float16) for name, face in faces.items()},
        "inflow_packed": np.zeros((count, densities[0].size // 8), np.uint8),
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
    """The first of the true volumes as a sequence."""
    return write(tmp_path_factory.mktemp("perfect") / "out", plume.scene, plume.densities[:3])


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
    assert command("evaluate", *words) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    return json.loads(captured.out)


def test_smoke_that_has_left_the_truths_box(plume, perfect, truth, tmp_path, capsys) -> None:
    domain = plume.scene.domain
    boxes = [domain, domain.grown((8, 0, 0), (0, 0, 8))]
    wholes = [np.full(box.shape, 0.5, np.float32) for box in boxes]
    for whole, box, density in zip(wholes, boxes, plume.densities[:2], strict=True):
        whole[domain.slices_in(box)] = density
    out = write(tmp_path / "out", plume.scene, wholes, boxes)
    assert evaluate(capsys, out, "--truth", truth)["truth"]["density_error"] < 1e-3


def test_frames_are_those_of_the_clip(plume, truth, tmp_path, capsys) -> None:
    scene = replace(plume.scene, clip=replace(plume.scene.clip, frames=(3, 4)))
    part = write(tmp_path / "part", scene, plume.densities[3:])
    found = evaluate(capsys, part, "--truth", truth)
    assert found["truth"]["density_error"] < 1e-3 and found["orbit"]["halo"] < 0.01


def test_the_truth_beside_itself_with_another_view(perfect, truth, side, tmp_path, capsys) -> None:
    files = ("--json", tmp_path / "a.json", "--picture", tmp_path / "a.png")
    assert command("evaluate", perfect, "--truth", truth, "--view", *side, *files) == 0
    assert "a.json written" in "".join(capsys.readouterr().out.splitlines())
    found = json.loads((tmp_path / "a.json").read_text())
    assert found["frames"] == 3
    figures = found["truth"]
    assert max(figures[f"{name}_error"] for name in ("density", "height_mass", "velocity")) < 1e-3
    assert figures["velocity_cosine"] == pytest.approx(1)
    assert figures["warp_error"] == pytest.approx(figures["warp_error_truth"], abs=1e-3)
    assert [(view["name"], view["size"]) for view in found["views"]] == [("input", [40, 56]), ("camera", [40, 56])]
    assert all(view["psnr"] is None or view["psnr"] > 50 for view in found["views"])
    assert found["views"][1]["ssim"] > 0.999
    assert found["orbit"]["patches"] < 1e-3 and found["orbit"]["flicker"] == pytest.approx(1, abs=0.01)
    with Image.open(tmp_path / "a.png") as sheet:
        assert np.asarray(sheet).std() > 10


def test_an_input_before_a_changing_background_is_left_out(plume, side, tmp_path, capsys) -> None:
    """Without a truth the orbit is compared with the front, and all views that there are with the sequence."""
    for frame in range(5):
        write_image(tmp_path / f"plate_{frame}.exr", np.zeros((56, 40, 3), np.float32))
    scene = replace(plume.scene, background=Background(image=tmp_path / "plate_#.exr"))
    Scene(camera=Scene.load(side[0]).camera, background=plume.scene.background).save(tmp_path / "camera.toml")
    alone, changing = (
        write(tmp_path / name, each, plume.densities[:2]) for name, each in (("a", plume.scene), ("b", scene))
    )
    for words, views in (((alone,), ["input"]), ((changing, "--view", tmp_path / "camera.toml", side[1]), ["camera"])):
        found = evaluate(capsys, *words)
        assert [view["name"] for view in found["views"]] == views
        assert found["orbit"]["reference"] == "front"
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
    sentence = refused(capsys, "evaluate", perfect, "--truth", path)
    assert str(path) in sentence
    assert said in sentence


def test_views_that_do_not_fit(plume, perfect, side, tmp_path, capsys) -> None:
    camera, clip = side
    Scene(background=Background(color=(0.0, 0.0, 0.0))).save(tmp_path / "nothing.toml")
    Scene(camera=plume.scene.camera.resized(40, 40)).save(tmp_path / "square.toml")
    for number in range(2):
        write_image(tmp_path / f"short_{number}.exr", render(plume.densities[0], plume.scene))
    for said, *files in (
        ("No such", tmp_path / "camera.toml", clip),
        ("no such", camera, tmp_path / "clip.mp4"),
        ("[camera]", tmp_path / "nothing.toml", clip),
        ("40 x 56", tmp_path / "square.toml", clip),
        ("has 2 frames", camera, tmp_path / "short_#.exr"),
    ):
        assert said in refused(capsys, "evaluate", perfect, "--view", *files)
