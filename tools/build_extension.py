"""Build the extension's zips, for each of Blender's platforms and Pythons, and check them as Blender does.

`smokelift` holds the add-on, the manifest, the licence, the manual and, in a folder that is named after its Python, the
engine with everything that it needs: it is installed from disk and works at once, without a network. numpy is left out,
because Blender has its own. `smokelift_gpu` holds Taichi, which only a GPU needs and which is larger than all the rest;
the add-on finds it beside itself.

What the engine needs lies there as a folder, not as wheels: Blender would keep a wheel beside its unpacked files, and
share those with other extensions, which may want another version. The engine is a process of its own.

Wheels of others are downloaded, as tools/bundle.txt and bundle_gpu.txt pin them, and what the engine never imports of
them is left out. The engine's own have been built before, here (engine_wheels.py) or on a machine of the platform they
are for. The same sources give the same zips, byte for byte.
"""

from __future__ import annotations

import argparse
import importlib.util
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

import tomli_w
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name, parse_wheel_filename
from packaging.version import Version

from engine_wheels import PYTHONS, ROOT, VERSION

STAGE = ROOT / "build" / "extension"

MANUAL = ROOT / "build" / "manual"
"""The manual as web pages, which the preferences' button opens."""

BLENDERS = {"3.11": ("4.2.0", "5.1.0"), "3.13": ("4.2.0", None)}
"""First Blender that a Python's zip installs in, and the first that it does not. Official ones have Python 3.13 from
5.1 on, Linux distributions' own earlier (Debian's 4.3): there the add-on says it if the zip is the wrong one."""

NAMED = {"3.11": "blender4.2-5.0", "3.13": "blender5.1"}
"""What a zip is called after the Blenders that it is for."""

BLENDER_NUMPY = {"3.11": "1.26.4", "3.13": "2.2.0"}
"""The numpy that Blender has beside each Python; what is bundled has to work with it."""

PINS = {"smokelift": "bundle.txt", "smokelift_gpu": "bundle_gpu.txt"}
"""The extensions, and the files in tools that pin their wheels."""

LEVEL = 5
"""Of compression: takes six tenths of the time of 6, which is usual, for 1 % more bytes."""

GPU = {"name": "Smokelift GPU", "tagline": "Lets Smokelift render on the graphics card"}
"""What the manifest of `smokelift_gpu` says otherwise."""

GPU_ADD_ON = '''"""Taichi for the extension Smokelift, which finds it here: there is nothing to register."""


def register() -> None:
    pass


def unregister() -> None:
    pass
'''

UNUSED = (
    "bin",
    "*.data",
    "**/tests",
    # of pip's notes: paths of this machine, and checksums of what is changed here
    *(f"*.dist-info/{name}" for name in ("RECORD", "REQUESTED", "INSTALLER", "direct_url.json")),
    *(
        f"scipy/{part}"
        for part in ("cluster", "datasets", "differentiate", "fftpack", "integrate", "interpolate", "io")
    ),
    *(f"scipy/{part}" for part in ("misc", "odr", "optimize", "signal", "stats")),
)
"""Patterns of what no module of the engine imports; tests/blender imports them all in every Blender."""

STRIPPED = ("av", "PIL")
"""Libraries whose Linux wheels hold debugging information, a quarter of all bytes of PyAV."""


@dataclass(frozen=True)
class Platform:
    """One of Blender's platforms.

    Attributes
    ----------
    name
        As Blender calls it.
    tags
        Platform tags of wheels that run there, for pip.
    fits
        Pattern of the platform tags that run there.
    markers
        What requirements may ask about it.
    """

    name: str
    tags: tuple[str, ...]
    fits: str
    markers: Mapping[str, str]


PLATFORMS = (
    Platform(
        "linux-x64",
        # Blender needs glibc 2.28 itself
        (*(f"manylinux_2_{minor}_x86_64" for minor in (28, 27, 26, 24, 17, 12, 5)), "manylinux2014_x86_64"),
        r"(many)?linux.*_x86_64",
        {"sys_platform": "linux", "platform_system": "Linux", "platform_machine": "x86_64", "os_name": "posix"},
    ),
    Platform(
        "windows-x64",
        ("win_amd64",),
        r"win_amd64",
        {"sys_platform": "win32", "platform_system": "Windows", "platform_machine": "AMD64", "os_name": "nt"},
    ),
    Platform(
        "macos-arm64",
        tuple(f"macosx_{major}_0_{kind}" for major in (14, 13, 12, 11) for kind in ("arm64", "universal2")),
        r"macosx_.*_(arm64|universal2)",
        {"sys_platform": "darwin", "platform_system": "Darwin", "platform_machine": "arm64", "os_name": "posix"},
    ),
)


class BuildError(RuntimeError):
    """A zip that cannot be built, and why."""


@dataclass(frozen=True)
class Product:
    """One zip.

    Attributes
    ----------
    name
        Of the extension.
    version
        Of the extension.
    platform
        What it is for.
    python
        The version of Python that it is for.
    """

    name: str
    version: str
    platform: Platform
    python: str

    @property
    def file(self) -> str:
        """Name of the zip."""
        return f"{self.name}-{self.version}-{NAMED[self.python]}-{self.platform.name.replace('-', '_')}.zip"

    @property
    def stage(self) -> Path:
        """Folder that is zipped."""
        return STAGE / self.file.removesuffix(".zip")

    @property
    def libraries(self) -> Path:
        """What the engine imports from; the add-on looks for a folder of this name (addon/job.py)."""
        return self.stage / f"python{self.python}"


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
                if any(t.interpreter == _tag(python) and re.fullmatch(platform.fits, t.platform) for t in tags):
                    found[platform.name, python] = file
    return found


