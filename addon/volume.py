"""The result: a Volume object that plays the sequence, with a material of the smoke's optical properties."""

import math
from typing import Any

import bpy
from bpy.app.handlers import persistent
from mathutils import Vector

from .contract import FRAME_FILE, MADE_UP
from .kept import set_unless_changed
from .paths import absolute, relative
from .scene_file import engine_to_world, frame_rate
from .take import Take

SHADER = "Smokelift"
"""Name of the shader node that holds the fitted values; a material without it is the user's own."""

PROVENANCE = "smokelift_provenance"
"""Custom property of the Volume that says what of the smoke is measured, also where its files are not at hand."""


def show(scene: bpy.types.Scene, take: Take) -> bpy.types.Object | None:
    """Show a take's finished frames in the scene's Volume object, which is made if there is none.

    What the artist changed of its place and material stays.

    Returns
    -------
    The Volume object, or None while no frame is finished.
    """
    index = take.index()
    if not index or not index["frames"]:
        return None
    obj = _object(scene)
    if shown_take(scene) != take:
        obj.delta_location = (0.0, 0.0, 0.0)
        set_unless_changed(obj, "place", obj, "matrix_basis", engine_to_world(scene))
    _correct_position(obj, index["scene"]["domain"])
    _set_sequence(obj.data, scene, take, index)
    _set_material(obj.data, index["scene"]["medium"])
    obj.data[PROVENANCE] = _provenance(index.get("provenance", []))
    return obj


def shown_take(scene: bpy.types.Scene) -> Take | None:
    """The take on show in the scene."""
    obj = scene.smokelift.volume
    if obj is None or obj.type != "VOLUME" or not obj.data.filepath:
        return None
    return take_of(obj.data)


def take_of(volume: bpy.types.Volume) -> Take:
    """The take that a Volume with a file plays."""
    return Take(absolute(volume.filepath, volume.library).parent)


def provenance_note(scene: bpy.types.Scene) -> str:
    """What of the smoke on show is measured and what is not, as a line for the panel; empty if that is unknown."""
    obj = scene.smokelift.volume
    return "" if obj is None or obj.type != "VOLUME" else obj.data.get(PROVENANCE, "")


def _provenance(parts: list[dict[str, Any]]) -> str:
    if not parts:  # the engine of earlier versions did not say
        return ""
    for part in parts:
        if part["origin"] == MADE_UP:
            detail, seed = part["settings"]["detail"], part["settings"]["seed"]
            return f"The camera's view is measured. Depth detail {detail:.2g} is made up: variation {seed}."
    return "The camera's view is measured. Nothing is made up: the depth is smooth."


def _object(scene: bpy.types.Scene) -> bpy.types.Object:
    obj = scene.smokelift.volume
    if obj is None or obj.type != "VOLUME" or obj.name not in scene.objects:
        name = f"Smoke {scene.smokelift.clip.name}" if scene.smokelift.clip else "Smoke"
        obj = bpy.data.objects.new(name, bpy.data.volumes.new(name))
        scene.collection.objects.link(obj)
        scene.smokelift.volume = obj
    return obj


@persistent
def correct_positions(_file: str = "") -> None:
    """Correct the smoke of every scene, since another version of Blender may have saved the file."""
    for scene in bpy.data.scenes:
        take = shown_take(scene)
        index = take.index() if take is not None else None
        if index is not None:
            _correct_position(scene.smokelift.volume, index["scene"]["domain"])


def _correct_position(obj: bpy.types.Object, domain: dict[str, Any]) -> None:
    """Compensate for Cycles, which before 5.0 renders every grid half a voxel too far along all its axes."""
    voxel = (domain["max"][0] - domain["min"][0]) / domain["resolution"][0]
    shift = Vector([-voxel / 2] * 3) if bpy.app.version < (5, 0, 0) else Vector()
    obj.delta_location = obj.matrix_basis.to_quaternion() @ shift


def _set_sequence(volume: bpy.types.Volume, scene: bpy.types.Scene, take: Take, index: dict[str, Any]) -> None:
    numbers = sorted(int(number) for number in index["frames"])
    path = relative(take.directory / FRAME_FILE.format(numbers[0]))
    if volume.filepath != path:
        volume.filepath = path
    volume.is_sequence = True
    volume.sequence_mode = "CLIP"
    clip_rate, scene_rate = index["scene"]["clip"]["fps"], frame_rate(scene)
    ratio = scene_rate / clip_rate
    # the smoke keeps step with a moving camera, which has one matrix for each frame of the clip
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
        # Blender shows one file in each frame of the scene; the driven offset selects another
        driver = volume.driver_add("frame_offset").driver
        driver.type = "SCRIPTED"
        driver.expression = f"floor((frame - {start} + 0.001) / {ratio:.9g}) - (frame - {start}) + {numbers[0] - 1}"
    if volume.velocity_grid != "velocity":  # Blender complains if the default is set again
        volume.velocity_grid = "velocity"
    volume.velocity_unit = "SECOND"
    volume.velocity_scale = 1.0 if real else ratio
    set_unless_changed(volume, "clipping", volume.render, "clipping", 0.0)
    # the viewport shows the render's optical depth
    set_unless_changed(volume, "density", volume.display, "density", index["scene"]["medium"]["extinction"])


def _set_material(volume: bpy.types.Volume, medium: dict[str, float]) -> None:
    material = volume.materials[0] if volume.materials else None
    if material is None:
        material = _material(volume.name)
        volume.materials.clear()
        volume.materials.append(material)
    shader = material.node_tree.nodes.get(SHADER) if material.node_tree else None
    if shader is None:
        return  # the user's own material
    values = {
        "Density": medium["extinction"],
        "Color": (*[medium["albedo"]] * 3, 1.0),
        "Anisotropy": medium["anisotropy"],
    }
    for name, value in values.items():
        set_unless_changed(material, name.lower(), shader.inputs[name], "default_value", value)


def _material(name: str) -> bpy.types.Material:
    """A material that scatters density x extinction x albedo and absorbs the rest of the extinction."""
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
    bpy.app.handlers.load_post.append(correct_positions)


def unregister() -> None:
    bpy.app.handlers.load_post.remove(correct_positions)
