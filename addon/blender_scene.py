"""Blender's scene as the engine's tables are read from it: at a frame; and the error for what cannot be used."""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy


class ShotError(ValueError):
    """A shot that the engine cannot run; says in one sentence what to do."""


@contextmanager
def at_frame(scene: bpy.types.Scene, frame: int) -> Iterator[bpy.types.Depsgraph]:
    """The scene evaluated in a frame; restores the current frame afterwards."""
    before, fraction = scene.frame_current, scene.frame_subframe
    if frame != before:
        scene.frame_set(frame)
    try:
        layer = scene.view_layers[0]
        layer.update()
        yield layer.depsgraph
    finally:
        if (scene.frame_current, scene.frame_subframe) != (before, fraction):
            scene.frame_set(before, subframe=fraction)


def frame_rate(scene: bpy.types.Scene) -> float:
    """Frames a second of a scene."""
    return scene.render.fps / scene.render.fps_base
