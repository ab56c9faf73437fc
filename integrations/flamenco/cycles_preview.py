"""Renders some frames of a sequence with Cycles, from its own camera and under its own lights.

    blender --background --factory-startup --python cycles_preview.py -- SEQUENCE PICTURES [--frames N] [--samples N]

It needs nothing but Blender (4.2 or later). Lights other than suns are left to `Set Up Shot` of the extension: without
a sun the smoke is lit from everywhere.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path
from typing import Any

import bpy
from mathutils import Matrix, Vector


def main(words: list[str]) -> None:
    """Render."""
    parser = argparse.ArgumentParser(prog="cycles_preview")
    parser.add_argument("sequence", type=Path)
    parser.add_argument("pictures", type=Path)
    parser.add_argument("--frames", type=int, default=4)
    parser.add_argument("--samples", type=int, default=64)
    options = parser.parse_args(words)
    index = json.loads((options.sequence / "sequence.json").read_text(encoding="utf-8"))
    numbers = sorted(map(int, index["frames"]))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    add_smoke(scene, options.sequence.resolve(), index["scene"], numbers, index.get("start_number", 1))
    add_lights(scene, index["scene"].get("lights", []))
    camera = add_camera(scene, index["scene"]["camera"])
    scene.render.engine = "CYCLES"
    scene.cycles.samples = options.samples
    scene.cycles.volume_bounces = 4
    if hasattr(scene.cycles, "volume_biased"):  # null scattering begins late and is noisy
        scene.cycles.volume_biased = True
    scene.view_settings.view_transform = "Standard"
    for number in spread(numbers, options.frames):
        scene.frame_set(number)
        camera.matrix_world = pose(index["scene"]["camera"], number)
        scene.render.filepath = str(options.pictures.resolve() / f"frame_{number:04d}.png")
        bpy.ops.render.render(write_still=True)


def spread(numbers: list[int], count: int) -> list[int]:
    """So many of the numbers, evenly spread, the last one among them."""
    count = max(1, min(count, len(numbers)))
    return [numbers[round((n + 1) * len(numbers) / count) - 1] for n in range(count)]


def add_smoke(scene: bpy.types.Scene, folder: Path, described: dict[str, Any], numbers: list[int], start: int) -> None:
    """Add the sequence, whose frame 1 has a file of the number ``start``, with the optical properties of its medium."""
    volume = bpy.data.volumes.new("Smoke")
    volume.filepath = str(folder / f"smoke_{numbers[0] + start - 1:04d}.vdb")
    volume.is_sequence = True
    volume.frame_start, volume.frame_offset, volume.frame_duration = numbers[0], numbers[0] + start - 2, len(numbers)
    medium = described["medium"]
    material = bpy.data.materials.new("Smoke")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output, shader = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeVolumePrincipled")
    scale, density = nodes.new("ShaderNodeMath"), nodes.new("ShaderNodeAttribute")
    density.attribute_name = "density"
    scale.operation = "MULTIPLY"
    scale.inputs[1].default_value = medium["extinction"]
    shader.inputs["Color"].default_value = (*[medium["albedo"]] * 3, 1.0)
    shader.inputs["Anisotropy"].default_value = medium["anisotropy"]
    shader.inputs["Density Attribute"].default_value = ""
    links.new(density.outputs["Fac"], scale.inputs[0])
    links.new(scale.outputs[0], shader.inputs["Density"])
    links.new(shader.outputs[0], output.inputs["Volume"])
    volume.materials.append(material)
    obj = bpy.data.objects.new("Smoke", volume)
    if bpy.app.version < (5, 0, 0):  # Cycles renders every grid half a voxel too far along all its axes there
        domain = described["domain"]
        obj.location = Vector([(domain["min"][0] - domain["max"][0]) / domain["resolution"][0] / 2] * 3)
    scene.collection.objects.link(obj)


def add_lights(scene: bpy.types.Scene, lights: list[dict[str, Any]]) -> None:
    """Add the suns, or a white sky without any."""
    suns = [light for light in lights if light["type"] == "directional"]
    for light in suns:
        sun = bpy.data.lights.new("Sun", "SUN")
        strength = max(*light["irradiance"], 1e-9)
        sun.energy, sun.color = strength, [part / strength for part in light["irradiance"]]
        obj = bpy.data.objects.new("Sun", sun)
        obj.rotation_euler = Vector(light["direction"]).to_track_quat("-Z", "Y").to_euler()
        scene.collection.objects.link(obj)
    world = scene.world = bpy.data.worlds.new("World")
    world.use_nodes = True
    gray = 0.0 if suns else 1.0
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (gray, gray, gray, 1.0)


def add_camera(scene: bpy.types.Scene, described: dict[str, Any]) -> bpy.types.Object:
    """Add the camera of the clip."""
    data = bpy.data.cameras.new("Camera")
    width, height = described["size"]
    scene.render.resolution_x, scene.render.resolution_y = width, height
    data.sensor_fit = "VERTICAL"
    if described["type"] == "orthographic":
        data.type, data.ortho_scale = "ORTHO", described["height"]
    elif "fov_y_degrees" in described:
        data.angle_y = math.radians(described["fov_y_degrees"])
    else:
        data.angle_y = 2 * math.atan(height / 2 / described["fy"])
    camera = scene.camera = bpy.data.objects.new("Camera", data)
    scene.collection.objects.link(camera)
    return camera


def pose(described: dict[str, Any], number: int) -> Matrix:
    """Where the camera is in a frame."""
    poses = described.get("matrices")
    return Matrix(poses[min(number, len(poses)) - 1] if poses else described["matrix"])


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :])
