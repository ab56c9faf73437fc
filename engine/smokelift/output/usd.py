"""A USD file, as text, of a sequence of OpenVDB files beside it: every renderer and program that knows USD opens it.

Source: the schemas UsdVol Volume and OpenVDBAsset, and the purposes ``render`` and ``proxy`` of UsdGeom Imageable.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from smokelift.scene import Domain


@dataclass(frozen=True)
class UsdVolume:
    """A volume of the file.

    Attributes
    ----------
    name
        Of its prim.
    purpose
        ``"render"``, ``"proxy"``, or ``"default"`` for both.
    files
        Name of the OpenVDB file of every frame, by its number.
    grids
        Names of the grids in the files: ``"density"``, and ``"velocity"`` and ``"flame"`` if there are such.
    domain
        The box of the smoke.
    """

    name: str
    purpose: str
    files: Mapping[int, str]
    grids: Sequence[str]
    domain: Domain


def usd_text(volumes: Sequence[UsdVolume], fps: float, medium: Mapping[str, float]) -> str:
    """Return the text of a ``.usda`` file.

    Parameters
    ----------
    volumes
        With the same frames each, at least one.
    fps
        Frames a second.
    medium
        Optical properties of smoke of density 1, kept as custom data: USD has no shader of its own for volumes.
    """
    numbers = sorted(volumes[0].files)
    properties = "".join(f"            double {name} = {value:.9g}\n" for name, value in medium.items())
    prims = "\n".join(_prim(volume) for volume in volumes)
    return f"""#usda 1.0
(
    defaultPrim = "Smoke"
    metersPerUnit = 1
    upAxis = "Z"
    startTimeCode = {numbers[0]}
    endTimeCode = {numbers[-1]}
    timeCodesPerSecond = {fps:.9g}
    framesPerSecond = {fps:.9g}
)

def Xform "Smoke" (
    kind = "component"
    customData = {{
        dictionary smokelift = {{
{properties}        }}
    }}
)
{{
{prims}}}
"""


def _prim(volume: UsdVolume) -> str:
    path = f"/Smoke/{volume.name}"
    low, high = (", ".join(f"{value:.9g}" for value in corner) for corner in (volume.domain.min, volume.domain.max))
    fields = "".join(f"        rel field:{grid} = <{path}/{grid}>\n" for grid in volume.grids)
    assets = "\n".join(_asset(grid, volume.files) for grid in volume.grids)
    return f"""    def Volume "{volume.name}"
    {{
        uniform token purpose = "{volume.purpose}"
        float3[] extent = [({low}), ({high})]
{fields}
{assets}    }}
"""


def _asset(grid: str, files: Mapping[int, str]) -> str:
    vector = grid == "velocity"
    kind, role = ("half3", '            token vectorDataRoleHint = "Vector"\n') if vector else ("half", "")
    samples = "".join(f"                {number}: @./{files[number]}@,\n" for number in sorted(files))
    return f"""        def OpenVDBAsset "{grid}"
        {{
            token fieldClass = "{"unknown" if vector else "fogVolume"}"
            token fieldDataType = "{kind}"
            token fieldName = "{grid}"
{role}            asset filePath.timeSamples = {{
{samples}            }}
        }}
"""
