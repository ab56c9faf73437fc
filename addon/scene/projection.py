"""The clean plate, projected from where the clip was filmed, on a card or on geometry of the artist.

It stays where it is while the camera of the render moves, and looks as in the clip from where that was filmed,
whatever it lies on. It is computed for every point that is shaded, so no mesh has to be subdivided for it.
"""

from typing import Any

import bpy
from mathutils import Matrix, Vector

from .blender import set_unless_changed
from .box import engine_to_world
from .nodes import Input, Tree, add_node, empty_material, file_group, math_node, number, vector_node
from .plate import show_plate
from .smoke import scene_of
from .volume import frames_before, shown, shown_take

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


def show_card(scene: bpy.types.Scene, shown: bool) -> None:
    """Show or hide the card, if the scene has one: it would hide a plate that is put elsewhere."""
    card = scene.objects.get(CARD)
    if card is not None:
        card.hide_viewport = card.hide_render = not shown


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
    """Key the place of an object in every frame from the first on."""
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
