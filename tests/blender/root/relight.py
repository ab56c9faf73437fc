"""Render a finished shot in other light and from elsewhere: ``blender -b SHOT --python relight.py -- FOLDER``."""

import math
import sys
from pathlib import Path

import bpy
from mathutils import Matrix, Vector

folder = Path(sys.argv[-1])
scene = bpy.context.scene
sun, camera = bpy.data.objects["Sun"], scene.camera


def shine(*direction: float) -> None:
    """Let the sun shine in a direction."""
    sun.rotation_euler = Vector(direction).to_track_quat("-Z", "Y").to_euler()


def render(name: str) -> None:
    """Render one picture."""
    scene.render.filepath = str(folder / name)
    bpy.ops.render.render(write_still=True)


sun.data.energy, sun.data.color = 22.0, (1.0, 0.72, 0.45)
(scene.world,) = [world for world in bpy.data.worlds if world.use_fake_user]  # black, from before Set Up Shot
shine(1.0, 0.2, -0.2)
render("from_left.png")
shine(-1.0, 0.2, -0.2)
render("from_right.png")
middle = Matrix.Translation((0.0, 0.0, 1.5))
camera.matrix_world = middle @ Matrix.Rotation(math.radians(50.0), 4, "Z") @ middle.inverted() @ camera.matrix_world
shine(-0.6, 0.5, -0.6)
render("elsewhere.png")
