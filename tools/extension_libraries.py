"""What the engine needs from others, as folders in the extension's zips.

Wheels are downloaded as tools/bundle.txt and bundle_gpu.txt pin them, and what the engine never imports of them is left
out.
"""

import shutil
import subprocess
import sys
from collections.abc import Iterable
from importlib.metadata import distributions
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

from engine_wheels import ROOT
from extension_products import BLENDER_NUMPY, STAGE, BuildError, Platform, Product, python_tag

PINS = {"smokelift": "bundle.txt", "smokelift_gpu": "bundle_gpu.txt"}
"""The extensions, and the files in tools that pin their wheels."""

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
        if requirement.marker is None or requirement.marker.evaluate(platform.environment(python)):
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
        command += [word for abi in (python_tag(product.python), "abi3", "none") for word in ("--abi", abi)]
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
    Requirements that nothing fulfils, and numpy if it is there, which would displace Blender's own.
    """
    have = {"numpy": Version(BLENDER_NUMPY[python])}
    for found in distributions(path=[str(folder) for folder in imported]):
        have[canonicalize_name(found.name)] = Version(found.version)
    faults = ["numpy is in it, which Blender has"] if (libraries / "numpy").exists() else []
    for found in distributions(path=[str(libraries)]):
        for line in found.requires or []:
            requirement = Requirement(line)
            if requirement.marker is not None and not requirement.marker.evaluate(platform.environment(python)):
                continue
            there = have.get(canonicalize_name(requirement.name))
            if there is None or not requirement.specifier.contains(there, prereleases=True):
                faults.append(f"{found.name} needs {requirement.name}{requirement.specifier}, and there is {there}")
    return faults
