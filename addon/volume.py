"""The result: a Volume object that plays the sequence, with a material that has the smoke's own optics."""

import math
from pathlib import Path
from typing import Any

import bpy
from bpy.app.handlers import persistent
from mathutils import Vector

from .scene import frame_rate, turned_world
from .take import Take

SHADER = "Smokelift"
"""Name of the node that holds the fitted values; another material, or another node, is the user's own."""


def show(scene: bpy.types.Scene, take: Take) -> bpy.types.Object | None:
    """Show a take's finished frames, in the object that shows this scene's smoke if there is one already.

    Returns
    -------
    The Volume object, or None while no frame is finished.
    """
    index = take.index()
    if not index or not index["frames"]:
        return None
    thing = _object(scene)
    if shown_take(scene) != take:
        thing.delta_location = (0.0, 0.0, 0.0)
        thing.matrix_world = turned_world(scene)
    _settle(thing, index["scene"]["domain"])
    _play(thing.data, scene, take, index)
    _shade(thing.data, index["scene"]["medium"])
    return thing


def shown_take(scene: bpy.types.Scene) -> Take | None:
    """The take that the scene's smoke is made of."""
    thing = scene.smokelift.volume
    if thing is None or thing.type != "VOLUME" or not thing.data.filepath:
        return None
    return Take(_absolute(thing.data).parent)


def _absolute(volume: bpy.types.Volume) -> Path:
    return Path(bpy.path.abspath(volume.filepath, library=volume.library))


def _object(scene: bpy.types.Scene) -> bpy.types.Object:
    thing = scene.smokelift.volume
    if thing is None or thing.type != "VOLUME" or thing.name not in scene.objects:
        name = f"Smoke {scene.smokelift.clip.name}" if scene.smokelift.clip else "Smoke"
        thing = bpy.data.objects.new(name, bpy.data.volumes.new(name))
        scene.collection.objects.link(thing)
        scene.smokelift.volume = thing
    return thing


@persistent
def settle_all(_file: str = "") -> None:
    """Put the smoke of every scene to where this Blender needs it, after another one saved the file."""
    for scene in bpy.data.scenes:
        take = shown_take(scene)
        index = take.index() if take is not None else None
        if index is not None:
            _settle(scene.smokelift.volume, index["scene"]["domain"])


def _settle(thing: bpy.types.Object, domain: dict[str, Any]) -> None:
    """Make up for Cycles, which before 5.0 renders every grid half a voxel too far along all its axes."""
    voxel = (domain["max"][0] - domain["min"][0]) / domain["resolution"][0]
    shift = Vector([-voxel / 2] * 3) if bpy.app.version < (5, 0, 0) else Vector()
    thing.delta_location = thing.matrix_basis.to_quaternion() @ shift


def _play(volume: bpy.types.Volume, scene: bpy.types.Scene, take: Take, index: dict[str, Any]) -> None:
    numbers = sorted(int(number) for number in index["frames"])
    path = str(take.directory / f"smoke_{numbers[0]:04d}.vdb")
    if bpy.data.filepath:
        path = _relative(path)
    if volume.filepath != path:
        volume.filepath = path
    volume.is_sequence = True
    volume.sequence_mode = "CLIP"
    clip_rate, scene_rate = index["scene"]["clip"]["fps"], frame_rate(scene)
    ratio = scene_rate / clip_rate
    # a camera that moves was read frame by frame, as Blender plays clips, and the smoke has to stay in step with it
    tracked = "matrices" in index["scene"].get("camera", {})
    real = scene.smokelift.speed == "REAL" and not tracked and not math.isclose(ratio, 1.0, rel_tol=1e-3)
    clip = scene.smokelift.clip
    before = scene.smokelift.first - 1
    start = (clip.frame_start if clip else 1) + (round(before * ratio) if real else before)
    volume.frame_start = start
    volume.frame_offset = numbers[0] - 1
    volume.frame_duration = math.ceil(len(numbers) * ratio) if real else len(numbers)
    volume.driver_remove("frame_offset")
    if real:
        # Blender shows one file a frame; the offset says which it is instead
        driver = volume.driver_add("frame_offset").driver
        driver.type = "SCRIPTED"
        driver.expression = f"floor((frame - {start} + 0.001) / {ratio:.9g}) - (frame - {start}) + {numbers[0] - 1}"
    if volume.velocity_grid != "velocity":  # Blender's default, and setting it again makes it complain
        volume.velocity_grid = "velocity"
    volume.velocity_unit = "SECOND"
    volume.velocity_scale = 1.0 if real else ratio
    volume.render.clipping = 0.0
    volume.display.density = index["scene"]["medium"]["extinction"]  # as thick in the viewport as in a render


def _relative(path: str) -> str:
    try:
        return bpy.path.relpath(path)
    except ValueError:  # on another drive
        return path


def _shade(volume: bpy.types.Volume, medium: dict[str, float]) -> None:
    material = volume.materials[0] if volume.materials else None
    if material is None:
        material = _material(volume.name)
        volume.materials.clear()
        volume.materials.append(material)
    shader = material.node_tree.nodes.get(SHADER) if material.node_tree else None
    if shader is None:
        return  # the user's own material
    shader.inputs["Density"].default_value = medium["extinction"]
    shader.inputs["Color"].default_value = (*[medium["albedo"]] * 3, 1.0)
    shader.inputs["Anisotropy"].default_value = medium["anisotropy"]


def _material(name: str) -> bpy.types.Material:
    """Scattering is density x extinction x albedo; what is left of the extinction is absorbed."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # since 5.0 there always is one
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    shader = tree.nodes.new("ShaderNodeVolumePrincipled")
    shader.name = shader.label = SHADER
    shader.location = (-300.0, 0.0)
    shader.inputs["Density Attribute"].default_value = "density"
    shader.inputs["Absorption Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    tree.links.new(shader.outputs["Volume"], output.inputs["Volume"])
    return material


def register() -> None:
    """Look after files that are loaded."""
    bpy.app.handlers.load_post.append(settle_all)


def unregister() -> None:
    """Leave them alone."""
    bpy.app.handlers.load_post.remove(settle_all)
