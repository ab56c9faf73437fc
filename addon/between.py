"""What lies between two frames of a take, where its pace asks for it: by geometry nodes that Blender has since 5.0.

A modifier moves the smoke of the frame before on with its velocity and that of the frame after back, and mixes them.
"""

from typing import Any

import bpy

from .nodes import Input, add_node, input_path, new_group, set_input
from .proxy import in_viewport
from .second_volume import SecondVolume

NAME = "Smokelift Frames Between"
"""Name of the node group, and of the modifier."""

AVAILABLE = bpy.app.version >= (5, 0, 0)
"""Whether this Blender has nodes that move grids."""

GRIDS = ("density", "flame")
"""What is moved, where the files have it."""

_INPUTS = (
    Input("Smoke", "NodeSocketGeometry", "The frame before"),
    Input("Next Frame", "NodeSocketObject", "Volume that plays the same files a frame earlier"),
    Input("Part", "NodeSocketFloat", "How far it is from the frame before, 0, to the frame after, 1", 0.0, 0.0, 1.0),
    Input("Seconds", "NodeSocketFloat", "From the frame before to the frame after", 1.0, 0.0),
)


def next_of(smoke: bpy.types.Object) -> bpy.types.Volume | None:
    """The Volume that plays the frame after the one that a smoke plays; None without frames between."""
    return _BETWEEN.volume(smoke)


def fit_between(smoke: bpy.types.Object, wanted: bool) -> None:
    """Give a smoke frames between, or take them away."""
    if not wanted or not AVAILABLE:
        _BETWEEN.remove(smoke)
        return
    modifier = _BETWEEN.add(smoke)
    # before the proxy, which takes the place of all; where that is on show, nothing need be computed
    smoke.modifiers.move(list(smoke.modifiers).index(modifier), 0)
    modifier.show_viewport = in_viewport(smoke) == smoke.data


def drive_between(smoke: bpy.types.Object, place: str, seconds: float) -> None:
    """Say where in the take a smoke is in a frame of the scene.

    Parameters
    ----------
    smoke
        With or without frames between.
    place
        The place in frames, as an expression for a driver.
    seconds
        From one frame to the next.
    """
    modifier = _BETWEEN.modifier(smoke)
    if modifier is None:
        return
    set_input(modifier, "Seconds", seconds)
    path = input_path(modifier, "Part")
    smoke.driver_remove(path)
    driver = smoke.driver_add(path).driver
    driver.type = "SCRIPTED"
    driver.expression = f"fmod({place},1)"


def _group() -> bpy.types.NodeTree:
    tree = new_group(NAME, "GeometryNodeTree", _BETWEEN.mark, _INPUTS, [("Smoke", "NodeSocketGeometry")])
    given = add_node(tree, "NodeGroupInput", 0, 0).outputs
    later = add_node(tree, "GeometryNodeObjectInfo", 1, 3, given["Next Frame"]).outputs["Geometry"]

    def math(operation: str, column: int, row: int, *values: Any) -> bpy.types.NodeSocket:
        return add_node(tree, "ShaderNodeMath", column, row, *values, operation=operation).outputs[0]

    def moved(volume: bpy.types.NodeSocket, name: str, row: int, seconds: Any, share: Any) -> bpy.types.NodeSocket:
        """A grid that went on with its velocity for some seconds, times a number."""
        grid, velocity = (
            add_node(tree, "GeometryNodeGetNamedGrid", 2, place, volume, grid_name, False, data_type=kind)
            for grid_name, kind, place in ((name, "FLOAT", row), ("velocity", "VECTOR", row + 1))
        )
        there = (grid.outputs["Grid"], velocity.outputs["Grid"], seconds)
        advected = add_node(tree, "GeometryNodeGridAdvect", 4, row, *there, data_type="FLOAT")
        return math("MULTIPLY", 5, row, advected.outputs[0], share)

    rest = math("SUBTRACT", 1, 5, 1.0, given["Part"])
    forth = math("MULTIPLY", 2, 8, given["Part"], given["Seconds"])
    back = math("MULTIPLY", 3, 9, math("MULTIPLY", 2, 9, rest, given["Seconds"]), -1.0)
    result = given["Smoke"]
    for number, name in enumerate(GRIDS):
        row = 4 * number
        before = moved(given["Smoke"], name, row, forth, rest)
        mixed = math("ADD", 6, row, before, moved(later, name, row + 2, back, given["Part"]))
        result = add_node(tree, "GeometryNodeStoreNamedGrid", 7 + number, row, result, name, mixed).outputs[0]
    add_node(tree, "NodeGroupOutput", 7 + len(GRIDS), 0, result)
    return tree


_BETWEEN = SecondVolume(NAME, "smokelift_between", "Next Frame", _group)
