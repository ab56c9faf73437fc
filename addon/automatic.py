"""Numbers that are chosen automatically where they are 0: a ticked word in the panel in place of the 0."""

from collections.abc import Callable
from typing import Any

import bpy
from bpy.props import BoolProperty


def automatic_unless(name: str, label: str, start: float | Callable[[Any], float]) -> Any:
    """A tick for a number that is chosen automatically where it is 0; ticked, the number begins with ``start``.

    It keeps nothing of its own, so it cannot contradict the number.
    """
    return BoolProperty(
        name=label,
        description=f"Choose {label} by hand; otherwise it is automatic",
        get=lambda settings: getattr(settings, name) > 0,
        set=lambda settings, on: setattr(settings, name, (start(settings) if callable(start) else start) if on else 0),
    )


def draw_automatic(layout: bpy.types.UILayout, settings: bpy.types.bpy_struct, name: str) -> bpy.types.UILayout:
    """Draw a number with a cross that makes it automatic, or that it is; returns its row."""
    if getattr(settings, f"use_{name}"):
        row = layout.row(align=True)
        row.prop(settings, name)
        row.prop(settings, f"use_{name}", text="", icon="X", invert_checkbox=True)
    else:  # ticked, as an empty box before the word would read as off
        row = layout.row(heading=settings.bl_rna.properties[name].name)
        row.prop(settings, f"use_{name}", text="Automatic", invert_checkbox=True)
    return row
