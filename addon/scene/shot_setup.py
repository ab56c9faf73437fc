"""Set Up Shot: size, speed, camera, background, light and colors of the clip for the Blender scene.

Everything made here is found again by its name, so a second set-up changes nothing.
"""

import math
from typing import Any

import bpy
from mathutils import Matrix, Vector

from . import volume
from .blender import rpt_, set_unless_changed
from .clip import used_range
from .compositing import composite, disable_composite
from .nodes import add_node
from .plate import project, show_card, show_clip_behind, show_plate, show_plate_behind
from .smoke import ASSUMED_CAMERA, hide_default_lamp, scene_of, smokes

NAME = "Smokelift"

NEW_RANGE = (1, 250)  # frames of a new file of Blender (by definition)
SENSOR_WIDTH = 36.0  # millimeters; Blender's default (by definition)
BOUNCES = 128  # of light in Cycles, in smoke fitted with scattering of all orders (docs/experiments/scattering.md)
NEW_SAMPLES = 4096  # Cycles' samples per pixel in a new file (by definition)

SAMPLES = 32
"""Samples per pixel of a set-up in a new file: marching through smoke and denoised, the example's 640 x 960 pixels take
two slow cores a minute, and differ from the clip by 2 of 255, root mean square (measured)."""


def match_clip(smoke: bpy.types.Object) -> None:
    """Give the smoke's scene the clip's size and frame rate, and the length of what is used or made of it."""
    clip, scene = smoke.smokelift.clip, scene_of(smoke)
    render = scene.render
    render.resolution_x, render.resolution_y = clip.size
    if clip.source == "MOVIE" and clip.fps > 0.0:
        render.fps = math.ceil(clip.fps - 1e-3)
        render.fps_base = render.fps / clip.fps
    _set_range(scene, anyway=True)


def follow_range(smoke: bpy.types.Object) -> None:
    """Give the scene the length of its results, unless the artist gave it another than that of a new file or a clip."""
    scene, clip = scene_of(smoke), smoke.smokelift.clip
    of_clip = (clip.frame_start, clip.frame_start + clip.frame_duration - 1) if clip is not None else NEW_RANGE
    if "smokelift_frame_end" in scene or (scene.frame_start, scene.frame_end) in (NEW_RANGE, of_clip):
        _set_range(scene)


def _set_range(scene: bpy.types.Scene, anyway: bool = False) -> None:
    """Set the scene's range to that of the results on show, and of the used frames of clips that have none yet."""
    ranges = [volume.shown_range(smoke) or used_range(smoke.smokelift) for smoke in smokes(scene)]
    found = [each for each in ranges if each is not None]
    if found:
        firsts, lasts = zip(*found, strict=True)
        set_unless_changed(scene, "frame_end", scene, "frame_end", max(lasts), anyway)
        set_unless_changed(scene, "frame_start", scene, "frame_start", min(firsts), anyway)


def set_up(smoke: bpy.types.Object) -> list[str]:
    """Make renders match the clip from the camera, in the ticked parts; returns what to know of it, a sentence each."""
    settings, scene, said = smoke.smokelift, scene_of(smoke), []
    if settings.set_up_plate:
        _disable_other_plates(smoke)  # first: what it gives back may be set up anew
    if settings.set_up_range:
        match_clip(smoke)
    if settings.set_up_camera:
        scene.camera = assumed_camera(smoke) or scene.camera
        if settings.set_up_plate:
            show_plate_behind(smoke, scene.camera.data)
        else:
            show_clip_behind(smoke, scene.camera.data)
    if settings.set_up_light:
        said = _light(scene, volume.shown(smoke).scene, settings.light_mode == "ESTIMATE")
    if settings.set_up_plate:
        {"WORLD": _set_world, "COMPOSITE": composite, "PROJECTION": project}[settings.plate_place](smoke)
    if settings.set_up_colors:
        scene.view_settings.view_transform = "Standard"
        scene.view_settings.look = "None"
        scene.view_settings.exposure, scene.view_settings.gamma = 0.0, 1.0
    return said


def _disable_other_plates(smoke: bpy.types.Object) -> None:
    """Undo what an earlier set-up did to show the plate elsewhere than it is shown now."""
    scene, place = scene_of(smoke), smoke.smokelift.plate_place
    if place != "COMPOSITE":
        disable_composite(scene)
    show_card(scene, place == "PROJECTION")
    tree = scene.world.node_tree if scene.world is not None else None
    if tree is not None and NAME in tree.nodes:
        tree.nodes[NAME].mute = place != "WORLD"  # a muted Mix Shader shows what the world was before


def assumed_camera(smoke: bpy.types.Object) -> bpy.types.Object | None:
    """The camera that the engine assumed, made or moved unless the artist did that; None if it used the scene's own."""
    settings, scene = smoke.smokelift, scene_of(smoke)
    if settings.camera_mode != "ESTIMATE":
        return None
    table = volume.shown(smoke).scene["camera"]
    camera = settings.assumed_camera
    if camera is None or camera.type != "CAMERA" or camera.name not in scene.objects:
        camera = bpy.data.objects.new(ASSUMED_CAMERA, bpy.data.cameras.new(ASSUMED_CAMERA))
        camera.data.sensor_fit, camera.data.sensor_width = "AUTO", SENSOR_WIDTH
        scene.collection.objects.link(camera)
    settings.assumed_camera = camera
    set_unless_changed(camera, "place", camera, "matrix_basis", Matrix(table["matrix"]))
    lens = table["fx"] * camera.data.sensor_width / max(table["size"])
    set_unless_changed(camera.data, "lens", camera.data, "lens", lens)
    if scene.camera is None:
        scene.camera = camera
    return camera


