"""What a clip shows: its background and what is noticed of it, its smoke, and fire apart from smoke."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from smokelift import Background, Clip, DirectionalLight, Medium, Scene, extract, prepare_shot
from smokelift.checks import Finding
from smokelift.extraction.find_background import FoundBackground, find_background
from smokelift.extraction.given_background import Strokes
from smokelift.extraction.matte import matte
from smokelift.footage.images import blurred
from smokelift.output.images import write_image
from smokelift.setup.first_estimate import (
    SmokeSamples,
    background_findings,
    doubts,
    first_estimate,
    first_findings,
    sample_smoke,
)
from tests.engine.films import clear_plate, clip_of, coded, film, puff, wall
from tests.engine.setup.shots import burning


@pytest.fixture
def one_source(monkeypatch) -> None:
    """The turns of a hidden plate begin with one source radiance, which is not found again from their end."""
    monkeypatch.setattr("smokelift.extraction.hidden_plate.SOURCES", 0)


def test_fire_is_said_and_does_not_light_the_smoke(plume, draft, tmp_path) -> None:
    dim = replace(plume.scene, lights=(DirectionalLight((0.3, 0.5, -0.8), (0.6, 0.6, 0.6)),))
    scene = replace(plume.write(tmp_path, plume.densities, dim), lights=())
    with Clip.open(scene.clip) as clip:
        without, with_fire = (prepare_shot(each, scene, draft) for each in (clip, clip.changed(burning)))
        given = replace(scene, medium=replace(scene.medium, flame_color=(1.0, 0.5, 0.2)))
        assert prepare_shot(clip.changed(burning), given, draft).scene.medium.flame_color == (1.0, 0.5, 0.2)
    assert not any(choice.about == "fire" for choice in without.findings)
    (found,) = [choice for choice in with_fire.findings if choice.about == "fire"]
    assert found.kind == "fire"
    assert found.figures["fraction"] > 0 and found.figures["green"] == pytest.approx(0.4, abs=0.05)
    assert without.fire is None and without.scene.medium.flame_color is None
    assert with_fire.observe_fire(2).image.max() > 0.5 and without.observe_fire(2) is None
    red, green, blue = with_fire.scene.medium.flame_color
    assert (red, green) == (1, pytest.approx(0.4, abs=0.05)) and blue < 0.2
    assert with_fire.optics.unshadowed_source().max() < 3 * without.optics.unshadowed_source().max()


def glowing(number: int, picture: np.ndarray) -> np.ndarray:
    """A picture with a dim flame, one pixel of which is as bright as white."""
    rows, columns = np.indices(picture.shape[:2])
    row, column = np.unravel_index(np.argmax(picture.sum(-1)), rows.shape)
    away = np.hypot(rows - row, columns - column)[..., None]
    flame = np.float32((0.75, 0.3, 0.06))
    return np.where(away < 4, np.where(away == 0, 1.25 * flame, flame), picture)


def test_what_may_be_fire_is_said_and_is_fire_where_its_color_is_given(plume, draft, tmp_path) -> None:
    scene = replace(plume.write(tmp_path, plume.densities, plume.scene), medium=None)
    given = replace(scene, medium=Medium(flame_color=(1.0, 0.4, 0.1)))
    with Clip.open(scene.clip) as clip:
        alone, certain, none = (
            prepare_shot(each, how, draft)
            for each, how in ((clip.changed(glowing), scene), (clip.changed(glowing), given), (clip, given))
        )
    assert alone.fire is None and "possible fire" in [remark.kind for remark in alone.findings]
    assert certain.fire is not None and "possible fire" not in [remark.kind for remark in certain.findings]
    assert certain.observe_fire(2).image.max() > 0.5
    assert certain.scene.medium.flame_color == (1.0, 0.4, 0.1)
    assert certain.scene.medium.extinction == alone.scene.medium.extinction, "the rest of the medium is not given"
    assert none.fire is None and "possible fire" not in [remark.kind for remark in none.findings]


@pytest.mark.parametrize("masked", [False, True])
def test_what_a_mask_hides_says_nothing_of_how_much_passes(plume, tmp_path, masked) -> None:
    """Stripes beside smoke before one color: without a mask the plate is a picture, with it as good as one color."""
    scene = plume.write(tmp_path, plume.densities)
    plate = np.zeros((56, 40, 3), np.float32)
    plate[:, :8], plate[::4, :8] = 0.4, 0.1
    write_image(tmp_path / "plate.png", plate)
    mask = np.ones((56, 40, 3))
    mask[:, :8] = 0
    write_image(tmp_path / "mask.png", mask)
    with Clip.open(scene.clip.path, fps=24, mask=tmp_path / "mask.png" if masked else None) as clip:
        clip = clip if masked else clip.changed(lambda _, picture: np.maximum(picture, plate))
        found = first_estimate(clip, None, Background(image=tmp_path / "plate.png"))
    assert (found.source is None) == masked


BLUE = (0.15, 0.3, 0.6)


@pytest.mark.parametrize(
    ("color", "smoke", "by_hue", "extracted"),
    [
        (BLUE, 0.5, False, False),
        (BLUE, 0.5, True, True),
        ((0.02, 0.3, 0.04), 0.01, True, False),
        ((0.3, 0.3, 0.3), 0.5, True, False),
        (0.0, 0.5, True, False),
    ],
    ids=["blue, light given", "blue", "dark smoke", "gray", "black"],
)
def test_one_color_shows_by_its_hue_how_much_passes(tmp_path, color, smoke, by_hue, extracted) -> None:
    """Where the light is assumed the hue is asked, which tells smoke in shadow from thin smoke."""
    plate = np.broadcast_to(color, (72, 56, 3))
    with film(tmp_path, plate, puff, smoke) as clip:
        found = first_estimate(clip, None, Background(color=tuple(map(float, plate[0, 0]))), by_hue=by_hue)
    assert (found.source is not None) == extracted


def smoke_over_a_cup(number: int, picture: np.ndarray) -> np.ndarray:
    """A frame of smoke that never leaves a red cup before a wall."""
    rows, columns = np.indices((56, 40))
    wall = 0.15 + 0.08 * np.random.default_rng(1).standard_normal((14, 10, 1)).clip(-1.5, 1.5) * (1, 0.9, 0.8)
    behind = np.kron(wall, np.ones((4, 4, 1)))
    behind[(np.abs(rows - 30) < 5) & (np.abs(columns - 20) < 4) | (rows < 8) & (columns < 8)] = 1.2, 0.45, 0.1
    along = rows - 30 - 12 * np.sin(2.4 * number)
    depth = 1.2 * np.exp(-((columns - 20) ** 2 + along**2) / 90) + 0.2 * (np.hypot(columns - 20, rows - 30) < 12)
    clear = np.exp(-depth)[..., None]
    return (clear * behind + (1 - clear) * 0.35).astype("f4")


def test_a_red_cup_that_shines_through_smoke_is_no_fire(plume, one_source) -> None:
    """No frame shows it clear, so the plate that is continued from around it has no cup there, but another one."""
    with Clip.open(plume.scene.clip) as clip:
        found = first_estimate(clip.changed(smoke_over_a_cup), None, None)
    assert found.hot.burn, "before the plate as it was found"
    assert found.fire is None


def test_what_a_mask_hides_shows_the_plate_as_it_is_in_the_end(plume, tmp_path, one_source) -> None:
    """Turns change the plate there, too; the clip with the plate before them would show smoke."""
    seen = np.ones((56, 40, 3))
    seen[:, 26:] = 0
    write_image(tmp_path / "mask.png", seen)
    with Clip.open(plume.scene.clip.path, fps=24, mask=tmp_path / "mask.png") as clip:
        found = first_estimate(clip.changed(smoke_over_a_cup), None, None)
        assert np.abs(found.plate.image - found.found.plate.image)[:, 26:].max() > 0.01
        extracted = extract(clip.changed(smoke_over_a_cup), Scene())
        for hidden, plate in ((found.clip, found.plate.image), (extracted.clip, extracted.plate)):
            np.testing.assert_allclose(hidden.frame(3)[:, 26:], plate[:, 26:], atol=1e-6)


COVERED = np.zeros((100, 50), np.bool_)
COVERED[10:80] = True
SEEN = SmokeSamples(1.0, COVERED, np.zeros_like(COVERED), *np.zeros((2, 0, 3), np.float32), (0,))
"""Frames that show smoke, in the middle of the picture."""

RANDOM = np.random.default_rng(0)
TILES = np.kron(RANDOM.uniform(0.05, 0.3, (9, 7)), np.ones((8, 8)))
ACROSS = np.abs(np.arange(56) - 28)
"""Pixels from the middle column."""
ROWS = np.arange(72)[:, None]


def before_tiles(smoke: np.ndarray, tiles: np.ndarray = TILES) -> np.ndarray:
    """A picture of smoke before a wall of tiles."""
    return tiles * (1 - smoke) + 0.6 * smoke


def kinds(found: FoundBackground, samples: SmokeSamples = SEEN, given: bool = False) -> list[str]:
    """What is doubted of a background and frames before it."""
    return [doubt.kind for doubt in doubts(found, samples, given)]


@pytest.fixture
def gray(tmp_path):
    """A clip of four frames of a gray wall, and its background."""
    with clip_of(tmp_path, [np.full((24, 32, 3), 0.2, np.float32)] * 4) as clip:
        yield FoundBackground("picture", clip, clear_plate(clip.frame(0)), frames=4)


def puff_at(row: int) -> np.ndarray:
    """Opacity of a round puff."""
    rows, columns = np.mgrid[:72, :56]
    return 0.6 * np.clip(1.5 - np.hypot(rows - row, columns - 28) / 9, 0, 1)


def before(floor: float, folder) -> Clip:
    """A clip of a puff that rises before black, above a floor of a brightness."""
    return clip_of(folder, (np.where(np.arange(72)[:, None] < 66, puff_at(60 - 4 * n), floor) for n in range(12)))


@pytest.mark.parametrize(("unknown_rows", "said"), [(0, False), (20, False), (60, True)])
def test_smoke_that_may_be_in_the_plate_is_said(gray, unknown_rows, said) -> None:
    unknown = np.zeros_like(COVERED)
    unknown[:unknown_rows] = True
    found = doubts(gray, replace(SEEN, unknown=unknown), given=False)
    assert found == [Finding("smoke in the background", {"fraction": 0.75}, doubt=True)] * said


def flickering(n: int) -> np.ndarray:
    """The opacity of smoke that flickers in its place."""
    return np.where(ACROSS < 6, np.random.default_rng(n).uniform(0.4, 0.9), 0) * np.ones((72, 1))


def test_the_frame_that_shows_most_of_a_background_is_said(tmp_path, one_source) -> None:
    """Smoke that flickers in its place, with a puff that rises beside it, and none of them in one frame."""
    smoke = (np.maximum(np.roll(flickering(n), 12, axis=1), np.roll(puff(2 * n + 1), -16, axis=1)) for n in range(12))
    whole = clip_of(tmp_path, (before_tiles(each * (n != 5)) for n, each in enumerate(smoke)))
    found = first_findings(first_estimate(whole.part(2, 11), None, None), given=False)
    assert [each.figures["frame"] for each in found if each.kind == "clearest frame"] == [5]
    late = find_background(whole.part(6, 11), None, None)
    assert sample_smoke(late.clip, late.plate).clearest is None


def test_strokes_are_said_and_what_is_green_is_not_in_the_plate(gray) -> None:
    unknown = np.zeros_like(COVERED)
    unknown[:60] = True
    smoke, nothing = np.zeros((2, 24, 32), np.bool_)
    smoke[:12] = True
    found = replace(gray, strokes=Strokes(smoke, nothing, ~smoke))
    assert background_findings(found)[-1] == Finding("strokes", {"smoke": 0.5, "other": 0.0, "behind": 0.5})
    assert doubts(found, replace(SEEN, unknown=unknown), given=False) == []


def test_strokes_that_contradict_the_clip_are_named(tmp_path) -> None:
    """Nothing but green over a clip of smoke that passes a little of it, and red over all of it."""
    clip = clip_of(tmp_path, (before_tiles(0.5 * (np.hypot(ACROSS - 9 + n, ROWS - 30) < 4)) for n in range(12)))
    for color, wanted in ((1, "background never seen beside strokes"), (0, "no smoke beside strokes")):
        painted = np.zeros((72, 56, 3), np.float32)
        painted[..., color] = 1
        write_image(tmp_path / "strokes.png", painted)
        said = first_findings(first_estimate(clip, None, Background(strokes=tmp_path / "strokes.png")), given=False)
        assert wanted in [each.kind for each in said]


def column(n: int) -> np.ndarray:
    """Smoke that never leaves its place, and a puff that rises."""
    return np.maximum(puff_at(60 - 4 * n), 0.8 * (ACROSS < 10))


def fog(n: int) -> np.ndarray:
    """Smoke that fills the picture all the time."""
    return 0.5 + 0.2 * np.sin(n + ROWS / 9) * np.ones(56)


@pytest.mark.parametrize(
    ("smoke", "frames", "given", "said"),
    [
        (column, 12, TILES, False),
        (fog, 12, TILES, False),
        (column, 12, 0.9 - TILES, True),
        (column, 12, (0.7, 0.4, 0.1), True),
        (column, 1, 0.9 - TILES, False),
    ],
    ids=["right", "right behind fog", "another wall", "color of no wall", "one frame"],
)
def test_a_given_background_that_the_clip_never_shows_is_said(tmp_path, smoke, frames, given, said) -> None:
    clip = clip_of(tmp_path, (before_tiles(smoke(n)) for n in range(frames)))
    if isinstance(given, tuple):
        background = Background(color=given)
    else:
        write_image(tmp_path / "plate.exr", np.repeat(given[..., None], 3, 2))
        background = Background(image=tmp_path / "plate.exr")
    found = find_background(clip, None, background)
    assert kinds(found, sample_smoke(found.clip, found.plate), given=True) == ["given background never seen"] * said


@pytest.mark.parametrize("color", [0.6, (0.6, 0.3, 0.1)], ids=["gray", "orange"])
@pytest.mark.parametrize("plate", [wall(0.2, 0.5), np.full((72, 56, 3), (0.2, 0.3, 0.5))], ids=["wall", "sky"])
def test_a_given_frame_that_holds_smoke_is_said(tmp_path, plate, color) -> None:
    """What the smoke has left since changes the other way than what it has reached."""
    with film(tmp_path, plate, lambda n: puff(n) * (n > 0), color) as clip:
        for frame, said in ((0, False), (12, True)):
            found = find_background(clip, None, Background(frame=(frame,)))
            doubted = kinds(found, sample_smoke(found.clip, found.plate), given=True)
            assert doubted == ["smoke in the given frame"] * said


def test_smoke_before_a_wall_that_no_frame_shows_is_undetermined(tmp_path) -> None:
    clip = clip_of(tmp_path, (before_tiles(flickering(n)) for n in range(12)))
    (found,) = background_findings(find_background(clip, None, None))
    assert found.kind == "background partly seen"


@pytest.mark.parametrize(("quantizer", "said"), [(36, False), (46, True)])
def test_a_clip_that_is_strongly_compressed_is_said(tmp_path, quantizer, said) -> None:
    """Where the codec's smoke that stands still may be in the background, which is not so before black."""
    for plate, doubted in ((wall(0.2, 0.5), said), (np.zeros((72, 56, 3)), False)):
        path = coded(tmp_path / f"{doubted}.mp4", plate, 0.8, qp=str(quantizer))
        with Clip.open(path) as clip:
            assert kinds(find_background(clip, None, None)) == ["strong compression"] * doubted
            assert not kinds(find_background(clip, None, Background(color=(0.1, 0.1, 0.1))))


