"""Pictures of a clip, also without its lens's distortion, and of masks drawn over it, by Blender's own compositor.

The engine's camera is a pinhole. Where the clip's lens was calibrated in the Movie Clip Editor, such a camera films the
undistorted pictures.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from .compositing import compositor
from .nodes import SINCE_5, Socket, Tree, add_node, set_kind

UNDISTORTED_BITS, FILMED_BITS = "16", "8"  # per channel of a picture that is computed anew, and as it was filmed

COEFFICIENTS = {
    "POLYNOMIAL": ("k1", "k2", "k3"),
    "DIVISION": ("division_k1", "division_k2"),
    "NUKE": ("nuke_k1", "nuke_k2"),
    "BROWN": ("brown_k1", "brown_k2", "brown_k3", "brown_k4", "brown_p1", "brown_p2"),
}
"""Names of a lens's coefficients by its distortion model."""


@contextmanager
def picture_scene(clip: bpy.types.MovieClip) -> Iterator[tuple[bpy.types.Scene, Tree, Socket]]:
    """A scene of its own that renders PNG of a clip's size, the nodes of its compositor, and what they are shown by."""
    scene = bpy.data.scenes.new("Smokelift Pictures")
    scene.camera = bpy.data.objects.new("Smokelift Pictures", bpy.data.cameras.new("Smokelift Pictures"))
    tree, shown = compositor(scene)
    try:
        scene.collection.objects.link(scene.camera)
        render = scene.render
        render.resolution_x, render.resolution_y, render.resolution_percentage = *clip.size, 100
        render.image_settings.file_format = "PNG"
        for node in [node for node in tree.nodes if node.type == "R_LAYERS"]:
            tree.nodes.remove(node)
        yield scene, tree, shown
    finally:
        bpy.data.objects.remove(scene.camera)
        bpy.data.scenes.remove(scene)
        if SINCE_5:
            bpy.data.node_groups.remove(tree)


def write_pictures(clip: bpy.types.MovieClip, first: int, last: int, prefix: Path, undistort: bool = False) -> Path:
    """Write what a clip shows in some frames of the scene, as PNG; returns the first picture.

    Blender adds the frame and the suffix to the prefix. RuntimeError if they cannot be written.
    """
    with picture_scene(clip) as (scene, tree, shown):
        scene.frame_start, scene.frame_end = first, last
        scene.view_settings.view_transform = "Standard"
        scene.render.filepath = str(prefix)
        picture = scene.render.image_settings
        picture.color_mode, picture.color_depth = "RGB", UNDISTORTED_BITS if undistort else FILMED_BITS
        pictures = add_node(tree, "CompositorNodeMovieClip", 0, 0, clip=clip).outputs["Image"]
        if undistort:
            lens = add_node(tree, "CompositorNodeMovieDistortion", 1, 0, pictures, clip=clip)
            set_kind(lens, "Undistort", "distortion_type")
            pictures = lens.outputs["Image"]
        tree.links.new(pictures, shown)
        bpy.ops.render.render(animation=True, scene=scene.name)
        return Path(scene.render.frame_path(frame=first))


def is_distorted(clip: bpy.types.MovieClip) -> bool:
    """Whether a clip's lens was calibrated, and bends lines."""
    lens = clip.tracking.camera
    return any(getattr(lens, name) != 0.0 for name in COEFFICIENTS.get(lens.distortion_model, ()))


def undistorted(clip: bpy.types.MovieClip, folder: Path) -> bpy.types.MovieClip:
    """Write a clip's undistorted pictures (PNG, 16 bits) into a folder; returns them as a clip of the same frames."""
    last = clip.frame_start + clip.frame_duration - 1
    first = write_pictures(clip, clip.frame_start, last, folder / "undistorted_", undistort=True)
    made = bpy.data.movieclips.load(str(first))
    made.name = f"{clip.name} undistorted"
    made.frame_start = clip.frame_start
    for name in ("sensor_width", "focal_length", "pixel_aspect"):
        setattr(made.tracking.camera, name, getattr(clip.tracking.camera, name))
    return made
