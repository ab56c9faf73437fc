"""Modifiers whose node group reads a second Volume: the proxy of a large smoke, and frames between two of a take.

The proxy acts in viewports alone, where it gives the smoke the grids of coarse copies of its files. So every render
uses the smoke itself, also in a Blender without the add-on, and no viewport reads the smoke's own files.

Between two frames, where the speed asks for that, the smoke of the frame before is moved on with its velocity and that
of the frame after back, and they are mixed, by geometry nodes that Blender has since 5.0.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import bpy

from ..core.contract import PROXY_FILE, PROXY_VOXELS
from ..core.take import Take
from .nodes import SINCE_5, Input, Socket, Tree, add_node, file_group, math_node, number


@dataclass(frozen=True)
class SecondVolume:
    """A kind of modifier, of which a smoke has one or none."""

    name: str  # of the modifier and its node group, as `file_group` has the next ones too
    mark: str
    inputs: tuple[Input, ...]
    build: Callable[[Tree], None]
    socket: str  # input that is the second Volume's object, whose name ends so

    def modifier(self, smoke: bpy.types.Object) -> bpy.types.Modifier | None:
        groups = ((each, each.node_group) for each in smoke.modifiers if each.type == "NODES")
        return next((modifier for modifier, group in groups if group is not None and group.get(self.mark)), None)

    def volume(self, smoke: bpy.types.Object) -> bpy.types.Volume | None:
        modifier = self.modifier(smoke)
        obj = _get_input(modifier, self.socket) if modifier is not None else None
        return obj.data if obj is not None else None

    def add(self, smoke: bpy.types.Object) -> bpy.types.Modifier:
        """Give a smoke the modifier unless it has it, with a Volume of its own that has the smoke's materials."""
        modifier = self.modifier(smoke)
        if modifier is None:
            modifier = smoke.modifiers.new(self.name, "NODES")
            outputs = {"Smoke": "NodeSocketGeometry"}
            group = file_group(self.name, "GeometryNodeTree", self.mark, self.inputs, outputs, self.build)
            modifier.node_group = group
            smoke.modifiers.move(len(smoke.modifiers) - 1, 0)  # those of the artist act on what it makes
        obj = _get_input(modifier, self.socket)
        if obj is None or obj.users > 1:  # that of the smoke that this one is a duplicate of
            obj = bpy.data.objects.new(f"{smoke.name} {self.socket}", smoke.data.copy())
            _set_input(modifier, self.socket, obj)
        if list(obj.data.materials) != list(smoke.data.materials):
            obj.data.materials.clear()
            for material in smoke.data.materials:
                obj.data.materials.append(material)
        return modifier

    def remove(self, smoke: bpy.types.Object) -> None:
        """Take the modifier and its Volume away."""
        modifier = self.modifier(smoke)
        if modifier is None:
            return
        obj = _get_input(modifier, self.socket)
        _set_input(modifier, self.socket, None)  # Blender 5.2 would go on counting it as used
        smoke.modifiers.remove(modifier)
        if obj is not None and obj.users == 0:  # else it is that of a duplicate, too
            bpy.data.volumes.remove(obj.data)  # takes the object with it


def _build_proxy(tree: Tree) -> None:
    given = add_node(tree, "NodeGroupInput", 0, 0)
    shown = add_node(tree, "GeometryNodeObjectInfo", 1, 0, given.outputs["Proxy"])
    add_node(tree, "NodeGroupOutput", 2, 0, shown.outputs["Geometry"])


_PROXY_INPUTS = (
    Input("Smoke", "NodeSocketGeometry", "The smoke itself"),
    Input("Proxy", "NodeSocketObject", "Volume that is shown in its place"),
)

PROXY = SecondVolume("Smokelift Proxy", "smokelift_proxy", _PROXY_INPUTS, _build_proxy, "Proxy")
"""Shows the proxy of a smoke in viewports, and is its switch."""


def in_viewport(smoke: bpy.types.Object) -> bpy.types.Volume:
    """The Volume that viewports show of a smoke, which has the settings for that."""
    modifier, proxy = PROXY.modifier(smoke), PROXY.volume(smoke)
    return proxy if proxy is not None and modifier.show_viewport else smoke.data


def lacks_proxy(smoke: bpy.types.Object, domain: Mapping[str, Any]) -> bool:
    """Whether a smoke of a domain is large for a viewport and has no proxy, as an earlier result."""
    return PROXY.modifier(smoke) is None and math.prod(domain["resolution"]) >= PROXY_VOXELS


def fit_proxy(smoke: bpy.types.Object, take: Take, numbers: list[int]) -> None:
    """Give a smoke a proxy if its take has files of one with these numbers, else none. Whether it is on show stays."""
    if {PROXY_FILE.format(number) for number in numbers} <= {file.name for file in take.directory.iterdir()}:
        PROXY.add(smoke).show_render = False
    else:
        PROXY.remove(smoke)


