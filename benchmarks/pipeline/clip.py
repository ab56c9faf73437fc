"""The built-in clip: smoke whose motion is a formula, pictured by Smokelift's renderer.

It serves for timing only: accuracy has to be measured on pictures from another renderer.
"""

from dataclasses import replace
from pathlib import Path

from benchmarks.velocity.flow import built_in_densities
from smokelift.output.images import write_image
from smokelift.render import render
from smokelift.scene import Background, Camera, ClipSource, DirectionalLight, Domain, Medium, Scene

SHAPE = (64, 64, 96)
"""Voxels of the pictured smoke; the grid that is timed may be another."""

PIXELS = (512, 768)
"""Columns and rows of the pictures: at least two pixels per voxel of the paper's finest grid."""

HEIGHT = 3.0
"""Longest side of the box (m)."""


def write_clip(
    folder: Path,
    frames: int,
    extent: float = 1.0,
    pixels: tuple[int, int] = PIXELS,
    shape: tuple[int, int, int] = SHAPE,
) -> Scene:
    """Write some frames into a folder, and return their scene.

    Parameters
    ----------
    folder
        It exists.
    frames
        How many.
    extent
        Length of the smoke along each side of the box, in fractions of the usual. Smaller smoke is as opaque.
    pixels, shape
        Of the pictures, and voxels of the pictured smoke.
    """
    scene = Scene(
        clip=ClipSource(folder / "frame_####.exr", fps=24.0),
        camera=Camera.look_at((0.0, -7.0, 0.0), (0.0, 0.0, 0.0), fov_y_degrees=30, size=pixels),
        domain=_box(shape, extent * HEIGHT),
        medium=Medium(extinction=5.0 / extent, albedo=0.9),
        lights=(DirectionalLight((0.5, 0.5, -0.7), (8.0, 8.0, 8.0)),),
        background=Background(color=(0.0, 0.0, 0.0)),
    )
    for number, density in enumerate(built_in_densities(shape, 0, frames), 1):
        write_image(folder / f"frame_{number:04d}.exr", render(density, scene))
    return scene


def with_grid(scene: Scene, shape: tuple[int, int, int]) -> Scene:
    """Return the scene with a box of other voxels, with the same middle and height."""
    return replace(scene, domain=_box(shape, HEIGHT))


def _box(shape: tuple[int, int, int], height: float) -> Domain:
    voxel = height / max(shape)
    x, y, z = (n * voxel / 2 for n in shape)
    return Domain((-x, -y, -z), (x, y, z), shape)
