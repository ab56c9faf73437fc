"""The engine's scene file, from the Blender scene.

The engine's axes are those of the box that holds the smoke, because its voxels lie along its world's axes. A rotated
box rotates the camera and the lights the other way. Without rotation both worlds are the same. One Blender unit is a
metre.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Matrix, Vector

from .contract import FEWEST_VOXELS, IMAGE_SUFFIXES, LONGEST_SIDE, PANORAMA_SUFFIXES, SIDES
from .paths import absolute
from .smoke import scene_of

LENS = ("fx", "fy", "cx", "cy")
TRANSFERS = {"sRGB": "srgb", "Linear Rec.709": "linear", "scene_linear": "linear", "Non-Color": "linear"}
"""The engine's name of the transfer function of a clip's pixels, by Blender's colour space."""

CAMERA_SAMPLES = 9
"""Frames that decide whether the camera moves."""


class ShotError(ValueError):
    """A shot that the engine cannot run; says in one sentence what to do."""


def shot_tables(smoke: bpy.types.Object, quick: bool = False) -> dict[str, Any]:
    """The tables of a scene file.

    Parameters
    ----------
    smoke
        Its settings decide what is used of its scene.
    quick
        Read the camera in the current frame only.

    Raises
    ------
    ShotError
        If something is missing or unusable.
    """
    settings, scene = smoke.smokelift, scene_of(smoke)
    tables: dict[str, Any] = {"clip": clip_table(smoke)}
    with at_frame(scene, scene.frame_current if quick else start_frame(settings)) as depsgraph:
        rotation = Matrix.Identity(3)
        if settings.camera_mode == "SCENE":
            box = box_of(smoke)
            if box is None:
                raise ShotError("The smoke has no box: press Make Box, and move it so that it holds the smoke.")
            rotation = box.matrix_world.to_quaternion().to_matrix()
            tables["domain"] = domain_table(box, rotation, settings)
            tables["camera"] = _camera_over_frames(smoke, rotation, box_corners(box), quick)
            inlet = _in_scene(scene, settings.inlet)
            if inlet is not None:
                tables["inlet"] = [inlet_table(inlet.evaluated_get(depsgraph), rotation, tables["domain"])]
        if settings.use_medium:
            tables["medium"] = {key: getattr(settings, key) for key in ("extinction", "albedo", "anisotropy")}
        if settings.light_mode == "SCENE":
            tables["lights"] = light_tables(scene, depsgraph, rotation)
            _require_lights_outside(tables)
        if settings.closed:
            tables.setdefault("domain", {})["closed"] = [side for side in SIDES if side in settings.closed]
    if settings.plate_mode == "FILE":
        plate = _existing(settings.plate, "clean plate")
        if "matrices" in tables.get("camera", {}):
            _require_moving_plate(Path(plate))
        tables["background"] = {"image": plate}
    return tables


def options(smoke: bpy.types.Object) -> list[str]:
    """The engine's options that the scene file does not hold."""
    settings = smoke.smokelift
    words = ["--quality", settings.quality, "--device", settings.device]
    words += [f"--detail={settings.detail:g}", f"--seed={settings.seed}"]
    if settings.camera_mode == "SCENE" and not settings.longest_side:
        words += ["--resolution", "auto"]  # the engine measures the clip's detail
    if settings.use_axis_depth:
        words.append(f"--axis-depth={settings.axis_depth:g}")  # one word, for "-1e-05" alone is an option
    return words


def engine_to_world(smoke: bpy.types.Object) -> Matrix:
    """The matrix (4x4) from the engine's world to Blender's."""
    settings = smoke.smokelift
    box = box_of(smoke) if settings.camera_mode == "SCENE" else None
    return Matrix.Identity(4) if box is None else box.matrix_world.to_quaternion().to_matrix().to_4x4()


# clip


def clip_path(clip: bpy.types.MovieClip) -> Path:
    """The absolute path of a clip."""
    return absolute(clip.filepath, clip.library)


