"""The result: a Volume object that plays the sequence, with a material of the smoke's optical properties."""

import math
from typing import Any

import bpy
from bpy.app.handlers import persistent
from mathutils import Matrix, Vector

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
    obj = smoke_object(scene)
    if shown_take(scene) != take:
        obj.delta_location = (0.0, 0.0, 0.0)
        set_unless_changed(obj, "place", obj, "matrix_basis", engine_to_world(scene))
    _correct_position(obj, index["scene"]["domain"])
    _set_file(obj.data, take, index)
    _set_time(obj.data, scene, index)
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


def smoke_object(scene: bpy.types.Scene) -> bpy.types.Object:
    """The scene's Volume object; if there is none, a new one, selected and active."""
    obj = scene.smokelift.volume
    if obj is None or obj.type != "VOLUME" or obj.name not in scene.objects:
        name = f"Smoke {scene.smokelift.clip.name}" if scene.smokelift.clip else "Smoke"
        obj = bpy.data.objects.new(name, bpy.data.volumes.new(name))
        scene.collection.objects.link(obj)
        scene.smokelift.volume = obj
        _select(obj, scene)
        if scene.smokelift.camera_mode == "GUESS":
            _hide_default_cube(scene)
    return obj


def _select(obj: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Select and activate an object, unless the artist works inside another."""
    layer = bpy.context.view_layer if bpy.context.scene == scene else scene.view_layers[0]
    active = layer.objects.active
    if active is not None and active.mode != "OBJECT":
        return
    for other in layer.objects.selected:
        other.select_set(False, view_layer=layer)
    obj.select_set(True, view_layer=layer)
    layer.objects.active = obj


def _hide_default_cube(scene: bpy.types.Scene) -> None:
    """Hide the cube of a new file, which stands where smoke is put if nothing is known of its place."""
    cube = scene.objects.get("Cube")
    if cube is None or cube.type != "MESH" or cube.matrix_basis != Matrix.Identity(4):
        return
    if cube.parent or cube.children or cube.modifiers or cube.constraints or cube.animation_data:
        return
    places = {tuple(vertex.co) for vertex in cube.data.vertices}
    if places == {(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)}:
        cube.hide_viewport = cube.hide_render = True


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


def keep_step() -> None:
    """Play the smoke of every scene in step with its clip, after either got another time or rate."""
    for scene in bpy.data.scenes:
        take = shown_take(scene)
        index = take.index() if take is not None else None
        if index and index["frames"]:
            _set_time(scene.smokelift.volume.data, scene, index)


def _numbers(index: dict[str, Any]) -> list[int]:
    return sorted(int(number) for number in index["frames"])


def _set_file(volume: bpy.types.Volume, take: Take, index: dict[str, Any]) -> None:
    """Make a Volume read the take's files."""
    path = relative(take.directory / FRAME_FILE.format(_numbers(index)[0]))
    if volume.filepath != path:
        volume.filepath = path
    volume.is_sequence = True
    volume.sequence_mode = "CLIP"
    if volume.velocity_grid != "velocity":  # Blender complains if the default is set again
        volume.velocity_grid = "velocity"
    volume.velocity_unit = "SECOND"
    set_unless_changed(volume, "clipping", volume.render, "clipping", 0.0)
    # the viewport shows the render's optical depth
    set_unless_changed(volume, "density", volume.display, "density", index["scene"]["medium"]["extinction"])


def _set_time(volume: bpy.types.Volume, scene: bpy.types.Scene, index: dict[str, Any]) -> None:
    """Make a Volume play when the clip does."""
    numbers = _numbers(index)
    clip_rate, scene_rate = index["scene"]["clip"]["fps"], frame_rate(scene)
    ratio = scene_rate / clip_rate
    # the smoke keeps step with a moving camera, which has one matrix for each frame of the clip
    tracked = "matrices" in index["scene"].get("camera", {})
    real = scene.smokelift.speed == "REAL" and not tracked and not math.isclose(ratio, 1.0, rel_tol=1e-3)
    clip = scene.smokelift.clip
    before = _frames_before(scene, index)
    start = (clip.frame_start if clip else 1) + (round(before * ratio) if real else before)
    set_unless_changed(volume, "start", volume, "frame_start", start)
    volume.frame_offset = numbers[0] - 1
    volume.frame_duration = math.ceil(len(numbers) * ratio) if real else len(numbers)
    volume.driver_remove("frame_offset")
    if real:
        # Blender shows one file in each frame of the scene; the driven offset selects another
        driver = volume.driver_add("frame_offset").driver
        driver.type = "SCRIPTED"
        start = volume.frame_start
        driver.expression = f"floor((frame - {start} + 0.001) / {ratio:.9g}) - (frame - {start}) + {numbers[0] - 1}"
    volume.velocity_scale = 1.0 if real else ratio


def _frames_before(scene: bpy.types.Scene, index: dict[str, Any]) -> int:
    """Number of the clip's frames before the take's first, which settings for the next take do not change."""
    settings = scene.smokelift
    frames = index["scene"]["clip"].get("frames")
    return settings.first - 1 if frames is None or settings.clip is None else frames[0] - settings.clip.frame_offset


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


@persistent
def _listen(_file: str = "") -> None:
    """Have Blender say when the time or rate of a clip or scene changes; loading a file ends that."""
    bpy.msgbus.clear_by_owner(_LISTENER)
    for owner, name in _TIMES:
        key = (getattr(bpy.types, owner), name)
        bpy.msgbus.subscribe_rna(key=key, owner=_LISTENER, args=(), notify=keep_step)


_LISTENER = object()
_TIMES = (
    ("MovieClip", "frame_start"),
    ("MovieClip", "frame_offset"),
    ("RenderSettings", "fps"),
    ("RenderSettings", "fps_base"),
)
_HANDLERS = (correct_positions, _listen)


def register() -> None:
    bpy.app.handlers.load_post.extend(_HANDLERS)
    _listen()


def unregister() -> None:
    bpy.msgbus.clear_by_owner(_LISTENER)
    for handler in _HANDLERS:
        bpy.app.handlers.load_post.remove(handler)
