"""Nothing is lost on the way into a file and back."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scene_examples import FRONT, moving_camera

from smokelift import Background, Camera, ClipSource, DirectionalLight, Domain, EnvironmentLight, Medium, Scene
from smokelift.scene import Box, Inlet, PointLight, View, scene_from_dict, scene_to_dict

CLIP = ClipSource(Path('/footage/a "b" \n ü/smoke_####.png'), 1e-6, (9, 10), "linear", Path("/footage/mask.png"))
DOMAIN = Domain((-0.1, 1 / 3, -1e-12), (0.9, 4 / 3, 2.0), (5, 5, 10))
SIDE = Camera("orthographic", FRONT, (9999, 1), 1e-6, 123.456789, 5000.1, 0.5)

SCENES = {
    "empty": Scene(),
    "walls alone": Scene(closed=("x-", "z+"), scattering="absorption"),
    "box": Scene(domain=Box((-1, -1, 0), (1, 1, 3)), inlets=(Inlet((0, 0, 1), 0.1), Inlet((0.1, 0.2, 2), 1e-6))),
    "everything": Scene(
        clip=CLIP,
        camera=moving_camera((0.1, -7, 0.5), (0.2, -7, 0.5)),
        domain=DOMAIN,
        medium=Medium(1e-9, 1 / 3, -0.99, (0.1, 0.2, 1.0), (1.0, 0.4, 0.1)),
        lights=(
            DirectionalLight((1, 2, -3), (0.1, 0.2, 1e6)),
            PointLight((1e3, 0.1, 5), (0, 0, 7)),
            EnvironmentLight(Path("/sky/a b.exr"), -12.5, 0.0, 7),
        ),
        background=Background(frame=(3, 10**6), strokes=Path("/strokes.png")),
        views=(
            View(SIDE, ClipSource(Path("/side.mp4")), Background(color=(0, 0.1, 1e6))),
            View(SIDE, CLIP, Background(image=Path("/plate.png"))),
        ),
        closed=("z-",),
        inlets=(Inlet((0.5, 1, 0), 0.3),),
        scattering="multiple",
    ),
}


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES.keys())
def test_a_scene_comes_back_as_it_was_saved(tmp_path, scene) -> None:
    scene.save(tmp_path / "scene.toml")
    assert Scene.load(tmp_path / "scene.toml") == scene
    assert scene_from_dict(scene_to_dict(scene)) == scene


def test_any_rotation_and_number_comes_back(tmp_path) -> None:
    random = np.random.default_rng(1)
    for n in range(20):
        matrix = np.eye(4)
        matrix[:3, :3] = np.linalg.qr(random.standard_normal((3, 3)))[0]
        matrix[:3, :3] *= np.linalg.det(matrix[:3, :3])
        matrix[:3, 3] = random.standard_normal(3) * 10.0 ** random.integers(-9, 6, 3)
        camera = replace(SIDE, matrix=matrix, cx=random.standard_normal())
        sun = DirectionalLight(tuple(random.standard_normal(3)), tuple(random.random(3)))
        scene = Scene(camera=camera, lights=(sun,))
        scene.save(tmp_path / f"{n}.toml")
        assert Scene.load(tmp_path / f"{n}.toml") == scene


def test_paths_move_with_the_scene_file(tmp_path) -> None:
    old, new = tmp_path / "old", tmp_path / "new"
    old.mkdir()
    Scene(
        clip=ClipSource(old / "clips" / "a.mp4", mask=old / "mask.png"),
        background=Background(image=tmp_path / "plate.png", strokes=old / "strokes.png"),
        domain=Domain((0, 0, 0), (1, 1, 1), (4, 4, 4)),
    ).save(old / "scene.toml")
    old.rename(new)
    scene = Scene.load(new / "scene.toml")
    assert scene.clip == ClipSource(new / "clips" / "a.mp4", mask=new / "mask.png")
    assert scene.background == Background(image=tmp_path / "plate.png", strokes=new / "strokes.png")
