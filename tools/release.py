"""The checklist of a release: every step is a check that can fail, and what is left for a person is said at the end.

    python tools/release.py              # after make extension: checks what is in dist/, and the sdist
    python tools/release.py --quick      # only what takes no time

What a release needs besides is `.ci/run` from a clean checkout of the same commit.
"""

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path

from engine_wheels import PYTHONS, ROOT, VERSION, find_python

DIST = ROOT / "dist"

LARGEST_ZIP, LARGEST_INSTALLED = 100e6, 250e6
"""Bytes of an extension."""

LICENSE = re.compile(r"licen[cs]e|copying|notice", re.IGNORECASE)
"""How files are called that hold a license."""

DEBIAN = Path(os.environ.get("SMOKELIFT_BLENDER_ROOT", Path.home() / ".cache" / "smokelift-tests" / "trixie"))
"""The root with a Blender that `make test-blender` builds."""


class NotReadyError(RuntimeError):
    """What stands against a release."""


def main() -> int:
    """Go through the list; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="only the checks that build nothing")
    quick: bool = parser.parse_args().quick
    steps: list[Callable[[], str]] = [clean_checkout, changelog_has_the_version]
    if not quick:
        steps += [zips_are_small_and_whole, licenses_are_carried, blender_takes_the_zips, sdist_builds_alone, checksums]
    failed = 0
    for step in steps:
        try:
            print(f"ok      {step()}", flush=True)
        except NotReadyError as reason:
            failed += 1
            print(f"NOT YET {reason}", flush=True)
    if not failed and not quick:
        print(f"Left to you: .ci/run of this commit; git tag -s v{VERSION}; upload dist/ with SHA256SUMS.")
    return 1 if failed else 0


def clean_checkout() -> str:
    """Nothing is changed that is not committed, and the version has no tag yet."""
    if _git("status", "--porcelain"):
        raise NotReadyError("the checkout has changes: commit them.")
    if f"v{VERSION}" in _git("tag").split():
        raise NotReadyError(f"v{VERSION} is released: raise __version__ in engine/smokelift/__init__.py.")
    return f"commit {_git('rev-parse', '--short', 'HEAD')}, which is to be v{VERSION}"


def changelog_has_the_version(path: Path = ROOT / "CHANGELOG.md") -> str:
    """The first section is this version's, with a date."""
    first = re.search(r"^## (.+)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    heading = first[1] if first else "nothing"
    if not re.fullmatch(rf"{re.escape(VERSION)} \(\d{{4}}-\d\d-\d\d\)", heading):
        raise NotReadyError(f"CHANGELOG.md begins with “{heading}”, not with “{VERSION} (YEAR-MONTH-DAY)”.")
    return f"CHANGELOG.md has {heading}"


def zips_are_small_and_whole(folder: Path = DIST, largest_installed: float = LARGEST_INSTALLED) -> str:
    """Every zip of this version can be read, holds its manual, and is small enough."""
    zips = sorted(folder.glob(f"smokelift*-{VERSION}-*.zip"))
    if not zips:
        raise NotReadyError("there are no zips in dist/: run make extension.")
    for path in zips:
        with zipfile.ZipFile(path) as archive:
            damaged = archive.testzip()
            installed = sum(entry.file_size for entry in archive.infolist())
            names = set(archive.namelist())
        if damaged is not None:
            raise NotReadyError(f"{path.name} is damaged: {damaged}.")
        if not path.name.startswith("smokelift_gpu") and "manual/index.html" not in names:
            raise NotReadyError(f"{path.name} has no manual: run make manual, then make extension.")
        if path.stat().st_size > LARGEST_ZIP or installed > largest_installed:
            raise NotReadyError(f"{path.name} has {path.stat().st_size / 1e6:.0f} MB, {installed / 1e6:.0f} installed.")
    return f"{len(zips)} zips: {', '.join(f'{path.name} {path.stat().st_size / 1e6:.0f} MB' for path in zips)}"


def licenses_are_carried(folder: Path = DIST) -> str:
    """Every package in a zip carries the text of its license, and so does the zip."""
    packages = set()
    for path in sorted(folder.glob(f"smokelift*-{VERSION}-*.zip")):
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
        if "LICENSE" not in names:
            raise NotReadyError(f"{path.name} has no LICENSE.")
        for about in {name.partition(".dist-info/")[0] for name in names if ".dist-info/" in name}:
            if not any(LICENSE.search(name) for name in names if name.startswith(f"{about}.dist-info/")):
                raise NotReadyError(f"{path.name} carries {about.rpartition('/')[2]} without its license.")
            packages.add(about.rpartition("/")[2].partition("-")[0])
    return f"licenses of {len(packages)} packages: {', '.join(sorted(packages))}"


def blender_takes_the_zips(folder: Path = DIST) -> str:
    """A real Blender finds no fault in any zip: one that can be called, else that of `make test-blender`."""
    command = [shutil.which("blender") or ""]
    if not command[0]:
        if not (DEBIAN / "usr" / "bin" / "blender").exists():
            raise NotReadyError("no Blender was found: run make test-blender as root, which installs one.")
        command = [str(ROOT / "tests" / "blender" / "root" / "enter.sh"), str(DEBIAN), str(ROOT), "blender"]
    zips = sorted(folder.glob(f"smokelift*-{VERSION}-*.zip"))
    for path in zips:
        said = _run([*command, "--command", "extension", "validate", str(path)], ROOT, dict(os.environ))
        if re.search("error", said, re.IGNORECASE):
            raise NotReadyError(f"Blender refuses {path.name}: {said.strip()[-500:]}")
    return f"Blender's own validation of {len(zips)} zips"


def sdist_builds_alone() -> str:
    """The sdist becomes a wheel in an empty environment that knows neither this checkout nor this shell's variables."""
    python = next((found for found in map(find_python, PYTHONS) if found), None)
    if python is None:
        raise NotReadyError(f"no Python {' or '.join(PYTHONS)} with its headers was found.")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        bare = {"PATH": "/usr/bin:/bin", "HOME": name, "LANG": "C.UTF-8"}

        def run(*words: str) -> str:
            return _run(words, folder, bare)

        run(python, "-m", "venv", "build")
        run("build/bin/pip", "install", "--quiet", "build")
        run("build/bin/python", "-m", "build", "--sdist", "--outdir", "sdist", str(ROOT))
        (sdist,) = (folder / "sdist").glob("*.tar.gz")
        with tarfile.open(sdist) as archive:
            listed = [Path(*Path(member).parts[1:]).as_posix() for member in archive.getnames()]
        foreign = [path for path in listed if path.startswith(("benchmarks/", "docs/", "examples/", "build/", "dist/"))]
        if foreign:
            raise NotReadyError(f"the sdist holds {foreign[0]} and {len(foreign) - 1} more that do not belong there.")
        run("build/bin/pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", "wheel", str(sdist))
        (wheel,) = (folder / "wheel").glob("*.whl")
        with zipfile.ZipFile(wheel) as archive_of_wheel:
            tops = {name.partition("/")[0] for name in archive_of_wheel.namelist()}
        allowed = {"smokelift", "smokelift_command", f"smokelift-{VERSION}.dist-info"}
        if tops - allowed:
            raise NotReadyError(f"the wheel holds {', '.join(sorted(tops - allowed))} besides the engine.")
        run(python, "-m", "venv", "use")
        run("use/bin/pip", "install", "--quiet", str(wheel))
        said = run("use/bin/smokelift", "doctor")
        DIST.mkdir(exist_ok=True)
        (DIST / sdist.name).write_bytes(sdist.read_bytes())
    return f"{sdist.name} builds and runs by itself: {said.splitlines()[0]}"


def checksums(folder: Path = DIST) -> str:
    """SHA256SUMS names every file of the release."""
    files = sorted(path for path in folder.iterdir() if path.suffix in (".zip", ".gz", ".whl") and VERSION in path.name)
    lines = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files]
    (folder / "SHA256SUMS").write_text("".join(lines), encoding="ascii")
    return f"SHA256SUMS of {len(lines)} files"


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def _run(command: Sequence[str], folder: Path, environment: dict[str, str]) -> str:
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        raise NotReadyError(f"{' '.join(command)} fails: {(done.stdout + done.stderr).strip()[-2000:]}")
    return done.stdout


if __name__ == "__main__":
    sys.exit(main())
