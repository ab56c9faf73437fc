"""Clips: every frame is the right one, upright, in the right colors; what cannot be read is said."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import OpenEXR
import pytest
from PIL import Image

from smokelift.checks import Finding
from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import ClipError, StoredPicture
from smokelift.footage.images import linear_to_srgb, srgb_to_linear
from smokelift.footage.video import Video
from smokelift.output.images import write_image
from smokelift.scene import ClipSource


def encode(
    path: Path,
    frames: Sequence[np.ndarray],
    *,
    codec: str = "libx264",
    pixels: str = "yuv420p",
    given: str = "rgb24",
    colorspace: int | None = None,
    rotation: int | None = None,
    times: Sequence[int] | None = None,
    container: dict[str, str] | None = None,
    **options: str,
) -> Path:
    """Write a clip of 24 frames a second (or of times in 1/240 s)."""
    with av.open(str(path), "w", options=container or {}) as out:
        stream = out.add_stream(codec, rate=24)
        stream.height, stream.width = frames[0].shape[:2]
        stream.pix_fmt = pixels
        stream.codec_context.time_base = Fraction(1, 240)
        stream.options = {"qp": "0", **options} if codec == "libx264" else options
        if colorspace is not None:
            stream.codec_context.colorspace = colorspace
        if rotation is not None:
            stream.set_display_rotation(rotation)
        for n, array in enumerate(frames):
            frame = av.VideoFrame.from_ndarray(array, format=given)
            frame = frame.reformat(format=pixels, dst_colorspace=colorspace)
            frame.pts = times[n] if times is not None else 10 * n
            frame.time_base = Fraction(1, 240)
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    return path


def flat(value: int | tuple[int, int, int], width: int = 32, height: int = 16) -> np.ndarray:
    return np.full((height, width, 3), value, np.uint8)


def codes(clip: Clip) -> list[int]:
    """Return the level of each frame of a clip of flat gray frames."""
    return [round(float(linear_to_srgb(image[8, 8, 1])) * 255) for image in clip]


def near(found: Sequence[int], wanted: Sequence[int], by: int = 1) -> bool:
    return len(found) == len(wanted) and all(abs(a - b) <= by for a, b in zip(found, wanted, strict=True))


LEVELS = [20 + 7 * n for n in range(30)]


@pytest.fixture(scope="module")
def ramp(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clip with B-frames and several key frames, whose frame n has the level 20 + 7 n."""
    path = tmp_path_factory.mktemp("clip") / "ramp.mp4"
    return encode(path, [flat(v) for v in LEVELS], g="8", bf="3", sc_threshold="0")


def test_frames_are_linear_and_in_order(ramp: Path) -> None:
    with Clip.open(ramp) as clip:
        assert (clip.fps, len(clip), clip.size) == (24.0, 30, (32, 16))
        assert (clip.path, clip.warning, clip.numbers[0]) == (ramp, None, 0)
        assert near(codes(clip), LEVELS)
        image = clip.frame(12)
        assert image.dtype == np.float32
        assert image.shape == (16, 32, 3)
        assert not image.flags.writeable
    with Clip.open(ramp, transfer="linear") as clip:
        np.testing.assert_allclose(srgb_to_linear(clip.frame(12)), image, rtol=1e-5)


def test_any_frame_can_be_had_in_any_order(ramp: Path) -> None:
    with Clip.open(ramp) as clip:
        in_order = [image.copy() for image in clip]
    order = np.random.default_rng(0).permutation(30).tolist()
    with Clip.open(ramp) as clip:
        for n in [*order, 29, 0, 7, 8, 9, 7]:
            np.testing.assert_array_equal(clip.frame(n), in_order[n])


@pytest.mark.parametrize(
    ("name", "codec", "pixels"),
    [
        ("a.mkv", "libx264", "yuv420p"),
        ("a.mov", "prores_ks", "yuv422p10le"),
        ("a.avi", "mpeg4", "yuv420p"),
        ("a.webm", "libvpx-vp9", "yuv420p"),
        ("a.mkv", "ffv1", "gray"),
        ("a.ts", "libx264", "yuv420p"),
        ("a.h264", "libx264", "yuv420p"),
        ("a.gif", "gif", "rgb8"),
    ],
)
def test_other_containers_and_codecs(tmp_path: Path, name: str, codec: str, pixels: str) -> None:
    path = encode(tmp_path / name, [flat(v) for v in LEVELS[:12]], codec=codec, pixels=pixels)
    slack = 40 if codec == "gif" else 4
    with Clip.open(path) as clip:
        assert near(codes(clip), LEVELS[:12], slack)
        assert clip.fps == pytest.approx(24, rel=0.05)
        assert near(codes(clip)[::-1], [codes_of(clip, n) for n in range(11, -1, -1)], 0)


