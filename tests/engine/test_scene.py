"""Scene files: what is read, what is refused and with which words, and that nothing is lost on the way."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smokelift.scene import (
    SCATTERINGS,
    SIDES,
    Background,
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
    completed,
    look_at_matrix,
    scene_from_dict,
    scene_to_dict,
)

DATA = Path(__file__).parents[3] / "shared" / "data"
FRONT = ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, -1.0, -7.0), (0.0, 1.0, 0.0, 1.5), (0.0, 0.0, 0.0, 1.0))

GOOD = """\
# a shot
[clip]
path = "smoke.mp4"
fps = 24
frames = [0, 10]

[camera]
position = [0, -7, 1.5]
target = [0, 0, 1.5]
fov_y_degrees = 30
size = [256, 384]

[domain]
min = [-1, -1, 0]
max = [1, 1, 3]
resolution = [
  64, 64,  # across
  96,
]

[medium]
albedo = 0.5

[[lights]]
type = "directional"
direction = [0, 3, -4]
irradiance = [1, 2, 3]

[[lights]]
type = "point"
position = [0, -5, 5]
intensity = [9, 9, 9]

[background]
color = [0.1, 0.2, 0.3]

[[views]]
[views.camera]
type = "orthographic"
position = [7, 0, 1.5]
target = [0, 0, 1.5]
height = 3
size = [200, 300]
[views.clip]
path = "side/frame_####.exr"
"""


AIMED = "position = [0, -7, 1.5]\ntarget = [0, 0, 1.5]"


def load(folder: Path, text: str) -> Scene:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return Scene.load(path)


def test_every_table_is_read(tmp_path: Path) -> None:
    scene = load(tmp_path, GOOD)
    assert scene.clip == ClipSource(tmp_path / "smoke.mp4", 24.0, (0, 10))
    assert scene.camera is not None
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


def test_further_views_keep_step_with_another_range(tmp_path: Path) -> None:
    """Frames that were said to belong to the clip's move with them; those that were not have the same numbers."""
    scene = load(tmp_path, GOOD)
    (view,) = scene.views
    said = replace(view, clip=replace(view.clip, frames=(5, 15)))
    later = replace(scene, views=(view, said)).with_frames(3, 7)
    assert later.clip == replace(scene.clip, frames=(3, 7))
    assert [each.clip.frames for each in later.views] == [None, (8, 12)]
    began = replace(scene, clip=replace(scene.clip, frames=(6, 10)), views=(said,))
    with pytest.raises(SceneError, match="its clip begins 1 frames after frame 0 of the input"):
        began.with_frames(0, 4)


def test_walls_and_inlets_are_read(tmp_path: Path) -> None:
    """In the order of the sides, whatever the file's."""
    inlets = "[[inlet]]\ncentre = [0, 0, 0]\nradius = 0.5\n[[inlet]]\ncentre = [1, 0, 1]\nradius = 0.25\n"
    text = GOOD.replace("[domain]", '[domain]\nclosed = ["z-", "x+"]').replace("[medium]", f"{inlets}[medium]")
    scene = load(tmp_path, text)
    assert scene.closed == ("x+", "z-")
    assert scene.inlets == (Inlet((0, 0, 0), 0.5), Inlet((1, 0, 1), 0.25))
    assert scene.domain == load(tmp_path, GOOD).domain


def test_walls_of_a_box_that_is_not_given(tmp_path: Path) -> None:
    """They wait for the one that will be found."""
    scene = load(tmp_path, '[domain]\nclosed = ["z-"]\n')
    assert scene == Scene(closed=("z-",))
    assert scene.inflow() is None
    with pytest.raises(SceneError, match="lacks min"):
        load(tmp_path, "[domain]\n")


def test_the_scattering_stands_with_the_medium(tmp_path: Path) -> None:
    scene = load(tmp_path, GOOD.replace("[medium]", '[medium]\nscattering = "unshadowed"'))
    assert scene == replace(load(tmp_path, GOOD), scattering="unshadowed")
    assert load(tmp_path, GOOD).scattering is None


