"""Camera, box and light in the tab; and the button that asks where the smoke stands."""

import bpy
from bpy_extras import view3d_utils

from ..core import ShotError
from ..scene.blender import rpt_
from ..scene.geometry import Floor, box_of, framed_box, has_inlet, new_box
from ..scene.plate import show_clip_behind
from ..scene.smoke import active_smoke, scene_of
from .clip_panel import draw_mask, draw_picture
from .common import UNDO, Need, Needing, needs_clip, needs_smoke, operator
from .layout import draw_automatic, draw_closed
from .settings import automatic_unless, choice, closed_sides, link, number, tick

USUAL_DISTANCE = 2.0  # meters from which a distance is given by hand where there is no box


def _box_chosen(settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    """A box belongs to the scene's camera."""
    if settings.box is not None:
        settings.camera_mode = "SCENE"


def _middle_of_box(settings: bpy.types.PropertyGroup) -> float:
    """Where a distance that is given by hand begins: at the middle of the box, if there is one before the camera."""
    box, camera = box_of(settings.id_data), scene_of(settings.id_data).camera
    if box is None or camera is None:
        return USUAL_DISTANCE
    pose = camera.matrix_world
    return max(0.0, -(box.matrix_world.translation - pose.translation).dot(pose.col[2].to_3d())) or USUAL_DISTANCE


class ShotSettings:
    """Where the clip was filmed from, the box of its smoke, and what lights it."""

    camera_mode: choice("Camera")(
        "Where the clip was filmed from",
        (
            "ESTIMATE",
            "From the Clip",
            "Assume a level camera with an ordinary lens and a box around the smoke, and add it",
        ),
        ("SCENE", "Scene Camera", "The scene's camera with its lens, sensor and shift, tracked or still"),
    )
    box: link("Box", bpy.types.Object, poll=lambda _settings, obj: obj.type == "MESH", update=_box_chosen)(
        "Box that holds all of the smoke. A smaller box gives a finer result"
    )
    inlet: link("Inlet", bpy.types.Object, poll=lambda _settings, obj: obj.type == "EMPTY")(
        "Empty at the smoke's source, as large as the opening. Without one, sources are estimated"
    )
    distance: number("Distance", subtype="DISTANCE", min=0.0)(
        "Distance from the camera to the lower end of the smoke, level and straight ahead; automatic is estimated. "
        "With Camera From the Clip it sets the scale"
    )
    use_distance: automatic_unless("distance", "Distance", _middle_of_box)
    closed: closed_sides(
        "Sides of the box, along its own axes, that are solid: no air flows through them. -Z is a floor"
    )
    light_mode: choice("Light")(
        "What lights the smoke in the clip",
        ("ESTIMATE", "From the Clip", "Estimate even light from the smoke's brightness"),
        ("SCENE", "Scene Lights", "The scene's suns and point lights, and its world's panorama"),
    )
    use_medium: tick("Smoke Material")("Set the smoke's optical properties")
    extinction: number("Extinction", default=5.0, min=0.001, max=1e9, soft_max=50.0)(
        "Extinction coefficient per meter of smoke of density 1"
    )
    albedo: number("Albedo", default=0.9, min=0.0, max=1.0)(
        "Scattered fraction of the extinction: 1 is white steam, 0 is black soot"
    )
    anisotropy: number("Anisotropy", min=-0.95, max=0.95)("Forward scattering above 0, backward scattering below")


_needs_camera = Need(
    "The scene has no camera: add one where the clip was filmed from", lambda context, _: context.scene.camera
)
_needs_floor = Need(
    "Choose Scene Camera and make a Box first: its bottom is the floor",
    lambda _, smoke: smoke.smokelift.camera_mode == "SCENE" and box_of(smoke),
)
_needs_view = Need(
    "Use the tab in a 3D View: the click is made there",
    lambda context, _: context.area is not None and context.area.type == "VIEW_3D",
)


@operator("Frame Box", needs_smoke, _needs_camera, bl_options=UNDO)
def make_box(context: bpy.types.Context, smoke: bpy.types.Object) -> None:
    """Fit the box to the camera's picture at the distance of the 3D cursor; make one if there is none"""
    low, high = framed_box(context.scene)
    box = box_of(smoke)
    if box is None:
        box = smoke.smokelift.box = new_box()
        context.scene.collection.objects.link(box)
    box.parent = None
    box.rotation_euler = (0.0, 0.0, 0.0)
    box.location = (low + high) / 2
    box.scale = (high - low) / 2


class SMOKELIFT_OT_place(Needing, bpy.types.Operator):
    """Click in the camera's picture on the floor of the box, right below the smoke: that gives its distance"""

    bl_label = "Click Where the Smoke Stands"
    bl_options = {"UNDO"}
    needs = (needs_clip, _needs_floor, _needs_view)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        smoke = active_smoke(context.scene)
        try:
            self._floor = Floor.of(smoke)
        except ShotError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        show_clip_behind(smoke, context.scene.camera.data)
        self._view = context.space_data.region_3d
        self._before = self._view.view_perspective
        self._view.view_perspective = "CAMERA"
        context.window.cursor_modal_set("EYEDROPPER")
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type in ("ESC", "RIGHTMOUSE"):
            self._view.view_perspective = self._before
            return self._end(context, {"CANCELLED"})
        clicked = event.type == "LEFTMOUSE" and event.value == "PRESS"
        if not clicked and event.type != "MOUSEMOVE":
            return {"PASS_THROUGH"}  # so that the view can be zoomed
        try:
            distance, why = self._distance(context, event), ""
        except ShotError as error:
            distance, why = 0.0, str(error)
        if not clicked:
            context.workspace.status_text_set(why or rpt_("Distance: {:.3g} m").format(distance))
            return {"RUNNING_MODAL"}
        if why:
            self.report({"ERROR"}, why)
            return self._end(context, {"CANCELLED"})
        active_smoke(context.scene).smokelift.distance = distance
        return self._end(context, {"FINISHED"})

    def _distance(self, context: bpy.types.Context, event: bpy.types.Event) -> float:
        """The distance of what is under the mouse; ShotError if that is not known."""
        region = next(region for region in context.area.regions if region.type == "WINDOW")
        rays = []
        for down in (0, 1):
            seen = region, self._view, (event.mouse_x - region.x, event.mouse_y - region.y - down)
            rays.append((view3d_utils.region_2d_to_origin_3d(*seen), view3d_utils.region_2d_to_vector_3d(*seen)))
        return self._floor.clicked(rays)

    def _end(self, context: bpy.types.Context, outcome: set[str]) -> set[str]:
        context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)
        return outcome


