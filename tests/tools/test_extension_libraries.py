"""What the engine needs in the extension's zips: pinned to the byte, whole, without what is never imported."""

import ast
import re

import pytest

from engine_wheels import PYTHONS, ROOT
from extension_libraries import PINS, UNUSED, library_faults, pins, prune, requirements_of
from extension_products import PLATFORMS

LINUX = PLATFORMS[0]


def distribution(folder, name, version, requires=()) -> None:
    """Leave what an installed library says of itself."""
    notes = folder / f"{name}-{version}.dist-info"
    notes.mkdir(parents=True)
    lines = ["Metadata-Version: 2.1", f"Name: {name}", f"Version: {version}"]
    (notes / "METADATA").write_text("\n".join([*lines, *(f"Requires-Dist: {each}" for each in requires)]))


@pytest.mark.parametrize("python", PYTHONS)
@pytest.mark.parametrize("platform", PLATFORMS, ids=lambda platform: platform.name)
@pytest.mark.parametrize(("name", "count"), [("smokelift", 11), ("smokelift_gpu", 3)])
def test_every_wheel_has_a_version_and_hashes(name, count, platform, python) -> None:
    lines = requirements_of(platform, python, pins(PINS[name]))
    names = [line.partition("==")[0] for line in lines]
    assert len(set(names)) == len(names) == count
    assert all(re.fullmatch(r"[\w-]+==[\w.]+( --hash=sha256:[0-9a-f]{64})+", line) for line in lines)


def test_what_is_never_imported_is_left_out(tmp_path) -> None:
    gone = ["scipy/stats/_stats.py", "scipy/fft/tests/test_fft.py", "a-1.dist-info/RECORD", "a-1.data/run", "bin/f"]
    kept = ["scipy/fft/__init__.py", "scipy/ndimage/_filters.py", "a-1.dist-info/METADATA", "a-1.dist-info/LICENSE"]
    for name in (*gone, *kept):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    prune(tmp_path)
    assert {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()} == set(kept)


def test_no_part_of_scipy_that_the_engine_imports_is_left_out() -> None:
    left_out = {pattern.partition("/")[2] for pattern in UNUSED if pattern.startswith("scipy/")}
    imported = set()
    for module in (ROOT / "engine").rglob("*.py"):
        for node in ast.walk(ast.parse(module.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module is not None:
                imported |= {node.module, *(f"{node.module}.{name.name}" for name in node.names)}
            elif isinstance(node, ast.Import):
                imported |= {name.name for name in node.names}
    parts = {name.split(".")[1] for name in imported if name.startswith("scipy.")}
    assert {"fft", "ndimage", "sparse"} <= parts
    assert parts & left_out == set()


def test_requirements_are_met_by_the_libraries_or_blenders_numpy(tmp_path) -> None:
    gpu = tmp_path / "gpu"
    needs = ["numpy>=1.26", "rich>=13", "colorama; sys_platform == 'win32'", "bpy; extra == 'vdb'"]
    distribution(tmp_path, "smokelift", "1.0.0", needs)
    distribution(tmp_path, "rich", "15.0.0")
    distribution(gpu, "taichi", "1.7.4", ["rich", "dill"])
    assert library_faults(tmp_path, [tmp_path], LINUX, "3.11") == []
    assert library_faults(gpu, [tmp_path, gpu], LINUX, "3.11") == ["taichi needs dill, and there is None"]
    assert "smokelift needs colorama, and there is None" in library_faults(tmp_path, [tmp_path], PLATFORMS[1], "3.11")
    distribution(tmp_path, "scipy", "1.17.1", ["numpy>=2"])
    assert library_faults(tmp_path, [tmp_path], LINUX, "3.11") == ["scipy needs numpy>=2, and there is 1.26.4"]
    (tmp_path / "numpy").mkdir()
    assert "numpy is in it, which Blender has" in library_faults(tmp_path, [tmp_path], LINUX, "3.13")
