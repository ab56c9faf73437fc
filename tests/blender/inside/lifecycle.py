"""The extension's life in a Blender that has nothing of it: installed from its zip, used, disabled, removed.

The tests are one story and run in this order. Whatever they need beyond the zip would be a fault: there is no other
engine here, and no network.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from mathutils import Vector

from tests.example_shot import EXAMPLE, set_up_example, smoke

ZIP, GPU_ZIP = (Path(os.environ[name]) for name in ("SMOKELIFT_ZIP", "SMOKELIFT_GPU_ZIP"))
MODULE = "bl_ext.user_default.smokelift"
FIRST, LAST = 21, 32
FRAMES = LAST - FIRST + 1
LONGEST_SIDE = 32

# Blender's own installer forgets to close its pipes
pytestmark = pytest.mark.filterwarnings("ignore:Exception ignored in. <_io:pytest.PytestUnraisableExceptionWarning")

# The engine knows best where its smoke is; it runs in a process of its own here too.
_CORNERS = """
import sys
sys.path.insert(0, sys.argv[1])
import json, numpy as np
from pathlib import Path
from smokelift import Sequence
sequence = Sequence.open(Path(sys.argv[2]))
domain = sequence.scene.domain
answer = {}
for number in sequence.frames:
    places = np.argwhere(sequence.density(number) > 0)
    low = np.array(domain.min) + places.min(0) * domain.voxel_size
    high = np.array(domain.min) + (places.max(0) + 1) * domain.voxel_size
    answer[number] = [low.tolist(), high.tolist(), float(sequence.density(number).astype(float).sum())]
print(json.dumps(answer))
"""

_IMPORT_ALL = """
import sys
sys.path.insert(0, sys.argv[1])
import importlib, json, pkgutil
import smokelift
missing = {}
for module in pkgutil.walk_packages(smokelift.__path__, "smokelift."):
    if not module.name.endswith("__main__"):
        try:
            importlib.import_module(module.name)
        except ModuleNotFoundError as error:
            missing[module.name] = error.name
