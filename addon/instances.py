"""Instances of a Volume, each with its own time: one object, or as many as geometry nodes place.

Blender keeps the time of a sequence in the Volume data-block, and all instances of a data-block show the same frame.
So the node group picks for every point one of a few Volumes that play the same files, each some frames later.
"""

from typing import Any

import bpy
from bpy.props import BoolProperty, IntProperty

from .nodes import Input, add_node, feed, file_group, get_input, set_input
from .paths import absolute, relative

GROUP = "Smokelift Instances"
"""Name of the node group."""

MARK = "smokelift_instances"
"""Custom property by which the group is known under any name."""

OFFSET = "time_offset"
"""Attribute of the points: frames by which the instance plays later."""

_INPUTS = (
    Input(
        "Points",
        "NodeSocketGeometry",
        "Where instances stand; the attribute time_offset says by how many frames each plays later",
    ),
    Input("Times", "NodeSocketCollection", "Volumes that play the same files, each later than the one before"),
    Input("Frames Apart", "NodeSocketInt", "Frames from one of the times to the next", default=1, low=1),
    Input(
        "Random Offset",
        "NodeSocketInt",
        "Frames by which an instance plays later at random, at most; added to time_offset",
        default=0,
        low=0,
    ),
    Input("Seed", "NodeSocketInt", "Another seed makes other random offsets", default=0, low=0),
)

APART = 1.1
"""Distance of the first points over the width of the smoke."""


def copy_of(obj: bpy.types.Object, name: str) -> bpy.types.Object:
    """A copy of a Volume object, with data of its own and the same material, which is no smoke to be made."""
    copy = bpy.data.objects.new(name, obj.data.copy())
    copy.matrix_basis, copy.delta_location = obj.matrix_basis, obj.delta_location
    return copy


def copy_later(obj: bpy.types.Object, name: str, offset: int, repeat: bool) -> bpy.types.Object:
    """A copy of a Volume object that plays some frames later; again and again if it repeats or the original does."""
    copy = copy_of(obj, name)
    if obj.data.library is not None:
        copy.data.filepath = relative(absolute(obj.data.filepath, obj.data.library))
    copy.data.frame_start += offset
    copy.data.sequence_mode = "REPEAT" if repeat else obj.data.sequence_mode
    return copy


def scatter(obj: bpy.types.Object, width: float, count: int, step: int, repeat: bool) -> bpy.types.Object:
    """An object whose points are instances of a Volume, each later than the one before; in no collection yet.

    Parameters
    ----------
    obj
        The Volume object; its place is that of the new object, its rotation and scale those of each instance.
    width
        Of the smoke in metres; what Blender does not know yet, 0, counts as 1.
    count
        Number of times, and of points at first.
    step
        Frames between two of them.
    repeat
        Whether they play again and again.
    """
    name = f"{obj.name} Instances"
    times = bpy.data.collections.new(f"{obj.name} Times")
    for number in range(count):
        # the node for collections counts objects in the order of their names
        copy = copy_later(obj, f"{obj.name} {number * step:05d}", number * step, repeat)
        copy.location = (0.0, 0.0, 0.0)
        times.objects.link(copy)
    apart = APART * (width or 1.0)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([((number + 1) * apart, 0.0, 0.0) for number in range(count)], [], [])
    mesh.attributes.new(OFFSET, "INT", "POINT").data.foreach_set("value", [number * step for number in range(count)])
    points = bpy.data.objects.new(name, mesh)
    points.location = obj.location
    modifier = points.modifiers.new(GROUP, "NODES")
    modifier.node_group = file_group(
        GROUP, "GeometryNodeTree", MARK, _INPUTS, [("Instances", "NodeSocketGeometry")], _build
    )
    set_input(modifier, "Times", times)
    set_input(modifier, "Frames Apart", step)
    return points


def remove_scattered(points: bpy.types.Object) -> None:
    """Remove what `scatter` made."""
    modifier = points.modifiers[GROUP]
    group, times = modifier.node_group, get_input(modifier, "Times")
    bpy.data.meshes.remove(points.data)  # takes the object with it
    for obj in list(times.objects):
        bpy.data.volumes.remove(obj.data)
    bpy.data.collections.remove(times)
    if group.users == 0:
        bpy.data.node_groups.remove(group)


