"""The Flamenco job type: its script in a model of the Manager, and its commands run for real."""

import importlib.util
import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from smokelift.app.cli import main
from smokelift.output.sequence import Sequence

FOLDER = Path(__file__).resolve().parents[2] / "integrations" / "flamenco"
MODEL = Path(__file__).with_name("flamenco_model.js")
EXAMPLE = FOLDER.parents[1] / "tests" / "plume" / "scene.toml"
NODE = shutil.which("node")

pytestmark = pytest.mark.skipif(NODE is None, reason="Node is not installed")

# What `blender --background ... --python SCRIPT -- ...` does, by the bpy module.
BLENDER = """
import runpy, sys
words = sys.argv
assert words[1:3] == ["--background", "--factory-startup"]
runpy.run_path(words[words.index("--python") + 1], run_name="__main__")
"""


def compiled(**settings: Any) -> dict[str, Any]:
    """The job type's settings, and the tasks of a job in an order in which they can run."""
    job = json.dumps({"name": "a job", "settings": settings})
    done = subprocess.run(
        [str(NODE), str(MODEL), str(FOLDER / "smokelift.js")], input=job, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise ValueError(done.stderr)
    return json.loads(done.stdout)


def test_a_job_is_reconstruct_then_check() -> None:
    tasks = compiled(input="/clips/a b.mp4", output="/out/a", frames="3:9", quality="draft")["tasks"]
    assert [(task["name"], task["type"], task["dependencies"]) for task in tasks] == [
        ("reconstruct", "misc", []),
        ("check", "misc", ["reconstruct"]),
    ]
    assert tasks[0]["commands"][0]["parameters"]["args"][:4] == ["reconstruct", "/clips/a b.mp4", "--out", "/out/a"]
    assert tasks[0]["commands"][0]["parameters"]["args"][-3:] == ["--frames", "3:9", "--resume"]


def test_a_preview_waits_for_the_check_and_lies_beside_the_sequence() -> None:
    preview = compiled(input="/a.mp4", output="/out/a", preview_script="/s/cycles_preview.py")["tasks"][-1]
    assert (preview["name"], preview["type"], preview["dependencies"]) == ("preview", "blender", ["check"])
    assert "/out/a_preview" in preview["commands"][0]["parameters"]["args"]


@pytest.mark.parametrize(
    ("wrong", "settings"),
    [("output", {"input": "a.mp4"}), ("quality", {"input": "a.mp4", "output": "a", "quality": "best"})],
)
def test_the_model_refuses_what_the_manager_refuses(wrong, settings) -> None:
    with pytest.raises(ValueError, match=wrong):
        compiled(**settings)


def test_the_commands_run(tmp_path) -> None:
    if importlib.util.find_spec("bpy") is None:
        pytest.skip("there is no bpy module, and so no OpenVDB and no Cycles")
    for path in EXAMPLE.parent.glob("*.[mp]*"):
        shutil.copy(path, tmp_path)
    scene = tmp_path / "scene.toml"
    scene.write_text(EXAMPLE.read_text().replace("[domain]\n", "[domain]\nresolution = [16, 16, 24]\n"))
    out = tmp_path / "smoke"
    script = str(FOLDER / "cycles_preview.py")
    few = {"frames": "30:31", "quality": "draft", "preview_frames": 1, "preview_samples": 1}
    tasks = compiled(input=str(scene), output=str(out), preview_script=script, **few)["tasks"]
    reconstruct, check, preview = (task["commands"][0]["parameters"] for task in tasks)
    assert (reconstruct["exe"], check["exe"], preview["exe"]) == ("{smokelift}", "{smokelift}", "{blender}")
    assert main(reconstruct["args"]) == main(check["args"]) == 0
    assert Sequence.open(out).complete
    index = out / "sequence.json"
    index.write_text(index.read_text().replace("[256, 384]", "[16, 24]"))  # a small picture, as Cycles takes seconds
    blender = [sys.executable, "-c", BLENDER, *preview["args"]]
    done = subprocess.run(blender, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert [path.name for path in (tmp_path / "smoke_preview").iterdir()] == ["frame_0002.png"]