CAN_INTERPOLATE = SINCE_5  # whether this Blender has nodes that move grids
GRIDS = ("density", "flame")  # what is moved, where the files have it

_INTERPOLATION_INPUTS = (
    Input("Smoke", "NodeSocketGeometry", "The frame before"),
    Input("Next Frame", "NodeSocketObject", "Volume that plays the same files a frame earlier"),
    number("Part", 0.0, 0.0, 1.0)("How far it is from the frame before, 0, to the frame after, 1"),
    number("Seconds", 1.0, 0.0)("From the frame before to the frame after"),
)


def fit_interpolation(smoke: bpy.types.Object, wanted: bool) -> None:
    """Give a smoke frames between, or take them away."""
    if not wanted or not CAN_INTERPOLATE:
        FRAMES_BETWEEN.remove(smoke)
        return
    modifier = FRAMES_BETWEEN.add(smoke)
    # before the proxy, which takes the place of all; where that is on show, nothing need be computed
    smoke.modifiers.move(list(smoke.modifiers).index(modifier), 0)
    modifier.show_viewport = in_viewport(smoke) == smoke.data


def drive_interpolation(smoke: bpy.types.Object, place: str, seconds: float) -> None:
    """Drive frames between by the place in the take, an expression in frames, of which each lasts so many seconds."""
    modifier = FRAMES_BETWEEN.modifier(smoke)
    if modifier is None:
        return
    _set_input(modifier, "Seconds", seconds)
    path = _input_path(modifier, "Part")
    smoke.driver_remove(path)
    smoke.driver_add(path).driver.expression = f"fmod({place},1)"


def _build_interpolation(tree: Tree) -> None:
    given = add_node(tree, "NodeGroupInput", 0, 0).outputs
    later = add_node(tree, "GeometryNodeObjectInfo", 1, 3, given["Next Frame"]).outputs["Geometry"]

    def moved(volume: Socket, name: str, row: int, seconds: Any, weight: Any) -> Socket:
        """A grid that went on with its velocity for some seconds, times a number."""
        grid, velocity = (
            add_node(tree, "GeometryNodeGetNamedGrid", 2, place, volume, grid_name, False, data_type=kind)
            for grid_name, kind, place in ((name, "FLOAT", row), ("velocity", "VECTOR", row + 1))
        )
        there = (grid.outputs["Grid"], velocity.outputs["Grid"], seconds)
        advected = add_node(tree, "GeometryNodeGridAdvect", 4, row, *there, data_type="FLOAT")
        return math_node(tree, "MULTIPLY", 5, row, advected.outputs[0], weight)

    rest = math_node(tree, "SUBTRACT", 1, 5, 1.0, given["Part"])
    forth = math_node(tree, "MULTIPLY", 2, 8, given["Part"], given["Seconds"])
    back = math_node(tree, "MULTIPLY", 3, 9, math_node(tree, "MULTIPLY", 2, 9, rest, given["Seconds"]), -1.0)
    result = given["Smoke"]
    for place, name in enumerate(GRIDS):
        row = 4 * place
        before = moved(given["Smoke"], name, row, forth, rest)
        mixed = math_node(tree, "ADD", 6, row, before, moved(later, name, row + 2, back, given["Part"]))
        result = add_node(tree, "GeometryNodeStoreNamedGrid", 7 + place, row, result, name, mixed).outputs[0]
    add_node(tree, "NodeGroupOutput", 7 + len(GRIDS), 0, result)


FRAMES_BETWEEN = SecondVolume(
    "Smokelift Frames Between", "smokelift_between", _INTERPOLATION_INPUTS, _build_interpolation, "Next Frame"
)
"""Computes frames between two of a take; its Volume plays the frame after the one that the smoke plays."""


def _get_input(modifier: bpy.types.Modifier, name: str) -> Any:
    """The value of an input of a modifier's node group."""
    holder, key = _input(modifier, name)
    return holder.value if key is None else holder.get(key)


def _set_input(modifier: bpy.types.Modifier, name: str, value: Any) -> None:
    """Set an input of a modifier's node group."""
    holder, key = _input(modifier, name)
    if key is None:
        holder.value = value
    else:
        holder[key] = value


def _input(modifier: bpy.types.Modifier, name: str) -> tuple[Any, str | None]:
    """What holds an input of a modifier as its attribute ``value``, or before 5.2 the modifier itself and the key."""
    key = modifier.node_group.interface.items_tree[name].identifier
    return (getattr(modifier.properties.inputs, key), None) if hasattr(modifier, "properties") else (modifier, key)


def _input_path(modifier: bpy.types.Modifier, name: str) -> str:
    """The path from its object to the value of an input of a modifier's node group, for a driver."""
    _, key = _input(modifier, name)
    before = f'modifiers["{modifier.name}"]'
    if key is not None:
        return f'{before}["{key}"]'
    return f"{before}.properties.inputs.{modifier.node_group.interface.items_tree[name].identifier}.value"