print(json.dumps(missing))
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the .blend is saved, and the takes beside it."""
    return tmp_path_factory.mktemp("shot")


def extension(name: str = "smokelift") -> Path:
    return Path(os.environ["BLENDER_USER_RESOURCES"], "extensions", "user_default", name)


def libraries(name: str = "smokelift") -> Path:
    """What the engine imports from."""
    return extension(name) / f"python{sys.version_info.major}.{sys.version_info.minor}"


def install(path: Path) -> None:
    said = bpy.ops.extensions.package_install_files(filepath=str(path), repo="user_default", enable_on_install=True)
    assert said == {"FINISHED"}


def uninstall(name: str) -> None:
    repositories = bpy.context.preferences.extensions.repos
    place = next(i for i, repository in enumerate(repositories) if repository.module == "user_default")
    assert bpy.ops.extensions.package_uninstall(repo_index=place, pkg_id=name) == {"FINISHED"}
    assert not extension(name).exists()


def size(folder: Path) -> int:
    """Bytes of all files in a folder."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def corners(take: Path) -> dict[int, Any]:
    """Lowest and highest corner of every frame's smoke (m) and its mass, as the engine reads its files."""
    command = [sys.executable, "-I", "-c", _CORNERS, str(libraries()), str(take)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return {int(number): corner for number, corner in json.loads(done.stdout.splitlines()[-1]).items()}


def shown(scene: bpy.types.Scene) -> bpy.types.Object:
    """The one object that shows smoke."""
    (obj,) = [obj for obj in scene.objects if obj.type == "VOLUME"]
    return obj


def take_of(obj: bpy.types.Object) -> Path:
    return Path(bpy.path.abspath(obj.data.filepath)).parent


def batch(blend: Path, *words: str) -> list[str]:
    """A command that runs the add-on on a file without a window, in a Blender of its own."""
    if not getattr(bpy.app, "module", False):  # Blender 4.3 does not know that it could be one
        return [bpy.app.binary_path, "-b", str(blend), "--command", "smokelift", "reconstruct", *words]
    start = f"""
import sys, bpy
bpy.ops.preferences.addon_enable(module={MODULE!r})
bpy.ops.wm.open_mainfile(filepath={str(blend)!r})
from {MODULE} import batch
sys.exit(batch.main(sys.argv[1:]))
"""
    return [sys.executable, "-c", start, *words]


def test_installs_from_disk() -> None:
    """The zip is all that is needed, Blender's own numpy stays the only one, and little of the disk is taken."""
    assert not extension().exists()
    began = time.perf_counter()
    install(ZIP)
    seconds = time.perf_counter() - began
    assert MODULE in bpy.context.preferences.addons
    assert not (libraries() / "taichi").exists()
    assert not (libraries() / "numpy").exists()
    assert Path(extension(), "LICENSE").is_file()
    zipped, everything = ZIP.stat().st_size, size(Path(os.environ["BLENDER_USER_RESOURCES"], "extensions"))
    print(f"{ZIP.name}: {zipped / 1e6:.0f} MB, installed {everything / 1e6:.0f} MB in {seconds:.1f} s")
    assert zipped < 100e6 and everything < 250e6
    bpy.ops.wm.save_userpref()


def doctor() -> str:
    """What the engine says of itself, started as the add-on starts it."""
    from bl_ext.user_default.smokelift.job import engine_command

    # it ends with its standard input, so that has to stay open
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    with subprocess.Popen(engine_command(["doctor"]), text=True, **pipes) as engine:
        said = engine.stdout.read()
        assert engine.wait() == 0, said
    return said


def test_engine_runs_with_blenders_numpy() -> None:
    """It finds its libraries, an OpenVDB module and Blender's numpy."""
    said = doctor()
    assert f"numpy {np.__version__}" in said
    assert "OpenVDB: missing" not in said


def test_every_module_of_the_engine_has_what_it_imports() -> None:
    """What the build leaves out of libraries is not needed; Taichi is needed by name."""
    command = [sys.executable, "-I", "-B", "-c", _IMPORT_ALL, str(libraries())]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    missing = dict(json.loads(done.stdout.splitlines()[-1]))
    assert set(missing.values()) <= {"taichi", "distributed"}, missing
    assert not any(name.startswith(("smokelift.app", "smokelift.pipeline")) for name in missing), missing


def test_taichi_is_found_where_its_extension_is_installed() -> None:
    """And gone with it."""
    assert "taichi missing" in doctor()
    install(GPU_ZIP)
    everything = size(extension("smokelift_gpu"))
    print(f"{GPU_ZIP.name}: {GPU_ZIP.stat().st_size / 1e6:.0f} MB, installed {everything / 1e6:.0f} MB")
    assert GPU_ZIP.stat().st_size < 100e6 and everything < 250e6
    assert re.search(r"taichi 1\.", doctor())
    uninstall("smokelift_gpu")
    assert "taichi missing" in doctor()


def test_makes_smoke(folder) -> None:
    """The example becomes a Volume with the engine's grids, frames, place and material."""
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = set_up_example(bpy.context.scene)
    smoke(scene).smokelift.longest_side = LONGEST_SIDE
    smoke(scene).smokelift.first, smoke(scene).smokelift.last = FIRST, LAST
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "shot.blend"))
    assert bpy.ops.smokelift.run() == {"FINISHED"}
    obj = shown(scene)
    volume = obj.data
    index = json.loads((take_of(obj) / "sequence.json").read_text())
    assert index["complete"] and len(index["frames"]) == FRAMES
    assert volume.is_sequence and volume.frame_duration == FRAMES
    assert volume.frame_start == smoke(scene).smokelift.clip.frame_start + FIRST - 1
    assert volume.velocity_unit == "SECOND" and volume.velocity_grid == "velocity"
    assert volume.render.clipping == 0.0
    node = next(node for node in obj.active_material.node_tree.nodes if node.name == "Smokelift")
    medium = index["scene"]["medium"]
    assert node.inputs["Extinction"].default_value == pytest.approx(medium["extinction"])
    assert node.inputs["Albedo"].default_value[:3] == pytest.approx([medium["albedo"]] * 3)
    assert node.inputs["Anisotropy"].default_value == pytest.approx(medium["anisotropy"])
    bpy.ops.wm.save_mainfile()


def test_smoke_is_where_the_engine_put_it() -> None:
    """In every frame Blender's voxels lie in the world where the engine's do, and its bounds hold the smoke."""
    scene = bpy.context.scene
    obj = shown(scene)
    take = take_of(obj)
    domain = json.loads((take / "sequence.json").read_text())["scene"]["domain"]
    voxel = (domain["max"][2] - domain["min"][2]) / domain["resolution"][2]
    expected = corners(take)
    assert sorted(expected) == list(range(1, FRAMES + 1))
    for number, (low, high, mass) in expected.items():
        assert mass > 0.0
        scene.frame_set(obj.data.frame_start + number - 1)
        obj.data.grids.load()
        assert {grid.name for grid in obj.data.grids} == {"density", "velocity"}
        assert Path(bpy.path.abspath(obj.data.grids.frame_filepath)).name == f"smoke_{number:04d}.vdb"
        assert not obj.data.grids.error_message
        (density,) = [grid for grid in obj.data.grids if grid.name == "density"]
        first = obj.matrix_world @ density.matrix_object @ Vector((0.0, 0.0, 0.0))
        # before 5.0 Cycles takes a voxel's corner for its centre, and the add-on makes up for it
        centre = 0.0 if bpy.app.version < (5, 0, 0) else voxel / 2
        assert list(first) == pytest.approx([edge + centre for edge in domain["min"]], abs=1e-4)
        places = [obj.matrix_world @ Vector(corner) for corner in obj.evaluated_get(depsgraph()).bound_box]
        # Blender's bounds go round all voxels that are stored, which are more than those with smoke
        for axis in range(3):
            least, most = min(p[axis] for p in places), max(p[axis] for p in places)
            assert domain["min"][axis] - 0.51 * voxel < least < low[axis] + 1.01 * voxel
            assert high[axis] - 1.01 * voxel < most < domain["max"][axis] + 0.51 * voxel