def test_scattering_alone_leaves_the_medium_open(tmp_path: Path) -> None:
    scene = load(tmp_path, '[medium]\nscattering = "absorption"\n')
    assert scene == Scene(scattering="absorption")


def test_a_complete_scene_comes_back_as_it_was_written(tmp_path: Path) -> None:
    scene = completed(replace(load(tmp_path, GOOD), scattering="absorption"))
    assert completed(scene_from_dict(scene_to_dict(scene))) == scene


def test_an_inlet_is_the_voxels_in_its_ball() -> None:
    domain = Domain((-1, -1, 0), (1, 1, 3), (64, 64, 96))
    inlet = Inlet((0.1, -0.2, 0), 0.4)
    found = inlet.voxels(domain)
    centres = np.stack(np.meshgrid(*(np.arange(n) + 0.5 for n in found.shape), indexing="ij"), -1) / 32 + domain.min
    np.testing.assert_array_equal(found, np.linalg.norm(centres - inlet.centre, axis=-1) <= 0.4)
    assert found.sum() / 32**3 == pytest.approx(2 / 3 * math.pi * 0.4**3, rel=0.02)


@pytest.mark.parametrize(
    ("centre", "voxel"), [((0.01, 0.02, 0.05), (32, 32, 1)), ((-1.005, 0.99, 3), (0, 63, 95))], ids=["in", "beside"]
)
def test_a_small_inlet_is_the_nearest_voxel(centre, voxel) -> None:
    domain = Domain((-1, -1, 0), (1, 1, 3), (64, 64, 96))
    np.testing.assert_array_equal(np.argwhere(Inlet(centre, 0.006).voxels(domain)), [voxel])


def test_inlets_add_up() -> None:
    domain = Domain((-1, -1, 0), (1, 1, 3), (64, 64, 96))
    inlets = Inlet((0, 0, 0), 0.2), Inlet((0.5, 0.5, 1), 0.1)
    inflow = Scene(domain=domain, inlets=inlets).inflow()
    np.testing.assert_array_equal(inflow, inlets[0].voxels(domain) | inlets[1].voxels(domain))
    assert Scene(domain=domain).inflow() is None


