"""Smoke before plates: the files that are composed, and the figures of elements and volumes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.baked import BLACK, VIEWS, Baked
from benchmarks.extraction.__main__ import main
from benchmarks.extraction.compose import FRAME, GIVEN, KNOWN, UNKNOWN, Composed, Filming, compose
from benchmarks.extraction.score import score_densities, score_element
from smokelift import Background, Clip, Scene
from smokelift.footage.image_files import read_image
from smokelift.footage.images import linear_to_srgb
from smokelift.render import scene_renderer
from smokelift.scene import completed, orbit
from tests.benchmarks.ball import scene, truth

SHAPE, FRAMES, VOXEL = (16, 16, 24), 12, 0.125


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A scene's folder with a ball of smoke that fades, whose front has no transmittance."""
    folder = tmp_path_factory.mktemp("ball")
    x, y, z = np.meshgrid(*((np.arange(n) + 0.5 - n / 2) * VOXEL for n in SHAPE), indexing="ij")
    ball = np.maximum(1 - 2 * (x**2 + y**2 + z**2), 0)
    density = np.stack([ball * (1 - 0.05 * frame) for frame in range(FRAMES)]).astype(np.float16)
    known = truth(density, VOXEL)
    faces = {f"velocity_{axis}": face for axis, face in zip("xyz", known.faces, strict=True)}
    inflow = known.inflow_packed
    np.savez(folder / "truth.npz", density=density, inflow_packed=inflow, voxel_size=VOXEL, fps=24, **faces)
    described = scene(SHAPE, (48, 72), 3)
    described.save(folder / "scene.toml")
    for view, name in VIEWS.items():
        camera = orbit(described.camera, described.domain, float(view))
        Scene(camera=camera).save(folder / f"{name}.toml")
        renderer = scene_renderer(completed(described), camera, BLACK)
        pictures = [renderer.image(each.astype(np.float32))[..., 0] for each in density]
        np.savez(folder / f"{name}.npz", image=np.stack(pictures).astype(np.float16))
    return folder


@pytest.fixture(scope="module")
def smoke(folder) -> Baked:
    return Baked.load(folder, FRAMES)


@pytest.fixture(scope="module")
def before_planks(smoke, tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("composed") / "ball-planks"
    compose(smoke, "planks", Filming(), out)
    return out


@pytest.fixture(scope="module")
def composed(before_planks) -> Composed:
    return Composed.load(before_planks)


def test_a_clip_shows_smoke_before_its_plate(before_planks, composed) -> None:
    with Clip.open(Scene.load(before_planks / f"{GIVEN}.toml").clip) as clip:
        assert len(clip) == FRAMES
        difference = linear_to_srgb(clip.frame(6)) - linear_to_srgb(composed.pictures()[6])
    assert np.abs(difference).mean() < 0.03  # H.264 halves the chroma
    np.testing.assert_allclose(read_image(before_planks / "plate.png"), composed.plate, atol=1e-4)


def test_scene_files_know_the_plate_a_frame_or_nothing(before_planks) -> None:
    assert {f"{known}.toml" for known in KNOWN} == {path.name for path in before_planks.glob("*.toml")}
    given, unknown = (Scene.load(before_planks / f"{known}.toml") for known in (GIVEN, UNKNOWN))
    assert given.background is not None and given.background.image == before_planks / "plate.png"
    assert replace(given, background=None) == unknown
    named = Scene.load(before_planks / f"{FRAME}.toml")
    assert named.clip is not None and named.background == Background(frame=(0,))
    with Clip.open(named.clip) as clip, Clip.open(unknown.clip) as used:
        assert clip.numbers[0] == 1 and len(clip) == len(used) == FRAMES
        empty = clip.whole().frame(0)
    assert np.abs(empty - read_image(before_planks / "plate.png")).mean() < 0.02


def test_what_is_composed_stays_and_is_not_taken_for_another_clip(smoke, folder, before_planks) -> None:
    written = (before_planks / "clip.mp4").stat().st_mtime_ns
    compose(smoke, "planks", Filming(), before_planks)
    assert (before_planks / "clip.mp4").stat().st_mtime_ns == written
    with pytest.raises(ValueError, match="OUT"):
        compose(Baked.load(folder, 3), "planks", Filming(), before_planks)


def test_an_element_is_scored_by_its_imprint_its_tail_and_its_mass(composed) -> None:
    """The true one has nothing wrong."""
    figures = score_element(composed.seen.transmittance, composed.seen.radiance, composed)
    assert figures["transmittance_error"] == figures["radiance_error"] == figures["imprint"] == 0
    assert (figures["thin_mass"], figures["tail"]) == pytest.approx((1, 1))
    assert figures["psnr"] > 100
    printed = composed.seen.transmittance + 0.1 * (composed.plate.mean(-1) - composed.plate.mean())
    figures = score_element(printed, composed.seen.radiance, composed)
    assert figures["imprint"] > 0.99
    noise = 0.01 * np.random.default_rng(0).standard_normal(composed.seen.transmittance.shape)
    assert score_element(composed.seen.transmittance + noise, composed.seen.radiance, composed)["imprint"] < 0.1
    clear = composed.seen.transmittance
    assert score_element(np.where(clear > 0.9, 1, clear), composed.seen.radiance, composed)["tail"] == 0
    assert score_element(0 * clear, composed.seen.radiance, composed)["tail"] == pytest.approx(1)
    assert score_element(np.sqrt(clear), composed.seen.radiance, composed)["thin_mass"] == pytest.approx(0.5, abs=0.01)


def test_the_true_volumes_score_as_the_truth(smoke, composed) -> None:
    whole = completed(smoke.scene)
    figures = score_densities(whole, lambda frame: smoke.densities[frame].astype(np.float32), smoke, composed)
    assert figures["transmittance_error"] < 1e-3
    assert figures["mass"] == pytest.approx(1)
    assert min(figures[f"psnr_{view}"] for view in (20, 45, 90)) > 50
    dark = score_densities(whole, lambda frame: 0.5 * smoke.densities[frame].astype(np.float32), smoke, composed)
    assert dark["mass"] == pytest.approx(0.5)
    assert dark["psnr_90"] < 40


@pytest.mark.parametrize(("relit", "known"), [([], "given"), (["--relit"], "given-relit")])
def test_the_command_measures_once(folder, tmp_path, capsys, relit, known) -> None:
    command = [str(tmp_path), str(folder), "--plates", "sky", "--known", GIVEN, "--frames", "3"]
    command += ["--quality", "draft", "--resolution", "16x16x24", *relit]
    main(command)
    first = capsys.readouterr().out.splitlines()[-1]
    assert first.startswith(f"| {folder.name} | sky | {known} |")
    (tmp_path / f"{folder.name}-sky" / "clip.mp4").unlink()
    main(command)
    assert capsys.readouterr().out.splitlines()[-1] == first