def pins(name: str) -> list[str]:
    """Return the lines of a file in tools: a requirement with the hashes of its wheels each."""
    lines = (ROOT / "tools" / name).read_text(encoding="utf-8").replace("\\\n", "").splitlines()
    return [line for line in lines if not line.startswith("#")]


def requirements_of(platform: Platform, python: str, lines: Iterable[str]) -> list[str]:
    """Return the lines of a requirements file that apply to a platform, for pip, which asks its own instead."""
    wanted = []
    for line in lines:
        name, *hashes = line.split(" --hash=")
        requirement = Requirement(name)
        if requirement.marker is None or requirement.marker.evaluate(_markers(platform, python)):
            hashed = " ".join(f"--hash={digits.strip()}" for digits in hashes)
            wanted.append(f"{requirement.name}{requirement.specifier} {hashed}")
    return wanted


def gather(product: Product, engine: Path | None) -> None:
    """Unpack the wheels of a product into its folder, without what is never imported.

    Raises
    ------
    BuildError
        If a wheel cannot be had.
    """
    product.libraries.mkdir(parents=True)
    wanted = STAGE / "requirements.txt"
    lines = requirements_of(product.platform, product.python, pins(PINS[product.name]))
    wanted.write_text("\n".join(lines) + "\n", encoding="utf-8")
    sources = [["--require-hashes", "--requirement", str(wanted)]]
    if engine is not None:
        sources.append(["--no-index", str(engine)])
    for source in sources:
        command = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet", "--no-deps"]
        command += ["--only-binary", ":all:", "--no-compile", "--upgrade", "--target", str(product.libraries)]
        command += ["--implementation", "cp", "--python-version", product.python]
        command += [word for abi in (_tag(product.python), "abi3", "none") for word in ("--abi", abi)]
        command += [word for tag in product.platform.tags for word in ("--platform", tag)]
        if subprocess.run([*command, *source]).returncode != 0:
            raise BuildError(
                f"the wheels of {product.file} could not be had (see above): check the network, and the versions and "
                f"hashes in tools/{PINS[product.name]}."
            )
    prune(product.libraries)
    if product.platform.name.startswith("linux"):
        strip(product.libraries)


def prune(libraries: Path) -> None:
    """Remove what is never imported."""
    for pattern in UNUSED:
        for found in list(libraries.glob(pattern)):
            if found.is_dir():
                shutil.rmtree(found)
            else:
                found.unlink()


def strip(libraries: Path) -> None:
    """Remove debugging information.

    Raises
    ------
    BuildError
        If the tool for that is missing.
    """
    files = [str(file) for part in STRIPPED for file in sorted((libraries / part).rglob("*.so"))]
    if not files:
        return
    try:
        subprocess.run(["strip", "--strip-debug", *files], check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise BuildError(f"strip of binutils is needed, and failed: {error} (Debian: apt install binutils).") from error


def library_faults(libraries: Path, imported: Iterable[Path], platform: Platform, python: str) -> list[str]:
    """Say what of a folder of libraries would not work in Blender.

    Parameters
    ----------
    libraries
        The folder.
    imported
        All folders that are imported from together, this one among them.
    platform, python
        What it is for.

    Returns
    -------
    Requirements that are not met, and numpy if it is there, which would displace Blender's own.
    """
    have = {"numpy": Version(BLENDER_NUMPY[python])}
    for found in distributions(path=[str(folder) for folder in imported]):
        have[canonicalize_name(found.name)] = Version(found.version)
    faults = ["numpy is in it, which Blender has"] if (libraries / "numpy").exists() else []
    for found in distributions(path=[str(libraries)]):
        for line in found.requires or []:
            requirement = Requirement(line)
            if requirement.marker is not None and not requirement.marker.evaluate(_markers(platform, python)):
                continue
            there = have.get(canonicalize_name(requirement.name))
            if there is None or not requirement.specifier.contains(there, prereleases=True):
                faults.append(f"{found.name} needs {requirement.name}{requirement.specifier}, and there is {there}")
    return faults


def stage_add_on(product: Product, manifest: Mapping[str, Any]) -> None:
    """Put the add-on's files beside its libraries, with a manifest that says what the zip is for."""
    stage = product.stage
    complete = {**manifest, "id": product.name, "version": product.version, "platforms": [product.platform.name]}
    complete["blender_version_min"], before = BLENDERS[product.python]
    if before is not None:
        complete["blender_version_max"] = before
    if product.name == "smokelift_gpu":
        complete |= GPU
        (stage / "__init__.py").write_text(GPU_ADD_ON, encoding="utf-8")
    else:
        for file in sorted((ROOT / "addon").glob("*.py")):
            shutil.copy(file, stage)
        if MANUAL.is_dir():
            shutil.copytree(MANUAL, stage / MANUAL.name, ignore=shutil.ignore_patterns("*.map", "*.gz"))
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


def _tag(python: str) -> str:
    return "cp" + python.replace(".", "")


def _markers(platform: Platform, python: str) -> dict[str, str]:
    return {**platform.markers, "python_version": python, "python_full_version": f"{python}.0", "extra": ""}


if __name__ == "__main__":
    sys.exit(main())
