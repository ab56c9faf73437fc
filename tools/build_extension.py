"""Build the extension's zips, for each of Blender's platforms and Pythons, and check them as Blender does.

`smokelift` holds the add-on, the manifest, the license, the manual and, in a folder that is named after its Python, the
engine with everything that it needs: it is installed from disk and works at once, without a network. numpy is left out,
because Blender has its own. `smokelift_gpu` holds Taichi, which only a GPU needs and which is larger than all the rest;
the add-on finds it beside itself.

What the engine needs lies there as a folder, not as wheels: Blender would keep a wheel beside its unpacked files, and
share those with other extensions, which may want another version. The engine is a process of its own.

The engine's own wheels have been built before, here (engine_wheels.py) or on a machine of the platform they are for.
The same sources give the same zips, byte for byte.
"""

import argparse
import importlib.util
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import tomli_w
from packaging.utils import parse_wheel_filename
from packaging.version import Version

from engine_wheels import PYTHONS, ROOT, VERSION
from extension_libraries import PINS, gather, library_faults
from extension_products import BLENDERS, PLATFORMS, STAGE, BuildError, Platform, Product, python_tag

MANUAL = ROOT / "build" / "manual"
"""The manual as web pages, which the preferences' button opens."""

LEVEL = 5
"""Level of compression: it takes six tenths of the time of 6, which is usual, for 1 % more bytes."""

GPU = {"name": "Smokelift GPU", "tagline": "Lets Smokelift render on the graphics card"}
"""What the manifest of `smokelift_gpu` says otherwise."""

GPU_ADD_ON = '''"""Taichi for the extension Smokelift, which finds it here: there is nothing to register."""

import sys
from pathlib import Path

PYTHON = f"{sys.version_info.major}.{sys.version_info.minor}"


def register() -> None:
    if not Path(__file__).with_name(f"python{PYTHON}").is_dir():
        raise RuntimeError(f"This zip is not for Python {PYTHON}: install the one that ends as that of Smokelift does.")


def unregister() -> None:
    pass
'''


def main() -> int:
    """Build and check the zips; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument(
        "--engine-wheels", type=Path, nargs="+", required=True, metavar="DIR", help="where the engine's wheels lie"
    )
    parser.add_argument("--out", type=Path, required=True, help="folder for the zips")
    options = parser.parse_args()
    try:
        build(options.engine_wheels, options.out)
    except BuildError as error:
        print(f"make extension: {error}", file=sys.stderr)
        return 2
    return 0


def build(engine_wheels: Sequence[Path], out: Path) -> list[Path]:
    """Build the zips of all platforms and Pythons that there is an engine for, and say how large they are.

    Parameters
    ----------
    engine_wheels
        Folders with the engine's wheels.
    out
        Folder for the zips; older ones in it are removed.

    Raises
    ------
    BuildError
        If nothing can be built, or what was built is not sound.
    """
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    engines = find_engines(engine_wheels, VERSION)
    for platform in PLATFORMS:
        missing = [python for python in PYTHONS if (platform.name, python) not in engines]
        if missing:
            print(
                f"{platform.name} is left out for Python {' and '.join(missing)}: it needs the engine's wheel of "
                f"version {VERSION}, built on such a machine and given with make extension ENGINE_WHEELS=DIR."
            )
    if not engines:
        raise BuildError("there are no engine wheels at all.")

    shutil.rmtree(STAGE, ignore_errors=True)
    out.mkdir(parents=True, exist_ok=True)
    for old in out.glob("smokelift*.zip"):
        old.unlink()
    zips = []
    for platform in PLATFORMS:
        for python in PYTHONS:
            if (platform.name, python) in engines:
                engine = engines[platform.name, python]
                zips += build_pair(manifest, platform, python, engine, out)
    return zips


def build_pair(manifest: Mapping[str, Any], platform: Platform, python: str, engine: Path, out: Path) -> list[Path]:
    """Build the extension and the one for the GPU, for one platform and Python."""
    zips = []
    libraries: list[Path] = []
    for name in PINS:
        product = Product(name, VERSION, platform, python)
        print(f"{product.file}: gathering what the engine needs.", flush=True)
        gather(product, engine if name == "smokelift" else None)
        libraries.append(product.libraries)
        faults = library_faults(product.libraries, libraries, platform, python)
        if faults:
            raise BuildError(f"{product.file}: {'; '.join(faults)}.")
        stage_add_on(product, manifest)
        print(f"{product.file}: zipping, and checking the zip as Blender does.", flush=True)
        built = out / product.file
        pack(product.stage, built)
        run_validator(built)
        unpacked = sum(file.stat().st_size for file in product.stage.rglob("*") if file.is_file())
        print(f"{built}: {built.stat().st_size / 1e6:.0f} MB, installed {unpacked / 1e6:.0f} MB", flush=True)
        zips.append(built)
    return zips


def find_engines(folders: Iterable[Path], version: str) -> dict[tuple[str, str], Path]:
    """Return the engine's wheels of a version by platform and Python."""
    found: dict[tuple[str, str], Path] = {}
    for file in (file for folder in folders for file in sorted(folder.glob("smokelift-*.whl"))):
        _, wheel_version, _, tags = parse_wheel_filename(file.name)
        if wheel_version != Version(version):
            continue
        for platform in PLATFORMS:
            for python in PYTHONS:
                if any(t.interpreter == python_tag(python) and re.fullmatch(platform.fits, t.platform) for t in tags):
                    found[platform.name, python] = file
    return found


