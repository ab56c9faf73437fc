"""The smoke over its clip in Blender's compositor.

The film is transparent. A plane below the smoke catches its shadow, and what is in the collection for holdouts hides
the smoke. The compositor puts the render over the clean plate, adds the clip's own grain, and shows the clip in front
of it all where a mask says so. What the artist changes of it stays.
"""

from typing import Any

import bpy
from mathutils import Matrix, Vector

from .geometry import engine_to_world
from .nodes import SINCE_5, Socket, Tree, add_node, color, compositor, feed, file_group, number, set_kind
from .plate import shown_background, synchronize_plate
from .smoke import scene_of
from .volume import shown

GROUP = "Smokelift Composite"  # name of the node group, and of its node in the scene's compositor
MARK = "smokelift_composite"  # custom property by which the group is known under any name
FLOOR = "Smokelift Floor"  # name of the plane that catches the shadow
FLOOR_WIDTHS = 2.0  # width of the plane over the box's: room for the shadow, and little beyond a wall behind the smoke
_ENGINE = "smokelift_engine"  # custom property of the scene: the render engine that it had before
HOLDOUTS = "Smokelift Holdouts"  # name of the collection whose objects hide the smoke, and show the plate

GRAIN_PIXELS = 4
"""What is finer than this is grain: the blur that separates it (pixels of the clip). Sensor noise differs from pixel to
pixel."""

_CLIP_SIZE = ("Clip Width", "Clip Height")
"""Names of the group's inputs for the clip's size: grain is as wide as its pixels, whatever the render's size."""

LARGEST_DIFFERENCE = 0.05  # of clip and plate, blurred (linear radiance): beyond it is smoke, whose detail is no grain

_INPUTS = (
    color("Render", 0.0, 0.0, 0.0, 0.0)("The smoke on transparent film"),
    color("Plate", 0.0, 0.0, 0.0, 1.0)("What is behind the smoke: the clean plate, or another clip"),
    color("Clip", 0.0, 0.0, 0.0, 1.0)("The clip, from which the grain and the foreground are taken"),
    number("Foreground", 0.0, 0.0, 1.0)("Mask of what is in front of the smoke in the clip"),
    number("Grain", 1.0, 0.0, 10.0)("Strength of the clip's grain on plate and smoke; 0 is none"),
    *(number(name, 1.0, 1.0)("Pixels of the clip, whatever the render's size") for name in _CLIP_SIZE),
)


def composite(smoke: bpy.types.Object) -> None:
    """Set the compositor up for the result on show; a second time changes the plate and the clip only."""
    scene = scene_of(smoke)
    if scene.render.engine != "CYCLES":
        scene[_ENGINE] = scene.render.engine
        scene.render.engine = "CYCLES"  # EEVEE has no shadow catcher
    scene.render.film_transparent = True
    _catch_shadow(scene, smoke, shown(smoke).scene["domain"])
    if HOLDOUTS not in scene.collection.children:
        held = bpy.data.collections.new(HOLDOUTS)
        scene.collection.children.link(held)
        for layer in scene.view_layers:
            layer.layer_collection.children[held.name].holdout = True
    tree, output = compositor(scene)
    node = tree.nodes.get(GROUP)
    if node is None:
        node = _insert(tree, output)
    elif node.mute:
        _show(scene, node, True)
    _connect(tree, node, smoke)


def disable_composite(scene: bpy.types.Scene) -> None:
    """Render as if it were not there, and keep it as the artist has it until it is set up again."""
    tree = scene.compositing_node_group if SINCE_5 else scene.node_tree
    node = tree.nodes.get(GROUP) if tree is not None else None
    if node is None or node.mute:
        return
    _show(scene, node, False)
    scene.render.film_transparent = False
    engine = scene.pop(_ENGINE, None)
    if engine is not None and scene.render.engine == "CYCLES":
        scene.render.engine = engine


def _show(scene: bpy.types.Scene, node: bpy.types.Node, shown: bool) -> None:
    """Switch the composite's parts on or off: a muted group shows the render."""
    node.mute = not shown
    floor = scene.objects.get(FLOOR)
    if floor is not None:
        floor.hide_viewport = floor.hide_render = not shown
    for layer in scene.view_layers:
        held = layer.layer_collection.children.get(HOLDOUTS)
        if held is not None:
            held.holdout = shown


def _catch_shadow(scene: bpy.types.Scene, smoke: bpy.types.Object, domain: dict[str, Any]) -> None:
    """A plane at the bottom of the smoke's box, unless the scene has one."""
    if FLOOR in scene.objects:
        return
    low, high = Vector(domain["min"]), Vector(domain["max"])
    half = FLOOR_WIDTHS * max(high.x - low.x, high.y - low.y) / 2
    mesh = bpy.data.meshes.new(FLOOR)
    mesh.from_pydata([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], [], [(0, 1, 2, 3)])
    plane = bpy.data.objects.new(FLOOR, mesh)
    middle = Vector(((low.x + high.x) / 2, (low.y + high.y) / 2, low.z))
    plane.matrix_basis = engine_to_world(smoke) @ Matrix.Translation(middle)
    plane.is_shadow_catcher = True
    # the light that a floor throws back is in what was fitted already
    plane.visible_volume_scatter = plane.visible_diffuse = plane.visible_shadow = False
    plane.display_type = "WIRE"
    scene.collection.objects.link(plane)


