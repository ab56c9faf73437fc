"""Node groups that the add-on makes: their sockets, and the nodes in them."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import bpy
from mathutils import Vector

Tree, Socket = bpy.types.NodeTree, bpy.types.NodeSocket

SINCE_5 = bpy.app.version >= (5, 0, 0)  # the compositor is a node group, with the shaders' Mix node
SPACING = 200.0  # pixels from one column or row of nodes to the next


class Input(NamedTuple):
    """An input of a node group; what is None stays as Blender has it."""

    name: str
    kind: str
    description: str
    default: Any = None
    low: float | None = None
    high: float | None = None


Described = Callable[[str], Input]  # makes an input of its tooltip


def number(name: str, default: float = 0.0, low: float | None = None, high: float | None = None) -> Described:
    return lambda description: Input(name, "NodeSocketFloat", description, default, low, high)


def color(name: str, *default: float) -> Described:
    """An input that is a color with alpha."""
    return lambda description: Input(name, "NodeSocketColor", description, default)


def empty_material(name: str) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # since 5.0 there always is one
        material.use_nodes = True
    material.node_tree.nodes.clear()
    return material


def compositor(scene: bpy.types.Scene) -> tuple[Tree, Socket]:
    """The scene's compositor, made if there is none, and the socket of its output."""
    if SINCE_5:
        tree = scene.compositing_node_group
        if tree is None:
            tree = scene.compositing_node_group = bpy.data.node_groups.new("Compositing", "CompositorNodeTree")
        if not any(item.item_type == "SOCKET" and item.in_out == "OUTPUT" for item in tree.interface.items_tree):
            tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        kind, identifier = "GROUP_OUTPUT", "NodeGroupOutput"
    else:
        scene.use_nodes = True
        tree = scene.node_tree
        kind, identifier = "COMPOSITE", "CompositorNodeComposite"
    scene.render.use_compositing = True
    output = next((node for node in tree.nodes if node.type == kind), None) or tree.nodes.new(identifier)
    return tree, output.inputs[0]


def file_group(
    name: str, kind: str, mark: str, inputs: Sequence[Input], outputs: Mapping[str, str], build: Callable[[Tree], None]
) -> Tree:
    """The file's own node group of a mark, its custom property, or else a new one, whose nodes ``build`` adds.

    The kind is that of its tree; outputs are names and types.
    """
    for group in bpy.data.node_groups:
        if group.library is None and group.get(mark):
            return group
    tree = bpy.data.node_groups.new(name, kind)
    tree[mark] = True
    if kind == "GeometryNodeTree":
        tree.is_modifier = True
    for item in inputs:
        socket = tree.interface.new_socket(
            item.name, description=item.description, in_out="INPUT", socket_type=item.kind
        )
        for attribute, value in (("min_value", item.low), ("max_value", item.high), ("default_value", item.default)):
            if value is not None:
                setattr(socket, attribute, value)
    for output, output_kind in outputs.items():
        tree.interface.new_socket(output, in_out="OUTPUT", socket_type=output_kind)
    build(tree)
    return tree


def add_node(
    tree: Tree, kind: str, column: float, row: float, *inputs: Any, name: str = "", near: Any = None, **settings: Any
) -> bpy.types.Node:
    """Add a node at a place of the grid that `SPACING` makes, near another if there is one, with these attributes.

    Sockets of other nodes, or values, feed its first inputs, in their order, after the attributes are set.
    """
    node = tree.nodes.new(kind)
    node.location = Vector((SPACING * column, -SPACING * row)) + (near.location if near else Vector((0.0, 0.0)))
    if name:
        node.name = node.label = name
    for attribute, value in settings.items():
        setattr(node, attribute, value)
    for place, value in enumerate(inputs):
        feed(tree, node.inputs[place], value)
    return node


def math_node(tree: Tree, operation: str, column: float, row: float, *values: Any) -> Socket:
    """A number of other numbers, by a node at a place of the grid."""
    return add_node(tree, "ShaderNodeMath", column, row, *values, operation=operation).outputs[0]


def vector_node(tree: Tree, operation: str, column: float, row: float, *values: Any) -> Socket:
    return add_node(tree, "ShaderNodeVectorMath", column, row, *values, operation=operation).outputs["Vector"]


def scaled_vector(tree: Tree, column: float, row: float, vector: Any, factor: Socket) -> Socket:
    """A vector times a number."""
    node = add_node(tree, "ShaderNodeVectorMath", column, row, vector, operation="SCALE")
    tree.links.new(factor, node.inputs["Scale"])
    return node.outputs["Vector"]


def set_kind(node: bpy.types.Node, kind: str, attribute: str) -> None:
    """Choose what kind a node of the compositor is: by its input Type, which is an attribute before 5.0."""
    if SINCE_5:
        node.inputs["Type"].default_value = kind
    else:
        setattr(node, attribute, kind.upper().replace(" ", "_"))


def feed(tree: Tree, socket: Socket, value: Any) -> None:
    """Link an input to a socket, or set it to a value."""
    if isinstance(value, bpy.types.NodeSocket):
        tree.links.new(value, socket)
    else:
        socket.default_value = value
