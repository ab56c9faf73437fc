"""Scene files: what is read, what is refused and with which words; nothing is lost on the way into a file and back."""

import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scene_examples import FRONT, GOOD, load, moving_camera

from smokelift.scene import (
    Background,
    Box,
    Camera,
    ClipSource,
    DirectionalLight,
    Domain,
    EnvironmentLight,
    Inlet,
    Medium,
    PointLight,
    Scene,
    SceneError,
    View,
    scene_from_dict,
    scene_to_dict,
)

AIMED = "position = [0, -7, 1.5]\ntarget = [0, 0, 1.5]"


def test_every_table_is_read(tmp_path) -> None:
    scene = load(tmp_path, GOOD)
    assert scene.clip == ClipSource(tmp_path / "smoke.mp4", 24.0, (0, 10))
    np.testing.assert_allclose(scene.camera.matrix, FRONT, atol=1e-12)
    assert scene.camera.fx == scene.camera.fy == pytest.approx(192 / math.tan(math.radians(15)))
    assert (scene.camera.cx, scene.camera.cy) == (128, 192)
    assert scene.domain == Domain((-1, -1, 0), (1, 1, 3), (64, 64, 96))
    assert scene.medium == Medium(albedo=0.5)
    sun, lamp = scene.lights
    assert isinstance(sun, DirectionalLight)
    assert sun.direction == pytest.approx((0, 0.6, -0.8))
    assert lamp == PointLight((0, -5, 5), (9, 9, 9))
    assert scene.background == Background(color=(0.1, 0.2, 0.3))
    (view,) = scene.views
    assert view.camera.fx == view.camera.fy == 100.0
    assert view.camera.position == (7.0, 0.0, 1.5)
    assert view.clip.path == tmp_path / "side" / "frame_####.exr"
    assert view.background is None
    (view,) = load(tmp_path, f'{GOOD}[views.background]\nimage = "wall.png"\n').views
    assert view.background == Background(image=tmp_path / "wall.png")
    walls = load(tmp_path, GOOD.replace("[domain]", '[domain]\nclosed = ["z-", "x+"]'))
    assert (walls.closed, walls.domain) == (("x+", "z-"), scene.domain)
    alone = load(tmp_path, '[background]\nstrokes = "strokes.png"\n').background
    frame = load(tmp_path, "[background]\nframe = 98\n").background
    assert alone is not None and alone.estimated and frame == Background(frame=(98,)) and not frame.estimated


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("albedo = 0.5", "albedo = 1.4", "line 22: [medium] albedo"),
        ("albedo = 0.5", "color = [1, 2, 0]", "line 22: [medium] color"),
        ("albedo = 0.5", "color = [0, 0, 0]", "one of them above 0, not"),
        ("albedo = 0.5", "anisotropy = 1", "line 22: [medium] anisotropy"),
        ("albedo = 0.5", 'scattering = "double"', "line 22: [medium] scattering"),
        ("albedo = 0.5", "albeda = 0.5", 'line 22: [medium] there is no key "albeda"'),
        ("[medium]", "[medim]", 'line 21: there is no table "medim"'),
        ("albedo = 0.5", '"al\\nbedo" = 0.5', 'line 21: [medium] there is no key "al\\nbedo"'),
        ("[0, 10]", "[3, 2]", "line 5: [clip] frames"),
        ("fps = 24", 'transfer = "log"', "line 4: [clip] transfer"),
        ('path = "smoke.mp4"', "", "line 2: [clip] lacks path"),
        ('"smoke.mp4"', "3", "line 3: [clip] path"),
        ("fov_y_degrees = 30", "fov_y_degrees = 180", "line 10: [camera] fov_y_degrees"),
        ("fov_y_degrees = 30", "", "line 7: [camera] needs fov_y_degrees or fx"),
        ("fov_y_degrees = 30", "fov_y_degrees = 30\nfx = 2", "line 11: [camera] takes fov_y_degrees or fx"),
        ("fov_y_degrees = 30", "height = 3", 'line 10: [camera] there is no key "height" here'),
        ("target = [0, 0, 1.5]\nfov", "target = [0, -7, 1.5]\nfov", "line 9: [camera] target"),
        ("target = [0, 0, 1.5]\nfov", "fov", "line 7: [camera] needs matrix, or position and target"),
        ("target = [0, 0, 1.5]\nfov", "target = [0, -7, 9]\nfov", "line 7: [camera] up"),
        ("size = [256, 384]", "size = [256, 0]", "line 11: [camera] size"),
        ("size = [256, 384]", "", "line 7: [camera] lacks size"),
        ("max = [1, 1, 3]", "max = [1, 1, 0]", "line 15: [domain] max"),
        ("max = [1, 1, 3]", "max = [1, 1, 3.1]", "line 16: [domain] resolution"),
        ("  96,", "  0,", "line 16: [domain] resolution"),
        ("[0, 3, -4]", "[0, 0, 0]", "line 26: [[lights]] direction"),
        ("[1, 2, 3]", "[1, -2, 3]", "line 27: [[lights]] irradiance"),
        ('type = "point"', 'type = "area"', "line 30: [[lights]] type"),
        ("intensity =", "irradiance =", 'line 32: [[lights]] there is no key "irradiance"'),
        ("[0, -5, 5]", "[0, 0.5, 1]", "line 31: [[lights]] position"),
        ("color = [0.1, 0.2, 0.3]", "color = [0.1, 0.2]", "line 35: [background] color"),
        (
            "color = [0.1, 0.2, 0.3]",
            'color = [0.1, 0.2, 0.3]\nimage = "a.png"',
            "line 36: [background] takes color or image, not both",
        ),
        (
            "color = [0.1, 0.2, 0.3]",
            'frame = 3\nimage = "a.png"',
            "line 35: [background] takes image or frame, not both",
        ),
        ("color = [0.1, 0.2, 0.3]", "frame = []", "line 35: [background] frame must be the number of a frame"),
        ("color = [0.1, 0.2, 0.3]", "strokes = 1", "line 35: [background] strokes must be the path of a file"),
        (
            "target = [0, 0, 1.5]\nfov",
            f"target = [0, 0, 1.5]\nmatrices = {[[list(row) for row in FRONT]]}\nfov",
            "line 8: [camera] takes matrices or position, not both",
        ),
        (AIMED, "matrices = []", "line 8: [camera] matrices"),
        (
            AIMED,
            f"matrices = [{[list(row) for row in FRONT]}, {np.diag([2, 1, 1, 1]).tolist()}]",
            "line 8: [camera] every",
        ),
        ("height = 3", "height = -3", "line 42: [views.camera] height"),
        ("[views.clip]\npath", "[views.clap]\npath", 'line 44: [[views]] there is no key "clap" here'),
        ("[-1, -1, 0]\nmax = [1, 1, 3]", "[9, -1, 0]\nmax = [11, 1, 3]", "[camera] does not see the domain"),
        ("[domain]", "domain = 3\n[dom]", "domain"),
        ("min = [-1, -1, 0]", 'closed = ["z-", "floor"]\nmin = [-1, -1, 0]', "line 14: [domain] closed"),
        ("min = [-1, -1, 0]", 'closed = "z-"\nmin = [-1, -1, 0]', "line 14: [domain] closed"),
        ("[medium]", "[[inlet]]\ncentre = [0, 0, 1]\nradius = 0\n[medium]", "line 23: [[inlet]] radius"),
        (
            "[medium]",
            "[[inlet]]\ncentre = [0, 0, 1]\nradius = 1\n[[inlet]]\ncentre = [0, 0, -2]\nradius = 1\n[medium]",
            "line 25: [[inlet]] is outside the domain",
        ),
        (
            "fps = 24",
            r'path = "C:\users\clip.mp4"',
            "is not valid TOML: Invalid hex value (at line 4, column 13); write a path with /",
        ),
        ("fps = 24", "fps = 1e-38", "line 4: [clip] fps"),
        ("albedo = 0.5", "extinction = 1e-40", "extinction must be a number above 0, 1e-09 at least"),
        ("albedo = 0.5", "extinction = 1e300", "extinction must be a number above 0, 1e+09 at most"),
        ("albedo = 0.5", f"albedo = {'9' * 400}", "albedo must be a number from 0 to 1, 1e+09 at most"),
        ("albedo = 0.5", f"albedo = {'[' * 900}{']' * 900}", "nested too deeply"),
        ("[0, -5, 5]", "[0, -5e6, 5]", "line 31: [[lights]] position"),
        ("fov_y_degrees = 30", "fov_y_degrees = 1e-5", "line 10: [camera] fov_y_degrees"),
        ("size = [256, 384]", "size = [256, 100000]", "line 11: [camera] size"),
        ("[-1, -1, 0]\nmax = [1, 1, 3]", "[0, 0, 0]\nmax = [4e-8, 4e-8, 6e-8]", "voxels must be from 1e-6 to 1e6 m"),
        ("[medium]", "[[inlet]]\ncentre = [0, 0, 1]\nradius = 1\n" * 300 + "[medium]", "[inlet] is given 300 times"),
        ("", "# one\nmedium = { albedo = 3 }\n", "line 2: [medium] albedo"),
        ("", "medium.albedo = 3\n", "line 1: [medium] albedo"),
        ("", "[lights]\n", "line 1: [lights] must be a list of tables"),
        ("", "medium = 3\n", "line 1: [medium] must be a table, not 3"),
        ("", "[domain]\n", "lacks min"),
        ("", "[domain]\nmin = [0, 0, 0]\nmax = [1, 1, 0]\n", "max must be above min"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(tmp_path, old, new, message) -> None:
    text = GOOD.replace(old, new, 1) if old else new
    assert text != GOOD
    with pytest.raises(SceneError) as caught:
        load(tmp_path, text)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_cannot_be_read_is_named_and_not_waited_for(tmp_path) -> None:
    binary, pipe, large = (tmp_path / f"{name}.toml" for name in ("binary", "pipe", "large"))
    binary.write_bytes(b"\xff\xfe\x00")
    os.mkfifo(pipe)
    with large.open("wb") as file:
        file.truncate(2**40)
    for path in (tmp_path / "nothing.toml", binary, pipe, Path("/dev/zero"), tmp_path, large):
        with pytest.raises(SceneError, match=str(path)):
            Scene.load(path)


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
