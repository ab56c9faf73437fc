"""The tab Smokelift in the sidebar of the 3D View and of the Movie Clip Editor."""

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ..core import ShotError
from ..result import smoke_takes
from ..scene.smoke import activate, smokes
from .camera_panel import draw_shot
from .clip_panel import draw_clip
from .common import HIDDEN, UNDO, needs_smoke, operator, panels
from .layout import draw_settings, draw_text
from .preferences import draw_header
from .quality_panel import draw_qualities
from .run_panel import draw_run


@operator("Select Smoke", needs_smoke, bl_options=UNDO, given={"smoke": HIDDEN})
def show_smoke(context: bpy.types.Context, _active: bpy.types.Object, smoke: str) -> None:
    """Select this smoke, and show its settings in the tab"""
    found = next((obj for obj in smokes(context.scene) if obj.name == smoke), None)
    if found is None:
        raise ShotError(rpt_("The scene has no smoke of the name {:s}.").format(smoke))
    activate(found, context.scene)


@panels("", "Smokelift", draw_header_preset=draw_header)
def _draw_tab(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object | None) -> None:
    column, found = layout.column(align=True), smokes(context.scene)
    for other in found if len(found) > 1 else ():
        row = column.operator("smokelift.show_smoke", text=other.name, icon="VOLUME_DATA", depress=other == smoke)
        row.smoke = other.name
    column.operator("smokelift.add", text="Smoke from Video...", icon="ADD")
    if smoke is None:
        draw_text(layout, "Choose a video or an image sequence of smoke. If its camera moves, track it.")
        return
    settings = smoke.smokelift
    layout.template_ID(settings, "clip", open="clip.open")
    if settings.clip is None:
        return
    draw_clip(layout, context, smoke)
    draw_shot(layout, context, smoke)
    draw_qualities(layout, context, smoke)
    layout.prop(settings, "detail")
    draw_settings(layout, settings, "seed", active=settings.detail > 0.0)
    layout.prop(settings, "output", placeholder=str(smoke_takes.output_folder(smoke)))
    draw_run(layout, context, smoke)
