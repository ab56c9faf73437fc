"""How smoke looks: a material with one node group, whose inputs are what the clip says and what the artist likes.

What was fitted to the clip (extinction, albedo, anisotropy) follows the newest result; what the artist sets
(density, brightness, colours, edges) is never touched by a run.
"""

from dataclasses import dataclass
from typing import Any

import bpy
from bpy.app.handlers import persistent

from .kept import set_and_remember, set_unless_changed

NODE = "Smokelift"
"""Name of the node that holds the values; a material without it is the artist's own."""

GROUP = "Smokelift Look"
"""Name of the node group."""

MARK = "smokelift_look"
"""Custom property by which the group is known under any name."""

BLACKBODY_KELVIN = 1000.0
"""Temperature that a grid's value of 1 stands for; that of Blender's Principled Volume."""

LEAST_RATIO = 1e-3
"""Density over the edge's, below which edges do not change any more; keeps the power of it finite."""


@dataclass(frozen=True)
class Look:
    """Values of the inputs that belong to the artist; as in the clip by default.

    ``anisotropy`` is the fitted one where it is None.
    """

    density: float = 1.0
    brightness: float = 1.0
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    edge_contrast: float = 1.0
    absorption_color: tuple[float, float, float] = (0.0, 0.0, 0.0)
    anisotropy: float | None = None

    def inputs(self) -> dict[str, Any]:
        """Values by name of the input."""
        values = {
            "Density": self.density,
            "Brightness": self.brightness,
            "Color": (*self.color, 1.0),
            "Edge Contrast": self.edge_contrast,
            "Absorption Color": (*self.absorption_color, 1.0),
        }
        return values if self.anisotropy is None else values | {"Anisotropy": self.anisotropy}


# Steam and mist are droplets of water, which absorb no light. One droplet scatters it forward (anisotropy about 0.85);
# many make it lose its direction, and a render that follows it to the first one only would show them black: with 0.25
# the lamp behind the camera gives half as much light as with 0, and the lamp before it twice as much. Dry air takes
# thin steam away, so its edges are sharp.
PRESETS = {
    "SMOKE": ("Smoke", "As in the clip", Look()),
    "STEAM": (
        "Steam",
        "White and thin, gone at its edges, bright against the light",
        Look(0.6, 100.0, edge_contrast=1.5, anisotropy=0.25),
    ),
    "SOOT": ("Soot", "Black and thick", Look(2.5, color=(0.05, 0.045, 0.04))),
    "DUST": (
        "Dust",
        "The color of sand, which reddens the light that passes through",
        Look(1.2, color=(0.7, 0.55, 0.4), edge_contrast=1.4, absorption_color=(0.25, 0.1, 0.03)),
    ),
    "MIST": ("Mist", "White, thin and without edges", Look(0.3, 100.0, edge_contrast=0.3, anisotropy=0.25)),
}
"""Name, description and look of each preset."""

CONTROLS = (*Look().inputs(), "Anisotropy")
"""Names of the inputs that the tab shows."""

# name, type, default, lowest and highest value, description
_INPUTS = (
    ("Density", "NodeSocketFloat", 1.0, 0.0, 1e6, "Times what was fitted to the clip"),
    (
        "Brightness",
        "NodeSocketFloat",
        1.0,
        0.0,
        1e3,
        "Below 1 darker; above 1 the share of light that the smoke absorbs is divided by this",
    ),
    (
        "Color",
        "NodeSocketColor",
        (1.0, 1.0, 1.0, 1.0),
        None,
        None,
        "Times the albedo: the color of the smoke in white light",
    ),
    ("Edge Contrast", "NodeSocketFloat", 1.0, 0.0, 10.0, "Above 1 thin smoke gets thinner, below 1 thicker"),
    (
        "Absorption Color",
        "NodeSocketColor",
        (0.0, 0.0, 0.0, 1.0),
        None,
        None,
        "Color of the light that gets through the smoke",
    ),
    ("Anisotropy", "NodeSocketFloat", 0.0, -1.0, 1.0, "Forward scattering above 0, backward below; fitted"),
    ("Extinction", "NodeSocketFloat", 1.0, 0.0, 1e9, "Per metre of smoke of density 1; fitted to the clip"),
    ("Albedo", "NodeSocketColor", (0.9, 0.9, 0.9, 1.0), None, None, "Scattered share of the extinction; fitted"),
    (
        "Edge Density",
        "NodeSocketFloat",
        0.1,
        1e-9,
        1e9,
        "Density below which smoke counts as thin: where Edge Contrast changes it",
    ),
    (
        "Flame Strength",
        "NodeSocketFloat",
        1.0,
        0.0,
        1e6,
        "Times the light of the grid flame, if there is one; 1 is as bright as in the clip",
    ),
    (
        "Flame Color",
        "NodeSocketColor",
        (1.0, 0.35, 0.08, 1.0),
        None,
        None,
        "Color of the light of the grid flame; fitted to the clip",
    ),
    ("Blackbody Intensity", "NodeSocketFloat", 1.0, 0.0, 1.0, "Glow of the grid temperature, if there is one"),
    (
        "Temperature",
        "NodeSocketFloat",
        BLACKBODY_KELVIN,
        0.0,
        1e5,
        "Kelvin that a value of 1 in the grid temperature stands for",
    ),
)


