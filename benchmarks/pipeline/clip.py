"""The built-in clip: smoke whose motion is a formula, pictured by our own renderer.

It is there to be timed. How right a result is has to be judged on pictures that we did not make.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from benchmarks.velocity.flow import built_in_densities
from smokelift.output.images import write_image
from smokelift.render import render
from smokelift.scene import Background, Camera, ClipSource, DirectionalLight, Domain, Medium, Scene

SHAPE = (64, 64, 96)
"""Voxels of the smoke that is pictured, whatever grid is timed."""

PIXELS = (512, 768)
"""Of the pictures: two and more a voxel of the paper's finest grid."""

HEIGHT = 3.0
"""Metres of the longest side of the box."""


def write_clip(folder: Path, frames: int) -> Scene:
    """Write so many frames into a folder; returns their scene."""
    scene = Scene(
        clip=ClipSource(folder / "frame_####.exr", fps=24.0),
        camera=Camera.look_at((0.0, -7.0, 0.0), (0.0, 0.0, 0.0), fov_y_degrees=30, size=PIXELS),
        domain=_box(SHAPE),
        medium=Medium(extinction=5.0, albedo=0.9),
        lights=(DirectionalLight((0.5, 0.5, -0.7), (8.0, 8.0, 8.0)),),
        background=Background(color=(0.0, 0.0, 0.0)),
    )
    for number, density in enumerate(built_in_densities(SHAPE, 0, frames), 1):
        write_image(folder / f"frame_{number:04d}.exr", render(density, scene))
    return scene


def with_grid(scene: Scene, shape: tuple[int, int, int]) -> Scene:
    """The scene with a box of so many voxels about the same middle, as high as before."""
    return replace(scene, domain=_box(shape))


def _box(shape: tuple[int, int, int]) -> Domain:
    voxel = HEIGHT / max(shape)
    x, y, z = (n * voxel / 2 for n in shape)
    return Domain((-x, -y, -z), (x, y, z), shape)
