"""How smoke looks: a material with one node group, whose inputs are what the clip says and what the artist likes.

What was fitted to the clip (extinction, albedo, anisotropy) follows the newest result; what the artist sets
(density, brightness, colors, edges) is never touched by a run.
"""

from typing import Any

import bpy

from .blender import set_unless_changed
from .nodes import add_node, color, empty_material, file_group, math_node, number, scaled_vector, vector_node

NODE = "Smokelift"  # name of the node that holds the values; a material without it is the artist's own
GROUP = "Smokelift Look"  # name of the node group
MARK = "smokelift_look"  # custom property by which the group is known under any name
BLACKBODY_KELVIN = 1000.0  # of a grid's value of 1: that of Blender's Principled Volume (by definition)
MIN_RATIO = 1e-3  # density over the edge's, below which edges do not change any more; keeps the power of it finite

_INPUTS = (
    number("Density", 1.0, 0.0, 1e6)("Times what was fitted to the clip"),
    number("Brightness", 1.0, 0.0, 1e3)(
        "Below 1 darker; above 1 the fraction of light that the smoke absorbs is divided by this"
    ),
    color("Color", 1.0, 1.0, 1.0, 1.0)("Times the albedo: the color of the smoke in white light"),
    number("Edge Contrast", 1.0, 0.0, 10.0)("Above 1 thin smoke gets thinner, below 1 thicker"),
    color("Absorption Color", 0.0, 0.0, 0.0, 1.0)("Color of the light that gets through the smoke"),
    number("Evaporation", 0.0, 0.0, 1e3)(
        "Smoke that is gone at the top of the clip's box, in Edge Densities: the higher it is the more of it, from its "
        "edges inwards"
    ),
    number("Anisotropy", 0.0, -1.0, 1.0)("Forward scattering above 0, backward below; fitted"),
    number("Extinction", 1.0, 0.0, 1e9)("Per meter of smoke of density 1; fitted to the clip"),
    color("Albedo", 0.9, 0.9, 0.9, 1.0)("Scattered fraction of the extinction; fitted"),
    number("Edge Density", 0.1, 1e-9, 1e9)("Density below which smoke counts as thin: where Edge Contrast changes it"),
    number("Floor", 0.0, -1e6, 1e6)("Height in the smoke where evaporation begins; fitted"),
    number("Height", 1.0, 1e-6, 1e6)("From there to where all of it counts; fitted"),
    number("Flame Strength", 1.0, 0.0, 1e6)(
        "Times the light of the grid flame, if there is one; 1 is as bright as in the clip"
    ),
    color("Flame Color", 1.0, 0.35, 0.08, 1.0)("Color of the light of the grid flame; fitted to the clip"),
    number("Blackbody Intensity", 1.0, 0.0, 1.0)("Glow of the grid temperature, if there is one"),
    number("Temperature", BLACKBODY_KELVIN, 0.0, 1e5)("Kelvin that a value of 1 in the grid temperature stands for"),
)

CONTROLS = tuple(item.name for item in _INPUTS[:7])
"""Names of the inputs that the tab shows: those that belong to the artist, and the anisotropy, which is fitted."""

# Steam and mist are droplets of water, which absorb no light. One droplet scatters it forward (anisotropy about 0.85);
# many make it lose its direction, and a render that follows it to the first one only would show them black: with 0.25
# the lamp behind the camera gives half as much light as with 0, and the lamp before it twice as much. Steam is dense
# where it comes out, and dry air takes it away as it rises, from its edges inwards.
PRESETS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "SMOKE": ("Smoke", "As in the clip", {}),
    "STEAM": (
        "Steam",
        "White where it comes out, dries up as it rises, bright against the light",
        {"Density": 1.2, "Brightness": 100.0, "Edge Contrast": 1.3, "Evaporation": 3.0, "Anisotropy": 0.25},
    ),
    "SOOT": ("Soot", "Black and thick", {"Density": 2.5, "Color": (0.05, 0.045, 0.04, 1.0)}),
    "DUST": (
        "Dust",
        "The color of sand, which reddens the light that passes through",
        {
            "Density": 1.2,
            "Color": (0.7, 0.55, 0.4, 1.0),
            "Edge Contrast": 1.4,
            "Absorption Color": (0.25, 0.1, 0.03, 1.0),
        },
    ),
    "MIST": (
        "Mist",
        "White, thin and without edges",
        {"Density": 0.3, "Brightness": 100.0, "Edge Contrast": 0.3, "Anisotropy": 0.25},
    ),
}
"""Name, description and inputs of each preset; the others are as in the clip."""


