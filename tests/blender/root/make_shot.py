"""Save the example as a .blend beside its clip: ``blender -b --python make_shot.py -- FILE FIRST LAST SIDE``."""

import shutil
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parents[3]))
from tests.example_shot import EXAMPLE, set_up_example, smoke

file, first, last, longest_side = sys.argv[sys.argv.index("--") + 1 :]
folder = Path(file).parent
shutil.copytree(EXAMPLE, folder)
for obj in list(bpy.data.objects):
    bpy.data.objects.remove(obj)
scene = set_up_example(bpy.context.scene, folder)
smoke(scene).smokelift.first, smoke(scene).smokelift.last = int(first), int(last)
smoke(scene).smokelift.longest_side = int(longest_side)
scene.frame_set(int(last))
scene.render.resolution_percentage = 50
scene.cycles.samples, scene.cycles.use_denoising = 32, False
bpy.ops.wm.save_as_mainfile(filepath=file)
