"""What extract returns: before what shows the smoke's transmittance and what does not, and what it says of the clip."""

from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from smokelift import Background, Clip, Extraction, Scene, extract
from tests.engine.films import COUNT, clip_of, film, puff, wall

BLACK, GRAY, GREEN = np.zeros((72, 56, 3)), np.full((72, 56, 3), 0.2), np.full((72, 56, 3), (0.05, 0.4, 0.08))


def kinds(extraction: Extraction) -> list[str]:
    """What is said of a clip."""
    return [finding.kind for finding in extraction.findings]


def shot(folder: Path, plate: np.ndarray) -> Clip:
    """A clip of gray smoke, in the middle of the picture, before a plate."""
    return film(folder, plate, puff, 0.5).part(6, COUNT - 8)


@pytest.mark.parametrize("plate", [BLACK, GRAY], ids=["black", "gray"])
def test_what_does_not_show_how_much_passes_gets_a_steady_alpha(tmp_path, plate) -> None:
    with shot(tmp_path, plate) as clip:
        extraction = extract(clip, Scene())
        assert not extraction.measured and "alpha of evenly lit smoke" in kinds(extraction)
        sums = []
        for frame in (0, 5, 10):
            element, true = extraction.element(frame), np.clip(puff(6 + frame), 0, 1)
            opacity = 1 - element.transmittance
            assert opacity[ndimage.maximum_filter(true, 13) == 0].max() == 0
            assert 0.8 < opacity[true > 0].sum() / true.sum() < 1.3
            assert np.sqrt(np.square(element.over(plate) - clip.frame(frame)).mean()) < 0.005
            sums.append(opacity.sum() / true.sum())
    assert np.ptp(sums) < 0.1, "the thickest smoke of the clip, not of each frame, is opaque"


def test_a_flame_lends_no_light_to_the_alpha_of_the_smoke_beside_it(tmp_path) -> None:
    rows, columns = np.mgrid[:72, :56]

    def burning(n: int, picture: np.ndarray) -> np.ndarray:
        away = np.hypot(rows - 60 + 5 * np.sin(2.1 * n), columns - 12 - 3 * np.cos(1.7 * n))
        flame = np.sqrt(np.maximum(1 - away / 6, 0))[..., None] * np.float32((1.5, 0.75, 0.2))
        return np.minimum(picture + flame, 1)

    with shot(tmp_path, BLACK) as clip:
        without, beside = (extract(each, Scene()).element(8) for each in (clip, clip.changed(burning)))
    assert np.abs(beside.transmittance - without.transmittance)[:40].max() < 0.02


def test_one_color_of_another_hue_shows_how_much_passes(tmp_path) -> None:
    with shot(tmp_path, GREEN) as clip:
        extraction = extract(clip, Scene())
        assert extraction.measured and "alpha of evenly lit smoke" not in kinds(extraction)
        wrong = 1 - extraction.element(4).transmittance - np.clip(puff(10), 0, 1)
    assert np.sqrt(np.square(wrong).mean()) < 0.05


def test_what_a_run_would_say_of_the_background_is_said(tmp_path) -> None:
    with film(tmp_path, wall(0.2, 0.5), puff, 0.6) as clip:
        assert kinds(extract(clip, Scene())) == ["background seen"]
    with film(tmp_path / "clear", wall(0.2, 0.5), lambda n: 0 * puff(n), 0.6) as clip:
        extraction = extract(clip, Scene(background=Background(frame=0)))
        assert {"no smoke examined", "no smoke before the given background"} <= set(kinds(extraction))
        assert all((element.transmittance == 1).all() for element in extraction)


def test_light_without_alpha_says_nothing_of_thickness(tmp_path) -> None:
    """As of fire that is added: the run reads its brightness, and extract keeps the alpha of the file."""
    pictures = [np.dstack([0.5 * puff(n)[..., None] * np.ones(3), 0 * puff(n)]).astype(np.float32) for n in range(6)]
    with clip_of(tmp_path, pictures, ".exr") as clip:
        extraction = extract(clip, Scene())
        assert "alpha is a mask" in kinds(extraction) and np.isfinite(extraction.source).all()
        assert all((element.transmittance == 1).all() for element in extraction)


def test_a_clip_with_alpha_is_its_own_element_even_where_alpha_is_a_mask(tmp_path) -> None:
    ramp = np.linspace(0, 1, 56, dtype=np.float32) * np.ones((72, 1), np.float32)
    for name, alpha in (("element", ramp), ("mask", np.float32(ramp > 0.5))):
        own = np.dstack([ramp * alpha * 0.5] * 3 + [alpha]).astype(np.float32)
        with clip_of(tmp_path / name, [own] * 3, ".exr") as clip:
            extraction = extract(clip, Scene())
            assert extraction.measured
            assert ("alpha is a mask" in kinds(extraction)) == (name == "mask")
            np.testing.assert_allclose(extraction.element(1).rgba(), own, atol=1e-3)
