"""The clean plate of a result, where Blender shows it: in a shader, behind a camera's view, and projected.

Projected from where the clip was filmed, on a card or on geometry of the artist, it stays where it is while the camera
of the render moves, and looks as in the clip from where that was filmed, whatever it lies on. It is computed for every
point that is shaded, so no mesh has to be subdivided for it.
"""

import re
from collections.abc import Callable
from typing import Any

import bpy
from mathutils import Color, Matrix, Vector

from .blender import relative, set_unless_changed
from .geometry import engine_to_world
from .nodes import Input, Socket, Tree, add_node, empty_material, file_group, math_node, number, vector_node
from .smoke import scene_of
from .volume import frames_before, shown, shown_take

PICTURE_MARK = "smokelift_plate"  # custom property of pictures that a camera's view shows behind smoke
ELEMENT_MARK = "smokelift_element"  # the same of elements that it shows over those
BACKGROUND = "Smokelift Background"  # name of a picture of one color

MATERIAL = "Smokelift Projection"  # name of the material, and of the node group in it
PLACE = "Smokelift Projection Place"  # name of the group's node in the material
MARK = "smokelift_projection"  # custom property by which material and group are known under any name
PROJECTOR = "Smokelift Projector"  # name of the camera that stands where the clip was filmed from
CARD = "Smokelift Card"  # name of the plane that the plate is projected on

_INPUTS = (
    Input("Point", "NodeSocketVector", "A point in the space of the camera that filmed"),
    Input("Focal Length", "NodeSocketVector", "Focal length over the width and over the height of the picture"),
    Input("Center", "NodeSocketVector", "Center of the lens in the picture, from 0 to 1"),
    number("Perspective")("1 for a perspective camera, 0 for an orthographic one"),
)

CARD_BEHIND = 1.1  # distance of the card from the projector over that of the box's farthest corner
CARD_WIDTHS = 2.0  # width of the card over the picture's there: room for a camera that moves aside


def shown_background(smoke: bpy.types.Object) -> tuple[bpy.types.Image | None, tuple[float, float, float, float]]:
    """The plate of the result on show, by a path relative to the .blend where there is one; or None, and one color."""
    background = shown(smoke).scene.get("background") or {}
    color = (*background.get("color", (0.0, 0.0, 0.0)), 1.0)
    if "image" not in background:
        return None, color
    file = shown_take(smoke).directory / background["image"]
    image = bpy.data.images.load(str(file), check_existing=True)
    if image.filepath != relative(file):
        image.filepath = relative(file)
    return image, color


def show_plate(smoke: bpy.types.Object, tree: Tree, shader: bpy.types.ShaderNode, place: Callable[[], Socket]) -> None:
    """Have a shader show the clean plate of the result on show, or one color if the background is that.

    It has an input Color. If no texture is connected to that yet, ``place`` makes coordinates in the plate.
    """
    color, (image, one_color) = shader.inputs["Color"], shown_background(smoke)
    if image is None:
        for link in list(color.links):
            tree.links.remove(link)
        color.default_value = one_color
        return
    if not color.links:
        texture = add_node(tree, "ShaderNodeTexImage", -1.5, 0, place(), near=shader, extension="EXTEND")
        texture.inputs[0].links[0].from_node.location = shader.location - Vector((500.0, 0.0))
        tree.links.new(texture.outputs["Color"], color)
    node = color.links[0].from_node
    node.image = image
    synchronize_plate(smoke, image, node.image_user)


def show_plate_behind(smoke: bpy.types.Object, camera: bpy.types.Camera) -> None:
    """Show in the view through a camera what a render shows behind the smoke; the clip can be shown over it.

    The second time only the picture changes: what the artist shows or hides stays.
    """
    pictures, (plate, color) = camera.background_images, shown_background(smoke)
    image = plate or bpy.data.images.get(BACKGROUND) or bpy.data.images.new(BACKGROUND, 8, 8)
    if plate is None:
        image.generated_color = (*Color(color[:3]).from_scene_linear_to_srgb(), 1.0)
    image[PICTURE_MARK] = True
    picture = _marked(camera, PICTURE_MARK)
    if picture is None:
        if (clip := clip_behind(smoke, camera)) is not None:
            pictures.remove(clip)  # it would be below
        picture = _new_picture(camera, "IMAGE")
        picture.frame_method = "STRETCH"
        show_clip_behind(smoke, camera, False)
    camera.show_background_images, picture.image = True, image
    if plate is not None:
        synchronize_plate(smoke, plate, picture.image_user)


def show_clip_behind(smoke: bpy.types.Object, camera: bpy.types.Camera, visible: bool = True) -> None:
    """Show the clip in the view through a camera, behind everything, or have it there at a switch."""
    camera.show_background_images = True
    if clip_behind(smoke, camera) is None:
        _new_picture(camera, "MOVIE_CLIP").clip = smoke.smokelift.clip
    clip_behind(smoke, camera).show_background_image = visible


