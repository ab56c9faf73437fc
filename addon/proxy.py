"""The proxy of a large smoke: coarse copies of its files, which viewports show in its place.

A modifier that acts in viewports alone gives the smoke the grids of another Volume. So every render uses the smoke
itself, also in a Blender without the add-on, and no viewport reads the smoke's own files.
"""

import math
from collections.abc import Mapping
from typing import Any

import bpy

from .contract import PROXY_FILE, PROXY_VOXELS
from .nodes import Input, add_node, new_group
from .second_volume import SecondVolume
from .take import Take

NAME = "Smokelift Proxy"
"""Name of the node group, and of the modifier."""

_INPUTS = (
    Input("Smoke", "NodeSocketGeometry", "The smoke itself"),
    Input("Proxy", "NodeSocketObject", "Volume that is shown in its place"),
)


def modifier_of(smoke: bpy.types.Object) -> bpy.types.Modifier | None:
    """The modifier that shows the proxy of a smoke, and is its switch; None where there is no proxy."""
    return _PROXY.modifier(smoke)


def proxy_of(smoke: bpy.types.Object) -> bpy.types.Volume | None:
    """The Volume that is the proxy of a smoke, whether it is on show or not."""
    return _PROXY.volume(smoke)


def in_viewport(smoke: bpy.types.Object) -> bpy.types.Volume:
    """The Volume that viewports show of a smoke, which has the settings for that."""
    modifier, proxy = modifier_of(smoke), proxy_of(smoke)
    return proxy if proxy is not None and modifier.show_viewport else smoke.data


def lacks_proxy(smoke: bpy.types.Object, index: Mapping[str, Any]) -> bool:
    """Whether a smoke is large for a viewport and has no proxy, as an earlier result; ``index`` is that of its take."""
    return modifier_of(smoke) is None and math.prod(index["scene"]["domain"]["resolution"]) >= PROXY_VOXELS


def fit_proxy(smoke: bpy.types.Object, take: Take, numbers: list[int]) -> None:
    """Give a smoke a proxy if its take has files of one with these numbers, else none. Whether it is on show stays."""
    if {PROXY_FILE.format(number) for number in numbers} <= {file.name for file in take.directory.iterdir()}:
        _PROXY.add(smoke).show_render = False
    else:
        _PROXY.remove(smoke)


def _group() -> bpy.types.NodeTree:
    tree = new_group(NAME, "GeometryNodeTree", _PROXY.mark, _INPUTS, [("Shown", "NodeSocketGeometry")])
    given = add_node(tree, "NodeGroupInput", 0, 0)
    shown = add_node(tree, "GeometryNodeObjectInfo", 1, 0, given.outputs["Proxy"])
    add_node(tree, "NodeGroupOutput", 2, 0, shown.outputs["Geometry"])
    return tree


_PROXY = SecondVolume(NAME, "smokelift_proxy", "Proxy", _group)
