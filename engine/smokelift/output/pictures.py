"""Pictures to look at: a sequence seen from a camera, a contact sheet, a preview video."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Sequence as Many
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow
from PIL import ImageDraw

from smokelift.footage.background import background_picture, open_plates
from smokelift.footage.clip import Clip
from smokelift.footage.images import area_average, linear_to_srgb
from smokelift.output.files import atomic_path
from smokelift.output.sequence import Sequence
from smokelift.pipeline import Frame
from smokelift.render import Renderer, scene_renderer
from smokelift.render.renderer import Image, Volume
from smokelift.scene import Camera, completed, orbit
from smokelift.setup.shot import Shot

SHEET_ANGLES = (0, 20, 45, 90)
SHEET_ROWS = 5
PREVIEW_ANGLES = (0, 45)
TILE_HEIGHT = 320
PREVIEW_HEIGHT = 480

VIDEO_KINDS = {
    ".mp4": ("mp4", "libx264"),
    ".mov": ("mov", "libx264"),
    ".mkv": ("matroska", "libx264"),
    ".webm": ("webm", "libvpx-vp9"),
}
"""Container and codec of each suffix."""


class Viewer:
    """Renders the frames of a sequence from its scene's camera, or from another before the scene's mean background.

    Where nothing moves, one renderer serves all frames.

    Parameters
    ----------
    sequence
        What is seen.
    camera
        Another camera than the scene's own.
    turn
        Yaw and pitch (degrees) by which the camera of each frame is carried around the domain; see `orbit`.
    height
        Rows of the picture, if not the camera's.
    """

    def __init__(
        self,
        sequence: Sequence,
        camera: Camera | None = None,
        *,
        turn: tuple[float, float] = (0.0, 0.0),
        height: int | None = None,
    ) -> None:
        scene = sequence.scene
        own = camera is None and turn == (0.0, 0.0)
        camera = camera or scene.camera
        assert camera is not None
        self._camera = camera if height is None else camera.resized(*small_size(camera, height))
        self._sequence, self._turn = sequence, turn
        self._plates = open_plates(scene) if own else None
        # the picture of its background belongs to the scene's own camera
        self._background = background_picture(scene, None if own else self._at(0))
        self._changes = camera.moves or self._plates is not None
        self._renderers: dict[int, Renderer] = {}

    def image(self, number: int, density: Volume) -> Image:
        """The picture of a frame, numbered as in the sequence, with its density."""
        frame = number - 1 if self._changes else 0
        if frame not in self._renderers:
            self._renderers = {frame: self._renderer(frame)}
        return self._renderers[frame].image(density)

    def _renderer(self, frame: int) -> Renderer:
        scene, camera, background = self._sequence.scene, self._at(frame), self._background
        if self._plates is not None:
            background = self._plates.frame(frame + (scene.clip.first if scene.clip is not None else 0))
        if background.ndim == 3:
            background = area_average(background, *camera.size)
        known = replace(scene, scattering=self._sequence.settings["density"]["scattering"])
        return scene_renderer(completed(known), camera, background)

    def _at(self, frame: int) -> Camera:
        domain = self._sequence.scene.domain
        assert domain is not None
        camera = self._camera.at(frame)
        return camera if self._turn == (0.0, 0.0) else orbit(camera, domain, *self._turn)


def small_size(camera: Camera, height: int) -> tuple[int, int]:
    """Width and height of a camera's picture with so many rows."""
    return max(2, round(camera.size[0] * height / camera.size[1])), height


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
    viewers = [Viewer(sequence, turn=(angle, 0.0), height=TILE_HEIGHT) for angle in SHEET_ANGLES]
    rows = []
    for number in chosen or frames:
        density = sequence.density(number)
        tiles = [_input(clip, number, sequence, TILE_HEIGHT)]
        tiles += [viewer.image(number, density) for viewer in viewers]
        rows.append([eight_bit(tile) for tile in tiles])
    titles = ["input", *(f"{angle}\N{DEGREE SIGN}" for angle in SHEET_ANGLES)]
    titles[1] = "reconstruction"
    with atomic_path(path) as aside:
        sheet(rows, titles, [f"frame {number}" for number in chosen or frames]).save(aside, format="PNG")


def write_preview(path: Path, sequence: Sequence, clip: Clip) -> None:
    """The input beside the reconstruction from the front and from 45 degrees, as a video."""
    viewers = [Viewer(sequence, turn=(angle, 0.0), height=PREVIEW_HEIGHT) for angle in PREVIEW_ANGLES]

    def frames() -> Iterable[Image]:
        for number in sequence.frames:
            density = sequence.density(number)
            views = [viewer.image(number, density) for viewer in viewers]
            yield np.concatenate([_input(clip, number, sequence, PREVIEW_HEIGHT), *views], 1)

    write_video(path, frames(), clip.fps)


def write_thumbnail(path: Path, clip: Clip, shot: Shot, frame: Frame) -> None:
    """The part of a frame that the grid is fitted to, beside its reconstruction (or above, if wide), as a PNG."""
    now = shot.at(frame.number - 1)
    if now is None:  # nothing of the domain is in this frame's picture: the picture of the last one stays
        return
    seen = now.working.cut(clip.frame(frame.number - 1))
    scene = completed(replace(now.small_scene, scattering=now.scattering))
    renderer = scene_renderer(scene, background=now.plate.image)
    wide = seen.shape[1] > seen.shape[0]
    both = eight_bit(np.concatenate([seen, renderer.image(frame.density)], 0 if wide else 1))
    with atomic_path(path) as aside:
        Pillow.fromarray(both).save(aside, format="PNG")


def _input(clip: Clip, number: int, sequence: Sequence, height: int) -> Image:
    assert sequence.scene.camera is not None
    return area_average(clip.frame(number - 1), *small_size(sequence.scene.camera, height))


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
