"""Render a finished shot in other light and from elsewhere: ``blender -b SHOT --python relight.py -- FOLDER``."""

import math
import sys
from pathlib import Path

import bpy
from mathutils import Matrix, Vector

folder = Path(sys.argv[-1])
scene = bpy.context.scene
sun, camera = bpy.data.objects["Sun"], scene.camera
sun.data.energy, sun.data.color = 22.0, (1.0, 0.72, 0.45)
(scene.world,) = [world for world in bpy.data.worlds if world.use_fake_user]  # black, from before Set Up Shot
scene.cycles.samples = 64


def render(name: str, light: tuple[float, float, float]) -> None:
    """Render one picture with the sun shining in a direction."""
    sun.rotation_euler = Vector(light).to_track_quat("-Z", "Y").to_euler()
    scene.render.filepath = str(folder / name)
    bpy.ops.render.render(write_still=True)


render("from_left.png", (1.0, 0.2, -0.2))
render("from_right.png", (-1.0, 0.2, -0.2))
middle = Matrix.Translation((0.0, 0.0, 1.5))
camera.matrix_world = middle @ Matrix.Rotation(math.radians(50.0), 4, "Z") @ middle.inverted() @ camera.matrix_world
render("elsewhere.png", (-0.6, 0.5, -0.6))