def fit_look(volume: bpy.types.Volume, scene: dict[str, Any]) -> None:
    """Give a Volume a material of what was fitted to the clip.

    Parameters
    ----------
    volume
        Gets a material if it has none; of one that has no node of ours, nothing is changed.
    scene
        Tables of a take's scene: its medium and its domain.
    """
    if not volume.materials or volume.materials[0] is None:
        material = _new_material(volume.name)
        volume.materials.clear()
        volume.materials.append(material)
    material = volume.materials[0]
    upgrade(material)
    node = node_of(volume)
    if node is None:
        return
    medium, domain = scene["medium"], scene["domain"]
    fitted = {"Anisotropy": medium["anisotropy"]}
    # earlier versions of the engine know no coloured smoke
    color = medium.get("color", [1.0, 1.0, 1.0])
    albedo = (*[medium["albedo"] * share for share in color], 1.0)
    if node.type == "GROUP":
        fitted |= {"Extinction": medium["extinction"], "Albedo": albedo}
        width = min(high - low for low, high in zip(domain["min"], domain["max"], strict=True))
        # smoke that could fill the box and would still let 1/e of the light through
        fitted["Edge Density"] = 1.0 / (medium["extinction"] * width)
        if "flame_color" in medium:
            fitted["Flame Color"] = (*medium["flame_color"], 1.0)
    else:
        fitted |= {"Density": medium["extinction"], "Color": albedo}
    for name, value in fitted.items():
        set_unless_changed(material, _key(name), node.inputs[name], "default_value", value)


def node_of(volume: bpy.types.Volume) -> bpy.types.ShaderNode | None:
    """The node with the values of a Volume's smoke; None if its material is the artist's own."""
    material = volume.materials[0] if volume.materials else None
    return material.node_tree.nodes.get(NODE) if material is not None and material.node_tree else None


def controls(volume: bpy.types.Volume) -> list[bpy.types.NodeSocket]:
    """What the tab shows of a Volume's look: inputs that no other node feeds."""
    node = node_of(volume)
    found = [node.inputs.get(name) for name in CONTROLS] if node is not None else []
    return [socket for socket in found if socket is not None and not socket.is_linked]


def use_preset(volume: bpy.types.Volume, name: str, fitted_anisotropy: float) -> bool:
    """Set the artist's inputs to a preset's; returns whether the material has them."""
    node = node_of(volume)
    if node is None or node.type != "GROUP":
        return False
    socket = node.inputs["Anisotropy"]
    set_and_remember(volume.materials[0], _key(socket.name), socket, "default_value", fitted_anisotropy)
    for key, value in PRESETS[name][2].inputs().items():
        node.inputs[key].default_value = value
    return True


def upgrade(material: bpy.types.Material) -> None:
    """Put our group in the place of the Principled Volume of earlier versions, which looks the same.

    One that the artist connected with other nodes, or whose other inputs were changed, stays as it is.
    """
    tree = material.node_tree
    old = tree.nodes.get(NODE) if tree is not None and material.library is None else None
    if old is None or old.type != "PRINCIPLED_VOLUME" or not _plain(old):
        return
    node = _add_group(tree)
    node.location = old.location
    renamed = {"Density": "Extinction", "Color": "Albedo", "Anisotropy": "Anisotropy"}
    for before, name in renamed.items():
        node.inputs[name].default_value = old.inputs[before].default_value
        fitted = material.get(f"smokelift_{_key(before)}")
        if fitted is not None:
            material[f"smokelift_{_key(name)}"] = fitted
    node.inputs["Absorption Color"].default_value = old.inputs["Absorption Color"].default_value
    for link in list(old.outputs[0].links):
        tree.links.new(node.outputs[0], link.to_socket)
    for name in ("Density", "Color"):
        material.pop(f"smokelift_{_key(name)}", None)
    tree.nodes.remove(old)
    node.name = node.label = NODE


def _plain(shader: bpy.types.ShaderNode) -> bool:
    """Whether a Principled Volume has only values that our group takes over."""
    if any(socket.is_linked for socket in shader.inputs):
        return False
    names = {name: shader.inputs[name].default_value for name in ("Density Attribute", "Color Attribute")}
    glow = shader.inputs["Emission Strength"].default_value + shader.inputs["Blackbody Intensity"].default_value
    return names == {"Density Attribute": "density", "Color Attribute": ""} and glow == 0.0


def _key(name: str) -> str:
    return name.lower().replace(" ", "_")


def _new_material(name: str) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # since 5.0 there always is one
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    node = _add_group(tree)
    node.name = node.label = NODE
    node.location = (-300.0, 0.0)
    tree.links.new(node.outputs[0], output.inputs["Volume"])
    return material


def _add_group(tree: bpy.types.NodeTree) -> bpy.types.ShaderNode:
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = _group()
    node.width = 220.0
    return node


