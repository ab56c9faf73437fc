"""Shots: what is given stays, what is missing is estimated with a note each, contradictions are refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from smokelift import Clip, Shot
from smokelift.checks import UNDETERMINED, Finding
from smokelift.density.upright_plane import AxisEstimate, SmokeAxis, view_frame
from smokelift.footage.image_files import read_image
from smokelift.output.images import write_image
from smokelift.scene import Background, Camera, ClipSource, Domain, Inlet, Scene, as_matrix, completed, look_at_matrix
from smokelift.scene.camera import project_points
from smokelift.setup.first_estimate import first_estimate
from smokelift.setup.geometry import MIN_SIDE_VOXELS, Geometry, find_geometry
from smokelift.setup.prepare import found_place, velocity_coarsening
from smokelift.setup.settings import LIMITS, Settings
from tests.engine.setup.shots import geometry_of, shot_of

SIZE = (40, 56)
"""Pixels of the plume's pictures."""


STEEP = Camera.look_at((0, 0, -3), (0, 1, 0), fov_y_degrees=40, size=SIZE)
WIDE = Camera.look_at((0, -3, 0), (0, 0, 2), fov_y_degrees=120, size=SIZE)


def bare(scene: Scene) -> Scene:
    """Nothing but the clip."""
    return Scene(clip=scene.clip)


def middle(scene: Scene | Geometry) -> float:
    """The distance of the middle of the box, straight ahead of the camera."""
    return float((np.array(scene.domain.centre) - scene.camera.position) @ view_frame(scene.camera)[1])


@pytest.fixture(scope="module")
def passing(plume, tmp_path_factory) -> Scene:
    """A clip in which a blob passes so far that every pixel is clear for a while."""
    heights = np.linspace(-0.3, 1.9, 14)
    densities = [plume.blob(plume.scene, height) for height in heights]
    return plume.write(tmp_path_factory.mktemp("passing"), densities)


@pytest.fixture(scope="module")
def estimated(passing, draft) -> Shot:
    """The shot of the clip alone."""
    return shot_of(bare(passing), draft)


@pytest.fixture(scope="module")
def given(plume, draft) -> Shot:
    """The shot of a complete scene."""
    return shot_of(plume.scene, draft)


def test_a_complete_scene_stays_as_it_is_and_its_settings_prepare_it_again(given, plume) -> None:
    assert [found.kind for found in given.findings if found.value is None] == []
    assert given.scene == completed(plume.scene)
    assert given.optics.scattering == "single"
    assert len(given.views) == 1 and not given.moves
    assert shot_of(plume.scene, given.settings).settings == given.settings


def test_all_that_a_clip_lacks_is_noted(estimated, passing, draft) -> None:
    assert [remark.kind for remark in estimated.findings if remark.value is None] == [
        "black background", "assumed camera", "box around the smoke", "assumed medium", "assumed light",
    ]  # fmt: skip
    assert [each.value for each in estimated.findings if each.about == "source radiance"] == [UNDETERMINED]
    with Clip.open(passing.clip) as clip:
        clip.lens = 26.0  # which its file gives
        found = find_geometry(bare(passing), first_estimate(clip, None, None), draft)
    assert found.camera.fx == pytest.approx(26 * np.hypot(*SIZE) / np.hypot(36, 24))
    assert [remark.figures["lens"] for remark in found.findings if "lens" in remark.figures] == [26]


def test_the_domain_holds_the_smoke(estimated, passing, draft) -> None:
    """Every clearly smoky pixel lies in the domain's picture; voxels are cubes, no more than the quality says."""
    camera, domain = estimated.scene.camera, estimated.scene.domain
    edges = np.array(domain.size) / domain.resolution
    np.testing.assert_allclose(edges, edges[0], rtol=1e-6)
    assert MIN_SIDE_VOXELS <= max(domain.resolution) <= LIMITS[draft.quality].most + 4
    pixels, depth = project_points(camera, domain.corners())
    assert (depth > 0).all()
    with Clip.open(passing.clip) as clip:
        rows, columns = np.nonzero(np.max([frame.max(-1) for frame in clip], axis=0) > 0.1)
    assert (np.maximum(pixels.min(0), 0) <= (columns.min() + 1, rows.min() + 1)).all()
    assert (np.minimum(pixels.max(0), camera.size) >= (columns.max(), rows.max())).all()