def camera_of_view(scene: bpy.types.Scene) -> bpy.types.Camera | None:
    """The scene's camera; None if another object stands in for one, which has no pictures behind its view."""
    return scene.camera.data if scene.camera is not None and scene.camera.type == "CAMERA" else None


def show_element_behind(camera: bpy.types.Camera, element: bpy.types.Image) -> None:
    """Lay the element of a frame over all else that the view through a camera shows behind its objects."""
    if (before := element_behind(camera)) is not None:
        camera.background_images.remove(before)  # a plate that was added later would be above
    element[ELEMENT_MARK] = camera.show_background_images = True
    _new_picture(camera, "IMAGE").image = element


def element_behind(camera: bpy.types.Camera) -> bpy.types.CameraBackgroundImage | None:
    """The element in the view through a camera, shown or hidden; None without one."""
    return _marked(camera, ELEMENT_MARK)


def clip_behind(smoke: bpy.types.Object, camera: bpy.types.Camera) -> bpy.types.CameraBackgroundImage | None:
    """The clip in the view through a camera, shown or hidden; None without one."""
    clip = smoke.smokelift.clip
    found = (each for each in camera.background_images if each.source == "MOVIE_CLIP" and each.clip == clip)
    return next(found, None)


def _marked(camera: bpy.types.Camera, mark: str) -> bpy.types.CameraBackgroundImage | None:
    """The picture in the view through a camera that has a mark; None without one."""
    pictures = (each for each in camera.background_images if each.source == "IMAGE" and each.image)
    return next((each for each in pictures if each.image.get(mark)), None)


def _new_picture(camera: bpy.types.Camera, source: str) -> bpy.types.CameraBackgroundImage:
    picture = camera.background_images.new()
    picture.source, picture.alpha, picture.display_depth = source, 1.0, "BACK"
    return picture


def synchronize_plate(smoke: bpy.types.Object, image: bpy.types.Image, user: Any) -> None:
    """Keep a plate of many pictures in step with the clip; one of a moving camera has a picture for every frame.

    The user, an image user or a node of the compositor, says which of them is shown.
    """
    clip, tracked = smoke.smokelift.clip, "matrices" in shown(smoke).scene["camera"]
    number = re.search(r"(\d+)\.\w+$", image.filepath)
    if tracked and image.source == "FILE" and number:
        image.source = "SEQUENCE"
    if image.source == "FILE":
        return
    # Blender counts the images of a sequence by the numbers in their names, and the frames of a video from 1
    before = int(number[1]) - 1 if number and image.source == "SEQUENCE" else 0
    user.frame_start, user.frame_duration = clip.frame_start, clip.frame_duration
    user.frame_offset = before + clip.frame_offset
    user.use_auto_refresh = True


def project(smoke: bpy.types.Object) -> None:
    """Project the plate of the result on show; a second time changes it and what the artist left as it was."""
    scene, tables = scene_of(smoke), shown(smoke).scene
    scene.render.film_transparent = False
    projector = _projector(smoke, tables["camera"])
    material = _material(projector, tables["camera"])
    placed = material.node_tree.nodes[PLACE].outputs[0]
    show_plate(smoke, material.node_tree, material.node_tree.nodes[MATERIAL], lambda: placed)
    if CARD not in scene.objects:
        _add_card(smoke, tables, material)


def show_card(scene: bpy.types.Scene, visible: bool) -> None:
    """Show or hide the card, if the scene has one: it would hide a plate that is put elsewhere."""
    card = scene.objects.get(CARD)
    if card is not None:
        card.hide_viewport = card.hide_render = not visible


def _poses(smoke: bpy.types.Object, table: dict[str, Any]) -> list[Matrix]:
    """Where the clip was filmed from, in Blender's world: one matrix, or one for every frame."""
    return [engine_to_world(smoke) @ Matrix(pose) for pose in table.get("matrices") or [table["matrix"]]]


def _projector(smoke: bpy.types.Object, table: dict[str, Any]) -> bpy.types.Object:
    """The camera that projects, made or moved; its place stays where the artist changed it."""
    scene = scene_of(smoke)
    projector = scene.objects.get(PROJECTOR)
    if projector is None or projector.type != "CAMERA":
        projector = bpy.data.objects.new(PROJECTOR, bpy.data.cameras.new(PROJECTOR))
        scene.collection.objects.link(projector)
    # its own picture only shows the clip's; what is projected is computed from the table
    (width, height), longest = table["size"], max(table["size"])
    lens = projector.data
    lens.type = "ORTHO" if table["type"] == "orthographic" else "PERSP"
    lens.lens, lens.ortho_scale = table["fx"] * lens.sensor_width / longest, longest / table["fx"]
    lens.shift_x, lens.shift_y = (width / 2 - table["cx"]) / longest, (table["cy"] - height / 2) / longest
    poses = _poses(smoke, table)
    if len(poses) == 1:
        set_unless_changed(projector, "place", projector, "matrix_basis", poses[0])
    else:
        first = smoke.smokelift.clip.frame_start + frames_before(smoke, shown_take(smoke))
        _animate(projector, poses, first)
    return projector


