"""Clips: every frame is the right one, in linear light; what is missing or damaged is replaced and said."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from smokelift import Clip, ClipSource
from smokelift.checks import Finding
from smokelift.footage.frame_source import ClipError
from smokelift.footage.images import linear_to_srgb, srgb_to_linear
from smokelift.footage.video import Video
from smokelift.output.images import write_image
from tests.engine.films import Filmed, blanked, encode

LEVELS = [20 + 7 * n for n in range(30)]


def flat(value: int) -> np.ndarray:
    return np.full((16, 32, 3), value, np.uint8)


def codes(clip: Iterable[np.ndarray]) -> list[int]:
    """Return the level of each frame of a clip of flat gray frames."""
    return [round(float(linear_to_srgb(image[8, 8, 1])) * 255) for image in clip]


@pytest.fixture(scope="module")
def ramp(tmp_path_factory) -> Path:
    """A clip with B-frames and several key frames, whose frame n has the level 20 + 7 n."""
    path = tmp_path_factory.mktemp("clip") / "ramp.mp4"
    return encode(path, [flat(v) for v in LEVELS], options={"g": "8", "bf": "3", "sc_threshold": "0"})


def test_frames_are_linear(ramp) -> None:
    with Clip.open(ramp) as clip:
        assert (clip.fps, len(clip), clip.size) == (24.0, 30, (32, 16))
        assert (clip.path, clip.warning, clip.numbers[0]) == (ramp, None, 0)
        np.testing.assert_allclose(codes(clip), LEVELS, atol=1)
        image = clip.frame(12)
        assert image.dtype == np.float32
        assert image.shape == (16, 32, 3)
        assert not image.flags.writeable
    with Clip.open(ramp, transfer="linear") as clip:
        np.testing.assert_allclose(srgb_to_linear(clip.frame(12)), image, rtol=1e-5)


def test_frames_are_decoded_once_for_all_clips_of_a_file() -> None:
    source = Filmed(np.stack([flat(v) for v in LEVELS]))
    clip = Clip(Path("film"), source)
    brighter = clip.changed(lambda _, picture: picture + 1)
    for shown in (clip, clip.part(2, 6), brighter, clip.whole()):
        list(shown)
    assert sorted(source.read_frames) == list(range(len(clip)))
    assert float(brighter.frame(3).min()) >= 1


def test_a_range_of_frames(ramp) -> None:
    source = ClipSource(ramp, fps=60.0, frames=(5, 9))
    with Clip.open(source) as clip:
        assert (clip.fps, len(clip), clip.numbers) == (60.0, 5, range(5, 10))
        np.testing.assert_allclose(codes(clip), LEVELS[5:10], atol=1)
        for outside in (-1, 5):
            with pytest.raises(ClipError, match="0 to 4"):
                clip.frame(outside)
    assert len(Clip.open(source, frames=(0, 29))) == 30
    with pytest.raises(ClipError, match="0 to 29"):
        Clip.open(ramp, frames=(25, 30))
    with pytest.raises(ClipError, match="fps"):
        Clip.open(ramp, fps=0.0)


@pytest.mark.parametrize("name", ["a.mp4", "a.mkv"])
def test_a_truncated_clip_offers_what_is_there(tmp_path, name) -> None:
    noise = np.random.default_rng(3).integers(0, 255, (30, 32, 64, 3), np.uint8)
    front = {"movflags": "faststart"} if name == "a.mp4" else {}
    whole = encode(tmp_path / name, noise, muxer=front, options={"qp": "30", "g": "6"})
    with Clip.open(whole) as clip:
        assert (len(clip), clip.warning) == (30, None)
        wanted = [image.copy() for image in clip]
    data = whole.read_bytes()
    whole.write_bytes(data[: len(data) * 6 // 10])
    with Clip.open(whole) as clip:
        assert 10 <= len(clip) <= 20
        assert clip.warning == Finding("truncated clip", {"path": str(clip.path), "frames": len(clip)})
        for n, image in enumerate(clip):
            np.testing.assert_array_equal(image, wanted[n])
    whole.write_bytes(data[:300])
    with pytest.raises(ClipError, match=name):
        Clip.open(whole)


@pytest.mark.parametrize(("broken", "levels"), [(3, [0, 1, 2, 2, 4, 5]), (0, [1, 1, 2, 3, 4, 5])])
def test_a_damaged_frame_is_as_one_that_a_camera_dropped(tmp_path, broken, levels) -> None:
    path = encode(tmp_path / "a.mov", [flat(v) for v in LEVELS[:6]], "png", "rgb24")
    with Clip.open(blanked(path, [broken])) as clip:
        assert codes(clip) == [LEVELS[n] for n in levels]
        assert clip.damaged == (broken,)
        (said,) = clip.findings()
        assert (said.kind, said.figures["frames"]) == ("damaged frames", f"frame {broken} is")
        assert clip.part(4, 5).damaged == ()
        changed = clip.changed(lambda n, picture: picture * (n == broken))
        assert codes([changed.frame(broken)]) == [0]
    assert changed.damaged == (broken,)  # known after the file is closed


def test_a_damaged_frame_has_its_number_in_the_clip_at_a_varying_rate_too(tmp_path) -> None:
    times = [0, 40, 80, 120, 160, 200, 210, 220, 230, 240]
    path = encode(tmp_path / "a.mov", [flat(v) for v in LEVELS[:10]], "png", "rgb24", times=times)
    video = Video(blanked(path, [4]), None)
    (damaged, *_) = video.damaged(0, 9)
    with pytest.raises(ClipError, match=rf"frame {damaged} "):
        video.read(damaged)
    assert damaged != 4


# numbered pictures


def write(folder: Path, name: str, levels: dict[int, int], shift: int = 0) -> None:
    """Write flat pictures by their numbers, under a name with a place for that."""
    for n, level in levels.items():
        write_image(folder / name.format(n), srgb_to_linear(flat(level + shift) / 255))


def by_tens(numbers: Sequence[int]) -> dict[int, int]:
    return {n: 10 * n for n in numbers}


def test_picture_sequences(tmp_path) -> None:
    write(tmp_path, "frame_{:04d}.png", by_tens([3, 4, 5, 6]))
    (tmp_path / "frame_note.txt").write_text("not a picture")
    with Clip.open(tmp_path / "frame_####.png", fps=30) as clip:
        assert (len(clip), clip.fps, clip.size, clip.warning) == (4, 30.0, (32, 16), None)
        assert codes(clip) == [30, 40, 50, 60]
    with Clip.open(tmp_path / "frame_0004.png") as clip:
        assert codes(clip) == [40, 50, 60]
        assert clip.fps == 24.0
        assert (clip.warning.kind, clip.warning.figures["fps"]) == ("pictures without a frame rate", 24)
    write(tmp_path, "frame_{:04d}.exr", by_tens([1, 2]))
    with Clip.open(tmp_path / "frame_####.exr", frames=(1, 1)) as clip:
        assert codes(clip) == [20]
    Image.fromarray(flat(77)).save(tmp_path / "still.png")
    assert codes(Clip.open(tmp_path / "still.png")) == [77]


def test_pictures_with_negative_numbers_come_first(tmp_path) -> None:
    write(tmp_path, "frame_{:04d}.png", by_tens(range(-2, 3)), shift=100)
    levels = [80, 90, 100, 110, 120]
    for name, first in (("####", 0), ("-002", 0), ("-001", 1), ("0000", 2)):
        assert codes(Clip.open(tmp_path / f"frame_{name}.png")) == levels[first:]
    (tmp_path / "frame_-001.png").unlink()
    assert codes(Clip.open(tmp_path / "frame_####.png")) == [80, 80, 100, 110, 120]


def test_a_dash_is_no_minus_sign_where_no_picture_has_the_number_0(tmp_path) -> None:
    write(tmp_path, "shot-{:03d}.png", {1: 50, 2: 100})
    for name in ("shot-###.png", "shot-001.png"):
        assert codes(Clip.open(tmp_path / name)) == [50, 100]
    for number in (3, 4):
        with pytest.raises(ClipError, match=r"shot-002\.png.* shot-###\.png"):
            Clip.open(tmp_path / "shot####.png")
        write(tmp_path, "shot{:04d}.png", {number: 9})
    assert codes(Clip.open(tmp_path / "shot0003.png")) == [9, 9]


def test_gaps_in_picture_sequences_are_named(tmp_path) -> None:
    write(tmp_path, "frame_{:04d}.png", by_tens([1, 2, 4]))
    (tmp_path / "frame_0005.png").write_bytes(b"nothing")
    with Clip.open(tmp_path / "frame_####.png", fps=24) as clip:
        assert codes(clip) == [10, 20, 20, 40, 40]
        assert [file.name for file in clip.files] == [f"frame_000{n}.png" for n in (1, 2, 4, 5)]
        assert clip.findings()[0].figures["frames"] == "frames 2 and 4 are"
    (tmp_path / "frame_0005.png").unlink()
    write(tmp_path, "frame_{:04d}.png", {400: 0})
    with pytest.raises(ClipError, match=r"frame_0003\.png: .* frame_0400\.png"):
        Clip.open(tmp_path / "frame_####.png")
