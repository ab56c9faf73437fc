"""What goes into the extension's zips: pinned to the byte, whole, without what is never imported."""

from __future__ import annotations

import hashlib
import os
import re
import tomllib

import pytest

import build_extension
from build_extension import PINS, PLATFORMS, PYTHONS, Product, library_faults, pack, pins, prune, requirements_of

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


def test_an_artist_finds_the_zip_by_its_blender() -> None:
    """Every zip has a name of its own."""
    products = [
        Product(name, "1.0.0", platform, python) for name in PINS for platform in PLATFORMS for python in PYTHONS
    ]
    assert len({product.file for product in products}) == len(products)
    assert products[0].file == "smokelift-1.0.0-blender4.2-5.0-linux_x64.zip"
    assert products[1].file == "smokelift-1.0.0-blender5.1-linux_x64.zip"


def test_engines_are_found_by_version_platform_and_python(tmp_path) -> None:
    """Others lie there unused."""
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
    """Whenever they were written, in whatever order, and whoever may read them."""
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


def test_what_is_never_imported_is_left_out(tmp_path) -> None:
    """Tests, parts of SciPy and pip's notes; licences and versions stay."""
    gone = [
        "scipy/stats/_stats.py",
        "scipy/fft/tests/test_fft.py",
        "a-1.dist-info/RECORD",
        "a-1.data/scripts/run",
        "bin/f",
    ]
    kept = ["scipy/fft/__init__.py", "scipy/ndimage/_filters.py", "a-1.dist-info/METADATA", "a-1.dist-info/LICENSE"]
    for name in (*gone, *kept):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    prune(tmp_path)
    assert {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()} == set(kept)


def test_requirements_are_met_by_the_libraries_or_blenders_numpy(tmp_path) -> None:
    """Those of other systems and of extras do not count."""
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


@pytest.mark.parametrize("name", PINS)
def test_the_manifest_says_what_the_zip_is_for(name, tmp_path, monkeypatch) -> None:
    """Its version is the project's; Blender refuses it where it has another Python."""
    monkeypatch.setattr(build_extension, "STAGE", tmp_path)
    monkeypatch.setattr(build_extension, "MANUAL", tmp_path / "none")
    manifest = tomllib.loads((build_extension.ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    product = Product(name, "2.3.4", LINUX, "3.11")
    product.libraries.mkdir(parents=True)
    build_extension.stage_add_on(product, manifest)
    said = tomllib.loads((product.stage / "blender_manifest.toml").read_text(encoding="utf-8"))
    assert (said["id"], said["version"], said["platforms"]) == (name, "2.3.4", ["linux-x64"])
    assert (said["blender_version_min"], said["blender_version_max"]) == ("4.2.0", "5.1.0")
    assert (product.stage / "__init__.py").is_file() and (product.stage / "LICENSE").is_file()
