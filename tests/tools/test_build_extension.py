"""The extension's zips: the same files make the same bytes, and the manifest says what each is for."""

import hashlib
import os
import tomllib
from typing import Any

import pytest

import build_extension
from build_extension import GPU_ADD_ON, pack
from engine_wheels import PYTHONS
from extension_libraries import PINS
from extension_products import PLATFORMS, Product

LINUX = PLATFORMS[0]


def test_engines_are_found_by_version_platform_and_python(tmp_path) -> None:
    for name in (
        "smokelift-1.0.0-cp311-cp311-manylinux_2_28_x86_64.whl",
        "smokelift-1.0.0-cp313-cp313-win_amd64.whl",
        "smokelift-1.0.0-cp312-cp312-win_amd64.whl",
        "smokelift-0.9.0-cp313-cp313-macosx_11_0_arm64.whl",
    ):
        (tmp_path / name).touch()
    found = build_extension.find_engines([tmp_path], "1.0.0")
    assert set(found) == {("linux-x64", "3.11"), ("windows-x64", "3.13")}


def test_the_same_files_make_the_same_zip(tmp_path) -> None:
    digests = set()
    for turn, names in enumerate((("b.py", "a/c.py"), ("a/c.py", "b.py"))):
        folder = tmp_path / str(turn)
        for name in names:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(name)
            os.utime(folder / name, (turn * 1e8 + 1e9,) * 2)
            (folder / name).chmod((0o600, 0o755)[turn])
        pack(folder, tmp_path / f"{turn}.zip")
        digests.add(hashlib.sha256((tmp_path / f"{turn}.zip").read_bytes()).hexdigest())
    assert len(digests) == 1


@pytest.mark.parametrize("name", PINS)
def test_the_manifest_says_what_the_zip_is_for(name, tmp_path) -> None:
    manifest = tomllib.loads((build_extension.ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    product = Product(name, "2.3.4", LINUX, "3.11", tmp_path)
    product.libraries.mkdir(parents=True)
    build_extension.stage_add_on(product, manifest, manual=tmp_path / "none")
    said = tomllib.loads((product.stage / "blender_manifest.toml").read_text(encoding="utf-8"))
    assert (said["id"], said["version"], said["platforms"]) == (name, "2.3.4", ["linux-x64"])
    assert (said["blender_version_min"], said["blender_version_max"]) == ("4.2.0", "5.1.0")
    parts = ("core/job.py", "scene/volume.py", "result/follow.py", "panel/tab.py") if name == "smokelift" else ()
    assert all((product.stage / part).is_file() for part in ("__init__.py", "LICENSE", *parts))


def test_an_artist_finds_the_zip_by_its_blender() -> None:
    products = [
        Product(name, "1.0.0", platform, python) for name in PINS for platform in PLATFORMS for python in PYTHONS
    ]
    assert len({product.file for product in products}) == len(products)
    assert products[0].file == "smokelift-1.0.0-blender4.2-5.0-linux_x64.zip"
    assert products[1].file == "smokelift-1.0.0-blender5.1-linux_x64.zip"


def test_taichi_for_another_python_is_not_enabled(tmp_path) -> None:
    (tmp_path / "__init__.py").write_text(GPU_ADD_ON)
    found: dict[str, Any] = {"__file__": str(tmp_path / "__init__.py")}
    exec(GPU_ADD_ON, found)
    with pytest.raises(RuntimeError, match="Python 3"):
        found["register"]()
    (tmp_path / f"python{found['PYTHON']}").mkdir()
    found["register"]()