def stage_add_on(product: Product, manifest: Mapping[str, Any], manual: Path = MANUAL) -> None:
    """Put the add-on's files and manual beside its libraries, with a manifest that says what the zip is for."""
    stage = product.stage
    complete = {**manifest, "id": product.name, "version": product.version, "platforms": [product.platform.name]}
    complete["blender_version_min"], before = BLENDERS[product.python]
    if before is not None:
        complete["blender_version_max"] = before
    if product.name == "smokelift_gpu":
        complete |= GPU
        (stage / "__init__.py").write_text(GPU_ADD_ON, encoding="utf-8")
    else:
        shutil.copytree(ROOT / "addon", stage, ignore=shutil.ignore_patterns("__pycache__"), dirs_exist_ok=True)
        if manual.is_dir():
            shutil.copytree(manual, stage / manual.name, ignore=shutil.ignore_patterns("*.map", "*.gz"))
        else:
            print(f"{product.file}: the manual is left out, as there is none in build/manual (make manual).")
    shutil.copy(ROOT / "LICENSE", stage)
    # what belongs to no section comes first
    text = tomli_w.dumps({key: complete[key] for key in sorted(complete, key=lambda key: key == "permissions")})
    (stage / "blender_manifest.toml").write_text(text, encoding="utf-8")


def pack(folder: Path, built: Path) -> None:
    """Zip a folder so that the same files make the same bytes: in the order of their names, and without their dates."""
    files = {file.relative_to(folder).as_posix(): file for file in folder.rglob("*") if file.is_file()}
    with zipfile.ZipFile(built, "w") as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name)
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, files[name].read_bytes(), zipfile.ZIP_DEFLATED, LEVEL)


def run_validator(built: Path) -> None:
    """Have Blender's own checks, which lie inside the bpy wheel, look at a zip.

    Raises
    ------
    BuildError
        If they are missing or find a fault.
    """
    found = importlib.util.find_spec("bpy")
    places = [] if found is None else [Path(place) for place in found.submodule_search_locations or []]
    program = _first(places, "*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    tags = _first(places, "*/scripts/modules/_bpy_internal/extensions/tags.py")
    command = [sys.executable, str(program), "validate", "--valid-tags", str(tags), str(built)]
    done = subprocess.run(command, capture_output=True, text=True)
    # it says FATAL_ERROR or ERROR and may end with 0 all the same
    if done.returncode != 0 or re.search("error", done.stdout + done.stderr, re.IGNORECASE):
        raise BuildError(f"Blender refuses {built.name}: {(done.stdout + done.stderr).strip()}")


def _first(places: Iterable[Path], pattern: str) -> Path:
    for place in places:
        for path in place.glob(pattern):
            return path
    raise BuildError("Blender's checks come with bpy, which exists for Python 3.11 and 3.13: use one of them.")


if __name__ == "__main__":
    sys.exit(main())
