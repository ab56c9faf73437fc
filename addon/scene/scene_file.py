"""The engine's scene file, from the Blender scene.

The engine's axes are those of the box that holds the smoke, because its voxels lie along its world's axes. A rotated
box rotates the camera and the lights the other way. Without rotation both worlds are the same. One Blender unit is a
meter.
"""

from pathlib import Path
from typing import Any

import bpy
from mathutils import Matrix

from ..core import ShotError
from ..core.contract import IMAGE_SUFFIXES, SIDES
from .background import background_table
from .blender import absolute, at_frame, file_of
from .box import box_corners, box_of, domain_table, has_inlet, in_scene, inlet_table, keep_camera_outside
from .camera import camera_over_frames
from .clip import clip_table, start_frame
from .lights import light_tables
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
        rotation = Matrix.Identity(3)
        if settings.camera_mode == "SCENE":
            box = box_of(smoke)
            if box is None:
                raise ShotError("The smoke has no box: press Make Box, and move it so that it holds the smoke.")
            rotation = box.matrix_world.to_quaternion().to_matrix()
            tables["domain"] = domain_table(box, rotation, settings)
            tables["camera"] = camera_over_frames(smoke, rotation, box_corners(box), quick)
            tables["domain"] = keep_camera_outside(tables["domain"], tables["camera"], box, rotation)
            inlet = in_scene(scene, settings.inlet)
            if inlet is not None:
                tables["inlet"] = [inlet_table(inlet.evaluated_get(depsgraph), rotation, tables["domain"])]
        if settings.use_medium:
            tables["medium"] = {key: getattr(settings, key) for key in ("extinction", "albedo", "anisotropy")}
        if settings.light_mode == "SCENE":
            tables["lights"] = light_tables(scene, depsgraph, rotation, tables.get("domain"))
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
