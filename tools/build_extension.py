"""Build the extension's zips, one for each of Blender's platforms, and check them as Blender does.

A zip holds the add-on, the manifest, the licence, and wheels of everything that the engine needs, for every version of
Python that a Blender carries: it is installed from disk and works at once, without a network. Only numpy is left out,
because Blender has its own and another one beside it breaks both.

Wheels of others are downloaded, as tools/bundle.txt pins them. The engine's own have been
built before, here (engine_wheels.py) or on a machine of the platform they are for.
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
from email.parser import Parser
from pathlib import Path
from typing import Any

import tomli_w
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name, parse_wheel_filename
from packaging.version import Version

from engine_wheels import PYTHONS, ROOT

STAGE = ROOT / "build" / "extension"

MANUAL = ROOT / "build" / "manual"
"""The manual as web pages, which the preferences' button opens."""

BLENDER_NUMPY = {"3.11": "1.26.4", "3.13": "2.2.0"}
"""The numpy that Blender has beside each Python; what is bundled has to work with it."""


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


def main() -> int:
    """Build and check the zips; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument(
        "--engine-wheels", type=Path, nargs="+", required=True, metavar="DIR", help="where the engine's wheels lie"
    )
    parser.add_argument("--out", type=Path, required=True, help="folder for the zips")
    options = parser.parse_args()
    try:
        for built in build(options.engine_wheels, options.out):
            print(f"{built} ({built.stat().st_size / 2**20:.0f} MB)")
    except BuildError as error:
        print(f"make extension: {error}", file=sys.stderr)
        return 2
    return 0


def build(engine_wheels: Sequence[Path], out: Path) -> list[Path]:
    """Build the zips of all platforms that there is an engine for.

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
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    if manifest["version"] != project["project"]["version"]:
        # Blender does not unpack a wheel again whose version it has already
        raise BuildError(
            f"the extension is {manifest['version']}, the engine {project['project']['version']}: give "
            "blender_manifest.toml and pyproject.toml the same version, or updates keep the old engine."
        )
    engines = engines_by_platform(engine_wheels, manifest["version"])
    for platform in PLATFORMS:
        if platform.name not in engines:
            print(
                f"{platform.name} is left out: it needs the engine's wheels of version {manifest['version']} for "
                f"Python {' and '.join(PYTHONS)}, built on such a machine with tools/engine_wheels.py and given with "
                "make extension ENGINE_WHEELS=DIR."
            )
    if not engines:
        raise BuildError("there are no engine wheels at all.")

    shutil.rmtree(STAGE, ignore_errors=True)
    wheels = STAGE / "wheels"
    wheels.mkdir(parents=True)
    for platform in PLATFORMS:
        if platform.name in engines:
            gather(platform, engines[platform.name], pins(), wheels)
    stage_add_on(manifest, [platform.name for platform in PLATFORMS if platform.name in engines])

    print("Zipping, and checking the zip as Blender does.", flush=True)
    out.mkdir(parents=True, exist_ok=True)
    for old in out.glob(f"{manifest['id']}-*.zip"):
        old.unlink()
    run_builder("build", "--split-platforms", "--source-dir", str(STAGE), "--output-dir", str(out))
    zips = sorted(out.glob(f"{manifest['id']}-{manifest['version']}-*.zip"))
    if len(zips) != len(engines):
        raise BuildError(f"Blender's builder left {len(zips)} zips in {out} for {len(engines)} platforms.")
    for built in zips:
        run_builder("validate", str(built))
        check_zip(built)
    return zips


def engines_by_platform(folders: Iterable[Path], version: str) -> dict[str, dict[str, Path]]:
    """Return the engine's wheels by platform and Python; only platforms that have one for every Python."""
    files = [file for folder in folders for file in sorted(folder.glob("smokelift-*.whl"))]
    found: dict[str, dict[str, Path]] = {platform.name: {} for platform in PLATFORMS}
    for file in files:
        _, wheel_version, _, tags = parse_wheel_filename(file.name)
        if wheel_version != Version(version):
            continue
        for platform in PLATFORMS:
            for python in PYTHONS:
                if any(t.interpreter == _tag(python) and re.fullmatch(platform.fits, t.platform) for t in tags):
                    found[platform.name][python] = file
    return {name: engines for name, engines in found.items() if len(engines) == len(PYTHONS)}


def pins() -> list[str]:
    """Return the lines of tools/bundle.txt: a requirement with the hashes of its wheels each."""
    lines = (ROOT / "tools" / "bundle.txt").read_text(encoding="utf-8").replace("\\\n", "").splitlines()
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