def clip_table(smoke: bpy.types.Object) -> dict[str, Any]:
    """The clip and its used frames, counted from 0."""
    settings = smoke.smokelift
    clip = settings.clip
    if clip is None:
        raise ShotError("Choose a clip first.")
    path, count = clip_path(clip), _frame_count(clip)
    if not 1 <= settings.first <= settings.last <= count:
        raise ShotError(f"Frames {settings.first} to {settings.last} are not in the clip: it has frames 1 to {count}.")
    before = clip.frame_offset - 1
    table: dict[str, Any] = {"path": str(path), "frames": [settings.first + before, settings.last + before]}
    if settings.fps > 0.0:
        table["fps"] = settings.fps
    elif clip.source == "SEQUENCE":
        table["fps"] = frame_rate(scene_of(smoke))
    transfer = _transfer(clip) if settings.transfer == "AUTO" else settings.transfer
    if transfer is not None:
        table["transfer"] = transfer
    return table


def _transfer(clip: bpy.types.MovieClip) -> str | None:
    """The transfer function that the clip's colour space says; None for the one that its kind of file has."""
    space = clip.colorspace_settings.name
    if not space:  # the colour management of this Blender does not know it
        return None
    if space not in TRANSFERS:
        raise ShotError(
            f"The clip's color space is {space}, and only sRGB and Linear Rec.709 can be read: convert the clip, or "
            "choose another Color Space under Advanced."
        )
    usual = "linear" if clip_path(clip).suffix.lower() in PANORAMA_SUFFIXES else "srgb"
    return None if TRANSFERS[space] == usual else TRANSFERS[space]


def _frame_count(clip: bpy.types.MovieClip) -> int:
    path = clip_path(clip)
    if not path.is_file():
        raise ShotError(f"The clip {path} is not there: choose it again, or use File > External Data.")
    if clip.frame_duration < 1:  # Blender takes any file for a clip
        raise ShotError(f"The clip {path} is no video and no picture that Blender can read: choose another.")
    return clip.frame_duration


def use_frames(smoke: bpy.types.Object, first: int, last: int) -> None:
    """Use some frames of the clip's file, counted from 0 as the engine counts them.

    Raises
    ------
    ShotError
        If the clip does not have them.
    """
    settings = smoke.smokelift
    lowest = settings.clip.frame_offset
    highest = lowest + _frame_count(settings.clip) - 1
    if not lowest <= first <= last <= highest:
        raise ShotError(f"Frames {first} to {last} are not in the clip: it has frames {lowest} to {highest}, from 0.")
    settings.first, settings.last = first - lowest + 1, last - lowest + 1


def frame_rate(scene: bpy.types.Scene) -> float:
    """Frames a second of a scene."""
    return scene.render.fps / scene.render.fps_base


def start_frame(settings: bpy.types.PropertyGroup) -> int:
    """The scene's frame that shows the first used frame of the clip."""
    return settings.clip.frame_start + settings.first - 1


def _existing(path: str, what: str) -> str:
    if not path:
        raise ShotError(f"Choose the {what}, or choose From the Clip.")
    file = absolute(path)
    if not file.is_file():
        raise ShotError(f"The {what} {file} is not there: choose it again.")
    return str(file)


# camera


def camera_table(
    smoke: bpy.types.Object, camera: bpy.types.Object, depsgraph: bpy.types.Depsgraph, rotation: Matrix
) -> dict[str, Any]:
    """The camera as a pinhole (or orthographic) camera of the clip's size.

    Parameters
    ----------
    smoke
        Gives the clip, and its scene the pixel aspect.
    camera, depsgraph
        Evaluated in the frame that counts.
    rotation
        From the engine's axes to Blender's (3x3).
    """
    width, height = smoke.smokelift.clip.size
    render = scene_of(smoke).render
    if camera.data.type not in ("PERSP", "ORTHO"):
        raise ShotError("The camera is panoramic: choose Perspective or Orthographic in its lens settings.")
    if not math.isclose(render.resolution_x * height, render.resolution_y * width, rel_tol=0.005):
        raise ShotError(
            f"The render size {render.resolution_x} x {render.resolution_y} has another shape than the clip, "
            f"{width} x {height}: press Match Scene to Clip, or set it in the output settings."
        )
    axes = camera.matrix_world.to_3x3().normalized()
    skew = max(abs(axes.col[i].dot(axes.col[j])) for i, j in ((0, 1), (0, 2), (1, 2)))
    if skew > 1e-4 or axes.determinant() < 0.0:
        raise ShotError("The camera is skewed or mirrored by the scale of its parents: apply their scale.")
    pose = rotation.to_4x4().inverted() @ Matrix.Translation(camera.matrix_world.translation) @ axes.to_4x4()
    # Blender's projection matrix holds sensor fit, shift and pixel aspect; it maps the image's edges to -1 and 1.
    lens = camera.calc_matrix_camera(
        depsgraph,
        x=width,
        y=height,
        scale_x=render.pixel_aspect_x,
        scale_y=render.pixel_aspect_y,
    )
    perspective = camera.data.type == "PERSP"
    off_x, off_y = (-lens[0][2], -lens[1][2]) if perspective else (lens[0][3], lens[1][3])
    return {
        "type": "perspective" if perspective else "orthographic",
        "matrix": [list(row) for row in pose],
        "fx": lens[0][0] * width / 2,
        "fy": lens[1][1] * height / 2,
        "cx": (1 + off_x) * width / 2,
        "cy": (1 - off_y) * height / 2,
        "size": [width, height],
    }


