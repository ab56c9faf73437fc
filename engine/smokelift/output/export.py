"""Writes what others need of a sequence: OpenVDB files as small as the picture allows, a USD file, and proxies.

What is left out or rounded does not show in a picture of 8 bits:

- Smoke that is so thin that a box full of it hides less than `MIN_OPACITY` of what is behind is left out.
- Quantized densities are multiples of a power of two; rounding errors along a ray are independent, so over n voxels of
  h meters they change the optical depth by extinction * h * sqrt(n / 12) steps (root mean square), which is kept below
  `HALF_CODE`. Powers of two leave the last bits of a 16 bit float zero, which compresses well.
- Quantized velocities move smoke by at most half of `VELOCITY_STEP` voxels per frame.

Names, axes and the range of values are those of the program that reads the files (`smokelift.output.vdb.Host`). Every
renderer and program that knows USD opens the USD file. Source: the schemas UsdVol Volume and OpenVDBAsset, the purposes
``render`` and ``proxy`` of UsdGeom Imageable, and for the material, which USD has no shader of its own for, the nodes
of MaterialX 1.39 (`pbrlib`).
"""

import json
import math
import re
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from smokelift.checks.whole_files import write_text
from smokelift.output.archive import FLAME
from smokelift.output.index import INDEX, SequenceError, frame_path, proxy_path
from smokelift.output.sequence import Sequence
from smokelift.output.vdb import HOSTS, Host, HostName, vdb_module, write_proxy, write_vdb
from smokelift.scene import Domain, Medium
from smokelift.transport import Array

NOTE = "export.json"
"""Says what an export is and how it was made; a folder without it is not overwritten."""

USD = "smoke.usda"

ASSET = "smoke.blend"
"""What the Blender extension adds; it stays when an export is replaced."""

MIN_OPACITY = 1e-3
"""Fraction of the light that smoke may hide and yet be left out."""

HALF_CODE = 1 / 510
"""Half a step of a picture of 8 bits (by definition)."""

VELOCITY_STEP = 1 / 16
"""Step of a quantized velocity in voxels per frame."""

UNITS = {"length_unit": "m", "velocity_unit": "m/s", "extinction_unit": "1/m"}
"""Metadata of every grid."""

SAMPLED_FRAMES = 5
"""Frames that are written to estimate the size of all."""

Precision = Literal["half", "quantized"]

_OWN = re.compile(r"(smoke|proxy)_\d{4,}\.vdb")

MATERIAL = "/Smoke/Material"


@dataclass(frozen=True)
class ExportSettings:
    """What is exported; ValueError if the proxy is not 1 to 16."""

    precision: Precision = "half"
    """``"half"`` for floats of 16 bits; ``"quantized"`` for as few bits as a picture of 8 bits needs."""
    velocity: bool = True
    """Whether to export the velocity, which motion blur needs."""
    proxy: int = 1
    """How many times coarser a second sequence for viewports is, of the density alone; 1 for none."""
    host: HostName = "blender"
    """The program that reads the files: ``"blender"``, ``"houdini"`` or ``"unreal"``."""

    def __post_init__(self) -> None:
        if not 1 <= self.proxy <= 16:
            raise ValueError(f"the proxy must be 1 (none) to 16 times coarser, not {self.proxy}.")