@pytest.mark.parametrize("tilt", [17, -25])
def test_a_box_is_found_for_a_camera_that_is_given(plume, draft, tilt) -> None:
    """It stands upright before the camera, around what the picture shows, wherever the camera looks."""
    turn = Rotation.from_euler("xz", [90 + tilt, 30], degrees=True).as_matrix()
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, (3, 4, 5)
    given = replace(plume.scene.camera, matrix=as_matrix(matrix), cx=0.6 * plume.scene.camera.cx)
    found, level = (geometry_of(replace(plume.scene, camera=camera, domain=None), draft) for camera in (given, None))
    assert found.camera == given.resized(*SIZE)
    assert Finding("assumed scale", {"height": 2.0}, source="assumed") in found.findings
    ends, right = (
        project_points(each.camera, np.array([(*each.domain.centre[:2], each.domain.min[2]), each.domain.centre]))
        for each in (found, level)
    )
    # the smoke's lower end and its middle show where they do before a level camera
    np.testing.assert_allclose(ends[0], right[0], atol=0.06 * max(SIZE))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"camera": STEEP, "domain": None}, "camera but no box"),
        ({"camera": WIDE, "domain": None}, "camera but no box"),
        ({"camera": None}, "a box but no camera"),
        ({"camera": None, "domain": None, "inlets": (Inlet((0, 0, 0), 0.1),)}, "inlet"),
        ({"camera": Camera.look_at((0, -4, 0.8), (0, 0, 0.8), fov_y_degrees=30, size=(64, 48))}, "64 x 48, the clip's"),
        ({"domain": Domain((-0.6, -12, 0), (0.6, -10.8, 1.6), (24, 24, 32))}, "see the domain"),
    ],
)
def test_what_contradicts_itself_is_refused(plume, draft, changes, said) -> None:
    with pytest.raises(ValueError, match=said):
        shot_of(replace(plume.scene, **changes), draft)


def test_each_frame_has_its_own_small_picture_unless_it_shows_nothing_of_the_domain(tracked, draft) -> None:
    away = look_at_matrix((0, -4, 0.8), (0, -9, 0.8), (0, 0, 1))
    poses = (away, *tracked.camera.matrices[1:])
    scene = replace(tracked, camera=replace(tracked.camera, matrix=away, matrices=poses))
    shot = shot_of(scene, draft)
    assert shot.scene == completed(scene) and shot.moves
    assert shot.views[0].working.camera.matrix == poses[1]
    assert shot.observe(0) == ()
    for frame in range(1, 5):
        (seen,) = shot.observe(frame)
        assert seen.camera.matrix == poses[frame]
        assert seen.plate.image.shape[:2] == seen.image.shape[:2] == seen.camera.size[::-1]


def test_one_color_behind_a_moving_camera_is_found(tracked, draft) -> None:
    shot = shot_of(replace(tracked, background=None), draft)
    assert shot.scene.background.color == pytest.approx((0, 0, 0), abs=1e-3)
    assert shot.found_background is None
    with pytest.raises(ValueError, match=r"matrices .* 5 frames"):
        shot_of(tracked.with_frames(1, 4), draft)


@pytest.mark.parametrize("color", [None, (0.0, 0.0, 0.0)])
def test_the_clip_is_behind_the_smoke_where_a_mask_hides_it(plume, draft, tmp_path, color) -> None:
    """A wall beside smoke before black, whether that is given or found."""
    scene, wall = plume.write(tmp_path, plume.densities), (0.2, 0.3, 0.25)
    for file in tmp_path.glob("frame_*.png"):
        picture = read_image(file)
        picture[:, :6] = wall
        write_image(file, picture)
    mask = np.ones((56, 40, 3))
    mask[:, :7] = 0
    write_image(tmp_path / "mask.png", mask)
    background = None if color is None else Background(color=color)
    shot = shot_of(replace(scene, clip=replace(scene.clip, mask=tmp_path / "mask.png"), background=background), draft)
    assert shot.found_background[:, :6] == pytest.approx(np.broadcast_to(wall, (56, 6, 3)), abs=0.01)
    assert shot.found_background[:, 8:].max() < 0.01


def test_a_color_behind_a_moving_camera_stays_one_with_a_mask(tracked, draft, tmp_path) -> None:
    visible = np.zeros((56, 40, 3), np.float32)
    visible[4:-4, 4:-4] = 1
    write_image(tmp_path / "mask.png", visible)
    clip = replace(tracked.clip, mask=tmp_path / "mask.png")
    assert shot_of(replace(tracked, clip=clip, background=Background()), draft).found_background is None


def test_a_background_that_moves_must_be_given(tracked, draft, tmp_path) -> None:
    for n in range(5):
        stripes = np.broadcast_to((0.2 + 0.1 * np.sin(np.arange(40) + n))[:, None], (56, 40, 3))
        write_image(tmp_path / f"wall_{n}.png", stripes)
    write_image(tmp_path / "plate.png", stripes)
    clip = ClipSource(tmp_path / "wall_#.png", fps=24)
    for background, said in (
        (None, "clean plate"),
        (Background(frame=0), "clean plate"),
        (Background(image=tmp_path / "plate.png"), "1 of the frames 0 to 4"),
    ):
        with pytest.raises(ValueError, match=said):
            shot_of(replace(tracked, clip=clip, background=background), draft)