def test_what_never_changes_before_one_color_is_said(tmp_path) -> None:
    remarks = background_findings(find_background(before(0.3, tmp_path), None, None))
    assert [remark.kind for remark in remarks] == ["black background", "background with objects"]


def test_a_cut_is_said_with_the_frames_of_each_side(tmp_path) -> None:
    shown = (before_tiles(puff_at(60 - 4 * n), TILES if n < 7 else 0.5 - TILES) for n in range(14))
    whole = clip_of(tmp_path, shown)
    (doubt,) = doubts(find_background(whole.part(2, 12), None, None), SEEN, given=False)
    assert doubt == Finding("cut", {"before": 6, "after": 7, "first": 2, "last": 12}, doubt=True)
    assert kinds(find_background(whole.part(7, 13), None, None)) == []


@pytest.mark.parametrize("color", [0.0, 0.2], ids=["black", "gray"])
def test_one_frame_before_one_color_shows_its_background(tmp_path, color) -> None:
    smoke = puff_at(50)[..., None]
    with clip_of(tmp_path, [np.full((72, 56, 3), color) * (1 - smoke) + 0.6 * smoke]) as clip:
        found = find_background(clip, None, None)
        given = find_background(clip, None, Background(color=(color,) * 3))
        masks = [matte(clip.frame(0), each.plate.at(0)).mask for each in (found, given)]
    assert masks[0][smoke[..., 0] > 0.1].all() and (masks[0] != masks[1]).mean() < 0.01
    assert kinds(found) == ["background of one frame"]
    assert background_findings(found)[0].kind == ("background of one color" if color else "black background")