def draw_shot(layout: bpy.types.UILayout, smoke: bpy.types.Object) -> None:
    settings = smoke.smokelift
    row = layout.row(align=True)
    row.prop(settings, "plate_mode")
    row.operator("smokelift.plate_from_frame", text="", icon="IMAGE_BACKGROUND")
    if settings.plate_mode == "FILE":
        draw_picture(layout, settings, "plate", "")
    elif settings.plate_mode == "FRAMES":
        row = layout.row(align=True)
        row.prop(settings, "plate_frames", text=" ")
        row.operator("smokelift.clear_plate_frames", text="", icon="X")
    elif settings.plate_mode == "COLOR":
        row = layout.row(align=True)
        row.prop(settings, "plate_color", text=" ")
        path = f'blend_data.objects["{bpy.utils.escape_identifier(smoke.name)}"].smokelift.plate_color'
        row.operator("ui.eyedropper_color", text="", icon="EYEDROPPER").prop_data_path = path
    draw_mask(layout, settings)
    layout.prop(settings, "camera_mode")
    if settings.camera_mode == "SCENE":
        layout.prop(settings, "box")
        known = box_of(smoke) is not None
        layout.operator("smokelift.make_box", text="Frame Box" if known else "Make Box", icon="MESH_CUBE")
        layout.prop(settings, "inlet")
    row = layout.row()
    row.active = not has_inlet(smoke)  # that says it
    draw_automatic(row, settings, "distance").operator("smokelift.place", text="", icon="EYEDROPPER")
    layout.prop(settings, "light_mode")
    draw_closed(layout, settings)