def fit_look(smoke: bpy.types.Object, scene: dict[str, Any]) -> None:
    """Give a smoke a material, if it has none, and our node in it what was fitted to the clip, by a take's scene."""
    volume = smoke.data
    if not volume.materials or volume.materials[0] is None:
        volume.materials.clear()
        volume.materials.append(_new_material(volume.name))
    material, node = material_of(smoke), node_of(smoke)
    if node is None:
        return
    medium, domain = scene["medium"], scene["domain"]
    width = min(high - low for low, high in zip(domain["min"], domain["max"], strict=True))
    fitted = {
        "Extinction": medium["extinction"],
        "Albedo": (*[medium["albedo"] * part for part in medium["color"]], 1.0),
        "Anisotropy": medium["anisotropy"],
        # smoke that could fill the box and would still let 1/e of the light through
        "Edge Density": 1.0 / (medium["extinction"] * width),
        "Floor": domain["min"][2],
        "Height": domain["max"][2] - domain["min"][2],
    }
    if "flame_color" in medium:
        fitted["Flame Color"] = (*medium["flame_color"], 1.0)
    for name, value in fitted.items():
        if name in node.inputs:  # a file's own node group may be older
            set_unless_changed(material, name, node.inputs[name], "default_value", value)


def material_of(smoke: bpy.types.Object) -> bpy.types.Material | None:
    """The material that a smoke is rendered with: its Volume's, or one of the object's own."""
    return smoke.material_slots[0].material if smoke.material_slots else None


def node_of(smoke: bpy.types.Object) -> bpy.types.ShaderNode | None:
    """The node with the values of a smoke; None if its material is the artist's own."""
    material = material_of(smoke)
    node = material.node_tree.nodes.get(NODE) if material is not None and material.node_tree else None
    return node if node is not None and node.type == "GROUP" else None


def is_linked(smoke: bpy.types.Object) -> bool:
    """Whether the material of a smoke belongs to another file, and cannot be changed in this one."""
    material = material_of(smoke)
    return material is not None and material.library is not None


def controls(smoke: bpy.types.Object) -> list[bpy.types.NodeSocket]:
    """What the tab shows of a smoke's look: inputs that no other node feeds."""
    node = node_of(smoke)
    found = [node.inputs.get(name) for name in CONTROLS] if node is not None else []
    return [socket for socket in found if socket is not None and not socket.is_linked]


def use_preset(smoke: bpy.types.Object, name: str, fitted_anisotropy: float) -> bool:
    """Set the artist's inputs to a preset's, in a copy of another file's material; returns whether it has them."""
    if node_of(smoke) is None:
        return False
    if is_linked(smoke):
        own = material_of(smoke).copy()
        smoke.material_slots[0].link = "OBJECT"
        smoke.material_slots[0].material = own
    node = node_of(smoke)
    socket = node.inputs["Anisotropy"]
    set_unless_changed(material_of(smoke), socket.name, socket, "default_value", fitted_anisotropy, anyway=True)
    as_in_clip = {item.name: item.default for item in _INPUTS[:6]}
    for key, value in (as_in_clip | PRESETS[name][2]).items():
        if key in node.inputs:
            node.inputs[key].default_value = value
    return True


def _new_material(name: str) -> bpy.types.Material:
    material = empty_material(name)
    tree = material.node_tree
    group = file_group(GROUP, "ShaderNodeTree", MARK, _INPUTS, {"Volume": "NodeSocketShader"}, _build)
    node = add_node(tree, "ShaderNodeGroup", -1.5, 0, node_tree=group, name=NODE, width=220.0)
    tree.links.new(node.outputs[0], add_node(tree, "ShaderNodeOutputMaterial", 0, 0).inputs["Volume"])
    return material


