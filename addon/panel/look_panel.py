"""The sub-panel Look: presets, the artist's inputs of the material, and how the viewport shows the smoke."""

import bpy

from ..core import ShotError
from ..scene import look, volume
from ..scene.modifiers import PROXY, in_viewport
from ..scene.smoke import is_override, smoke_with_look
from .common import UNDO, Need, needs_result, operator, panels
from .layout import draw_text, draw_work
from .settings import choice

SHORT = {"Absorption Color": "Absorption"}  # names of inputs that the sidebar would cut off


# also a smoke that is linked from another file can be changed so
_needs_look = Need(
    needs_result.why,
    lambda context, smoke: is_override(smoke_with_look(context.scene)) or needs_result.is_there(context, smoke),
)
PRESETS = [(key, name, description) for key, (name, description, _) in look.PRESETS.items()]


@operator("Use Look", _needs_look, bl_options=UNDO, given={"preset": choice("Preset")("Kind of smoke", *PRESETS)})
def use_look(context: bpy.types.Context, _smoke: bpy.types.Object, preset: str) -> None:
    """Set density, brightness, colors and edges of the smoke. What was fitted to the clip stays"""
    smoke = smoke_with_look(context.scene)
    now = volume.shown_take(smoke).read()
    if not now.index:
        raise ShotError("The smoke's files are missing: make it again.")
    if not look.use_preset(smoke, preset, now.scene["medium"]["anisotropy"]):
        raise ShotError("The smoke's material is your own: remove it and show the result again for presets.")


@panels("look", "Look", _needs_look)
def _draw_look(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    smoke = smoke_with_look(context.scene)
    layout.use_property_decorate = True  # the look may be animated
    override = is_override(smoke)
    if override:
        layout.label(text=smoke.name, translate=False, icon="LIBRARY_DATA_OVERRIDE")
    sockets = look.controls(smoke)
    if sockets:
        layout.operator_menu_enum("smokelift.use_look", "preset", text="Presets", icon="PRESET")
    else:
        layout.label(text="The material is your own", icon="MATERIAL")
    if look.is_linked(smoke):
        draw_text(layout, "A preset gives this override a look of its own.", "INFO")
    else:
        column = layout.column()
        for socket in sockets:
            column.prop(socket, "default_value", text=SHORT.get(socket.name, socket.name))
    column = layout.column()
    column.use_property_decorate = False
    modifier = PROXY.modifier(smoke)
    if not override:
        column.prop(in_viewport(smoke).display, "density", text="View Density")
        # Cycles goes through smoke by null scattering since 5.0, unless it is set to march as before
        cycles = getattr(context.scene, "cycles", None)
        may_choose = hasattr(cycles, "volume_biased")
        if may_choose:
            column.prop(cycles, "volume_biased", text="March in Cycles")
        row = column.row()
        row.active = not may_choose or cycles.volume_biased
        row.prop(smoke.data.render, "step_size", text="Render Step")
        if may_choose and not cycles.volume_biased:
            draw_text(column, "Marching has less noise per sample, but its steps make an error.", "INFO")
    if modifier is not None:
        column.prop(modifier, "show_viewport", text="Proxy in View", icon="NONE")
    elif not override:
        draw_work(column, smoke, "smokelift.make_proxy", "MOD_REMESH")
