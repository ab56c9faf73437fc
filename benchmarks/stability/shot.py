"""A shot of a few pixels, whose files a campaign damages: a video, pictures, a plate, a sequence finished and begun."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from smokelift import Background, Camera, Clip, ClipSource, DirectionalLight, Domain, Medium, Scene, Settings
from smokelift.checks import Array
from smokelift.output.images import write_image, write_video
from smokelift.pipeline import Frame, reconstruct
from smokelift.render import render

FRAMES = 3


@dataclass(frozen=True)
class TinyShot:
    """Folders with a scene file each, or a sequence.

    Attributes
    ----------
    video, pictures
        ``scene.toml`` with ``clip.mp4``; with ``frame_0000.png`` and so on and ``plate.exr``.
    painted
        ``scene.toml`` with pictures before ``plate.exr``, which has tiles, with ``mask.png`` and ``strokes.png``.
    finished, filmed, begun
        A sequence with NumPy twins in ``out``, beside the scene file and the clip: of the pictures; of the video; of
        the pictures, with its first two frames.
    """

    video: Path
    pictures: Path
    painted: Path
    finished: Path
    filmed: Path
    begun: Path


def tiny_shot(folder: Path) -> TinyShot:
    """Make the shot in a folder."""
    folder = folder.absolute()
    shot = TinyShot(*(folder / name for name in ("video", "pictures", "painted", "finished", "filmed", "begun")))
    scene = Scene(
        camera=Camera.look_at((0, -4, 0.8), (0, 0, 0.8), fov_y_degrees=27, size=(24, 32)),
        domain=Domain((-0.6, -0.6, 0), (0.6, 0.6, 1.6), (12, 12, 16)),
        medium=Medium(extinction=8.0),
        lights=(DirectionalLight((0.3, 0.5, -0.8), (12.0, 11.0, 10.0)),),
    )
    x, y, z = np.meshgrid(*(np.linspace(-1, 1, n) for n in (12, 12, 16)), indexing="ij")
    densities = [
        np.maximum(np.exp(-6 * (x**2 + y**2 + (z + 0.4 - 0.2 * n) ** 2)) - 0.1, 0).astype(np.float32)
        for n in range(FRAMES)
    ]
    images = [render(density, replace(scene, background=Background(color=(0, 0, 0)))) for density in densities]
    _paint(shot.painted, scene, densities)
    for place in (shot.video, shot.pictures, shot.finished, shot.filmed, shot.begun):
        place.mkdir(parents=True)
        if place in (shot.video, shot.filmed):
            write_video(place / "clip.mp4", images, 24)
            known = replace(scene, clip=ClipSource(place / "clip.mp4"), background=Background(color=(0, 0, 0)))
        else:
            for number, image in enumerate(images):
                write_image(place / f"frame_{number:04d}.png", image)
            write_image(place / "plate.exr", np.zeros((32, 24, 3)))
            clip = ClipSource(place / "frame_####.png", fps=24.0)
            known = replace(scene, clip=clip, background=Background(image=place / "plate.exr"))
        known.save(place / "scene.toml")
        if place in (shot.finished, shot.filmed, shot.begun):
            assert known.clip is not None
            with Clip.open(known.clip) as opened:
                run = reconstruct(opened, known, Settings.preset("draft"))
                with suppress(KeyboardInterrupt):
                    run.write(place / "out", npz=True, on_frame=_cancelled if place == shot.begun else None)
    return shot


def _paint(place: Path, scene: Scene, densities: Sequence[Array]) -> None:
    """Write the smoke before tiles, with a mask that hides nothing and a stroke over what is behind it."""
    place.mkdir(parents=True)
    plate = np.kron(np.random.default_rng(0).uniform(0.1, 0.6, (8, 6, 3)), np.ones((4, 4, 1)))
    write_image(place / "plate.exr", plate)
    behind = Background(image=place / "plate.exr")
    for number, density in enumerate(densities):
        write_image(place / f"frame_{number:04d}.png", render(density, replace(scene, background=behind)))
    write_image(place / "mask.png", np.ones((32, 24, 3)))
    strokes = np.zeros((32, 24, 3))
    strokes[2:6, 2:6, 2] = 1
    write_image(place / "strokes.png", strokes)
    clip = ClipSource(place / "frame_####.png", fps=24.0, mask=place / "mask.png")
    background = replace(behind, strokes=place / "strokes.png")
    replace(scene, clip=clip, background=background).save(place / "scene.toml")


def _cancelled(frame: Frame) -> None:
    """Interrupt a run before its last frame."""
    if frame.number == FRAMES - 1:
        raise KeyboardInterrupt