def codes_of(clip: Clip, n: int) -> int:
    return round(float(linear_to_srgb(clip.frame(n)[8, 8, 1])) * 255)


@pytest.mark.parametrize("colorspace", [1, 5])
def test_the_color_matrix_is_honored(tmp_path: Path, colorspace: int) -> None:
    color = (200, 60, 30)
    path = encode(tmp_path / "a.mp4", [flat(color, 64, 64)] * 2, colorspace=colorspace, pixels="yuv444p")
    found = linear_to_srgb(Clip.open(path).frame(0)[32, 32]) * 255
    np.testing.assert_allclose(found, color, atol=2.1)


@pytest.mark.parametrize("full", [False, True])
def test_the_color_range_is_honored_and_rounding_is_unbiased(tmp_path: Path, full: bool) -> None:
    luma = np.arange(16, 236, dtype=np.uint8)
    planes = np.full((6, 220), 128, np.uint8)  # four rows of luma over two of chroma, as yuv420p is packed
    planes[:4] = luma
    path = tmp_path / "a.mp4"
    with av.open(str(path), "w") as out:
        stream = out.add_stream("libx264", rate=24)
        stream.width, stream.height, stream.pix_fmt = 220, 4, "yuv420p"
        stream.options = {"qp": "0"}
        stream.codec_context.color_range = 2 if full else 1
        frame = av.VideoFrame.from_ndarray(planes, format="yuv420p")
        frame.color_range = 2 if full else 1
        out.mux(stream.encode(frame))
        out.mux(stream.encode())
    found = linear_to_srgb(Clip.open(path).frame(0)[2, :, 1]) * 255
    exact = luma if full else (luma - 16.0) * 255 / 219
    assert np.abs(found - exact).max() < 0.51
    assert abs(np.mean(found - exact)) < 0.05


def test_alpha_is_shown_over_black(tmp_path: Path) -> None:
    rgba = np.full((16, 16, 4), 255, np.uint8)
    rgba[:, :8, 3] = 51
    path = encode(tmp_path / "a.mov", [rgba], codec="qtrle", pixels="argb", given="rgba")
    image = Clip.open(path).frame(0)
    np.testing.assert_allclose(image[:, :8], 0.2, rtol=1e-5)
    np.testing.assert_allclose(image[:, 8:], 1.0)


@pytest.mark.parametrize("rotation", [None, 90, 180, -90])
def test_rotated_clips_are_upright(tmp_path: Path, rotation: int | None) -> None:
    picture = np.zeros((32, 64, 3), np.uint8)
    picture[:16, :32] = 200  # a bright quarter at the top left, as stored
    path = encode(tmp_path / "a.mp4", [picture] * 2, rotation=rotation)
    with Clip.open(path) as clip:
        wanted = np.rot90(picture, (rotation or 0) // 90)  # counterclockwise, as PyAV counts
        assert clip.size == (wanted.shape[1], wanted.shape[0])
        np.testing.assert_allclose(linear_to_srgb(clip.frame(1)), wanted / 255, atol=0.02)


def test_a_varying_rate_is_evened_out(tmp_path: Path) -> None:
    # Ten frames; the first five last four times as long as the others.
    times = [0, 40, 80, 120, 160, 200, 210, 220, 230, 240]
    path = encode(tmp_path / "a.mp4", [flat(v) for v in LEVELS[:10]], times=times, bf="0")
    with Clip.open(path) as clip:
        step = 240 / 9
        assert clip.fps == pytest.approx(240 / step)
        shown = [max(k for k, t in enumerate(times) if t <= n * step + 0.5) for n in range(10)]
        assert near(codes(clip), [LEVELS[k] for k in shown])


def test_frames_are_decoded_once_for_all_clips_of_a_file(ramp: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[int] = []
    own = Video.read

    def counted(video: Video, n: int) -> StoredPicture:
        read.append(n)
        return own(video, n)

    monkeypatch.setattr(Video, "read", counted)
    with Clip.open(ramp) as clip:
        brighter = clip.changed(lambda _, picture: picture + 1)
        for shown in (clip, clip.part(2, 6), brighter, clip.whole()):
            list(shown)
        assert sorted(read) == list(range(len(clip)))
        assert float(brighter.frame(3).min()) >= 1


def test_a_range_of_frames(ramp: Path) -> None:
    source = ClipSource(ramp, fps=60.0, frames=(5, 9))
    with Clip.open(source) as clip:
        assert (clip.fps, len(clip), clip.numbers) == (60.0, 5, range(5, 10))
        assert near(codes(clip), LEVELS[5:10])
        for outside in (-1, 5):
            with pytest.raises(ClipError, match=f"there is no frame {outside}; there are 0 to 4"):
                clip.frame(outside)
    assert len(Clip.open(source, frames=(0, 29))) == 30
    with pytest.raises(ClipError, match="there are no frames 25 to 30; choose some of 0 to 29"):
        Clip.open(ramp, frames=(25, 30))
    with pytest.raises(ClipError, match="fps must be"):
        Clip.open(ramp, fps=0.0)


def test_what_is_no_video_is_named(tmp_path: Path) -> None:
    with pytest.raises(ClipError, match=r"nothing\.mp4: no such file"):
        Clip.open(tmp_path / "nothing.mp4")
    (tmp_path / "junk.mp4").write_bytes(bytes(range(256)) * 40)
    with pytest.raises(ClipError, match=r"junk\.mp4: is not a video, or is damaged"):
        Clip.open(tmp_path / "junk.mp4")
    (tmp_path / "empty.mp4").write_bytes(b"")
    with pytest.raises(ClipError, match=r"empty\.mp4: is empty; copy or export it again"):
        Clip.open(tmp_path / "empty.mp4")
    with pytest.raises(ClipError, match="is a folder"):
        Clip.open(tmp_path)
    with av.open(str(tmp_path / "sound.mp4"), "w") as out:
        stream = out.add_stream("aac", rate=44100)
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 1024), np.float32), format="fltp", layout="mono")
        frame.sample_rate = 44100
        out.mux(stream.encode(frame))
        out.mux(stream.encode())
    with pytest.raises(ClipError, match=r"sound\.mp4: holds no video stream"):
        Clip.open(tmp_path / "sound.mp4")