def _build(tree: bpy.types.NodeTree) -> None:
    source = add_node(tree, "NodeGroupInput", -1, 3).outputs
    feeds = {
        "Density": _extinction(tree, source),
        "Color": _albedo(tree, source),
        "Absorption Color": source["Absorption Color"],
        "Anisotropy": source["Anisotropy"],
        "Emission Strength": math_node(tree, "MULTIPLY", 1, 7, _grid(tree, "flame", 7), source["Flame Strength"]),
        "Emission Color": source["Flame Color"],
        "Blackbody Intensity": source["Blackbody Intensity"],
        "Temperature": math_node(tree, "MULTIPLY", 1, 8, _grid(tree, "temperature", 8), source["Temperature"]),
    }
    shader = add_node(tree, "ShaderNodeVolumePrincipled", 6, 0)
    for name in ("Density Attribute", "Color Attribute", "Temperature Attribute"):
        shader.inputs[name].default_value = ""
    for name, socket in feeds.items():
        tree.links.new(socket, shader.inputs[name])
    add_node(tree, "NodeGroupOutput", 8, 0, shader.outputs[0])


def _grid(tree: bpy.types.NodeTree, name: str, row: int) -> bpy.types.NodeSocket:
    """The values of a grid of the Volume; 0 where it has none of that name."""
    return add_node(tree, "ShaderNodeAttribute", 0, row, attribute_name=name).outputs["Fac"]


def _extinction(tree: bpy.types.NodeTree, source: Any) -> bpy.types.NodeSocket:
    """The extinction times density x min(density / edge density, 1) ^ (edge contrast - 1), of what is not dried up."""
    density = _remaining(tree, source)
    ratio = math_node(tree, "DIVIDE", 1, 0, density, source["Edge Density"])
    thin = math_node(tree, "MAXIMUM", 2, 0, math_node(tree, "MINIMUM", 1, 1, ratio, 1.0), MIN_RATIO)
    exponent = math_node(tree, "SUBTRACT", 2, 1, source["Edge Contrast"], 1.0)
    shape = math_node(tree, "POWER", 3, 0, thin, exponent)
    amount = math_node(tree, "MULTIPLY", 3, 1, source["Extinction"], source["Density"])
    return math_node(tree, "MULTIPLY", 5, 0, math_node(tree, "MULTIPLY", 4, 0, density, shape), amount)


def _remaining(tree: bpy.types.NodeTree, source: Any) -> bpy.types.NodeSocket:
    """The density less evaporation x edge density x (z - floor) / height: high smoke is old, thin smoke goes first."""
    place = add_node(tree, "ShaderNodeTexCoord", -3, 2).outputs["Object"]
    height = add_node(tree, "ShaderNodeSeparateXYZ", -3, 3, place).outputs["Z"]
    above = math_node(tree, "SUBTRACT", -2, 2, height, source["Floor"])
    age = math_node(tree, "MAXIMUM", -1, 2, math_node(tree, "DIVIDE", -1, 3, above, source["Height"]), 0.0)
    most = math_node(tree, "MULTIPLY", -2, 3, source["Evaporation"], source["Edge Density"])
    left = math_node(tree, "SUBTRACT", 0, 1, _grid(tree, "density", 0), math_node(tree, "MULTIPLY", 0, 2, age, most))
    return math_node(tree, "MAXIMUM", 1, 2, left, 0.0)


def _albedo(tree: bpy.types.NodeTree, source: Any) -> bpy.types.NodeSocket:
    """1 - (1 - a min(brightness, 1)) / max(brightness, 1) of the tinted albedo a: it stays between black and white."""
    white = (1.0, 1.0, 1.0)
    tinted = vector_node(tree, "MULTIPLY", 1, 3, source["Albedo"], source["Color"])
    darker = scaled_vector(tree, 2, 3, tinted, math_node(tree, "MINIMUM", 1, 4, source["Brightness"], 1.0))
    inverse = math_node(tree, "DIVIDE", 2, 5, 1.0, math_node(tree, "MAXIMUM", 1, 5, source["Brightness"], 1.0))
    absorbed = scaled_vector(tree, 4, 3, vector_node(tree, "SUBTRACT", 3, 3, white, darker), inverse)
    return vector_node(tree, "SUBTRACT", 5, 3, white, absorbed)