@pytest.mark.parametrize(("count", "doubted"), [(1, False), (2, True), (4, False)])
def test_a_background_that_few_frames_show_is_doubted(tmp_path, count, doubted) -> None:
    with clip_of(tmp_path, (before_tiles(puff_at(60 - 8 * n)) for n in range(count))) as clip:
        assert ("background of few frames" in kinds(find_background(clip, None, None))) == doubted


@pytest.mark.parametrize(
    ("rows", "missing", "at_a_time", "said"),
    [
        ((6, 44), 0.0, 1.0, ["bars"]),
        ((6, 44), 0.2, 0.8, []),
        ((20, 50), 0.0, 1.0, []),
        ((0, 44), 0.0, 1.0, []),
        ((6, 44), 0.0, 0.3, []),
        ((0, 50), 0.0, 0.9, ["smoke everywhere"]),
        ((0, 50), 0.0, 0.3, []),
        ((0, 50), 0.1, 0.9, []),
    ],
    ids=["bars", "ragged", "bank", "from above", "a puff that passes", "all over", "passing all", "with holes"],
)
@pytest.mark.parametrize("turned", [False, True])
def test_a_picture_that_is_taken_for_smoke_is_said(gray, rows, missing, at_a_time, said, turned) -> None:
    covered = np.zeros((50, 80), np.bool_)
    covered[slice(*rows)] = np.random.default_rng(0).random((rows[1] - rows[0], 80)) >= missing
    covered = covered.T if turned else covered
    seen = np.zeros((round(2 * at_a_time * covered.sum()), 3), np.float32)  # in two samples
    frames = dict.fromkeys(range(2), 0)
    nowhere = np.zeros_like(covered)
    samples = replace(SEEN, covered=covered, unknown=nowhere, colors=seen, behind=seen, over_known=frames)
    assert kinds(replace(gray, kind="color"), samples) == said


