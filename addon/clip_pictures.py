"""Pictures of a clip, written by Blender's own Movie Clip nodes."""

from pathlib import Path

import bpy

from .compositing import SINCE_5, compositor

UNDISTORTED_BITS, FILMED_BITS = "16", "8"
"""Bits per channel of a picture that is computed anew, and of one that is shown as it was filmed."""


def write_pictures(clip: bpy.types.MovieClip, first: int, last: int, prefix: Path, undistort: bool = False) -> Path:
    """Write what a clip shows in some frames of the scene, as PNG; returns the first picture.

    Parameters
    ----------
    clip
        The clip.
    first, last
        Frames of the scene.
    prefix
        The pictures' path, to which Blender adds the frame and the suffix.
    undistort
        Whether the distortion of the clip's lens is taken out.

    Raises
    ------
    RuntimeError
        If they cannot be written.
    """
    scene = bpy.data.scenes.new("Smokelift Pictures")
    try:
        return _write(scene, clip, first, last, prefix, undistort)
    finally:
        tree = scene.compositing_node_group if SINCE_5 else None
        bpy.data.objects.remove(scene.camera)
        bpy.data.scenes.remove(scene)
        if tree is not None:
            bpy.data.node_groups.remove(tree)


def _write(
    scene: bpy.types.Scene, clip: bpy.types.MovieClip, first: int, last: int, prefix: Path, undistort: bool
) -> Path:
    render = scene.render
    scene.camera = bpy.data.objects.new("Smokelift Pictures", bpy.data.cameras.new("Smokelift Pictures"))
    scene.collection.objects.link(scene.camera)
    render.resolution_x, render.resolution_y, render.resolution_percentage = *clip.size, 100
    scene.frame_start, scene.frame_end = first, last
    scene.view_settings.view_transform = "Standard"
    render.filepath = str(prefix)
    picture = render.image_settings
    picture.file_format, picture.color_mode = "PNG", "RGB"
    picture.color_depth = UNDISTORTED_BITS if undistort else FILMED_BITS
    tree, shown = compositor(scene)
    source = tree.nodes.new("CompositorNodeMovieClip")
    source.clip = clip
    pictures = source.outputs["Image"]
    if undistort:
        pictures = _undistorted(tree, clip, pictures)
    tree.links.new(pictures, shown)
    for node in [node for node in tree.nodes if node.type == "R_LAYERS"]:
        tree.nodes.remove(node)
    bpy.ops.render.render(animation=True, scene=scene.name)
    return Path(render.frame_path(frame=first))


def _undistorted(
    tree: bpy.types.NodeTree, clip: bpy.types.MovieClip, pictures: bpy.types.NodeSocket
) -> bpy.types.NodeSocket:
    lens = tree.nodes.new("CompositorNodeMovieDistortion")
    lens.clip = clip
    if "Type" in lens.inputs:  # since 5.0
        lens.inputs["Type"].default_value = "Undistort"
    else:
        lens.distortion_type = "UNDISTORT"
    tree.links.new(pictures, lens.inputs["Image"])
    return lens.outputs["Image"]
