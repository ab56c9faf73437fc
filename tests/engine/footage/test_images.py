"""Pictures: what is written is what is read, whatever the format, and what is unknown is continued from around it."""

import numpy as np
import OpenEXR
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from scipy import ndimage

from smokelift.footage.image_files import (
    ImageError,
    PictureKindError,
    linear_layer,
    read_image,
    read_layer,
    read_stored,
)
from smokelift.footage.images import (
    area_average,
    blurred,
    brightest_channel,
    continuation_errors,
    in_one_piece,
    linear_to_srgb,
    mostly_beside,
    push_pull,
    srgb_to_linear,
)
from smokelift.output.images import write_image
from tests.engine.films import encode, write_exr


def colors(height: int = 6, width: int = 5) -> np.ndarray:
    return np.random.default_rng(1).random((height, width, 3), np.float32)


def test_srgb_is_the_standard_curve() -> None:
    codes = np.array([0, 10, 11, 128, 255]) / 255
    np.testing.assert_allclose(srgb_to_linear(codes), [0.0, 0.00303527, 0.00334654, 0.21586050, 1.0], rtol=2e-5)
    values = np.linspace(-0.1, 4.0, 1001, dtype=np.float32)
    assert srgb_to_linear(values).dtype == np.float32
    np.testing.assert_allclose(linear_to_srgb(srgb_to_linear(values)), values, atol=2e-6)
    assert np.all(np.diff(linear_to_srgb(values)) > 0)


def test_png_of_8_bits(tmp_path) -> None:
    codes = np.rint(colors() * 255).astype(np.uint8)
    Image.fromarray(codes).save(tmp_path / "a.png")
    image = read_image(tmp_path / "a.png")
    assert image.dtype == np.float32
    np.testing.assert_allclose(image, srgb_to_linear(codes / 255), rtol=1e-6)
    np.testing.assert_allclose(read_image(tmp_path / "a.png", "linear"), codes / 255, rtol=1e-6)
    write_image(tmp_path / "b.png", image)
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "b.png")), codes)


def test_gray_palette_and_transparent_png(tmp_path) -> None:
    Image.fromarray(np.full((2, 3), 128, np.uint8)).save(tmp_path / "gray.png")
    np.testing.assert_allclose(read_image(tmp_path / "gray.png"), np.full((2, 3, 3), 0.2158605), rtol=1e-5)
    Image.fromarray(np.full((2, 3, 3), 255, np.uint8)).convert("P").save(tmp_path / "palette.png")
    np.testing.assert_allclose(read_image(tmp_path / "palette.png"), np.ones((2, 3, 3)))
    half = np.full((2, 3, 4), 255, np.uint8)
    half[..., 3] = 51
    Image.fromarray(half).save(tmp_path / "half.png")
    np.testing.assert_allclose(read_image(tmp_path / "half.png"), np.full((2, 3, 3), 0.2), rtol=1e-6)


@pytest.mark.parametrize("half", [True, False])
def test_exr_comes_back(tmp_path, half) -> None:
    image = 30.0 * colors() - 1.0
    write_image(tmp_path / "a.exr", image, half=half)
    read = read_image(tmp_path / "a.exr")
    assert read.dtype == np.float32
    np.testing.assert_allclose(read, image, rtol=1e-3 * half, atol=1e-3 * half)
    assert [file.name for file in tmp_path.iterdir()] == ["a.exr"]


def test_exr_channels_and_tiles(tmp_path) -> None:
    rgb = colors(40, 50)
    gray = np.ascontiguousarray(rgb[..., 0])
    tiles = OpenEXR.TileDescription()
    tiles.xSize = tiles.ySize = 16
    for channels, header, shown in (
        ({"Y": gray}, {}, gray[..., None].repeat(3, 2)),
        ({"A": gray}, {}, gray[..., None].repeat(3, 2)),
        ({"RGBA": np.dstack([rgb / 4, np.full_like(gray, 0.25)])}, {}, rgb / 4),
        ({"RGB": rgb}, {"type": OpenEXR.tiledimage, "tiles": tiles}, rgb),
    ):
        np.testing.assert_array_equal(read_image(write_exr(tmp_path / "a.exr", channels, **header)), shown)
    for names in (("N.X", "N.Y"), ("Z",), ("View.Z",), ("A", "Z")):
        with pytest.raises(PictureKindError, match=names[0]):
            read_image(write_exr(tmp_path / "x.exr", dict.fromkeys(names, gray)))