def _light(scene: bpy.types.Scene, fitted: dict[str, Any], estimated: bool) -> list[str]:
    """Render with Cycles in the light that smoke was fitted in, added if it was estimated; returns what to know of it.

    Light bounces in smoke as often as in the model that it was fitted with; by default it does once.
    """
    said, cycles = [], scene.cycles
    scene.render.engine = "CYCLES"
    if cycles.samples == NEW_SAMPLES:  # the artist did not choose how many
        cycles.samples = SAMPLES
        if hasattr(cycles, "volume_biased"):  # null scattering takes four times as many for the same noise
            cycles.volume_biased = True
    if cycles.use_denoising and not has_denoiser():  # or F12 ends in an error
        cycles.use_denoising = False
        said.append(rpt_("Denoise is off, since this Blender has no denoiser: more Max Samples make less noise."))
    bounces = BOUNCES if fitted["medium"].get("scattering") == "multiple" else 0
    set_unless_changed(scene, "volume_bounces", cycles, "volume_bounces", bounces)
    if cycles.volume_bounces == bounces:  # bounces of all kinds together end a path too
        cycles.max_bounces = max(cycles.max_bounces, bounces)
    _estimated_suns(scene, fitted, fitted["lights"] if estimated else [])
    if not estimated:
        return said
    lamps = [obj.name for obj in scene.objects if _is_estimated(obj) and not obj.data.use_shadow]
    if lamps:
        text = "The clip's light is even and casts no shadow: to light smoke from a side, give {:s} a shadow."
        said.append(rpt_(text).format(", ".join(lamps)))
    if hide_default_lamp(scene):
        said.append(rpt_("The lamp of the new file is hidden: the smoke has the clip's light."))
    lights = (obj for obj in scene.objects if obj.type == "LIGHT" and not obj.hide_render)
    further = [obj.name for obj in lights if not _is_estimated(obj)]
    if further:
        text = "Beside the clip's light the smoke has that of {:s}: hide it from renders for a match."
        said.append(rpt_(text).format(", ".join(further)))
    return said


def has_denoiser() -> bool:
    """Whether Cycles was built with the denoiser that needs no graphics card."""
    try:
        import _cycles  # a part of Blender, where it has Cycles
    except ImportError:
        return True
    return bool(getattr(_cycles, "with_openimagedenoise", True))


def _estimated_suns(scene: bpy.types.Scene, fitted: dict[str, Any], tables: list[dict[str, Any]]) -> None:
    """The suns that the engine estimated, with shadows if the smoke was fitted with them; none of earlier results."""
    names = [f"{NAME} Light", *(f"{NAME} Light {number}" for number in range(2, len(tables) + 1))][: len(tables)]
    for name, table in zip(names, tables, strict=True):
        sun = scene.objects.get(name)
        if sun is None or sun.type != "LIGHT":
            sun = bpy.data.objects.new(name, bpy.data.lights.new(name, "SUN"))
            scene.collection.objects.link(sun)
        strongest = max(table["irradiance"]) or 1.0
        sun.data.energy = strongest
        sun.data.color = [part / strongest for part in table["irradiance"]]
        sun.data.use_shadow = fitted["medium"].get("scattering") in ("multiple", "single")
        sun.rotation_euler = Vector(table["direction"]).to_track_quat("-Z", "Y").to_euler()
    for sun in [each for each in scene.objects if _is_estimated(each) and each.name not in names]:
        bpy.data.objects.remove(sun)


def _is_estimated(obj: bpy.types.Object) -> bool:
    return f"{obj.name} ".startswith(f"{NAME} Light ")


def _set_world(smoke: bpy.types.Object) -> None:
    """A world that shows the camera the clean plate, and lights the smoke as the scene's own world does."""
    scene = scene_of(smoke)
    scene.render.film_transparent = False
    world = scene.world
    if world is None or not world.name.startswith(NAME):
        for unused in [each for each in bpy.data.worlds if each.users == 0 and each.node_tree is not None]:
            if NAME in unused.node_tree.nodes:  # an earlier set-up's, which the artist took out of its scene
                bpy.data.worlds.remove(unused)
        if world is None:
            world = bpy.data.worlds.new(NAME)
        else:
            world.use_fake_user = True  # or it would not be saved any more
            world = world.copy()
            world.name, world.use_fake_user = NAME, False
        scene.world = world
    if world.node_tree is None:  # since 5.0 there always is one
        world.use_nodes = True
    tree = world.node_tree
    output = next((node for node in tree.nodes if node.type == "OUTPUT_WORLD" and node.is_active_output), None)
    output = output or tree.nodes.new("ShaderNodeOutputWorld")
    mix = tree.nodes.get(NAME)
    if mix is None:
        rays = add_node(tree, "ShaderNodeLightPath", -2, 2, near=output).outputs["Is Camera Ray"]
        mix = add_node(tree, "ShaderNodeMixShader", 0, 1, rays, near=output, name=NAME)
        if output.inputs["Surface"].links:
            tree.links.new(output.inputs["Surface"].links[0].from_socket, mix.inputs[1])
        tree.links.new(add_node(tree, "ShaderNodeBackground", -1, 2, near=output).outputs[0], mix.inputs[2])
        tree.links.new(mix.outputs[0], output.inputs["Surface"])
    background = mix.inputs[2].links[0].from_node
    show_plate(smoke, tree, background, lambda: tree.nodes.new("ShaderNodeTexCoord").outputs["Window"])
