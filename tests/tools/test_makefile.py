"""What `make extension` makes again after a change, and what it reuses."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = (
    *("pyproject.toml", "CMakeLists.txt", "cpp/a.cpp", "engine/a.py", "LICENSE", "blender_manifest.toml"),
    *("docs/a.md", "mkdocs.yml", "examples/a.toml", "addon/core/a.py"),
    *("tools/build_extension.py", "tools/extension_libraries.py", "tools/engine_wheels.py", "tools/bundle.txt"),
)
MADE = (
    *(f".venv/{name}.stamp" for name in ("pip", "engine", "manual", "extension")),
    *("build/engine-wheels/stamp", "build/manual/index.html", "dist/extension.stamp"),
)
STEPS = {"wheels": "engine_wheels.py --blender", "manual": "mkdocs build", "zip": "build_extension.py"}


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
@pytest.mark.parametrize(
    ("changed", "steps"),
    [
        (None, set()),
        ("addon/core/a.py", {"manual", "zip"}),
        ("docs/a.md", {"manual", "zip"}),
        ("tools/bundle.txt", {"manual", "zip"}),
        ("tools/extension_libraries.py", {"manual", "zip"}),
        ("cpp/a.cpp", {"wheels", "manual", "zip"}),
    ],
)
def test_only_what_changed_is_made_again(tmp_path, changed, steps) -> None:
    for seconds, names in ((1000, SOURCES), (2000, MADE)):
        for name in names:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).touch()
            os.utime(tmp_path / name, (seconds, seconds))
    if changed:
        os.utime(tmp_path / changed, (3000, 3000))
    command = ["make", "--dry-run", "--directory", tmp_path, "--makefile", ROOT / "Makefile", "extension"]
    # a make that runs these tests hands its own variables on, VENV among them
    environment = {name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MAKEOVERRIDES")}
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    assert {name for name, word in STEPS.items() if word in done.stdout} == steps