def test_a_file_may_hold_any_one_table(tmp_path: Path) -> None:
    assert load(tmp_path, "") == Scene()
    assert load(tmp_path, "[medium]\n") == Scene(medium=Medium())
    assert load(tmp_path, "[background]\nimage = 'plate.png'\n").background == Background(image=tmp_path / "plate.png")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "albedo = 0.5",
            "albedo = 1.4",
            "scene.toml, line 22: [medium] albedo must be a number from 0 to 1, not 1.4",
        ),
        ("albedo = 0.5", 'albedo = "x"', 'line 22: [medium] albedo must be a number from 0 to 1, not "x"'),
        ("albedo = 0.5", "albedo = true", "line 22: [medium] albedo must be a number from 0 to 1, not true"),
        ("albedo = 0.5", "albedo = nan", "line 22: [medium] albedo must be"),
        (
            "albedo = 0.5",
            "anisotropy = 1",
            "line 22: [medium] anisotropy must be a number between -1 and 1, not 1",
        ),
        (
            "albedo = 0.5",
            'scattering = "double"',
            'line 22: [medium] scattering must be one of "single", "unshadowed", "absorption", not "double"',
        ),
        ("albedo = 0.5", "scattering = [1]", "line 22: [medium] scattering must be one of"),
        ("albedo = 0.5", "extinction = 0", "line 22: [medium] extinction must be a number above 0"),
        (
            "albedo = 0.5",
            "albeda = 0.5",
            'line 22: [medium] there is no key "albeda" here; known are extinction',
        ),
        ("[medium]", "[medim]", 'line 21: there is no table "medim" here; known are clip, camera'),
        ("fps = 24", "fps = 0", "line 4: [clip] fps must be a number above 0, not 0"),
        ("[0, 10]", "[3, 2]", "line 5: [clip] frames must be [first, last]"),
        ("[0, 10]", "[0, 1.5]", "line 5: [clip] frames must be"),
        ("fps = 24", 'transfer = "log"', 'line 4: [clip] transfer must be "srgb" or "linear", not "log"'),
        ('path = "smoke.mp4"', "", "line 2: [clip] lacks path"),
        ('"smoke.mp4"', "3", "line 3: [clip] path must be the path of a file, not 3"),
        (
            "fov_y_degrees = 30",
            "fov_y_degrees = 180",
            "line 10: [camera] fov_y_degrees must be a number between",
        ),
        ("fov_y_degrees = 30", "", "line 7: [camera] needs fov_y_degrees or fx"),
        ("fov_y_degrees = 30", "fov_y_degrees = 30\nfx = 2", "line 11: [camera] takes fov_y_degrees or fx"),
        ("fov_y_degrees = 30", "height = 3", 'line 10: [camera] there is no key "height" here'),
        ("fov_y_degrees = 30", "fx = -3", "line 10: [camera] fx must be a number above 0"),
        ("target = [0, 0, 1.5]\nfov", "target = [0, -7, 1.5]\nfov", "line 9: [camera] target must differ"),
        ("target = [0, 0, 1.5]\nfov", "fov", "line 7: [camera] needs matrix, or position and target"),
        ("target = [0, 0, 1.5]\nfov", "target = [0, -7, 9]\nfov", "line 7: [camera] up must not be"),
        ("size = [256, 384]", "size = [256, 0]", "line 11: [camera] size must be [width, height]"),
        ("size = [256, 384]", "", "line 7: [camera] lacks size"),
        (
            "max = [1, 1, 3]",
            "max = [1, 1, 0]",
            "line 15: [domain] max must be above min on every axis; along z",
        ),
        ("max = [1, 1, 3]", "max = [1, 1, 3.1]", "line 16: [domain] resolution must make cubic voxels"),
        ("max = [1, 1, 3]", "max = [1, 1]", "line 15: [domain] max must be three numbers"),
        ("  96,", "  0,", "line 16: [domain] resolution must be three whole numbers"),
        ("min = [-1, -1, 0]", "", "line 13: [domain] lacks min"),
        ("[0, 3, -4]", "[0, 0, 0]", "line 26: [[lights]] direction must not be [0, 0, 0]"),
        (
            "[1, 2, 3]",
            "[1, -2, 3]",
            "line 27: [[lights]] irradiance must be three numbers [r, g, b], none below 0",
        ),
        ("irradiance = [1, 2, 3]", "", "line 24: [[lights]] lacks irradiance"),
        ('type = "point"', 'type = "area"', 'line 30: [[lights]] type must be one of "directional", "point"'),
        ("intensity =", "irradiance =", 'line 32: [[lights]] there is no key "irradiance" here'),
        ("[0, -5, 5]", "[0, 0.5, 1]", "line 31: [[lights]] position [0.0, 0.5, 1.0] is inside the domain"),
        (
            "color = [0.1, 0.2, 0.3]",
            "color = [0.1, 0.2]",
            "line 35: [background] color must be three numbers",
        ),
        (
            "color = [0.1, 0.2, 0.3]",
            'color = [0.1, 0.2, 0.3]\nimage = "a.png"',
            "line 36: [background] takes color or image, not both",
        ),
        (
            "target = [0, 0, 1.5]\nfov",
            f"target = [0, 0, 1.5]\nmatrices = {[[list(row) for row in FRONT]]}\nfov",
            "line 8: [camera] takes matrices or position, not both",
        ),
        (AIMED, "matrices = []", "line 8: [camera] matrices must be a list of 4x4 matrices"),
        (AIMED, "matrices = [[1, 2], [3, 4]]", "line 8: [camera] matrices must be four rows of four numbers"),
        (
            AIMED,
            f"matrices = [{[list(row) for row in FRONT]}, {np.diag([2, 1, 1, 1]).tolist()}]",
            "line 8: [camera] every one of matrices must be rigid",
        ),
        ("height = 3", "height = -3", "line 42: [views.camera] height must be a number of metres above 0"),
        ("side/frame", "", None),
        ("[views.clip]\npath", "[views.clap]\npath", 'line 44: [[views]] there is no key "clap" here'),
        ("[-1, -1, 0]\nmax = [1, 1, 3]", "[9, -1, 0]\nmax = [11, 1, 3]", "[camera] does not see the domain"),
        ("[domain]", "domain = 3\n[dom]", "domain"),
        (
            "min = [-1, -1, 0]",
            'closed = ["z-", "floor"]\nmin = [-1, -1, 0]',
            'line 14: [domain] closed must be a list of sides of the box, of "x-", "x+", "y-", "y+", "z-", "z+", '
            "not ['z-', 'floor']",
        ),
        ("min = [-1, -1, 0]", 'closed = "z-"', "line 13: [domain] lacks min"),
        (
            "min = [-1, -1, 0]",
            'closed = "z-"\nmin = [-1, -1, 0]',
            "line 14: [domain] closed must be a list of sides of the box",
        ),
        (
            "[medium]",
            "[[inlet]]\ncentre = [0, 0, 1]\nradius = 0\n[medium]",
            "line 23: [[inlet]] radius must be a number of metres above 0, not 0",
        ),
        ("[medium]", "[[inlet]]\ncentre = [0, 0, 1]\n[medium]", "line 21: [[inlet]] lacks radius"),
        (
            "[medium]",
            "[[inlet]]\ncentre = [0, 0]\nradius = 1\n[medium]",
            "line 22: [[inlet]] centre must be three numbers",
        ),
        (
            "[medium]",
            "[[inlet]]\ncentre = [0, 0, 1]\nradius = 1\n[[inlet]]\ncentre = [0, 0, -2]\nradius = 1\n[medium]",
            "line 25: [[inlet]] is outside the domain: nothing within 1 m of centre [0.0, 0.0, -2.0] is in the box",
        ),
        ("albedo = 0.5", "albedo = ", "scene.toml: is not valid TOML: "),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_with_its_line(tmp_path: Path, old: str, new: str, message: str | None) -> None:
    assert old in GOOD
    text = GOOD.replace(old, new, 1)
    if message is None:
        load(tmp_path, text)
        return
    with pytest.raises(SceneError) as caught:
        load(tmp_path, text)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_inline_tables_are_named_by_their_own_line(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"line 2: \[medium\] albedo"):
        load(tmp_path, "# one\nmedium = { albedo = 3 }\n")
    with pytest.raises(SceneError, match=r"line 1: \[medium\] albedo"):
        load(tmp_path, "medium.albedo = 3\n")
    with pytest.raises(SceneError, match=r"line 1: \[lights\] must be a list of tables"):
        load(tmp_path, "[lights]\n")
    with pytest.raises(SceneError, match=r"line 1: \[medium\] must be a table, not 3"):
        load(tmp_path, "medium = 3\n")


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"nothing\.toml: cannot be read"):
        Scene.load(tmp_path / "nothing.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SceneError, match="not a text file"):
        Scene.load(tmp_path / "binary.toml")


@pytest.mark.parametrize(
    "rows",
    [
        np.diag([2.0, 1.0, 1.0, 1.0]),
        np.diag([-1.0, 1.0, 1.0, 1.0]),
        np.eye(4) + np.eye(4)[::-1],
        np.eye(3),
        np.full((4, 4), np.nan),
    ],
)
def test_only_rigid_matrices_are_cameras(rows: np.ndarray) -> None:
    with pytest.raises(SceneError, match="matrix"):
        Camera("perspective", rows, (4, 4), 1.0, 1.0, 2.0, 2.0)  # type: ignore[arg-type]


def test_look_at_turns_the_camera_to_the_target() -> None:
    camera = Camera.look_at((0, -7, 1.5), (0, 0, 1.5), fov_y_degrees=30, size=(256, 384))
    np.testing.assert_allclose(camera.matrix, FRONT, atol=1e-12)
    oblique = np.array(Camera.look_at((1, 2, 3), (-4, 0, 1), fov_y_degrees=30, size=(4, 4)).matrix)
    forward = -oblique[:3, 2]
    np.testing.assert_allclose(forward, np.array([-5, -2, -2]) / math.sqrt(33))
    assert oblique[2, 0] == pytest.approx(0.0)  # the horizon is level
    assert oblique[2, 1] > 0.0


def test_resizing_and_cropping_keep_the_rays() -> None:
    camera = Camera("perspective", FRONT, (256, 384), 700.0, 710.0, 120.0, 200.0)

    def ray(camera: Camera, x: float, y: float) -> tuple[float, float]:
        return (x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy

    small = camera.resized(64, 192)
    assert small.size == (64, 192)
    assert ray(small, 10, 30) == pytest.approx(ray(camera, 40, 60))
    part = camera.cropped(20, 30, 100, 50)
    assert part.size == (100, 50)
    assert ray(part, 5, 6) == pytest.approx(ray(camera, 25, 36))
    assert small.position == camera.position == (0.0, -7.0, 1.5)


def test_domain_helpers() -> None:
    domain = Domain((-1, -1, 0), (1, 1, 3), (64, 64, 96))
    assert domain.centre == (0.0, 0.0, 1.5)
    assert domain.shape == (64, 64, 96)
    assert domain.voxel_size == 1 / 32


def test_a_camera_that_passes_the_domain_by_is_refused() -> None:
    domain = Domain((-1, -1, 0), (1, 1, 3), (2, 2, 3))
    size = (64, 64)
    for target in ((0, -20, 1.5), (20, -7, 1.5), (0, -7.1, 20)):
        camera = Camera.look_at((0, -7, 1.5), target, fov_y_degrees=30, size=size)
        with pytest.raises(SceneError, match="does not see the domain"):
            Scene(camera=camera, domain=domain)
    inside = Camera.look_at((0, 0, 1.5), (0, 5, 1.5), fov_y_degrees=30, size=size)
    assert Scene(camera=inside, domain=domain).camera == inside


def moving(*positions: tuple[float, float, float]) -> Camera:
    """A camera that looks along +Y from one position after the other."""
    poses = [look_at_matrix(p, (p[0], p[1] + 1, p[2]), (0, 0, 1)) for p in positions]
    return Camera("perspective", poses[0], (256, 384), 700.0, 700.0, 128.0, 192.0, tuple(poses))


def test_a_moving_camera_stands_still_in_every_frame() -> None:
    """Each frame has its own matrix; size and lens are shared, also by resized ones."""
    camera = moving((0, -7, 1.5), (1, -7, 1.5), (2, -7, 1.5))
    for frame in range(3):
        still = camera.at(frame)
        assert not still.moves
        assert still.position == (frame, -7.0, 1.5)
        assert still.at(9) == still
        assert camera.resized(64, 96).at(frame) == still.resized(64, 96)
    assert camera.matrix == camera.matrices[0]
    with pytest.raises(SceneError, match="frames 0 to 2, not for 3"):
        camera.at(3)
    with pytest.raises(SceneError, match="first of matrices"):
        replace(camera, matrix=camera.matrices[1])


def test_a_moving_camera_must_see_the_domain_once() -> None:
    """One frame with the box in its picture is enough."""
    domain = Domain((-1, -1, 0), (1, 1, 3), (20, 20, 30))
    camera = moving((50, -7, 1.5), (0, -7, 1.5))
    assert Scene(camera=camera, domain=domain).camera == camera
    with pytest.raises(SceneError, match="does not see the domain"):
        Scene(camera=moving((50, -7, 1.5), (40, -7, 1.5)), domain=domain)


numbers = st.floats(-1e6, 1e6, allow_subnormal=False)
positive = st.floats(1e-6, 1e6)
vectors = st.tuples(numbers, numbers, numbers)
colours = st.tuples(*[st.floats(0, 1e6, allow_subnormal=False)] * 3)
paths = st.text(st.characters(codec="utf-8", exclude_characters="/\\\0"), min_size=1, max_size=12).filter(
    lambda name: name not in (".", "..") and name == name.strip()
)
clips = st.builds(
    ClipSource,
    paths.map(lambda name: Path("/footage") / name),
    st.none() | positive,
    st.none() | st.tuples(st.integers(0, 9), st.integers(10, 99)),
    st.sampled_from([None, "srgb", "linear"]),
)


@st.composite
def cameras(draw: st.DrawFn) -> Camera:
    angles = draw(st.tuples(*[st.floats(-3, 3, allow_subnormal=False)] * 3))
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles), np.sin(angles)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    matrix = np.eye(4)
    matrix[:3, :3] = about_z @ about_y @ about_x
    matrix[:3, 3] = draw(vectors)
    moved = matrix.copy()
    moved[:3, 3] = draw(vectors)
    matrices = draw(st.sampled_from([(), (matrix,), (matrix, moved)]))
    kind = draw(st.sampled_from(["perspective", "orthographic"]))
    size = draw(st.tuples(st.integers(1, 9999), st.integers(1, 9999)))
    lens = draw(st.tuples(positive, positive, numbers, numbers))
    return Camera(kind, matrix, size, *lens, matrices)  # type: ignore[arg-type]


lights = st.one_of(
    st.builds(DirectionalLight, vectors.filter(lambda v: math.hypot(*v) > 1e-3), colours),
    st.builds(PointLight, vectors, colours),
    st.builds(EnvironmentLight, paths.map(lambda name: Path("/sky") / f"{name}.exr"), numbers, positive),
)


domains = st.builds(
    lambda low, edge, counts: Domain(low, tuple(a + edge * n for a, n in zip(low, counts, strict=True)), counts),
    st.tuples(*[st.floats(-100, 100, allow_subnormal=False)] * 3),
    st.floats(0.01, 10),
    st.tuples(*[st.integers(1, 500)] * 3),
)


backgrounds = st.none() | st.just(Background()) | st.builds(Background, color=colours)
walls = st.lists(st.sampled_from(SIDES), max_size=6).map(tuple)


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    if draw(st.booleans()):  # whatever cameras see and lights hit is refused or not elsewhere
        domain = draw(domains)
        inlets = draw(st.lists(st.builds(Inlet, st.just(domain.centre), positive), max_size=2))
        return Scene(domain=domain, clip=draw(clips), closed=draw(walls), inlets=inlets)
    return Scene(
        closed=draw(walls),
        inlets=draw(st.lists(st.builds(Inlet, vectors, positive), max_size=2)),
        clip=draw(st.none() | clips),
        camera=draw(st.none() | cameras()),
        medium=draw(
            st.none()
            | st.builds(
                Medium, positive, st.floats(0, 1, allow_subnormal=False), st.floats(-0.99, 0.99, allow_subnormal=False)
            )
        ),
        scattering=draw(st.sampled_from([None, *SCATTERINGS])),
        lights=tuple(draw(st.lists(lights, max_size=3))),
        background=draw(backgrounds),
        views=tuple(draw(st.lists(st.builds(View, cameras(), clips, backgrounds), max_size=2))),
    )


@settings(max_examples=60, deadline=None, derandomize=True)
@given(scenes())
def test_a_scene_comes_back_as_it_was_saved(tmp_path_factory: pytest.TempPathFactory, scene: Scene) -> None:
    path = tmp_path_factory.getbasetemp() / "round.toml"
    scene.save(path)
    assert Scene.load(path) == scene
    assert scene_from_dict(scene_to_dict(scene)) == scene


def test_paths_move_with_the_scene_file(tmp_path: Path) -> None:
    old, new = tmp_path / "old", tmp_path / "new"
    old.mkdir()
    Scene(
        clip=ClipSource(old / "clips" / "a.mp4"),
        background=Background(image=tmp_path / "plate.png"),
        domain=Domain((0, 0, 0), (1, 1, 1), (4, 4, 4)),
    ).save(old / "scene.toml")
    old.rename(new)
    scene = Scene.load(new / "scene.toml")
    assert scene.clip == ClipSource(new / "clips" / "a.mp4")
    assert scene.background == Background(image=tmp_path / "plate.png")


@pytest.mark.skipif(not DATA.is_dir(), reason="needs the development data")
def test_the_development_scenes_are_read(tmp_path: Path) -> None:
    files = sorted(DATA.rglob("*.toml"))
    assert files
    for file in files:
        scene = Scene.load(file)
        scene.save(tmp_path / "copy.toml")
        assert Scene.load(tmp_path / "copy.toml") == scene