@pytest.mark.parametrize("bars", [True, False], ids=["bars", "bars cropped off"])
def test_black_that_no_part_of_the_picture_shows_is_assumed_and_not_found(tmp_path, bars) -> None:
    """Fog that drifts over all of a picture, which is between black bars or was cropped to what they enclose."""
    shown = slice(16, -16) if bars else slice(None)
    random = np.random.default_rng(0)
    wide = 0.3 + 0.1 * blurred(random.normal(0, 1, (72, 400)).astype(np.float32), 4) / 0.07
    pictures = np.zeros((24, 72, 56))
    for n, picture in enumerate(pictures):
        picture[shown] = np.clip(wide[:, 12 * n :][:, :56], 0.02, 0.95)[shown]
    with clip_of(tmp_path, pictures) as clip:
        said = [remark.kind for remark in first_findings(first_estimate(clip, None, None), given=False)]
    assert said == ["background assumed", "bars" if bars else "background never seen"]


@pytest.mark.parametrize("plate", [np.zeros((72, 56, 3)), wall(0.2, 0.5)], ids=["black", "wall"])
@pytest.mark.parametrize(("inverted", "smoke"), [(False, True), (True, True), (True, False)])
def test_a_mask_that_hides_all_smoke_is_said(tmp_path, plate, inverted, smoke) -> None:
    """A mask over smoke on the left half, one over the other half, and this one where there is no smoke at all."""
    left = np.arange(56) < 28

    clip = film(tmp_path, plate, lambda n: np.roll(puff(n), -14, axis=1) * left * smoke, 0.6)
    write_image(tmp_path / "mask.png", np.broadcast_to((left != inverted)[None, :, None], (72, 56, 3)).astype(float))
    with Clip.open(clip.path, fps=24, mask=tmp_path / "mask.png") as masked:
        said = [remark.kind for remark in first_findings(first_estimate(masked, None, None), given=False)]
    wanted = "smoke behind the mask" if smoke else "no smoke before an estimated background"
    assert said[1:] == (["no smoke examined", wanted] if inverted else [])