def _build(tree: bpy.types.NodeTree) -> None:
    """Make the group's nodes: the offset of each point, counted in Frames Apart, picks its Volume."""
    given, output = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    source = given.outputs

    def new(kind: str, column: int, row: int, inputs: dict[str | int, Any], **settings: Any) -> bpy.types.NodeSocket:
        """A node with inputs by name or number; returns its first output. Which there are depends on its settings."""
        node = add_node(tree, kind, column, row, **settings)
        sockets = [socket for socket in node.inputs if socket.enabled]
        for key, value in inputs.items():
            feed(tree, sockets[key] if isinstance(key, int) else next(s for s in sockets if s.name == key), value)
        return next(socket for socket in node.outputs if socket.enabled)

    def frames(operation: str, column: int, a: Any, b: Any) -> bpy.types.NodeSocket:
        return new("FunctionNodeIntegerMath", column, 1, {0: a, 1: b}, operation=operation)

    stored = new("GeometryNodeInputNamedAttribute", 1, 1, {"Name": OFFSET}, data_type="INT")
    chance = {"Min": 0, "Max": source["Random Offset"], "Seed": source["Seed"]}
    random = new("FunctionNodeRandomValue", 1, 2, chance, data_type="INT")
    index = frames("DIVIDE_FLOOR", 3, frames("ADD", 2, stored, random), source["Frames Apart"])
    volumes = {"Collection": source["Times"], "Separate Children": True}
    instances = new("GeometryNodeCollectionInfo", 3, 0, volumes)
    chosen = {"Points": source["Points"], "Instance": instances, "Pick Instance": True, "Instance Index": index}
    placed = new("GeometryNodeInstanceOnPoints", 4, 0, chosen)
    tree.links.new(placed, output.inputs[0])
    given.location, output.location = (-100.0, 0.0), (1000.0, 0.0)


def _activate(context: bpy.types.Context, obj: bpy.types.Object) -> None:
    for other in context.selected_objects:
        other.select_set(False)
    obj.select_set(True)
    context.view_layer.objects.active = obj


class _NeedsSequence:
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        obj = context.object
        if obj is None or obj.type != "VOLUME" or not obj.data.is_sequence:
            cls.poll_message_set("Select a Volume that plays a sequence")
            return False
        if obj.data.animation_data is not None and obj.data.animation_data.drivers:
            cls.poll_message_set("Set Speed to Frame by Frame first")
            return False
        return True


class SMOKELIFT_OT_add_instance(_NeedsSequence, bpy.types.Operator):
    """Add another object that plays the active Volume's files later or earlier. The material is shared"""

    bl_idname = "smokelift.add_instance"
    bl_label = "Instance in Time"
    bl_options = {"REGISTER", "UNDO"}

    offset: IntProperty(
        name="Time Offset", description="Frames by which the new object plays later; below 0 earlier", default=12
    )
    repeat: BoolProperty(name="Repeat", description="Play the frames again and again, as for a loop")

    def execute(self, context: bpy.types.Context) -> set[str]:
        obj = context.object
        instance = copy_later(obj, obj.name, self.offset, self.repeat)
        context.collection.objects.link(instance)
        _activate(context, instance)
        return {"FINISHED"}


class SMOKELIFT_OT_scatter(_NeedsSequence, bpy.types.Operator):
    """Add an object whose points each show the active Volume at a time of their own, by geometry nodes"""

    bl_idname = "smokelift.scatter"
    bl_label = "Scatter in Time"
    bl_options = {"REGISTER", "UNDO"}

    count: IntProperty(
        name="Times",
        description="Number of different times. Each reads a file in every frame, however many instances it has",
        default=6,
        min=1,
        soft_max=24,
        max=1000,
    )
    step: IntProperty(name="Frames Apart", description="Frames from one of the times to the next", default=8, min=1)
    repeat: BoolProperty(name="Repeat", description="Play the frames again and again, as for a loop")

    def execute(self, context: bpy.types.Context) -> set[str]:
        obj = context.object
        points = scatter(obj, max(obj.dimensions.xy), self.count, self.step, self.repeat)
        context.collection.objects.link(points)
        _activate(context, points)
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory((SMOKELIFT_OT_add_instance, SMOKELIFT_OT_scatter))
