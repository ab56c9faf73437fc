"""Cycles' picture of a result beside the clip: ``python -m benchmarks.blender.beside_the_clip OUT SCENE ...``.

A SCENE is a folder of `benchmarks.truth.picture` whose clip shows its smoke in a sun, before one colour, or one of
`benchmarks.background.flames` with fire. Camera, box, sun, medium and background are given to Blender as far as its
scene file has them; the rest is done by the add-on's own buttons. In OUT stay the takes, and every compared frame: the
clip, Cycles, the engine and the difference. Needs bpy.

The table has decibels of displayed values where the clip's smoke covers more than 1 % (its fire adds more than 5 %): of
Cycles against the clip, with one scattering in Cycles, of the engine's own picture of the same smoke, and of Cycles
against that. The product of the differences of two renders with other noise keeps noise out of the error.
Brightness is the mean of Cycles' picture there over the clip's; of fire that of linear red, green and blue, and also
the engine's.
"""

from __future__ import annotations

import argparse
import math
import sys
import tomllib
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

import addon
from addon import volume
from addon.take import takes
from smokelift.footage.clip import Clip
from smokelift.footage.images import linear_to_srgb, read_image, srgb_to_linear
from smokelift.output.images import write_image
from smokelift.output.sequence import Sequence
from smokelift.scene import Scene
from tests.example_shot import add, add_box, add_camera, smoke

SAMPLES = 32
THIN = 0.99
"""Transmittance from which on a pixel shows no smoke."""

BURNING = 0.05
"""Linear red that fire adds to a pixel that shows it."""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("scenes", type=Path, nargs="+")
    parser.add_argument("--frames", type=int, nargs="+", default=[2], help="of the clip, from 1")
    parser.add_argument("--samples", type=int, default=SAMPLES, help="a pixel of each of the two renders")
    parser.add_argument("--march", action="store_true", help="through the volume: faster, too dark in thick smoke")
    options = parser.parse_args()
    rows = ["| clip | frame | bounces | Cycles | one scattering | engine | Cycles to engine | brightness |"]
    rows.append("|---|---|---|---|---|---|---|---|")
    for folder in options.scenes:
        rows += compared(folder.absolute(), options.out.absolute() / folder.name, options)
    print("\n".join(rows))


