"""The proxy of a large smoke: coarse copies of its files, which viewports show in its place.

A modifier that acts in viewports alone gives the smoke the grids of another Volume, which is in no collection. So every
render uses the smoke itself, also in a Blender without the add-on, and no viewport reads the smoke's own files.
"""

import bpy

from .contract import PROXY_FILE
from .nodes import Input, add_node, get_input, new_group, own_group, set_input
from .take import Take

GROUP = "Smokelift Proxy"
"""Name of the node group, and of the modifier."""

MARK = "smokelift_proxy"
"""Custom property by which the group is known under any name."""

_INPUTS = (
    Input("Smoke", "NodeSocketGeometry", "The smoke itself"),
    Input("Proxy", "NodeSocketObject", "Volume that is shown in its place"),
)


def modifier_of(smoke: bpy.types.Object) -> bpy.types.Modifier | None:
    """The modifier that shows the proxy of a smoke, and is its switch; None where there is no proxy."""
    groups = ((each, each.node_group) for each in smoke.modifiers if each.type == "NODES")
    return next((modifier for modifier, group in groups if group is not None and group.get(MARK)), None)


def proxy_of(smoke: bpy.types.Object) -> bpy.types.Volume | None:
    """The Volume that is the proxy of a smoke, whether it is on show or not."""
    modifier = modifier_of(smoke)
    obj = get_input(modifier, "Proxy") if modifier is not None else None
    return obj.data if obj is not None else None


def in_viewport(smoke: bpy.types.Object) -> bpy.types.Volume:
    """The Volume that viewports show of a smoke, which has the settings for that."""
    modifier, proxy = modifier_of(smoke), proxy_of(smoke)
    return proxy if proxy is not None and modifier.show_viewport else smoke.data


def fit_proxy(smoke: bpy.types.Object, take: Take, numbers: list[int]) -> None:
    """Give a smoke a proxy if its take has the files of one, else none. Whether it is on show stays."""
    modifier = modifier_of(smoke)
    if not {PROXY_FILE.format(number) for number in numbers} <= {file.name for file in take.directory.iterdir()}:
        proxy = proxy_of(smoke)
        if modifier is not None:
            smoke.modifiers.remove(modifier)
        if proxy is not None and proxy.users == 1:
            bpy.data.volumes.remove(proxy)  # takes the object with it
        return
    if modifier is None:
        modifier = smoke.modifiers.new(GROUP, "NODES")
        modifier.node_group = _group()
        modifier.show_render = False
        smoke.modifiers.move(len(smoke.modifiers) - 1, 0)  # those of the artist act on what is shown
    obj = get_input(modifier, "Proxy")
    if obj is None or obj.users > 1:  # that of the smoke that this one is a duplicate of
        obj = bpy.data.objects.new(f"{smoke.name} Proxy", smoke.data.copy())
        set_input(modifier, "Proxy", obj)
    if list(obj.data.materials) != list(smoke.data.materials):
        obj.data.materials.clear()
        for material in smoke.data.materials:
            obj.data.materials.append(material)


def _group() -> bpy.types.NodeTree:
    """The node group: the file's own, which the artist may have changed, else a new one."""
    tree = own_group(MARK)
    if tree is None:
        tree = new_group(GROUP, "GeometryNodeTree", MARK, _INPUTS, [("Shown", "NodeSocketGeometry")])
        tree.is_modifier = True
        given = add_node(tree, "NodeGroupInput", 0, 0)
        shown = add_node(tree, "GeometryNodeObjectInfo", 1, 0, given.outputs["Proxy"])
        add_node(tree, "NodeGroupOutput", 2, 0, shown.outputs["Geometry"])
    return tree
