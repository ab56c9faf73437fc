"""The smokes of a scene: Volume objects with the settings that they are made with."""

import itertools
import os.path
from pathlib import Path

import bpy
from mathutils import Matrix, Vector

from .blender import preferred

LAMP_OF_A_NEW_FILE = (4.0762453, 1.0054539, 5.9038620), 1000.0
"""Place (m) and power (W) of the point light that Blender's own new file begins with (by definition)."""

ASSUMED_CAMERA = "Smokelift Camera"  # name of a camera that stands where the engine assumed the clip's


def volume_objects() -> list[bpy.types.Object]:
    """The objects that may have settings; before 5.0 to ask any other for them would give it a custom property."""
    return [obj for obj in bpy.data.objects if obj.type == "VOLUME"]


def is_smoke(obj: bpy.types.Object | None) -> bool:
    """Whether an object is a smoke that can be made: one that is linked from another file is finished."""
    if obj is None or obj.type != "VOLUME" or obj.library is not None or obj.data.library is not None:
        return False
    return obj.override_library is None and obj.smokelift.is_smoke


def is_override(obj: bpy.types.Object | None) -> bool:
    """Whether an object is the override of a smoke that is linked from another file: only its look can be changed."""
    return obj is not None and obj.type == "VOLUME" and obj.override_library is not None and obj.smokelift.is_smoke


def smokes(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    return [obj for obj in scene.objects if is_smoke(obj)]


def active_smoke(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The smoke in the tab: the active object, else that whose box, inlet, camera or child it is, else the first."""
    active = _layer(scene).objects.active
    if is_smoke(active):
        return active
    found = smokes(scene)
    if active is not None:
        for obj in found:
            settings = obj.smokelift
            if active in (settings.box, settings.inlet, settings.assumed_camera) or active.parent == obj:
                return obj
    return found[0] if found else None


def smoke_with_look(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The smoke whose look is in the tab: the active override of a linked one, else as above."""
    active = _layer(scene).objects.active
    return active if is_override(active) else active_smoke(scene)


def find_smoke(uid: int) -> bpy.types.Object | None:
    """A smoke by its number of this session, also after a new name; None if it was deleted."""
    return next((obj for scene in bpy.data.scenes for obj in smokes(scene) if obj.session_uid == uid), None)


def scene_of(smoke: bpy.types.Object) -> bpy.types.Scene:
    """The scene of a smoke: the one at the window if it is in several."""
    scenes = smoke.users_scene
    return bpy.context.scene if bpy.context.scene in scenes else scenes[0]


def new_smoke(scene: bpy.types.Scene, clip: bpy.types.MovieClip | None = None) -> bpy.types.Object:
    """A new smoke, selected and active, which has no result yet."""
    name = f"Smoke {clip.name}" if clip else "Smoke"
    obj = bpy.data.objects.new(name, bpy.data.volumes.new(name))
    scene.collection.objects.link(obj)
    obj.smokelift.is_smoke = True
    if clip is not None:
        obj.smokelift.clip = clip
    activate(obj, scene)
    obj.smokelift.quality = preferred("quality") or obj.smokelift.quality
    return obj


def activate(obj: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Select and activate an object, unless the artist works inside another."""
    layer = _layer(scene)
    active = layer.objects.active
    if active is not None and active.mode != "OBJECT":
        return
    for other in layer.objects.selected:
        other.select_set(False, view_layer=layer)
    obj.select_set(True, view_layer=layer)
    layer.objects.active = obj


def free_folder(smoke: bpy.types.Object) -> str:
    """A name for the folder of a smoke's takes that no other smoke has: its clip's, with a number if need be."""
    taken = {obj.smokelift.folder for obj in volume_objects() if obj != smoke and obj.smokelift.is_smoke}
    stem = bpy.path.clean_name(Path(smoke.smokelift.clip.filepath).stem)
    names = itertools.chain([stem], (f"{stem}_{number}" for number in itertools.count(2)))
    return next(name for name in names if name not in taken)


def separate_duplicate(smoke: bpy.types.Object) -> None:
    """Give a duplicate, the younger of two, a folder and a Volume of its own before it gets a take of its own."""
    settings = smoke.smokelift
    twins = [obj for obj in bpy.data.objects if is_smoke(obj) and obj.smokelift.folder == settings.folder]
    if all(obj.session_uid >= smoke.session_uid for obj in twins):
        return
    settings.folder, settings.results = free_folder(smoke), ""
    if settings.output:
        settings.output = os.path.join(settings.output, settings.folder)  # noqa: PTH118 - a Path would lose the // of Blender
    if smoke.data.users > 1:
        smoke.data = smoke.data.copy()


def _layer(scene: bpy.types.Scene) -> bpy.types.ViewLayer:
    return bpy.context.view_layer if bpy.context.scene == scene else scene.view_layers[0]


def _untouched(scene: bpy.types.Scene, name: str, kind: str) -> bpy.types.Object | None:
    """An object of a new file that renders show, unless something was added to it or moves it."""
    obj = scene.objects.get(name)
    if obj is None or obj.type != kind or obj.hide_render:
        return None
    added = obj.parent or obj.children or obj.modifiers or obj.constraints or obj.animation_data
    return None if added else obj


def hide_default_cube(scene: bpy.types.Scene) -> bool:
    """Hide the cube of a new file, which stands where smoke of an unknown place is put; returns whether it was seen."""
    cube = _untouched(scene, "Cube", "MESH")
    corners = {(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)}
    if cube is None or cube.matrix_basis != Matrix.Identity(4) or {(*v.co,) for v in cube.data.vertices} != corners:
        return False
    cube.hide_viewport = cube.hide_render = True
    return True


def hide_default_lamp(scene: bpy.types.Scene) -> bool:
    """Hide the lamp of a new file, which would light smoke that has its own light; returns whether it was seen."""
    lamp = _untouched(scene, "Light", "LIGHT")
    if lamp is None or lamp.data.type != "POINT" or lamp.data.animation_data:
        return False
    place, power = LAMP_OF_A_NEW_FILE
    moved = (lamp.location - Vector(place)).length > 1e-4
    if moved or lamp.data.energy != power or tuple(lamp.data.color) != (1.0, 1.0, 1.0):
        return False
    lamp.hide_viewport = lamp.hide_render = True
    return True