@pytest.mark.parametrize("name", ["a.mp4", "a.mkv"])
def test_a_truncated_clip_offers_what_is_there(tmp_path: Path, name: str) -> None:
    noise = np.random.default_rng(3).integers(0, 255, (30, 32, 64, 3), np.uint8)
    front = {"movflags": "faststart"} if name == "a.mp4" else {}
    whole = encode(tmp_path / name, list(noise), container=front, qp="30", g="6")
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


def blanked(path: Path, frames: Sequence[int]) -> Path:
    """Put zeros where the coded frames of some numbers are."""
    with av.open(str(path)) as container:
        packets = [packet for packet in container.demux(video=0) if packet.size]
        places = [(packets[n].pos, packets[n].size) for n in frames]
    data = bytearray(path.read_bytes())
    for place, size in places:
        data[place : place + size] = bytes(size)
    path.write_bytes(data)
    return path


@pytest.mark.parametrize(("broken", "levels"), [([3], [0, 1, 2, 2, 4, 5]), ([0], [1, 1, 2, 3, 4, 5])])
def test_a_damaged_frame_is_as_one_that_a_camera_dropped(tmp_path: Path, broken: list[int], levels: list[int]) -> None:
    path = encode(tmp_path / "a.mov", [flat(v) for v in LEVELS[:6]], codec="png", pixels="rgb24")
    with Clip.open(blanked(path, broken)) as clip:
        assert codes(clip) == [LEVELS[n] for n in levels]
        assert clip.damaged == tuple(broken)
        (said,) = clip.findings()
        assert (said.kind, said.figures["frames"]) == ("damaged frames", f"frame {broken[0]} is")
        assert clip.part(4, 5).damaged == ()
        changed = clip.changed(lambda n, picture: picture * (n == broken[0]))
        assert codes_of(changed, broken[0]) == 0
    assert changed.damaged == tuple(broken)  # known after the file is closed


def test_a_damaged_frame_has_its_number_in_the_clip_at_a_varying_rate_too(tmp_path: Path) -> None:
    times = [0, 40, 80, 120, 160, 200, 210, 220, 230, 240]
    path = encode(tmp_path / "a.mov", [flat(v) for v in LEVELS[:10]], codec="png", pixels="rgb24", times=times)
    video = Video(blanked(path, [4]), None)
    (damaged, *_) = video.damaged(0, 9)
    with pytest.raises(ClipError, match=rf"frame {damaged} is damaged"):
        video.read(damaged)
    assert damaged != 4


