"""The lights in a scene file: suns, point lights, and the picture that lights the world."""

import math
from typing import Any

import bpy
from mathutils import Matrix, Vector

from ..core import ShotError
from ..core.contract import PANORAMA_SUFFIXES
from .blender import file_of
from .box import is_inside


def light_tables(
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
    """The strength of a light in red, green and blue, times a number: of a sun its irradiance (W/m^2).

    That of a point light (W), over the sphere's 4 pi, is its intensity (W/sr).
    """
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
