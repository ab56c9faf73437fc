"""The engine's scene file, from the Blender scene: its tables, of which those of the lights are made here.

The engine's axes are those of the box that holds the smoke, because its voxels lie along its world's axes. A rotated
box rotates the camera and the lights the other way. Without rotation both worlds are the same. One Blender unit is a
meter.
"""

import math
from pathlib import Path
from typing import Any

import bpy
from mathutils import Matrix, Vector

from ..core import ShotError
from ..core.contract import IMAGE_SUFFIXES, PANORAMA_SUFFIXES, SIDES
from .blender import absolute, at_frame, file_of
from .clip import background_table, clip_table, start_frame
from .geometry import engine_to_world, geometry_tables, has_inlet, is_inside
from .pictures import mask_path
from .smoke import scene_of


def footage_tables(smoke: bpy.types.Object, quick: bool = False) -> dict[str, Any]:
    """The tables of the clip and of what is behind its smoke; ``quick`` and errors as in `shot_tables`."""
    tables: dict[str, Any] = {"clip": clip_table(smoke)}
    mask = mask_path(smoke, quick)
    if mask is not None:
        tables["clip"]["mask"] = str(mask)
    background = background_table(smoke)
    return {**tables, "background": background} if background else tables


def shot_files(smoke: bpy.types.Object) -> dict[tuple[str, str], Path]:
    """The files that are chosen for a shot, by the table of its scene file that names them, and their key there."""
    settings = smoke.smokelift
    chosen = {("clip", "mask"): settings.mask, ("background", "image"): settings.plate}
    files = {key: absolute(path) for key, path in chosen.items() if path}
    if settings.strokes is not None:
        files["background", "strokes"] = file_of(settings.strokes)
    return {("clip", "path"): file_of(settings.clip), **files}


def shot_tables(smoke: bpy.types.Object, quick: bool = False) -> dict[str, Any]:
    """The tables of a scene file, of which the smoke's settings decide what is used of its scene.

    ``quick`` reads the camera, and a mask that is drawn, in the current frame only. ShotError if something is
    missing or unusable.
    """
    settings, scene = smoke.smokelift, scene_of(smoke)
    tables = footage_tables(smoke, quick)
    with at_frame(scene, scene.frame_current if quick else start_frame(settings)) as depsgraph:
        tables |= geometry_tables(smoke, depsgraph, quick)
        if settings.use_medium:
            tables["medium"] = {key: getattr(settings, key) for key in ("extinction", "albedo", "anisotropy")}
        if settings.light_mode == "SCENE":
            tables["lights"] = _light_tables(scene, depsgraph, engine_to_world(smoke).to_3x3(), tables.get("domain"))
        if settings.closed:
            tables.setdefault("domain", {})["closed"] = [side for side in SIDES if side in settings.closed]
    if "image" in tables.get("background", {}) and "matrices" in tables.get("camera", {}):
        plate = Path(tables["background"]["image"])
        if plate.suffix.lower() in IMAGE_SUFFIXES and not plate.stem[-1].isdigit():
            raise ShotError(
                "The camera moves, and one picture cannot show what is behind the smoke all the time: choose a video, "
                "or the first of a sequence of pictures, with a clean plate for every frame of the clip."
            )
    return tables


def options(smoke: bpy.types.Object) -> list[str]:
    """The engine's options that the scene file does not hold."""
    settings = smoke.smokelift
    words = ["--quality", settings.quality, "--device", settings.device]
    words += [f"--detail={settings.detail:g}", f"--seed={settings.seed}"]
    if settings.camera_mode == "SCENE" and not settings.longest_side:
        words += ["--resolution", "auto"]  # the engine measures the clip's detail
    if settings.distance and not has_inlet(smoke):
        words.append(f"--distance={settings.distance:g}")
    return words


def _light_tables(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, rotation: Matrix, domain: dict[str, Any] | None
) -> list[dict[str, Any]]:
    """The scene's suns and point lights, which stand outside the domain, and the picture that lights its world."""
    to_engine, tables, unusable = rotation.inverted(), [], []
    for obj in scene.objects:
        if obj.type != "LIGHT" or obj.hide_render:
            continue
        light = obj.data
        matrix = obj.evaluated_get(depsgraph).matrix_world
        if light.type == "SUN":
            direction = to_engine @ -matrix.to_3x3().col[2].normalized()
            tables.append({"type": "directional", "direction": list(direction), "irradiance": emitted(light)})
        elif light.type == "POINT":
            position, intensity = to_engine @ matrix.translation, emitted(light, 1.0 / (4 * math.pi))
            tables.append({"type": "point", "position": list(position), "intensity": intensity})
        else:
            unusable.append(obj.name)
    tables += _world_tables(scene, rotation)
    if not tables:
        others = f" ({', '.join(unusable)} cannot be used)" if unusable else ""
        raise ShotError(
            f"The scene has no sun, point light or world picture{others}: add one, or choose light From the Clip."
        )
    places = [light["position"] for light in tables if light["type"] == "point"]
    if domain is not None and any(is_inside(domain["min"], domain["max"], place) for place in places):
        raise ShotError("A point light is inside the box: move it out, or hide it from renders.")
    return tables


def emitted(light: bpy.types.Light, scale: float = 1.0) -> list[float]:
    """The strength of a light in RGB, times a number: a sun's irradiance (W/m^2), a point's power (W: 4 pi W/sr)."""
    scale *= light.energy * 2.0 ** getattr(light, "exposure", 0.0)  # older versions of Blender lack it, and temperature
    warmth = light.temperature_color if getattr(light, "use_temperature", False) else (1.0, 1.0, 1.0)
    return [scale * a * b for a, b in zip(light.color, warmth, strict=True)]


def _world_tables(scene: bpy.types.Scene, rotation: Matrix) -> list[dict[str, Any]]:
    """The equirectangular picture of the world's background, if there is one.

    Blender rotates a direction before it reads the picture; a rotated box adds its own rotation.
    """
    tree = scene.world.node_tree if scene.world is not None else None
    for node in tree.nodes if tree is not None else ():
        if node.type != "BACKGROUND":
            continue
        links = node.inputs["Color"].links
        source = links[0].from_node if links else None
        strength = node.inputs["Strength"].default_value
        if source is None or source.type != "TEX_ENVIRONMENT" or source.image is None or strength == 0.0:
            continue
        path = file_of(source.image)
        if source.projection != "EQUIRECTANGULAR" or path.suffix.lower() not in PANORAMA_SUFFIXES:
            raise ShotError(
                f"The world's picture {source.image.name} cannot be used: it has to be an .exr or .hdr panorama."
            )
        if not path.is_file():
            raise ShotError(f"The world's picture {path} is not there: choose it again, or unpack it.")
        turned, up = _mapping(source) @ rotation, Vector((0.0, 0.0, 1.0))
        if up.angle(turned @ up) > 1e-3:
            raise ShotError("The box is tilted against the world's picture: stand it upright, or choose other lights.")
        yaw = math.degrees(math.atan2(turned[1][0], turned[0][0]))
        return [{"type": "environment", "image": str(path), "rotation_degrees": yaw, "strength": strength}]
    return []


def _mapping(texture: bpy.types.ShaderNode) -> Matrix:
    """Rotation (3x3) of a texture's Mapping node."""
    links = texture.inputs["Vector"].links
    node = links[0].from_node if links else None
    if node is None or node.type != "MAPPING":
        return Matrix.Identity(3)
    rotation = node.inputs["Rotation"].default_value.to_matrix()
    return rotation.inverted() if node.vector_type == "TEXTURE" else rotation