def export_sequence(sequence: Sequence, out: str | Path, settings: ExportSettings) -> Iterator[tuple[int, int]]:
    """Export a sequence to a folder: `smoke_0001.vdb`, ..., `smoke.usda`, `export.json`, and `proxy_0001.vdb`, ...

    Files have the numbers of the sequence's own, and so do the times of the USD file. There is none for a program
    whose axes are left-handed. An earlier export in the folder is replaced. The sequence stays as it is. The number
    of every frame is yielded once it is written, with the bytes of its files.

    It raises SequenceError if there are no frames, the folder holds other files, or a file cannot be read or
    written, and VdbUnavailable.
    """
    out = Path(out)
    require_export(sequence, out)
    try:
        out.mkdir(parents=True, exist_ok=True)
        for path in out.iterdir():  # of an earlier export
            if _OWN.fullmatch(path.name) or path.name == USD:
                path.unlink()
        export = _Export(sequence, settings, _peak(sequence, sequence.frames, settings))
        note = {**export.note(), "complete": False}
        write_text(out / NOTE, json.dumps(note, indent=1) + "\n")  # first: it says whose files these are
        for number in sequence.frames:
            yield number, export.write_frame(number, out)
        if not export.host.left_handed:  # USD has no such axes
            write_text(out / USD, export.usd())
        write_text(out / NOTE, json.dumps({**note, "complete": True}, indent=1) + "\n")
    except OSError as error:
        raise SequenceError(f"{out}: cannot be written: {error}") from error


def require_export(sequence: Sequence, out: Path) -> None:
    """Check, before anything is spent or written, that a sequence can be exported to a folder.

    It raises what `export_sequence` would.
    """
    vdb_module()
    if not sequence.frames:
        raise SequenceError(f"{sequence.directory}: has no finished frame to export yet.")
    if out.exists() and not out.is_dir():
        raise SequenceError(f"{out}: is a file; choose a folder for the export.")
    names = [file.name for file in out.iterdir() if not file.name.startswith(".")] if out.is_dir() else []
    foreign = [name for name in names if not (name in (NOTE, USD, ASSET) or _OWN.fullmatch(name))]
    if foreign or (names and NOTE not in names):
        other = INDEX if INDEX in names else sorted(foreign or names)[0]
        raise SequenceError(f"{out}: holds other files ({other}); nothing was overwritten, choose an empty folder.")


def export_size(sequence: Sequence, settings: ExportSettings) -> int:
    """Estimate the bytes of an export, from frames that are evenly spaced over the sequence."""
    places = np.unique(np.linspace(0, len(sequence.frames) - 1, SAMPLED_FRAMES).round().astype(int))
    numbers = [sequence.frames[place] for place in places]
    export = _Export(sequence, settings, _peak(sequence, numbers, settings))
    with tempfile.TemporaryDirectory() as folder:
        sizes = [export.write_frame(number, Path(folder)) for number in numbers]
    return round(float(np.interp(np.arange(len(sequence.frames)), places, sizes).sum()))


def require_space(out: Path, size: int) -> None:
    """Check that so many bytes are free where a folder will be; SequenceError if not."""
    there = next(folder for folder in (out, *out.absolute().parents) if folder.exists())
    free = shutil.disk_usage(there).free
    if free < size:
        raise SequenceError(
            f"{out}: the export takes {size / 1e6:.0f} MB, but only {free / 1e6:.0f} MB are free; choose another disk."
        )


def _peak(sequence: Sequence, numbers: Iterable[int], settings: ExportSettings) -> float:
    """What densities are divided by: the largest of these frames for a program that keeps 8 bits of them, else 1."""
    if not HOSTS[settings.host].eight_bits:
        return 1.0
    return max(float(sequence.density(number).max()) for number in numbers) or 1.0