def depsgraph() -> bpy.types.Depsgraph:
    return bpy.context.evaluated_depsgraph_get()


def test_file_can_be_loaded_again(folder) -> None:
    """Settings, result and material come back with the .blend, also from another place."""
    moved = folder.with_name(folder.name + "_moved")
    folder.rename(moved)
    try:
        bpy.ops.wm.read_homefile(use_empty=True)
        bpy.ops.wm.open_mainfile(filepath=str(moved / "shot.blend"))
        scene = bpy.context.scene
        settings = smoke(scene).smokelift
        assert (settings.last, settings.longest_side, settings.quality) == (LAST, LONGEST_SIDE, "draft")
        assert settings.box.name == "Box" and settings.clip is not None and smoke(scene) == shown(scene)
        scene.frame_set(shown(scene).data.frame_start)
        assert shown(scene).data.grids.load()
        assert take_of(shown(scene)).is_relative_to(moved)
    finally:
        bpy.ops.wm.read_homefile(use_empty=True)
        moved.rename(folder)


def test_cancel_keeps_frames_and_resume_ends_the_same(folder) -> None:
    """In a Blender without a window: SIGTERM after the first frame, then --resume, gives what one go gave."""
    blend = folder / "shot.blend"
    words = ["--output", str(folder / "again")]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    with subprocess.Popen(batch(blend, *words), text=True, **pipes) as process:
        said = []
        for line in process.stdout:
            said.append(line)
            if re.match("frame [1-9]", line):
                process.terminate()
                break
        said += process.stdout.readlines()
        assert process.wait() == 130, "".join(said)
    assert any("finished frames stay" in line for line in said)
    take = folder / "again" / "take_0001"
    index = json.loads((take / "sequence.json").read_text())
    assert 1 <= len(index["frames"]) < FRAMES and not index["complete"]

    done = subprocess.run(batch(blend, "--resume", *words), capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"frame {FRAMES} of {FRAMES}" in done.stdout
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    assert corners(take) == corners(take_of(shown(bpy.context.scene)))


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["--clip", "nowhere.mp4"], "nowhere.mp4"),
        (["--clip", str(EXAMPLE / "README.md")], "README.md"),
        (["--frames", "5:500"], "5 to 500"),
        (["--output", "/proc/nowhere"], "/proc/nowhere"),
    ],
)
def test_bad_input_is_one_sentence(folder, words, reason) -> None:
    """Exit status 2 and one sentence that names what is wrong; nothing else on standard error from us."""
    done = subprocess.run(batch(folder / "shot.blend", *words), capture_output=True, text=True)
    assert done.returncode == 2, done.stdout + done.stderr
    (sentence,) = [line for line in done.stderr.splitlines() if line.startswith("smokelift: ")]
    assert reason in sentence and sentence.endswith(".")
    assert "Traceback" not in done.stderr


def test_disabling_leaves_nothing() -> None:
    """No property, operator, class or handler is left."""
    bpy.ops.preferences.addon_disable(module=MODULE)
    assert not hasattr(bpy.types.Scene, "smokelift") and not hasattr(bpy.types.WindowManager, "smokelift")
    assert not dir(bpy.ops.smokelift)
    assert not [name for name in dir(bpy.types) if "smokelift" in name.lower()]
    lists = [getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers)]
    assert not [f for entries in lists if isinstance(entries, list) for f in entries if MODULE in f.__module__]


def test_uninstalling_leaves_nothing() -> None:
    """All files are gone, and Blender still has its numpy."""
    uninstall("smokelift")
    left = list(Path(os.environ["BLENDER_USER_RESOURCES"], "extensions").rglob("*.so"))
    assert not left
    assert np.zeros(1).size == 1