@pytest.mark.parametrize("complete", [True, False])
def test_a_clip_without_smoke_gives_a_shot(plume, draft, tmp_path, complete) -> None:
    scene = plume.write(tmp_path / "clip", [np.zeros_like(plume.densities[0])] * 3)
    shot = shot_of(replace(scene, lights=(), medium=None) if complete else bare(scene), draft)
    assert np.isfinite(shot.scene.lights[0].irradiance).all()
    assert shot.views[0].light_assumed and not shot_of(scene, draft).views[0].light_assumed


def test_the_velocity_grid_is_as_coarse_as_the_depth_is_unknown(plume, draft) -> None:
    """However fine the densities are; by hand it is what was said, and thin boxes keep eight voxels per side."""
    shapes = [(20, 20, 30), (32, 32, 48), (64, 64, 96), (128, 128, 192), (256, 256, 288), (31, 20, 150)]
    choices = [velocity_coarsening(Domain((0.0, 0.0, 0.0), shape, shape), draft) for shape in shapes]
    assert [coarsening for coarsening, _ in choices] == [choice.value for _, choice in choices] == [0, 1, 2, 3, 4, 1]
    assert [choice.figures["voxels"] for _, choice in choices] == [30, 24, 24, 24, 18, 75]
    by_hand = replace(draft, velocity=replace(draft.velocity, coarsening=0))
    coarsening, choice = velocity_coarsening(plume.scene.domain, by_hand)
    assert (coarsening, choice.value, choice.source) == (0, 0, "given")


@pytest.mark.parametrize(
    ("cue", "source"),
    [("box", "assumed"), ("floor contact", "measured"), ("inlets", "measured"), ("distance", "given")],
)
def test_the_cue_and_the_uncertainty_are_kept(cue, source) -> None:
    found = found_place(AxisEstimate(SmokeAxis.upright(-0.25), cue, -0.25, 0.123))
    assert (found.kind, found.figures, found.spread) == (f"axis depth by {cue}", {"depth": -0.25}, 0.123)
    assert (found.value == UNDETERMINED, found.source) == (cue == "box", source)


def test_a_shot_knows_where_its_smoke_stands(given, plume, draft) -> None:
    assert given.place is not None and given.findings[-1] == found_place(given.place)
    inlet = replace(plume.scene, inlets=(Inlet(plume.scene.domain.centre, 0.2),))
    marked = shot_of(inlet, draft)
    assert marked.place is not None and marked.place.cue == "inlets"
    measured = replace(draft, distance=middle(plume.scene) + 0.1)
    known = shot_of(plume.scene, measured)
    assert known.place is not None and known.place.cue == "distance"
    assert known.place.depth == pytest.approx(0.1, abs=0.05)
    assert known.findings[-1].source == "given"
    blank = shot_of(plume.scene, Settings.preset(draft.quality, method="paper"))
    assert blank.place is None
    assert "axis depth" not in [choice.about for choice in blank.findings]
    with pytest.raises(ValueError, match="distance"):
        shot_of(inlet, measured)


def test_a_distance_sets_the_scale_where_no_box_is_given(plume, draft) -> None:
    """Of a camera that is not given, and of a box that is not; the smoke stands in the middle of that."""
    for camera in (None, plume.scene.camera):
        scene = replace(plume.scene, camera=camera, domain=None)
        near, far = (geometry_of(scene, replace(draft, distance=distance)) for distance in (3.0, 6.0))
        assert (middle(near), middle(far)) == (pytest.approx(3, rel=1e-3), pytest.approx(6, rel=1e-3))
        np.testing.assert_allclose(far.domain.size, 2 * np.array(near.domain.size), rtol=0.05)
        place = shot_of(scene, replace(draft, distance=3.0)).place
        assert place is not None and place.depth == pytest.approx(0, abs=0.06)


def test_a_camera_that_only_turns_tells_the_place_as_one_that_stands(given, plume, draft) -> None:
    poses = np.repeat(np.array(plume.scene.camera.matrix)[None], len(plume.densities), axis=0)

    def with_poses() -> Scene:
        return replace(plume.scene, camera=replace(plume.scene.camera, matrices=tuple(map(as_matrix, poses))))

    still, turning = given.place, shot_of(with_poses(), draft).place
    assert turning.cue == still.cue
    assert turning.depth == pytest.approx(still.depth, abs=0.1 * still.deviation)
    poses[:, 0, 3] += np.linspace(0, 0.1, len(poses))  # it travels along X
    assert shot_of(with_poses(), draft).place is None
    known = shot_of(with_poses(), replace(draft, distance=middle(plume.scene) + 0.1)).place
    assert known is not None and known.depth == pytest.approx(0.1)