@dataclass(frozen=True)
class _Export:
    """A sequence as a program reads it, with densities divided by a peak."""

    sequence: Sequence
    settings: ExportSettings
    peak: float

    @property
    def host(self) -> Host:
        """What the program expects."""
        return HOSTS[self.settings.host]

    @property
    def domain(self) -> Domain:
        """The box in the program's axes."""
        return self.host.box(self.sequence.scene.domain)

    @property
    def medium(self) -> Medium:
        """Optical properties of smoke of density 1, as the files have it."""
        medium = self.sequence.scene.medium
        return replace(medium, extinction=medium.extinction * self.peak)

    @property
    def optics(self) -> dict[str, float]:
        """What that smoke does to light, by the name of the property."""
        return {name: getattr(self.medium, name) for name in ("extinction", "albedo", "anisotropy")}

    @property
    def grids(self) -> tuple[str, ...]:
        """Names of the grids in the files of all frames."""
        burns = self.sequence.scene.medium.flame_color is not None
        return ("density", *[self.host.velocity] * self.settings.velocity, *[FLAME] * burns)

    def write_frame(self, number: int, out: Path) -> int:
        """Write the files of a frame; returns their bytes."""
        sequence, host = self.sequence, self.host
        domain, extinction = sequence.scene.domain, sequence.scene.medium.extinction
        density, longest = sequence.density(number), max(domain.resolution) * domain.voxel_size
        thinned = np.where(density < MIN_OPACITY / (extinction * longest), np.float32(0), density)
        rho, velocity, flame = thinned, None, None
        if self.settings.velocity:
            velocity = sequence.velocity_at_centres(number)
        if FLAME in self.grids:
            found = sequence.flame(number)
            flame = np.zeros_like(rho) if found is None else found
        if self.settings.precision == "quantized":
            rho = _rounded(rho, _density_step(domain, extinction))
            step = _power_of_two(VELOCITY_STEP * domain.voxel_size * sequence.fps)
            velocity = None if velocity is None else _rounded(velocity, step)
            # radiance adds up along a ray as optical depth does
            flame = None if flame is None else _rounded(flame, _density_step(domain, 1.0))
        if host.eight_bits:
            rho = _rounded(thinned / np.float32(self.peak), 1 / 255)
        paths = [frame_path(out, sequence.file_number(number), "vdb")]
        write_vdb(
            paths[0],
            host.turned(rho),
            None if velocity is None else host.turned(velocity),
            self.domain,
            sequence.settings,
            None if flame is None else host.turned(flame),
            metadata={"fps": sequence.fps, **UNITS, **self.optics},
            host=host,
        )
        if self.settings.proxy > 1:
            paths.append(proxy_path(out, sequence.file_number(number)))
            write_proxy(paths[1], host.turned(thinned / np.float32(self.peak)), self.domain, self.settings.proxy)
        return sum(path.stat().st_size for path in paths)

    def usd(self) -> str:
        """The text of the USD file, whose frames have the numbers of the files that lie beside it."""
        sequence, host = self.sequence, self.host
        numbers = [sequence.file_number(number) for number in sequence.frames]
        properties = "".join(f"            double {name} = {value:.9g}\n" for name, value in self.optics.items())
        proxy = self.settings.proxy > 1
        files = {number: frame_path(Path(), number, "vdb").name for number in numbers}
        volumes = self._prim("Volume", "render" if proxy else "default", files, self.grids)
        if proxy:
            files = {number: proxy_path(Path(), number).name for number in numbers}
            volumes += "\n" + self._prim("Proxy", "proxy", files, ("density",))
        return f"""#usda 1.0
(
    defaultPrim = "Smoke"
    metersPerUnit = 1
    upAxis = "{host.up_axis}"
    startTimeCode = {numbers[0]}
    endTimeCode = {numbers[-1]}
    timeCodesPerSecond = {sequence.fps:.9g}
    framesPerSecond = {sequence.fps:.9g}
)

def Xform "Smoke" (
    kind = "component"
    customData = {{
        dictionary smokelift = {{
{properties}        }}
    }}
)
{{
{volumes}
{_material(self.medium)}}}
"""

    def _prim(self, name: str, purpose: str, files: Mapping[int, str], grids: tuple[str, ...]) -> str:
        """A volume with a purpose: ``"render"``, ``"proxy"``, or ``"default"`` for both; ``files`` are by number."""
        low, high = _numbers(self.domain.min), _numbers(self.domain.max)
        fields = "".join(f"        rel field:{grid} = </Smoke/{name}/{grid}>\n" for grid in grids)
        assets = "\n".join(_asset(grid, files, vector=grid == self.host.velocity) for grid in grids)
        return f"""    def Volume "{name}" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {{
        uniform token purpose = "{purpose}"
        float3[] extent = [({low}), ({high})]
        rel material:binding = <{MATERIAL}>
{fields}
{assets}    }}
"""

    def note(self) -> dict[str, Any]:
        """What the export is and how it was made."""
        sequence, domain = self.sequence, self.domain
        return {
            "host": self.settings.host,
            "precision": self.settings.precision,
            "grids": list(self.grids),
            "proxy": self.settings.proxy,
            "frames": [sequence.file_number(sequence.frames[0]), sequence.file_number(sequence.frames[-1])],
            "fps": sequence.fps,
            "medium": {key: value for key, value in vars(self.medium).items() if value is not None},
            "domain": {"min": list(domain.min), "max": list(domain.max), "resolution": list(domain.resolution)},
            "provenance": [dict(part) for part in sequence.provenance],
        }


