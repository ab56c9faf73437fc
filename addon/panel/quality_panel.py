"""The qualities in the tab, with what each takes and loses."""

import bpy

from ..core.contract import BOX_VOXELS
from ..core.sentences import duration
from ..result import shot_check
from ..scene.blender import iface_
from .common import needs_clip, operator
from .layout import draw_doubts, draw_failure, draw_text
from .settings import automatic_unless, choice, number, whole

SEEDS = 2**31  # numbers of variations: as many as Blender's whole numbers have from 0
CELLS = 0.245, 0.215, 0.18, 0.18  # fractions of a line: button, time, memory, disk; the rest is what is lost


class QualitySettings:
    """How fine the smoke is made, and on what."""

    quality: choice("Quality", default="balanced")(
        "More detail takes more time, memory (RAM, in GiB) and disk space. Lost is the fraction of the contrast of the "
        "clip's smoke that is finer than the voxels",
        ("draft", "Draft", "A quick preview"),
        ("balanced", "Balanced", "Good for most shots"),
        ("fine", "Fine", "More of the clip's detail, several times slower"),
        ("final", "Final", "All of the clip's detail, one voxel per pixel: much memory, seconds to minutes per frame"),
    )
    detail: number("Depth Detail", subtype="FACTOR", default=1.0, min=0.0, max=1.0)(
        "How much fine structure in depth is made up in the clip's texture, since no camera shows it. At 0 the smoke "
        "is smooth from the side, which is best for measuring; at 1 it is as detailed as in the clip"
    )
    seed: whole("Variation", min=0, max=SEEDS - 1)(
        "Number of the plausible smoke: all look alike from the camera, and differ from the side"
    )
    longest_side: whole("Resolution", min=0, max=1024)(
        "Voxels along the box's longest side; automatic is by the detail that is measured in the clip"
    )
    use_longest_side: automatic_unless("longest_side", "Resolution", BOX_VOXELS)
    device: choice("Device")(
        "Device that renders",
        ("auto", "Automatic", "The CPU, until a GPU is measured to be faster"),
        ("cpu", "CPU", "The CPU only"),
        ("gpu", "GPU Compute", "The GPU only; without a usable one the run fails"),
    )


@operator("Check Shot", needs_clip, bl_options={"INTERNAL"})
def check(_context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Estimate time, memory and disk space of the run, and list its assumptions"""
    shot_check.check(smoke)


@operator("Stop Reading", needs_clip, bl_options={"INTERNAL"})
def stop_check(_context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Stop reading the clip; Make Smoke and all settings work without the estimate"""
    shot_check.stop(smoke)


def draw_qualities(layout: bpy.types.UILayout, context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """A button for each quality with what it takes and loses; the first drawing of the tab starts the estimate.

    While a change is estimated, the figures of before stay, grayed. The line below is one of the same height always,
    so that nothing moves under the pointer; `draw_check` has the rest.
    """
    state, settings = shot_check.state, smoke.smokelift
    checked, costs = state.fits(smoke), state.costs(smoke)
    column = layout.column(align=True)
    column.use_property_split = False
    title = settings.bl_rna.properties["quality"].name
    for cell, word in zip(_cells(column), (title, "Time", "RAM", "Disk", "Lost"), strict=True):
        cell.label(text=word)
    for item in settings.bl_rna.properties["quality"].enum_items:
        button, *cells = _cells(column)
        button.prop_enum(settings, "quality", item.identifier)
        cost = costs.get(item.identifier)
        if cost is not None:
            seconds, megabytes = cost["seconds"], cost["disk"] / 1e6
            words = (
                duration(seconds) if seconds < 3570.0 else _brief(seconds / 3600.0, "h"),
                _brief(cost["memory"] / 2**30, "G"),
                f"{megabytes:.0f} M" if megabytes < 99.5 else _brief(megabytes / 1000.0, "G"),
                _brief_fraction(cost["lost"]),
            )
            for cell, word in zip(cells, words, strict=True):
                cell.active = checked and state.done
                cell.alert = cost["memory"] > cost["memory_free"]
                cell.label(text=word, translate=False)
    reading = not state.done if checked else shot_check.check_soon(context, smoke)
    if state.error or not (checked or reading):
        layout.operator("smokelift.check", icon="VIEWZOOM")
    elif reading:
        seconds = shot_check.check_job.seconds if shot_check.check_job.job is not None else 0
        text = iface_("Reading the clip: {:s}").format(duration(seconds)) if seconds else iface_("Reading the clip")
        row = layout.row(align=True)
        row.label(text=text, translate=False, icon="TIME")
        row.operator("smokelift.stop_check", text="", icon="X")
    else:
        own = costs.get(settings.quality)
        text = iface_("{} x {} x {} voxels").format(*own["resolution"]) if own is not None else ""
        layout.label(text=text, translate=False, icon="MESH_GRID")


def draw_check(layout: bpy.types.UILayout, smoke: bpy.types.Object, said: set[str]) -> None:
    """What the check of this smoke warns of, or why it failed, but for sentences and doubts that are ``said``."""
    state = shot_check.state
    if not state.fits(smoke) or (state.error and state.error in said):
        return
    if state.error:
        draw_failure(layout, state.error)
    elif state.done:
        cost = state.costs(smoke)[smoke.smokelift.quality]
        if cost["memory"] > cost["memory_free"]:
            gigabytes = cost["memory_free"] / 2**30
            draw_text(layout, "Only {:.1f} GiB are free: choose a lower quality.", "ERROR", gigabytes)
        draw_doubts(layout, smoke, state.doubts, said)


def _cells(column: bpy.types.UILayout) -> list[bpy.types.UILayout]:
    cells, left = [], 1.0
    for fraction in CELLS:
        column = column.split(factor=fraction / left, align=True)
        cells.append(column.row(align=True))
        left -= fraction
    return [*cells, column.row(align=True)]


def _brief_fraction(fraction: float | None) -> str:
    """A fraction in percent; nothing where it is unknown."""
    if fraction is None:
        return ""
    return f"{fraction:.1%}" if 0.0005 <= fraction < 0.00995 else f"{fraction:.0%}"


def _brief(value: float, unit: str) -> str:
    """To two digits at least: a cell of the table holds six letters."""
    return f"{value:.1f} {unit}" if value < 9.95 else f"{value:.0f} {unit}"