def _animate(obj: bpy.types.Object, poses: list[Matrix], first: int) -> None:
    obj.animation_data_clear()
    obj.rotation_mode = "QUATERNION"
    before = None
    for frame, pose in enumerate(poses, first):
        obj.matrix_basis = pose
        if before is not None:
            turned = obj.rotation_quaternion.copy()
            turned.make_compatible(before)
            obj.rotation_quaternion = turned
        before = obj.rotation_quaternion.copy()
        for path in ("location", "rotation_quaternion"):
            obj.keyframe_insert(path, frame=frame)


def _add_card(smoke: bpy.types.Object, tables: dict[str, Any], material: bpy.types.Material) -> None:
    """A plane behind the smoke's box, across the view of the clip's first frame and beyond its edges."""
    table, domain = tables["camera"], tables["domain"]
    pose = _poses(smoke, table)[0]
    low, high = domain["min"], domain["max"]
    corners = [Vector((x, y, z)) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    to_camera = pose.inverted() @ engine_to_world(smoke)
    distance = CARD_BEHIND * max(-(to_camera @ corner).z for corner in corners)
    spread = 1.0 if table["type"] == "orthographic" else distance
    width, height = (size * spread / table[focal] for size, focal in zip(table["size"], ("fx", "fy"), strict=True))
    right = (table["size"][0] / 2 - table["cx"]) * spread / table["fx"]
    up = (table["cy"] - table["size"][1] / 2) * spread / table["fy"]
    x, y = CARD_WIDTHS * width / 2, CARD_WIDTHS * height / 2
    mesh = bpy.data.meshes.new(CARD)
    mesh.from_pydata([(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)], [], [(0, 1, 2, 3)])
    mesh.materials.append(material)
    card = bpy.data.objects.new(CARD, mesh)
    card.matrix_basis = pose @ Matrix.Translation((right, up, -distance))
    scene_of(smoke).collection.objects.link(card)


def _material(projector: bpy.types.Object, table: dict[str, Any]) -> bpy.types.Material:
    """The material: the file's own, which the artist may have changed, else a new one; with the clip's lens."""
    material = next((known for known in bpy.data.materials if known.library is None and known.get(MARK)), None)
    material = material or _new_material()
    nodes = material.node_tree.nodes
    nodes[PROJECTOR].object = projector
    place, (width, height) = nodes[PLACE], table["size"]
    place.inputs["Focal Length"].default_value = (table["fx"] / width, table["fy"] / height, 0.0)
    # Blender counts the rows of a picture from below
    place.inputs["Center"].default_value = (table["cx"] / width, 1.0 - table["cy"] / height, 0.0)
    place.inputs["Perspective"].default_value = 0.0 if table["type"] == "orthographic" else 1.0
    return material


def _new_material() -> bpy.types.Material:
    """A material that the camera sees, and which neither lights the smoke nor takes light from it."""
    material = empty_material(MATERIAL)
    material[MARK] = True
    tree = material.node_tree
    outputs = {"Vector": "NodeSocketVector", "In Front": "NodeSocketFloat"}
    group = file_group(MATERIAL, "ShaderNodeTree", MARK, _INPUTS, outputs, _build)
    point = add_node(tree, "ShaderNodeTexCoord", 0, 1, name=PROJECTOR).outputs["Object"]
    place = add_node(tree, "ShaderNodeGroup", 1, 1, node_tree=group, name=PLACE, width=180.0)
    tree.links.new(point, place.inputs["Point"])
    shader = add_node(tree, "ShaderNodeEmission", 3, 1, name=MATERIAL)
    tree.links.new(place.outputs["In Front"], shader.inputs["Strength"])
    rays = add_node(tree, "ShaderNodeLightPath", 3, -2).outputs["Is Camera Ray"]
    clear = add_node(tree, "ShaderNodeBsdfTransparent", 3, -1).outputs[0]
    mix = add_node(tree, "ShaderNodeMixShader", 4, 0, rays, clear, shader.outputs[0])
    add_node(tree, "ShaderNodeOutputMaterial", 5, 0, mix.outputs[0])
    material.cycles.emission_sampling = "NONE"
    return material


def _build(tree: Tree) -> None:
    """Make the nodes of center + focal length x (point / depth); a camera looks along its -Z axis."""
    source = add_node(tree, "NodeGroupInput", 0, 0).outputs
    z = add_node(tree, "ShaderNodeSeparateXYZ", 1, 0, source["Point"]).outputs["Z"]
    depth = math_node(tree, "MULTIPLY", 2, 0, z, -1.0)
    # depth ^ 0 = 1 for an orthographic camera
    divisor = math_node(tree, "POWER", 3, 0, depth, source["Perspective"])
    slope = vector_node(tree, "DIVIDE", 4, 0, source["Point"], divisor)
    point = vector_node(tree, "MULTIPLY_ADD", 5, 0, slope, source["Focal Length"], source["Center"])
    in_front = math_node(tree, "GREATER_THAN", 5, 1.25, depth, 0.0)
    add_node(tree, "NodeGroupOutput", 6, 0, point, in_front)