def write_proxies(sequence: Sequence) -> Iterator[int]:
    """Write the coarse copies of all frames of a sequence into its directory, and yield their numbers.

    It raises SequenceError if there are no frames, or a file cannot be read or written, and VdbUnavailable.
    """
    vdb_module()
    if not sequence.frames:
        raise SequenceError(f"{sequence.directory}: has no finished frame to make a proxy of yet.")
    for number in sequence.frames:
        path = proxy_path(sequence.directory, sequence.file_number(number))
        try:
            write_proxy(path, sequence.density(number), sequence.scene.domain, flame=sequence.flame(number))
        except OSError as error:
            raise SequenceError(f"{path}: cannot be written: {error}") from error
        yield number


def _density_step(domain: Domain, extinction: float) -> float:
    """Step of a quantized density: the largest power of two whose rounding does not show (see the module)."""
    longest = max(domain.resolution)
    return _power_of_two(HALF_CODE / (extinction * domain.voxel_size * math.sqrt(longest / 12)))


def _rounded(values: Array, step: float) -> Array:
    return np.asarray(np.round(values / np.float32(step)) * np.float32(step))


def _power_of_two(value: float) -> float:
    return 2.0 ** math.floor(math.log2(value))


def _asset(grid: str, files: Mapping[int, str], *, vector: bool) -> str:
    kind, role = ("half3", '            token vectorDataRoleHint = "Vector"\n') if vector else ("half", "")
    samples = "".join(f"                {number}: @./{name}@,\n" for number, name in files.items())
    return f"""        def OpenVDBAsset "{grid}"
        {{
            token fieldClass = "{"unknown" if vector else "fogVolume"}"
            token fieldDataType = "{kind}"
            token fieldName = "{grid}"
{role}            asset filePath.timeSamples = {{
{samples}            }}
        }}
"""


def _material(medium: Medium) -> str:
    """The material: absorption and scattering, 1/m, are those of density 1 times the field ``density``."""
    scattering = [medium.extinction * albedo for albedo in medium.albedos]
    absorption = [medium.extinction - scattered for scattered in scattering]
    coefficients = "\n".join(
        f"""        def Shader "{name}"
        {{
            uniform token info:id = "ND_multiply_vector3FA"
            float3 inputs:in1 = ({_numbers(values)})
            float inputs:in2.connect = <{MATERIAL}/Density.outputs:out>
            float3 outputs:out
        }}
"""
        for name, values in (("Absorption", absorption), ("Scattering", scattering))
    )
    return f"""    def Material "Material"
    {{
        token outputs:mtlx:volume.connect = <{MATERIAL}/Volume.outputs:out>

        def Shader "Density"
        {{
            uniform token info:id = "ND_geompropvalue_float"
            string inputs:geomprop = "density"
            float outputs:out
        }}

{coefficients}
        def Shader "Phase"
        {{
            uniform token info:id = "ND_anisotropic_vdf"
            float3 inputs:absorption.connect = <{MATERIAL}/Absorption.outputs:out>
            float3 inputs:scattering.connect = <{MATERIAL}/Scattering.outputs:out>
            float inputs:anisotropy = {medium.anisotropy:.9g}
            token outputs:out
        }}

        def Shader "Volume"
        {{
            uniform token info:id = "ND_volume"
            token inputs:vdf.connect = <{MATERIAL}/Phase.outputs:out>
            token outputs:out
        }}
    }}
"""


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.9g}" for value in values)
