"""What a clip shows: fire apart from smoke, and whether what is behind the smoke shows how much of it passes."""

from dataclasses import replace

import numpy as np
import pytest

from smokelift import Background, Clip, DirectionalLight, Medium, Scene, extract, prepare_shot
from smokelift.output.images import write_image
from smokelift.setup.first_estimate import first_estimate
from tests.engine.setup.shots import burning


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


def test_a_red_cup_that_shines_through_smoke_is_no_fire(plume) -> None:
    """No frame shows it clear, so the plate that is continued from around it has no cup there, but another one."""
    with Clip.open(plume.scene.clip) as clip:
        found = first_estimate(clip.changed(smoke_over_a_cup), None, None)
    assert found.hot.burn, "before the plate as it was found"
    assert found.fire is None


def test_what_a_mask_hides_shows_the_plate_as_it_is_in_the_end(plume, tmp_path) -> None:
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