def test_how_many_frames_were_examined_is_said(gray) -> None:
    assert doubts(gray, sample_smoke(gray.clip, gray.plate), given=False) == [
        Finding("no smoke examined", {"frames": 4}, doubt=True),
        Finding("no smoke before an estimated background", doubt=True),
    ]


@pytest.mark.parametrize("parallax", [0.0, 2.0])
def test_a_clip_from_the_hand_is_registered_and_one_of_a_camera_that_travels_is_refused(tmp_path, parallax) -> None:
    """A puff before a textured wall and a camera that shakes; with parallax the wall slides by more below."""
    random = np.random.default_rng(0)
    texture = blurred(random.standard_normal((140, 180)).astype(np.float32), 1.5)
    rows, columns = np.mgrid[:140, :180]
    pictures = []
    for n, (down, right) in enumerate(random.integers(-4, 5, (8, 2)) + 8):
        at = [rows, columns + parallax * (n - 4) * (rows / 70 - 1)]
        slid = ndimage.map_coordinates(0.3 + 0.1 * texture / texture.std(), at, mode="mirror")
        smoke = 0.8 * np.exp(-((rows - 95 + 6 * n) ** 2 + (columns - 90) ** 2) / 200)
        seen = (slid * (1 - smoke) + 0.9 * smoke)[down : down + 120, right : right + 160]
        pictures.append(np.clip(seen, 0, 1)[..., None].repeat(3, -1))
    clip = clip_of(tmp_path, pictures)
    if parallax:
        with pytest.raises(ValueError, match="Stabilize the clip"):
            find_background(clip, None, None)
    else:
        (said,) = [found for found in background_findings(find_background(clip, None, None)) if "regis" in found.kind]
        assert said.kind == "frames registered"
        assert 3 < said.figures["pixels"] < 12
        assert 0 <= said.figures["frame"] < 8
