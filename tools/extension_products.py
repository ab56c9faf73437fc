"""What zips of the extension there are: for Blender's platforms, and for the Pythons in it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from engine_wheels import ROOT

STAGE = ROOT / "build" / "extension"
"""Folders that are zipped."""

BLENDERS = {"3.11": ("4.2.0", "5.1.0"), "3.13": ("4.2.0", None)}
"""First Blender that a Python's zip installs in, and the first that it does not. Official ones have Python 3.13 from
5.1 on, Linux distributions' own earlier (Debian's 4.3): there the add-on says it if the zip is the wrong one."""

NAMED = {"3.11": "blender4.2-5.0", "3.13": "blender5.1"}
"""What a zip is called after the Blenders that it is for."""

BLENDER_NUMPY = {"3.11": "1.26.4", "3.13": "2.2.0"}
"""The numpy that Blender has beside each Python; what is bundled has to work with it."""


class BuildError(RuntimeError):
    """A zip that cannot be built, and why."""


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
        What markers of requirements ask about it.
    """

    name: str
    tags: tuple[str, ...]
    fits: str
    markers: Mapping[str, str]

    def environment(self, python: str) -> dict[str, str]:
        """Return what the markers of requirements (PEP 508) are compared with, for a version of Python."""
        return {**self.markers, "python_version": python, "python_full_version": f"{python}.0", "extra": ""}


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
    folder
        Where it is put together.
    """

    name: str
    version: str
    platform: Platform
    python: str
    folder: Path = STAGE

    @property
    def file(self) -> str:
        """Name of the zip."""
        return f"{self.name}-{self.version}-{NAMED[self.python]}-{self.platform.name.replace('-', '_')}.zip"

    @property
    def stage(self) -> Path:
        """Folder that is zipped."""
        return self.folder / self.file.removesuffix(".zip")

    @property
    def libraries(self) -> Path:
        """What the engine imports from; the add-on looks for a folder of this name (addon/core/job.py)."""
        return self.stage / f"python{self.python}"


def python_tag(python: str) -> str:
    """Return the tag of a version of Python in the names of wheels."""
    return "cp" + python.replace(".", "")