def gather(platform: Platform, engines: Mapping[str, Path], lines: Sequence[str], folder: Path) -> None:
    """Bring all wheels for a platform together in a folder, and check that nothing is missing.

    Raises
    ------
    BuildError
        If a wheel cannot be had, or they do not fit each other.
    """
    for python in PYTHONS:
        print(f"Gathering the wheels for {platform.name} and Python {python}.", flush=True)
        aside = STAGE / "downloads" / f"{platform.name}-{python}"
        aside.mkdir(parents=True)
        wanted = aside / "requirements.txt"
        wanted.write_text("\n".join(requirements_of(platform, python, lines)) + "\n", encoding="utf-8")
        command = [sys.executable, "-m", "pip", "--disable-pip-version-check", "download", "--quiet", "--no-deps"]
        command += ["--require-hashes", "--only-binary", ":all:", "--implementation", "cp", "--python-version", python]
        command += [word for abi in (_tag(python), "abi3", "none") for word in ("--abi", abi)]
        command += [word for tag in platform.tags for word in ("--platform", tag)]
        command += ["--dest", str(aside), "--requirement", str(wanted)]
        if subprocess.run(command).returncode != 0:
            raise BuildError(
                f"the wheels for {platform.name} and Python {python} could not be downloaded (see above): check the "
                "network, and the versions and hashes in tools/bundle.txt."
            )
        shutil.copy(engines[python], aside)
        files = sorted(aside.glob("*.whl"))
        faults = [fault for file in files for fault in wheel_faults(file, files, platform, python)]
        if faults:
            raise BuildError(f"for {platform.name} and Python {python}, {'; '.join(faults)}.")
        for file in files:
            shutil.copy(file, folder)


def wheel_faults(wheel: Path, bundle: Sequence[Path], platform: Platform, python: str) -> list[str]:
    """Say what of a wheel would not work in Blender: a requirement that is not met, or a layout it cannot unpack."""
    faults = []
    have = {"numpy": Version(BLENDER_NUMPY[python])}
    for file in bundle:
        name, version, _, _ = parse_wheel_filename(file.name)
        have[name] = version
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        metadata = archive.read(next(name for name in names if re.fullmatch(r"[^/]+\.dist-info/METADATA", name)))
    if any(re.match(r"[^/]+\.data/(purelib|platlib)/", name) for name in names):
        faults.append(f"{wheel.name} keeps modules where Blender before 4.4 does not find them")
    for line in Parser().parsestr(metadata.decode()).get_all("Requires-Dist", []):
        requirement = Requirement(line)
        if requirement.marker is not None and not requirement.marker.evaluate(_markers(platform, python)):
            continue
        there = have.get(canonicalize_name(requirement.name))
        if there is None or not requirement.specifier.contains(there, prereleases=True):
            faults.append(f"{wheel.name} needs {requirement.name}{requirement.specifier}, and there is {there}")
    return faults


def stage_add_on(manifest: Mapping[str, Any], platforms: Sequence[str]) -> None:
    """Put the add-on's files beside the wheels, with a manifest that names them."""
    for file in sorted((ROOT / "addon").rglob("*.py")):
        target = STAGE / file.relative_to(ROOT / "addon")
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, target)
    shutil.copy(ROOT / "LICENSE", STAGE)
    if MANUAL.is_dir():
        shutil.copytree(MANUAL, STAGE / MANUAL.name)
    else:
        print("The manual is left out: there is none in build/manual.")
    wheels = sorted(f"./wheels/{file.name}" for file in (STAGE / "wheels").iterdir())
    shutil.rmtree(STAGE / "downloads")
    complete = {**manifest, "platforms": list(platforms), "wheels": wheels}
    (STAGE / "blender_manifest.toml").write_text(tomli_w.dumps(complete), encoding="utf-8")


def run_builder(command: str, *arguments: str) -> None:
    """Run Blender's own builder of extensions, which lies inside the bpy wheel.

    Raises
    ------
    BuildError
        If it is missing or finds a fault.
    """
    found = importlib.util.find_spec("bpy")
    places = [] if found is None else [Path(place) for place in found.submodule_search_locations or []]
    builder = _first(places, "*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    tags = _first(places, "*/scripts/modules/_bpy_internal/extensions/tags.py")
    done = subprocess.run(
        [sys.executable, str(builder), command, "--valid-tags", str(tags), *arguments], capture_output=True, text=True
    )
    # it says FATAL_ERROR or ERROR and may end with 0 all the same
    if done.returncode != 0 or re.search("error", done.stdout + done.stderr, re.IGNORECASE):
        raise BuildError(f"Blender's builder refuses to {command}: {(done.stdout + done.stderr).strip()}")


def _first(places: Iterable[Path], pattern: str) -> Path:
    for place in places:
        for path in place.glob(pattern):
            return path
    raise BuildError("Blender's builder comes with bpy, which exists for Python 3.11 and 3.13: use one of them.")


def check_zip(built: Path) -> None:
    """Check what a builder's exit status does not say: that a zip holds what its manifest promises, and no numpy.

    Raises
    ------
    BuildError
        If it does not.
    """
    with zipfile.ZipFile(built) as archive:
        names = set(archive.namelist())
        promised = tomllib.loads(archive.read("blender_manifest.toml").decode())["build"]["generated"]["wheels"]
    missing = {"__init__.py", "LICENSE", *(wheel.removeprefix("./") for wheel in promised)} - names
    if missing:
        raise BuildError(f"{built.name} lacks {', '.join(sorted(missing))}.")
    if any(parse_wheel_filename(Path(wheel).name)[0] == "numpy" for wheel in promised):
        raise BuildError(f"{built.name} holds numpy, which would displace Blender's own.")


def _tag(python: str) -> str:
    return "cp" + python.replace(".", "")


def _markers(platform: Platform, python: str) -> dict[str, str]:
    return {**platform.markers, "python_version": python, "python_full_version": f"{python}.0", "extra": ""}


if __name__ == "__main__":
    sys.exit(main())