def wide_codes(path: Path, planes: Sequence[int], codec: str = "ffv1", **tags: int) -> Path:
    """Write a flat 4:4:4 picture of 10 bit luma and chroma codes."""
    with av.open(str(path), "w") as out:
        stream = out.add_stream(codec, rate=24)
        stream.width, stream.height, stream.pix_fmt = 32, 16, "yuv444p10le"
        for name, value in tags.items():
            setattr(stream.codec_context, name, value)
        frame = av.VideoFrame(32, 16, "yuv444p10le")
        for plane, code in zip(frame.planes, planes, strict=True):
            plane.update(np.full(plane.buffer_size // 2, code, np.uint16).tobytes())
        frame.pts = 0
        out.mux(stream.encode(frame))
        out.mux(stream.encode())
    return path


@pytest.mark.parametrize(
    ("transfer", "luma", "linear"),
    [(18, 64 + 876 * 0.75, 1.0), (18, 64 + 876 * 0.5, 0.3145), (16, 64 + 876 * 0.5807, 1.0), (8, 64 + 876 * 0.5, 0.5)],
)
def test_hlg_pq_and_linear_video(tmp_path: Path, transfer: int, luma: float, linear: float) -> None:
    path = wide_codes(tmp_path / "a.mkv", [round(luma), 512, 512], color_trc=transfer, color_primaries=9, colorspace=9)
    with Clip.open(path) as clip:
        np.testing.assert_allclose(clip.frame(0)[8, 8], linear, rtol=0.005)
        said = {found.kind: found.figures for found in clip.findings()}
        assert said["other primaries"] == {"primaries": "BT.2020"}
        assert (said.get("high dynamic range") == {"transfer": "HLG"}) == (transfer == 18)


@pytest.mark.parametrize("shape", [Fraction(2, 1), Fraction(3, 4)])
def test_anamorphic_pixels_become_square(tmp_path: Path, shape: Fraction) -> None:
    picture = np.zeros((48, 64, 3), np.uint8)
    picture[:, :16] = 200
    path = tmp_path / "a.mp4"
    with av.open(str(path), "w") as out:
        stream = out.add_stream("libx264", rate=24)
        stream.width, stream.height, stream.pix_fmt, stream.options = 64, 48, "yuv444p", {"qp": "0"}
        stream.codec_context.sample_aspect_ratio = shape
        out.mux(stream.encode(av.VideoFrame.from_ndarray(picture)))
        out.mux(stream.encode())
    with Clip.open(path) as clip:
        assert clip.size == (round(64 * shape), 48)
        edge = round(16 * shape)
        assert linear_to_srgb(clip.frame(0)[24, : edge - 3]).min() > 0.75
        assert linear_to_srgb(clip.frame(0)[24, edge + 3 :]).max() < 0.05
        (note,) = clip.findings()
        assert (note.kind, note.figures["scaled"]) == ("scaled pictures", (clip.size[0], 48))


def test_interlaced_video_is_of_one_moment(tmp_path: Path) -> None:
    picture = np.zeros((64, 64, 3), np.uint8)
    picture[::2] = np.linspace(40, 200, 32)[:, None, None]
    picture[1::2, :, 0] = 250
    path = tmp_path / "a.mp4"
    with av.open(str(path), "w") as out:
        stream = out.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = 64, 64, "yuv444p"
        stream.options = {"qp": "0", "x264-params": "tff=1"}
        out.mux(stream.encode(av.VideoFrame.from_ndarray(picture)))
        out.mux(stream.encode())
    with Clip.open(path) as clip:
        assert [found.kind for found in clip.findings()] == ["interlaced clip"]
        found = linear_to_srgb(clip.frame(0)[:63, 32]) * 255
        lines = np.interp(np.arange(63), np.arange(0, 64, 2), picture[::2, 0, 0])
        np.testing.assert_allclose(found, lines[:, None].repeat(3, 1), atol=2.5)


def pictures(folder: Path, numbers: Sequence[int], suffix: str = "png") -> None:
    for n in numbers:
        write_image(folder / f"frame_{n:04d}.{suffix}", srgb_to_linear(flat(min(10 * n, 255)) / 255))


def test_picture_sequences(tmp_path: Path) -> None:
    pictures(tmp_path, [3, 4, 5, 6])
    (tmp_path / "frame_note.txt").write_text("not a picture")
    with Clip.open(tmp_path / "frame_####.png", fps=30) as clip:
        assert (len(clip), clip.fps, clip.size, clip.warning) == (4, 30.0, (32, 16), None)
        assert codes(clip) == [30, 40, 50, 60]
    with Clip.open(tmp_path / "frame_0004.png") as clip:
        assert codes(clip) == [40, 50, 60]
        assert clip.fps == 24.0
        assert clip.warning is not None
        assert (clip.warning.kind, clip.warning.figures["fps"]) == ("pictures without a frame rate", 24)
    pictures(tmp_path, [1, 2], "exr")
    with Clip.open(tmp_path / "frame_####.exr", frames=(1, 1)) as clip:
        assert codes(clip) == [20]
    Image.fromarray(flat(77)).save(tmp_path / "still.png")
    assert codes(Clip.open(tmp_path / "still.png")) == [77]


def test_pictures_with_negative_numbers_come_first(tmp_path: Path) -> None:
    for n in range(-2, 3):
        Image.fromarray(flat(100 + 10 * n)).save(tmp_path / f"frame_{n:04d}.png")
    levels = [80, 90, 100, 110, 120]
    for name in ("frame_####.png", "frame_-002.png"):
        with Clip.open(tmp_path / name, fps=24) as clip:
            assert codes(clip) == levels
    assert codes(Clip.open(tmp_path / "frame_-001.png")) == levels[1:]
    assert codes(Clip.open(tmp_path / "frame_0000.png")) == levels[2:]
    (tmp_path / "frame_-001.png").unlink()
    assert codes(Clip.open(tmp_path / "frame_####.png")) == [80, 80, 100, 110, 120]


def test_a_dash_is_no_minus_sign_where_no_picture_has_the_number_0(tmp_path: Path) -> None:
    for n in (1, 2):
        Image.fromarray(flat(50 * n)).save(tmp_path / f"shot-{n:03d}.png")
    for name in ("shot-###.png", "shot-001.png"):
        assert codes(Clip.open(tmp_path / name)) == [50, 100]
    for name in ("shot0003.png", "shot0004.png"):
        with pytest.raises(ClipError, match=r"shot-002\.png: has a dash before its number.* or give shot-###\.png"):
            Clip.open(tmp_path / "shot####.png")
        Image.fromarray(flat(9)).save(tmp_path / name)
    assert codes(Clip.open(tmp_path / "shot0003.png")) == [9, 9]


def test_gaps_in_picture_sequences_are_named(tmp_path: Path) -> None:
    pictures(tmp_path, [1, 2, 4])
    (tmp_path / "frame_0005.png").write_bytes(b"nothing")
    with Clip.open(tmp_path / "frame_####.png", fps=24) as clip:
        assert codes(clip) == [10, 20, 20, 40, 40]
        assert [file.name for file in clip.files] == [f"frame_000{n}.png" for n in (1, 2, 4, 5)]
        assert clip.findings()[0].figures["frames"] == "frames 2 and 4 are"
    (tmp_path / "frame_0005.png").unlink()
    pictures(tmp_path, [400])
    with pytest.raises(ClipError, match=r"frame_0003\.png: this picture is missing, as .* most .* frame_0400\.png"):
        Clip.open(tmp_path / "frame_####.png")
    (tmp_path / "frame_0400.png").unlink()
    with pytest.raises(ClipError, match=r"other_####\.png: no such pictures"):
        Clip.open(tmp_path / "other_####.png")
    for name in ("frame_0000.png", "still.png"):
        with pytest.raises(ClipError, match=f"{name}: no such file"):
            Clip.open(tmp_path / name)
    for name in ("frame_*.png", "frame_%04d.png"):
        with pytest.raises(ClipError, match=r"no such file; give numbered pictures as frame_####\.png"):
            Clip.open(tmp_path / name)
    with pytest.raises(ClipError, match="no such pictures"):
        Clip.open(tmp_path / "#_##.png")
    Image.fromarray(flat(1, 8, 8)).save(tmp_path / "frame_0003.png")
    with (
        Clip.open(tmp_path / "frame_####.png") as clip,
        pytest.raises(ClipError, match=r"frame_0003\.png: is 8 x 8 pixels, the first picture 32 x 16"),
    ):
        clip.frame(2)


def test_pictures_of_a_kind_that_is_not_read_are_named_and_not_taken_for_damage(tmp_path: Path) -> None:
    for n in range(4):
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        OpenEXR.File(header, {"Z": np.ones((16, 32), np.float32)}).write(str(tmp_path / f"z{n}.exr"))
        Image.fromarray(flat(10)).save(tmp_path / f"b{n}.bmp")
    for pattern, reason in (("z#.exr", "holds neither RGB nor Y channels, but Z"), ("b#.bmp", "is none of .*save it")):
        with pytest.raises(ClipError, match=rf"0\.\w+: {reason}") as refused:
            Clip.open(tmp_path / pattern)
        assert "damaged" not in str(refused.value) and "missing" not in str(refused.value)