def _group() -> bpy.types.NodeTree:
    """The node group: the file's own, which the artist may have changed, else a new one."""
    for known in bpy.data.node_groups:
        if known.library is None and known.get(MARK):
            return known
    tree = bpy.data.node_groups.new(GROUP, "ShaderNodeTree")
    tree[MARK] = True
    for name, kind, default, low, high, description in _INPUTS:
        socket = tree.interface.new_socket(name, description=description, in_out="INPUT", socket_type=kind)
        if low is not None:
            socket.min_value, socket.max_value = low, high
        socket.default_value = default
    tree.interface.new_socket("Volume", in_out="OUTPUT", socket_type="NodeSocketShader")
    _connect(tree)
    return tree


def _connect(tree: bpy.types.NodeTree) -> None:
    """Make the group's nodes."""
    given = tree.nodes.new("NodeGroupInput")
    source = given.outputs

    def new(kind: str, column: int, row: int, *inputs: Any, **settings: Any) -> bpy.types.ShaderNode:
        node = tree.nodes.new(kind)
        node.location = (200.0 * column, -200.0 * row)
        for name, value in settings.items():
            setattr(node, name, value)
        for place, value in enumerate(inputs):
            if isinstance(value, bpy.types.NodeSocket):
                tree.links.new(value, node.inputs[place])
            else:
                node.inputs[place].default_value = value
        return node

    def grid(name: str, row: int) -> bpy.types.NodeSocket:
        return new("ShaderNodeAttribute", 0, row, attribute_name=name).outputs["Fac"]

    def math(operation: str, column: int, row: int, a: Any, b: Any) -> bpy.types.NodeSocket:
        return new("ShaderNodeMath", column, row, a, b, operation=operation).outputs[0]

    def vector(operation: str, column: int, row: int, a: Any, b: Any) -> bpy.types.NodeSocket:
        return new("ShaderNodeVectorMath", column, row, a, b, operation=operation).outputs["Vector"]

    def scaled(column: int, row: int, a: Any, factor: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
        node = new("ShaderNodeVectorMath", column, row, a, operation="SCALE")
        tree.links.new(factor, node.inputs["Scale"])
        return node.outputs["Vector"]

    # extinction: density x min(density / edge density, 1) ^ (edge contrast - 1)
    density = grid("density", 0)
    ratio = math("DIVIDE", 1, 0, density, source["Edge Density"])
    thin = math("MAXIMUM", 2, 0, math("MINIMUM", 1, 1, ratio, 1.0), LEAST_RATIO)
    shape = math("POWER", 3, 0, thin, math("SUBTRACT", 2, 1, source["Edge Contrast"], 1.0))
    amount = math("MULTIPLY", 3, 1, source["Extinction"], source["Density"])
    extinction = math("MULTIPLY", 5, 0, math("MULTIPLY", 4, 0, density, shape), amount)

    # albedo: 1 - (1 - a min(brightness, 1)) / max(brightness, 1), which stays between black and white
    white = (1.0, 1.0, 1.0)
    tinted = vector("MULTIPLY", 1, 3, source["Albedo"], source["Color"])
    darker = scaled(2, 3, tinted, math("MINIMUM", 1, 4, source["Brightness"], 1.0))
    share = math("DIVIDE", 2, 5, 1.0, math("MAXIMUM", 1, 5, source["Brightness"], 1.0))
    absorbed = scaled(4, 3, vector("SUBTRACT", 3, 3, white, darker), share)
    albedo = vector("SUBTRACT", 5, 3, white, absorbed)

    # light of its own: an attribute without a grid is 0
    flame = math("MULTIPLY", 1, 7, grid("flame", 7), source["Flame Strength"])
    kelvin = math("MULTIPLY", 1, 8, grid("temperature", 8), source["Temperature"])

    shader = new("ShaderNodeVolumePrincipled", 6, 0)
    for name in ("Density Attribute", "Color Attribute", "Temperature Attribute"):
        shader.inputs[name].default_value = ""
    feeds = {
        "Density": extinction,
        "Color": albedo,
        "Absorption Color": source["Absorption Color"],
        "Anisotropy": source["Anisotropy"],
        "Emission Strength": flame,
        "Emission Color": source["Flame Color"],
        "Blackbody Intensity": source["Blackbody Intensity"],
        "Temperature": kelvin,
    }
    for name, socket in feeds.items():
        tree.links.new(socket, shader.inputs[name])
    given.location = (-200.0, -600.0)
    output = new("NodeGroupOutput", 8, 0)
    tree.links.new(shader.outputs[0], output.inputs[0])


@persistent
def upgrade_all(_file: str = "") -> None:
    """Upgrade the materials of the file's smokes."""
    for volume in bpy.data.volumes:
        if volume.library is None and volume.materials and volume.materials[0] is not None:
            upgrade(volume.materials[0])


def register() -> None:
    bpy.app.handlers.load_post.append(upgrade_all)


def unregister() -> None:
    bpy.app.handlers.load_post.remove(upgrade_all)