def _camera(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> bpy.types.Object:
    if scene.camera is None:
        raise ShotError("The scene has no camera: add one where the clip was filmed from, or choose Guess.")
    return scene.camera.evaluated_get(depsgraph)


def _camera_over_frames(
    smoke: bpy.types.Object, rotation: Matrix, corners: list[Vector], quick: bool
) -> dict[str, Any]:
    """The camera's table: one matrix, or one for every used frame if the camera moves.

    Each frame costs an evaluation of the whole scene, so a few frames decide whether the camera moves; ``quick`` reads
    the current one only. The corners are those of the box, in Blender's world.
    """
    settings, scene = smoke.smokelift, scene_of(smoke)
    start, length = start_frame(settings), settings.last - settings.first
    frames = [start + round(step * length / (CAMERA_SAMPLES - 1)) for step in range(CAMERA_SAMPLES)]
    samples = _sample_camera(smoke, [scene.frame_current] if quick else sorted(set(frames)), rotation, corners)
    first = samples[0][0]
    size = max((a - b).length for a in corners for b in corners)
    moves = any(_moved(table["matrix"], first["matrix"], size) for table, _ in samples)
    if moves:
        samples = _sample_camera(smoke, list(range(start, start + length + 1)), rotation, corners)
    if any(abs(table[key] - first[key]) > 1e-4 * max(table["size"]) for table, _ in samples for key in LENS):
        raise ShotError(
            "The camera zooms during the clip, and only footage with one focal length can be used: choose frames in "
            "which its lens does not change."
        )
    if not any(visible for _, visible in samples):
        raise ShotError("The box is not in the camera's picture: move it there, or press Frame Box.")
    if not moves:
        return first
    matrices = [table["matrix"] for table, _ in samples]
    return {**{key: value for key, value in first.items() if key != "matrix"}, "matrices": matrices}


def _sample_camera(
    smoke: bpy.types.Object, frames: list[int], rotation: Matrix, corners: list[Vector]
) -> list[tuple[dict[str, Any], bool]]:
    """The camera's table in each frame, and whether the box is in its picture."""
    samples, scene = [], scene_of(smoke)
    with at_frame(scene, frames[0]) as depsgraph:
        for frame in frames:
            if frame != scene.frame_current:
                scene.frame_set(frame)
            camera = _camera(scene, depsgraph)
            samples.append((camera_table(smoke, camera, depsgraph, rotation), _in_picture(scene, camera, corners)))
    return samples


def _moved(pose: list[list[float]], before: list[list[float]], size: float) -> bool:
    """Whether the camera moved by 0.1% of the box's size, or rotated by 0.001 rad."""
    matrix, other = Matrix(pose), Matrix(before)
    shifted = (matrix.translation - other.translation).length > 1e-3 * size
    return shifted or matrix.to_quaternion().rotation_difference(other.to_quaternion()).angle > 1e-3


def _require_moving_plate(plate: Path) -> None:
    """Refuse a single picture as the clean plate of a moving camera."""
    if plate.suffix.lower() in IMAGE_SUFFIXES and not plate.stem[-1].isdigit():
        raise ShotError(
            "The camera moves, and one picture cannot show what is behind the smoke all the time: choose a video, or "
            "the first of a sequence of pictures, with a clean plate for every frame of the clip."
        )


def _in_picture(scene: bpy.types.Scene, camera: bpy.types.Object, corners: list[Vector]) -> bool:
    """False for a box that lies wholly outside the picture or behind the camera."""
    points = [world_to_camera_view(scene, camera, corner) for corner in corners]
    outside = (
        all(p.z <= 0.0 for p in points),
        all(p.x < 0.0 for p in points),
        all(p.x > 1.0 for p in points),
        all(p.y < 0.0 for p in points),
        all(p.y > 1.0 for p in points),
    )
    return not (outside[0] or (any(outside) and all(p.z > 0.0 for p in points)))


# box


def box_of(smoke: bpy.types.Object) -> bpy.types.Object | None:
    """The box that holds the smoke."""
    return _in_scene(scene_of(smoke), smoke.smokelift.box)


def _in_scene(scene: bpy.types.Scene, obj: bpy.types.Object | None) -> bpy.types.Object | None:
    """The object if the scene holds it. A setting still refers to an object that was deleted."""
    return obj if obj is not None and obj.name in scene.objects else None


def box_corners(box: bpy.types.Object) -> list[Vector]:
    """The eight corners of a box in the world."""
    return [box.matrix_world @ Vector(corner) for corner in box.bound_box]


def domain_table(box: bpy.types.Object, rotation: Matrix, settings: bpy.types.PropertyGroup) -> dict[str, Any]:
    """The domain: the box in cubic voxels, a multiple of four along each side. It grows and keeps its floor."""
    to_engine = rotation.inverted()
    corners = [to_engine @ corner for corner in box_corners(box)]
    low = Vector(min(corner[axis] for corner in corners) for axis in range(3))
    high = Vector(max(corner[axis] for corner in corners) for axis in range(3))
    extent = high - low
    if min(extent) <= 1e-6 * max(*extent, 1e-6):
        raise ShotError("The box is flat: give it a width, a depth and a height.")
    voxel = max(extent) / (settings.longest_side or LONGEST_SIDE[settings.quality])
    counts = [max(FEWEST_VOXELS, 4 * math.ceil(length / voxel / 4 - 1e-4)) for length in extent]
    size = [count * voxel for count in counts]
    middle = (low + high) / 2
    start = [middle[0] - size[0] / 2, middle[1] - size[1] / 2, low[2]]
    return {
        "min": start,
        "max": [s + length for s, length in zip(start, size, strict=True)],
        "resolution": counts,
    }


def inlet_table(inlet: bpy.types.Object, rotation: Matrix, domain: dict[str, Any]) -> dict[str, Any]:
    """A ball, as large as the Empty is drawn."""
    centre = rotation.inverted() @ inlet.matrix_world.translation
    radius = inlet.empty_display_size * max(abs(scale) for scale in inlet.matrix_world.to_scale())
    if radius <= 0.0:
        raise ShotError("The inlet has no size: scale up its Empty.")
    sides = zip(domain["min"], centre, domain["max"], strict=True)
    if (centre - Vector(min(max(place, low), high) for low, place, high in sides)).length > radius:
        raise ShotError("The inlet is outside the box: move it to where the smoke enters.")
    return {"centre": list(centre), "radius": radius}


# lights


def light_tables(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, rotation: Matrix) -> list[dict[str, Any]]:
    """The scene's suns and point lights, and the picture that lights its world."""
    to_engine = rotation.inverted()
    tables = []
    unusable = []
    for obj in scene.objects:
        if obj.type != "LIGHT" or obj.hide_render:
            continue
        light = obj.data
        matrix = obj.evaluated_get(depsgraph).matrix_world
        if light.type == "SUN":
            direction = to_engine @ -matrix.to_3x3().col[2].normalized()
            tables.append({"type": "directional", "direction": list(direction), "irradiance": sun_irradiance(light)})
        elif light.type == "POINT":
            position = to_engine @ matrix.translation
            tables.append({"type": "point", "position": list(position), "intensity": point_intensity(light)})
        else:
            unusable.append(obj.name)
    tables += _world_tables(scene, rotation)
    if not tables:
        others = f" ({', '.join(unusable)} cannot be used)" if unusable else ""
        raise ShotError(
            f"The scene has no sun, point light or world picture{others}: add one, or choose light From the Clip."
        )
    return tables


def sun_irradiance(light: bpy.types.Light) -> list[float]:
    """Irradiance (W/m^2) of a sun, red, green and blue: Blender's strength."""
    return [light.energy * part for part in _emitted(light)]


def point_intensity(light: bpy.types.Light) -> list[float]:
    """Intensity (W/sr) of a point light, red, green and blue: its power over the sphere's 4 pi."""
    return [light.energy * part / (4 * math.pi) for part in _emitted(light)]


def _emitted(light: bpy.types.Light) -> list[float]:
    """Strength in red, green and blue. Older versions of Blender lack exposure and temperature."""
    factor = 2.0 ** getattr(light, "exposure", 0.0)
    warmth = light.temperature_color if getattr(light, "use_temperature", False) else (1.0, 1.0, 1.0)
    return [factor * a * b for a, b in zip(light.color, warmth, strict=True)]


def _world_tables(scene: bpy.types.Scene, rotation: Matrix) -> list[dict[str, Any]]:
    """The equirectangular picture of the world's background, if there is one.

    Blender rotates a direction before it reads the picture; a rotated box adds its own rotation.
    """
    world = scene.world
    if world is None or world.node_tree is None:
        return []
    backgrounds = [node for node in world.node_tree.nodes if node.type == "BACKGROUND"]
    for node in backgrounds:
        links = node.inputs["Color"].links
        source = links[0].from_node if links else None
        strength = node.inputs["Strength"].default_value
        if source is None or source.type != "TEX_ENVIRONMENT" or source.image is None or strength == 0.0:
            continue
        path = absolute(source.image.filepath, source.image.library)
        if source.projection != "EQUIRECTANGULAR" or path.suffix.lower() not in PANORAMA_SUFFIXES:
            raise ShotError(
                f"The world's picture {source.image.name} cannot be used: it has to be an .exr or .hdr panorama."
            )
        if not path.is_file():
            raise ShotError(f"The world's picture {path} is not there: choose it again, or unpack it.")
        yaw, tilt = _yaw(_mapping(source) @ rotation)
        if tilt > 1e-3:
            raise ShotError("The box is tilted against the world's picture: stand it upright, or choose other lights.")
        return [
            {"type": "environment", "image": str(path), "rotation_degrees": math.degrees(yaw), "strength": strength}
        ]
    return []


def _mapping(texture: bpy.types.ShaderNode) -> Matrix:
    """Rotation (3x3) of a texture's Mapping node."""
    links = texture.inputs["Vector"].links
    node = links[0].from_node if links else None
    if node is None or node.type != "MAPPING":
        return Matrix.Identity(3)
    rotation = node.inputs["Rotation"].default_value.to_matrix()
    return rotation.inverted() if node.vector_type == "TEXTURE" else rotation


def _yaw(rotation: Matrix) -> tuple[float, float]:
    """Angle of a rotation about Z, and the tilt of Z (radians)."""
    up = rotation @ Vector((0.0, 0.0, 1.0))
    return math.atan2(rotation[1][0], rotation[0][0]), up.angle(Vector((0.0, 0.0, 1.0)))


def _require_lights_outside(tables: dict[str, Any]) -> None:
    """Refuse a point light inside the box."""
    domain = tables.get("domain")
    for light in tables["lights"]:
        if domain is None or light["type"] != "point":
            continue
        sides = zip(domain["min"], light["position"], domain["max"], strict=True)
        if all(low <= place <= high for low, place, high in sides):
            raise ShotError("A point light is inside the box: move it out, or hide it from renders.")


@contextmanager
def at_frame(scene: bpy.types.Scene, frame: int) -> Iterator[bpy.types.Depsgraph]:
    """The scene evaluated in a frame; restores the current frame afterwards."""
    before, fraction = scene.frame_current, scene.frame_subframe
    if frame != before:
        scene.frame_set(frame)
    try:
        layer = scene.view_layers[0]
        layer.update()
        yield layer.depsgraph
    finally:
        if (scene.frame_current, scene.frame_subframe) != (before, fraction):
            scene.frame_set(before, subframe=fraction)
