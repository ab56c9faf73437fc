"""Pictures to look at: a sequence seen from a camera, a contact sheet, a preview video."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Sequence as Many
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow
from PIL import ImageDraw

from smokelift.cameras import orbit
from smokelift.clip import Clip
from smokelift.files import atomic_path
from smokelift.images import area_average, linear_to_srgb
from smokelift.reconstruct import Frame
from smokelift.render import Renderer, scene_background, scene_renderer
from smokelift.render.renderer import Image
from smokelift.scene import Camera
from smokelift.sequence import Sequence
from smokelift.shot import Shot

SHEET_ANGLES = (0, 20, 45, 90)
SHEET_ROWS = 5
TILE_HEIGHT = 320
PREVIEW_HEIGHT = 480

VIDEO_KINDS = {
    ".mp4": ("mp4", "libx264"),
    ".mov": ("mov", "libx264"),
    ".mkv": ("matroska", "libx264"),
    ".webm": ("webm", "libvpx-vp9"),
}
"""Container and codec of each suffix."""


def sequence_renderer(sequence: Sequence, camera: Camera | None = None, background: Image | None = None) -> Renderer:
    """The renderer of a sequence's own scene, or of another camera before the scene's mean background."""
    return scene_renderer(sequence.scene, camera, sequence.settings["density"]["scattering"], background)


def eight_bit(image: Image) -> NDArray[np.uint8]:
    """Linear radiance as 8 bit sRGB."""
    return np.asarray(np.rint(255 * linear_to_srgb(np.clip(image, 0, 1))), np.uint8)


def write_video(path: Path, frames: Iterable[Image], fps: float) -> None:
    """Write linear frames (rows, columns, 3) of one size as a video of the kind that the suffix says."""
    container_format, codec = VIDEO_KINDS[path.suffix.lower()]
    with atomic_path(path) as aside, av.open(str(aside), "w", format=container_format) as container:
        stream: Any = None
        for frame in frames:
            picture = eight_bit(frame)
            picture = picture[: picture.shape[0] // 2 * 2, : picture.shape[1] // 2 * 2]  # codecs want even sides
            if stream is None:
                stream = container.add_stream(codec, rate=Fraction(fps).limit_denominator(1001))
                stream.height, stream.width = picture.shape[:2]
                stream.pix_fmt = "yuv420p"
                stream.options = {"crf": "18"}
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        if stream is not None:
            container.mux(stream.encode())


def write_contact_sheet(path: Path, sequence: Sequence, clip: Clip) -> None:
    """Input, reconstruction and turned views of some frames, side by side."""
    frames = sequence.frames
    chosen = [frames[i] for i in np.unique(np.linspace(0, len(frames) - 1, SHEET_ROWS + 2).round().astype(int))[1:-1]]
    renderers = _turned(sequence, TILE_HEIGHT)
    rows = []
    for number in chosen or frames:
        density = sequence.density(number)
        tiles = [_fitted(clip.frame(number - 1), renderers[0].camera)]
        tiles += [renderer.image(density) for renderer in renderers]
        rows.append([eight_bit(tile) for tile in tiles])
    titles = ["input", *(f"{angle}\N{DEGREE SIGN}" for angle in SHEET_ANGLES)]
    titles[1] = "reconstruction"
    with atomic_path(path) as aside:
        sheet(rows, titles, [f"frame {number}" for number in chosen or frames]).save(aside, format="PNG")


def write_preview(path: Path, sequence: Sequence, clip: Clip) -> None:
    """The input beside the reconstruction from the front and from 45 degrees, as a video."""
    front, _, turned, _ = _turned(sequence, PREVIEW_HEIGHT)

    def frames() -> Iterable[Image]:
        for number in sequence.frames:
            density = sequence.density(number)
            yield np.concatenate(
                [_fitted(clip.frame(number - 1), front.camera), front.image(density), turned.image(density)], 1
            )

    write_video(path, frames(), clip.fps)


def write_thumbnail(path: Path, clip: Clip, shot: Shot, frame: Frame) -> None:
    """The part of a frame that the grid is fitted to, beside its reconstruction (or above, if wide), as a PNG."""
    seen = shot.working.cut(clip.frame(frame.number - 1))
    renderer = scene_renderer(shot.small_scene, None, shot.scattering, shot.plate.image)
    wide = seen.shape[1] > seen.shape[0]
    both = eight_bit(np.concatenate([seen, renderer.image(frame.density)], 0 if wide else 1))
    with atomic_path(path) as aside:
        Pillow.fromarray(both).save(aside, format="PNG")


def _turned(sequence: Sequence, height: int) -> list[Renderer]:
    """Renderers of small pictures from the front and from the sheet's other angles."""
    scene = sequence.scene
    assert scene.camera is not None and scene.domain is not None
    width = max(2, round(scene.camera.size[0] * height / scene.camera.size[1]))
    small = scene.camera.resized(width, height)
    behind = scene_background(scene)
    front = sequence_renderer(sequence, small, area_average(behind, width, height) if behind.ndim == 3 else behind)
    turned = [orbit(small, scene.domain, angle) for angle in SHEET_ANGLES if angle]
    return [front, *(sequence_renderer(sequence, camera) for camera in turned)]


def _fitted(frame: Image, camera: Camera) -> Image:
    return area_average(frame, *camera.size)


def sheet(rows: Many[Many[NDArray[np.uint8]]], titles: Many[str], labels: Many[str]) -> Pillow.Image:
    """Rows of tiles of one height, as wide as those in their column, with titles above and a label over each row."""
    gap, line = 4, 16
    height = rows[0][0].shape[0]
    lefts = gap + np.cumsum([0, *(tile.shape[1] + gap for tile in rows[0])])
    whole = Pillow.new("RGB", (int(lefts[-1]), line + len(rows) * (height + line + gap)), (32, 32, 32))
    draw = ImageDraw.Draw(whole)
    for title, left in zip(titles, lefts, strict=False):
        draw.text((left, 2), title, fill=(230, 230, 230))
    for row, (tiles, label) in enumerate(zip(rows, labels, strict=True)):
        top = line + row * (height + line + gap)
        draw.text((gap, top + 2), label, fill=(170, 170, 170))
        for tile, left in zip(tiles, lefts, strict=False):
            whole.paste(Pillow.fromarray(tile), (int(left), top + line))
    return whole