def _insert(tree: Tree, shown: Socket) -> bpy.types.Node:
    """Put our group between the output and what it showed, or the render if it showed nothing."""
    if shown.links:
        render = shown.links[0].from_socket
    else:
        layers = next((node for node in tree.nodes if node.type == "R_LAYERS"), None)
        layers = layers or tree.nodes.new("CompositorNodeRLayers")
        render = layers.outputs["Image"]
    group = file_group(GROUP, "CompositorNodeTree", MARK, _INPUTS, {"Image": "NodeSocketColor"}, _build)
    node = add_node(tree, "CompositorNodeGroup", 0, 0, node_tree=group, name=GROUP, width=200.0)
    node.location = render.node.location + Vector((render.node.width + 60.0, 0.0))
    shown.node.location = node.location + Vector((node.width + 60.0, 0.0))
    tree.links.new(render, node.inputs["Render"])
    tree.links.new(node.outputs[0], shown)
    return node


def _connect(tree: Tree, node: bpy.types.Node, smoke: bpy.types.Object) -> None:
    """Feed the sockets of clip and plate, whose sources have our names unless the artist put others there."""
    clip = smoke.smokelift.clip
    for side, pixels in zip(_CLIP_SIZE, clip.size, strict=True):
        if side in node.inputs:  # the group may be an artist's own
            node.inputs[side].default_value, node.inputs[side].hide = pixels, True
    plate, one_color = shown_background(smoke)
    source = _source(tree, "CompositorNodeImage", node, "Plate", 1.5)
    if source is not None and plate is not None:
        source.image = plate
        synchronize_plate(smoke, plate, source)
    elif source is not None:
        tree.nodes.remove(source)
        node.inputs["Plate"].default_value = one_color
    source = _source(tree, "CompositorNodeMovieClip", node, "Clip", 3.0)
    if source is not None:
        source.clip = clip


def _source(tree: Tree, kind: str, node: bpy.types.Node, socket: str, down: float) -> bpy.types.Node | None:
    """Our node of pictures that feeds a socket of ours, made if need be; None where the artist put another there."""
    source = tree.nodes.get(f"{GROUP} {socket}")
    if source is None and not node.inputs[socket].links:
        source = add_node(tree, kind, -1.5, down, near=node, name=f"{GROUP} {socket}")
        tree.links.new(source.outputs["Image"], node.inputs[socket])
    return source


def _build(tree: Tree) -> None:
    """Make the group's nodes: the render over the plate, with the clip's grain, and the clip's foreground over both."""
    given, output = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    source = given.outputs
    over = tree.nodes.new("CompositorNodeAlphaOver")
    below, above = over.inputs[:2] if SINCE_5 else over.inputs[1:3]
    tree.links.new(_scaled(tree, source["Plate"], "Render Size"), below)
    tree.links.new(source["Render"], above)
    grain = _scaled(tree, _grain(tree, source), "Render Size")
    grainy = _mix(tree, "ADD", source["Grain"], over.outputs["Image"], grain)
    front = _mix(tree, "MIX", source["Foreground"], grainy, _scaled(tree, source["Clip"], "Render Size"))
    tree.links.new(front, output.inputs[0])
    for place, node in enumerate(tree.nodes):
        node.location = (0.0, 0.0) if node == given else (220.0 * (len(tree.nodes) if node == output else place), 0.0)


def _grain(tree: Tree, source: bpy.types.bpy_prop_collection) -> Socket:
    """The clip's own grain, frame by frame, at the clip's pixels.

    The plate has no grain, and the same edges as the clip: their difference less its blur is grain. Where the blurred
    difference is large the clip shows smoke, and the grain fades out.
    """
    plate = _scaled(tree, source["Plate"], "Absolute")
    for socket, side in zip("XY", _CLIP_SIZE, strict=True):
        tree.links.new(source[side], plate.node.inputs[socket])
    differs = _mix(tree, "SUBTRACT", 1.0, source["Clip"], plate)
    blurred = _blurred(tree, differs)
    fine = _mix(tree, "SUBTRACT", 1.0, differs, blurred)
    steep = (*[1.0 / LARGEST_DIFFERENCE] * 3, 1.0)
    ratio = _mix(tree, "MULTIPLY", 1.0, blurred, steep)
    smoky = _mix(tree, "MULTIPLY", 1.0, ratio, ratio)
    clear = _mix(tree, "SUBTRACT", 1.0, (1.0, 1.0, 1.0, 1.0), smoky, clamp=True)
    return _mix(tree, "MULTIPLY", 1.0, fine, clear)


def _scaled(tree: Tree, picture: Socket, kind: str) -> Socket:
    """A picture at the render's size, or at an absolute one."""
    node = add_node(tree, "CompositorNodeScale", 0, 0, picture)
    set_kind(node, kind, "space")
    return node.outputs[0]


def _mix(tree: Tree, blend: str, factor: Any, a: Any, b: Any, clamp: bool = False) -> Socket:
    """Two pictures in one; from 0 to 1 if it is clamped."""
    if SINCE_5:
        node = tree.nodes.new("ShaderNodeMix")
        node.data_type, node.clamp_factor, node.clamp_result = "RGBA", False, clamp
        known = {socket.identifier: socket for socket in (*node.inputs, *node.outputs)}
        *sockets, result = (known[name] for name in ("Factor_Float", "A_Color", "B_Color", "Result_Color"))
    else:
        node = tree.nodes.new("CompositorNodeMixRGB")
        node.use_clamp = clamp
        sockets, result = list(node.inputs), node.outputs[0]
    node.blend_type = blend
    for socket, value in zip(sockets, (factor, a, b), strict=True):
        feed(tree, socket, value)
    return result


def _blurred(tree: Tree, picture: Socket) -> Socket:
    node = add_node(tree, "CompositorNodeBlur", 0, 0, picture)
    if "Size" in node.inputs and node.inputs["Size"].type == "VECTOR":  # since 4.5
        node.inputs["Size"].default_value = [GRAIN_PIXELS] * len(node.inputs["Size"].default_value)
    else:
        node.size_x = node.size_y = GRAIN_PIXELS
    return node.outputs[0]