@pytest.mark.parametrize(
    "parts",
    [
        [("depth", "Z"), ("color", "R G B")],
        [("normal", "X Y Z"), ("beauty", "R G B A")],
        [("albedo", "R G B"), ("Beauty", "R G B")],
        [("", "albedo.R albedo.G albedo.B beauty.R beauty.G beauty.B beauty.A Z")],
        [("", "A.Mist.R A.Mist.G A.Mist.B View.Combined.R View.Combined.G View.Combined.B")],
        [("", "a.R a.G a.B R G B")],
        [("depth", "Z"), ("left", "N.X N.Y light.Y")],
    ],
)
def test_the_picture_of_an_exr_is_found_among_parts_and_layers(tmp_path, parts) -> None:
    """The part or layer that is the picture has the value 0.5, every other one 0.1."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    wanted = ("color", "beauty", "Beauty", "light", "View.Combined", "")

    def value(part: str, channel: str) -> float:
        layer = channel.rpartition(".")[0] or part
        return 0.5 if layer in wanted and not channel.endswith("Z") else 0.1

    written = [
        OpenEXR.Part(
            dict(header), {name: np.full((4, 6), value(part, name), np.float32) for name in names.split()}, part
        )
        for part, names in parts
    ]
    OpenEXR.File(written).write(str(tmp_path / "a.exr"))
    image, alpha = read_layer(tmp_path / "a.exr")
    np.testing.assert_allclose(image, 0.5)
    assert (alpha is not None) == ("A" in parts[-1][1].replace("A.Mist", "").replace(".", " ").split())


@pytest.mark.parametrize(
    ("name", "codec", "pixels", "bits"),
    [
        ("a.png", "png", "rgb48be", 16),
        ("a.tif", "tiff", "rgb48le", 16),
        ("a.tiff", "tiff", "rgba64le", 16),
        ("a.TIF", "tiff", "rgb24", 8),
        ("a.tif", "tiff", "rgba", 8),
        ("a.dpx", "dpx", "gbrp10le", 10),
        ("a.dpx", "dpx", "gbrp12be", 12),
        ("a.dpx", "dpx", "rgba64be", 16),
        ("a.dpx", "dpx", "rgb24", 8),
    ],
)
def test_pictures_keep_their_bits(tmp_path, name, codec, pixels, bits) -> None:
    alpha = "a" in pixels.removeprefix("gbrp").removeprefix("rgb")
    codes = np.random.default_rng(2).integers(0, 65536, (6, 8, 3 + alpha), np.uint16)
    path = encode(tmp_path / name, [codes], codec, pixels)
    image, opacity = linear_layer(read_stored(path), "linear", "premultiplied in linear light")
    np.testing.assert_allclose(image, codes[..., :3] / 65535, atol=1.5 / (2**bits - 1))
    assert (opacity is not None) == alpha
    if opacity is not None:
        np.testing.assert_allclose(opacity, codes[..., 3] / 65535, atol=1.5 / (2**bits - 1))
    np.testing.assert_allclose(
        linear_layer(read_stored(path), None, "premultiplied in linear light")[0], srgb_to_linear(image)
    )


@pytest.mark.parametrize("mode", ["L", "P", "CMYK", "1", "I;16"])
@pytest.mark.parametrize("compression", [None, "tiff_lzw", "tiff_deflate"])
def test_tiff_of_other_kinds(tmp_path, mode, compression) -> None:
    gray = np.kron(np.array([[0, 255], [255, 0]], np.uint8), np.ones((8, 8), np.uint8))
    picture = Image.fromarray(gray * np.uint16(257)) if mode == "I;16" else Image.fromarray(gray).convert(mode)
    picture.save(tmp_path / "a.tif", compression=compression)
    np.testing.assert_allclose(read_image(tmp_path / "a.tif"), np.repeat(gray[..., None] / 255, 3, -1), atol=0.01)


def test_log_dpx_and_floating_tiff_are_named(tmp_path) -> None:
    path = encode(tmp_path / "a.dpx", [np.zeros((6, 8, 3), np.uint16)], "dpx", "gbrp10le")
    content = bytearray(path.read_bytes())
    for code in (1, 3):
        content[801] = code
        path.write_bytes(content)
        with pytest.raises(PictureKindError, match=r"save it as \.exr"):
            read_image(path)
    Image.fromarray(np.zeros((6, 8), np.float32)).save(tmp_path / "a.tif")
    with pytest.raises(PictureKindError, match=r"save it as \.exr"):
        read_image(tmp_path / "a.tif")


def test_exr_gives_the_display_window(tmp_path) -> None:
    rgb = colors(4, 6)
    window = (np.array([-1, 2], np.int32), np.array([4, 5], np.int32))
    display = (np.array([0, 0], np.int32), np.array([7, 3], np.int32))
    path = write_exr(tmp_path / "a.exr", {"RGB": rgb}, dataWindow=window, displayWindow=display)
    wanted = np.zeros((4, 8, 3), np.float32)
    wanted[2:, :5] = rgb[:2, 1:]
    np.testing.assert_array_equal(read_image(path), wanted)


def test_radiance_hdr(tmp_path) -> None:
    pixels = np.array([[[128, 64, 32, 129], [255, 0, 128, 136]]], np.uint8)
    head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n"
    (tmp_path / "sky.hdr").write_bytes(head + pixels.tobytes())
    image = read_image(tmp_path / "sky.hdr")
    wanted = pixels[..., :3] / 256.0 * 2.0 ** (pixels[..., 3:].astype(float) - 128)
    np.testing.assert_allclose(image, wanted, rtol=0.02)


@pytest.mark.parametrize("name", ["a.png", "a.exr", "a.jpg", "a.hdr", "a.tif", "a.dpx"])
def test_damaged_and_missing_pictures_are_named(tmp_path, name) -> None:
    with pytest.raises(ImageError, match="no such file"):
        read_image(tmp_path / name)
    (tmp_path / name).write_bytes(b"not a picture at all")
    with pytest.raises(ImageError, match=f"{name}: cannot be read"):
        read_image(tmp_path / name)


def test_what_cannot_be_written_leaves_the_old_file(tmp_path) -> None:
    path, other = tmp_path / "a.exr", tmp_path / "a.bmp"
    write_image(path, colors())
    before = path.read_bytes()
    for said, call, *values in (
        ("finite", write_image, path, np.full((2, 2, 3), np.nan)),
        ("shape", write_image, path, np.zeros((2, 2, 5))),
        (r"only write \.exr and \.png", write_image, other, colors()),
        ("is none of", read_image, other),
    ):
        with pytest.raises(ImageError, match=said):
            call(*values)
    assert path.read_bytes() == before


def test_alpha_is_premultiplied_in_exr_and_straight_in_png(tmp_path) -> None:
    element = np.full((2, 3, 4), [0.2, 0.1, 0.05, 0.5], np.float32)
    element[0, 0] = 0  # clear
    write_image(tmp_path / "a.exr", element)
    (part,) = OpenEXR.File(str(tmp_path / "a.exr")).parts
    np.testing.assert_allclose(part.channels["RGBA"].pixels, element, atol=1e-3)
    write_image(tmp_path / "a.png", element)
    with Image.open(tmp_path / "a.png") as picture:
        codes = np.asarray(picture)
    assert codes.shape == (2, 3, 4) and codes[0, 0].tolist() == [0, 0, 0, 0] and codes[1, 1, 3] == 128
    np.testing.assert_allclose(srgb_to_linear(codes[1, 1, :3] / np.float32(255)), [0.4, 0.2, 0.1], atol=0.005)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(*[st.integers(1, 40)] * 4)
def test_resizing_keeps_flat_pictures_flat_and_shrinking_keeps_the_mean(rows, columns, height, width) -> None:
    small = area_average(np.full((rows, columns, 3), 0.7), width, height)
    assert small.shape == (height, width, 3)
    np.testing.assert_allclose(small, 0.7, rtol=1e-5)
    image = np.random.default_rng(rows).random((rows, columns), np.float32)
    shrunk = area_average(image, min(width, columns), min(height, rows))
    assert shrunk.mean() == pytest.approx(image.mean(), rel=1e-5)


def test_area_averages_are_exact() -> None:
    image = np.arange(12, dtype=np.float32).reshape(1, 12)
    np.testing.assert_allclose(area_average(image, 4, 1), [[1, 4, 7, 10]])
    np.testing.assert_allclose(area_average(np.array([[0.0, 1.0, 5.0]]), 2, 1), [[1 / 3, (0.5 + 5) / 1.5]], rtol=1e-6)
    np.testing.assert_allclose(area_average(np.array([[0.0, 1.0]]), 4, 1), [[0.0, 0.25, 0.75, 1.0]], rtol=1e-6)
    with pytest.raises(ValueError, match="pixel"):
        area_average(image, 0, 1)


@pytest.mark.parametrize(
    ("kind", "size"), [("xyze", "-Y 1 +X 1"), ("rgbe", "+Y 1 +X 1"), ("rgbe", "-Y 1 -X 1"), ("rgbe", "+X 1 -Y 1")]
)
def test_radiance_pictures_of_a_rare_kind_are_refused(tmp_path, kind, size):
    path = tmp_path / "map.hdr"
    path.write_bytes(f"#?RADIANCE\nFORMAT=32-bit_rle_{kind}\n\n{size}\n".encode() + bytes([128, 64, 32, 129]))
    with pytest.raises(ImageError, match="ordinary"):
        read_image(path)


def test_a_damaged_exr_leaves_the_standard_streams_alone(tmp_path, capfd) -> None:
    """OpenEXR writes of pixels that it cannot decode to standard output, where the command line writes its events."""
    path = tmp_path / "damaged.exr"
    write_image(path, colors())
    content = path.read_bytes()
    path.write_bytes(content.replace(b"B\0\x01\0\0\0", b"B\0\0\0\0\0", 1))
    with pytest.raises(ImageError, match="cannot be read"):
        read_image(path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("shape", [(20, 41), (9, 30, 3), (3, 5, 2), (1, 1)])
@pytest.mark.parametrize("deviation", [0.8, 1.5, 6.0])
def test_pictures_are_smoothed_as_by_scipy(shape, deviation) -> None:
    picture = np.random.default_rng(0).standard_normal(shape).astype(np.float32)
    expected = ndimage.gaussian_filter(picture, (deviation, deviation, 0)[: len(shape)])
    np.testing.assert_allclose(blurred(picture, deviation), expected, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("shape", [(0, 3), (7, 3), (4, 5, 3)])
def test_the_brightest_channel_is_the_largest(shape) -> None:
    values = np.random.default_rng(0).standard_normal(shape).astype(np.float32)
    assert np.array_equal(brightest_channel(values), values.max(-1))


HEIGHT, WIDTH = 40, 60
COLOR = np.array([0.3, 0.2, 0.1], np.float32)


def hole() -> np.ndarray:
    """Return what is known: all but a block."""
    known = np.ones((HEIGHT, WIDTH), np.bool_)
    known[12:28, 20:40] = False
    return known


def test_what_is_known_stays_and_the_rest_is_between_it() -> None:
    """A slope goes on."""
    known = hole()
    for image in (np.random.default_rng(1).uniform(0.2, 0.8, (HEIGHT, WIDTH, 3)), np.linspace(0, 1, WIDTH)[:, None]):
        whole = np.broadcast_to(image, (HEIGHT, WIDTH, 3)).astype(np.float32)
        spoilt = np.where(known[..., None], whole, 100).astype(np.float32)
        continued = push_pull(spoilt, known.astype(np.float32))
        assert (continued[known] == whole[known]).all()
        assert whole.min() <= continued.min() <= continued.max() <= whole.max()
    assert np.abs(continued - whole)[~known].mean() < 0.02
    assert (np.diff(continued[20, 20:40, 0]) > -0.02).all()


def test_what_most_of_a_square_shows_is_its_median() -> None:
    known = ndimage.gaussian_filter(np.random.default_rng(0).random((40, 60)), 2) > 0.5
    smooth = ndimage.median_filter(known.astype(np.uint8), 7) > 0
    islands, count = ndimage.label(smooth)
    large = [n for n in range(1, count + 1) if (islands == n).mean() > 0.01]
    assert np.array_equal(in_one_piece(known), np.isin(islands, large))


def bricks(deviation: float) -> np.ndarray:
    """A wall of one color, whose bricks of 16 x 16 pixels are brighter and darker."""
    light = 1 + deviation * np.random.default_rng(4).standard_normal((8, 14, 1))
    return (np.kron(light, np.ones((16, 16, 1))) * COLOR).astype(np.float32)


def column(width: int, shape: tuple[int, ...]) -> np.ndarray:
    """All but a column in the middle is known."""
    known = np.ones(shape[:2], np.bool_)
    known[:, (shape[1] - width) // 2 : (shape[1] + width) // 2] = False
    return known


def test_errors_are_along_the_walls_color_and_as_large_as_behind_the_smoke() -> None:
    wall = bricks(0.15)
    known = column(32, wall.shape)
    variances, axes = np.linalg.eigh(continuation_errors(wall, known))
    assert abs(axes[:, 2] @ COLOR) > 0.999 * np.linalg.norm(COLOR)
    assert np.sqrt(variances[2]) == pytest.approx(0.15 * np.linalg.norm(COLOR), rel=0.5)
    assert variances[1] < 1e-3 * variances[2]
    # what is hidden has no part in it
    wall[~known] = 0.9
    np.testing.assert_array_equal(continuation_errors(wall, known), continuation_errors(wall * known[..., None], known))


def test_a_patch_counts_if_it_borders_on_more_that_is_known() -> None:
    known = hole()
    grown = known.copy()
    grown[12:15, 20:40] = True  # along the upper rim
    grown[20:23, 28:31] = True  # amid the unknown
    kept = mostly_beside(grown, known)
    assert kept[12:15, 20:40].all()
    assert not kept[20:23, 28:31].any()
    assert kept[known].all()