def compared(folder: Path, out: Path, options: argparse.Namespace) -> list[str]:
    """The rows of a scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon.register()
    scene = shot(folder, out)
    if not volume.shown_take(smoke(scene)):
        assert bpy.ops.smokelift.run() == {"FINISHED"}
    assert bpy.ops.smokelift.set_up() == {"FINISHED"}
    scene.cycles.samples, scene.cycles.use_denoising = options.samples, False
    if hasattr(scene.cycles, "volume_biased"):
        scene.cycles.volume_biased = options.march
    take = volume.shown_take(smoke(scene))
    assert take is not None
    sequence = Sequence.open(take.directory)
    with np.load(folder / "front.npz") as file:
        burns = "fire" in file
        there = file["fire"][..., 0] > BURNING if burns else file["transmittance"] < THIN
    rows = []
    for frame in options.frames:
        clip = filmed(sequence, frame)
        cycles = [rendered(scene, frame, seed, out) for seed in (0, 1)]
        bounces, scene.cycles.volume_bounces = scene.cycles.volume_bounces, 0
        once = [rendered(scene, frame, seed, out) for seed in (0, 1)]
        scene.cycles.volume_bounces = bounces
        own = linear_to_srgb(sequence.render(frame))
        inside = there[frame - 1]
        figures = [
            decibels(cycles, clip, inside),
            decibels(once, clip, inside),
            decibels([own, own], clip, inside),
            decibels(cycles, own, inside),
        ]
        mean = np.mean(cycles, 0)
        if burns:
            shown = " / ".join(colours(pictures, clip, inside) for pictures in (cycles, [own]))
        else:
            shown = f"{float(mean[inside].mean() / clip[inside].mean()):.3f}"
        cells = [folder.name, str(frame), str(bounces), *(f"{value:.1f}" for value in figures), shown]
        rows.append(f"| {' | '.join(cells)} |")
        print(rows[-1], file=sys.stderr, flush=True)
        beside = np.concatenate([clip, mean, own, 0.5 + (mean - clip)], 1)
        write_image(out / f"beside_{frame:04d}.png", srgb_to_linear(np.clip(beside, 0, 1)))
    addon.unregister()
    return rows


def shot(folder: Path, out: Path) -> bpy.types.Scene:
    """A Blender scene with what the scene file says; the smoke that OUT holds already is shown."""
    tables = tomllib.loads((folder / "scene.toml").read_text())
    scene = bpy.context.scene
    world = scene.world = bpy.data.worlds.new("World")
    if world.node_tree is None:
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    table = tables["camera"]
    camera = add_camera(scene, (0.0, 0.0, 0.0))
    camera.matrix_world = Matrix(table["matrix"])
    camera.data.sensor_fit = "VERTICAL"
    camera.data.lens = camera.data.sensor_height * Scene.load(folder / "scene.toml").camera.fy / table["size"][1]
    for light in tables.get("lights", ()):
        sun = add(scene, "Sun", bpy.data.lights.new("Sun", "SUN"))
        sun.data.energy = light["irradiance"][0]
        sun.rotation_euler = Vector(light["direction"]).to_track_quat("-Z", "Y").to_euler()
    obj = smoke(scene)
    settings = obj.smokelift
    settings.clip = bpy.data.movieclips.load(str(folder / tables["clip"]["path"].replace("####", "0001")))
    settings.fps = tables["clip"]["fps"]
    settings.box = add_box(scene, tables["domain"]["min"], tables["domain"]["max"])
    settings.use_medium = "medium" in tables
    settings.light_mode = "SCENE" if "lights" in tables else "ESTIMATE"
    out.mkdir(parents=True, exist_ok=True)
    plate = np.broadcast_to(np.float32(tables["background"]["color"]), (*table["size"][::-1], 3))
    write_image(out / "plate.png", plate)
    settings.plate_mode, settings.plate = "FILE", str(out / "plate.png")
    for name, value in tables.get("medium", {}).items():
        setattr(settings, name, value)
    settings.quality, settings.output = "balanced", str(out)
    scene.render.resolution_x, scene.render.resolution_y = table["size"]
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = obj
    for take in takes(out):
        volume.show(obj, take)
    return scene


def filmed(sequence: Sequence, frame: int) -> Any:
    """A frame of the clip, as displayed."""
    with Clip.open(sequence.scene.clip) as clip:
        return linear_to_srgb(clip.frame(frame - 1))


def rendered(scene: bpy.types.Scene, frame: int, seed: int, out: Path) -> Any:
    """A frame as Cycles shows it."""
    scene.frame_set(frame)
    scene.cycles.seed = seed
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "PNG", "16"
    scene.render.filepath = str(out / "render.png")
    bpy.ops.render.render(write_still=True)
    return linear_to_srgb(read_image(out / "render.png"))


def colours(pictures: list[Any], wanted: Any, inside: Any) -> str:
    """Mean linear red, green and blue of displayed pictures over that of another."""
    light = np.mean([srgb_to_linear(picture[inside]) for picture in pictures], (0, 1))
    return ", ".join(f"{share:.2f}" for share in light / srgb_to_linear(wanted[inside]).mean(0))


def decibels(pair: list[Any], wanted: Any, inside: Any) -> float:
    """Decibels of displayed values, without the noise of a pair of pictures."""
    one, other = (picture[inside] - wanted[inside] for picture in pair)
    return -10 * math.log10(max(float(np.mean(one * other)), 1e-9))


if __name__ == "__main__":
    main()
