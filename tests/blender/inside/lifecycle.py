"""The extension's life in a Blender that has nothing of it: installed from its zip, used, disabled, removed.

The tests are one story and run in this order. Whatever they need beyond the zip would be a fault: there is no other
engine here, and no network.
"""

import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import bpy
import numpy as np
import pytest

from tests.example_shot import set_up_example, smoke

ZIP, GPU_ZIP = (Path(os.environ[name]) for name in ("SMOKELIFT_ZIP", "SMOKELIFT_GPU_ZIP"))
MODULE = "bl_ext.user_default.smokelift"
FIRST, LAST = 21, 32
FRAMES = LAST - FIRST + 1
LONGEST_SIDE = 32

# Blender's own installer forgets to close its pipes
pytestmark = pytest.mark.filterwarnings("ignore:Exception ignored in. <_io:pytest.PytestUnraisableExceptionWarning")

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
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def shown(scene: bpy.types.Scene) -> bpy.types.Object:
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
from {MODULE}.result import command_line
sys.exit(command_line.main(sys.argv[1:]))
"""
    return [sys.executable, "-c", start, *words]


def test_a_zip_for_another_blender_is_not_enabled() -> None:
    """It says so at once; where Blender's own version is the wrong one, Blender does, in 5.2 without an exception."""
    (other,) = set(ZIP.parent.glob("smokelift-*-linux_x64.zip")) - {ZIP}
    said = ""
    try:
        install(other)
    except RuntimeError as refused:
        said = str(refused)
    assert f"install {ZIP.name}" in said or "This zip" not in said
    assert MODULE not in bpy.context.preferences.addons
    if extension().exists():
        uninstall("smokelift")


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
    from bl_ext.user_default.smokelift.core.job import engine_command

    # it ends with its standard input, so that has to stay open
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    with subprocess.Popen(engine_command(["doctor"]), text=True, **pipes) as engine:
        said = engine.stdout.read()
        assert engine.wait() == 0, said
    return said


def test_engine_runs_with_blenders_numpy() -> None:
    said = doctor()
    assert f"numpy {np.__version__}" in said
    assert "OpenVDB: missing" not in said


def test_every_module_of_the_engine_has_what_it_imports() -> None:
    command = [sys.executable, "-I", "-B", "-c", _IMPORT_ALL, str(libraries())]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    missing = dict(json.loads(done.stdout.splitlines()[-1]))
    assert set(missing.values()) <= {"taichi", "distributed"}, missing
    assert not any(name.startswith(("smokelift.app", "smokelift.pipeline")) for name in missing), missing


def test_taichi_is_found_where_its_extension_is_installed() -> None:
    assert "taichi missing" in doctor()
    install(GPU_ZIP)
    everything = size(extension("smokelift_gpu"))
    print(f"{GPU_ZIP.name}: {GPU_ZIP.stat().st_size / 1e6:.0f} MB, installed {everything / 1e6:.0f} MB")
    assert GPU_ZIP.stat().st_size < 100e6 and everything < 250e6
    assert re.search(r"taichi 1\.", doctor())
    uninstall("smokelift_gpu")
    assert "taichi missing" in doctor()


def test_makes_smoke(folder) -> None:
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = set_up_example(bpy.context.scene)
    smoke(scene).smokelift.longest_side = LONGEST_SIDE
    smoke(scene).smokelift.first, smoke(scene).smokelift.last = FIRST, LAST
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "shot.blend"))
    assert bpy.ops.smokelift.run() == {"FINISHED"}
    obj = shown(scene)
    index = json.loads((take_of(obj) / "sequence.json").read_text())
    assert index["complete"] and len(index["frames"]) == obj.data.frame_duration == FRAMES
    bpy.ops.wm.save_mainfile()


def test_cancel_keeps_frames_and_resume_ends_what_was_begun(folder) -> None:
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
    assert json.loads((take / "sequence.json").read_text())["complete"]


def test_disabling_leaves_nothing() -> None:
    bpy.ops.preferences.addon_disable(module=MODULE)
    assert not hasattr(bpy.types.Scene, "smokelift") and not hasattr(bpy.types.WindowManager, "smokelift")
    assert not dir(bpy.ops.smokelift)
    assert not [name for name in dir(bpy.types) if "smokelift" in name.lower()]
    lists = [getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers)]
    assert not [f for entries in lists if isinstance(entries, list) for f in entries if MODULE in f.__module__]


def test_uninstalling_leaves_nothing() -> None:
    uninstall("smokelift")
    assert not list(Path(os.environ["BLENDER_USER_RESOURCES"], "extensions").rglob("*.so"))
