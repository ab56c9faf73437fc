"""A USD file, as text, of a sequence of OpenVDB files beside it: every renderer and program that knows USD opens it.

Source: the schemas UsdVol Volume and OpenVDBAsset, the purposes ``render`` and ``proxy`` of UsdGeom Imageable, and for
the material, which USD has no shader of its own for, the nodes of MaterialX 1.39 (`pbrlib`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from smokelift.scene import Domain, Medium

MATERIAL = "/Smoke/Material"


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
        Names of the grids in the files: ``"density"``, and that of the velocity and ``"flame"`` if there are such.
    domain
        The box of the smoke.
    """

    name: str
    purpose: str
    files: Mapping[int, str]
    grids: Sequence[str]
    domain: Domain


def usd_text(
    volumes: Sequence[UsdVolume], fps: float, medium: Medium, velocity: str = "velocity", up_axis: str = "Z"
) -> str:
    """Return the text of a ``.usda`` file of volumes with the same frames each.

    Smoke of density 1 is the medium, for the material and custom data; `velocity` names the grid that holds vectors,
    and `up_axis` is ``"Z"`` or ``"Y"``.
    """
    numbers = sorted(volumes[0].files)
    known = light_properties(medium).items()
    properties = "".join(f"            double {name} = {value:.9g}\n" for name, value in known)
    prims = "\n".join(_prim(volume, velocity) for volume in volumes)
    return f"""#usda 1.0
(
    defaultPrim = "Smoke"
    metersPerUnit = 1
    upAxis = "{up_axis}"
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
{prims}
{_material(medium)}}}
"""


def light_properties(medium: Medium) -> dict[str, float]:
    """Return what smoke of density 1 does to light, by the name of the property."""
    return {"extinction": medium.extinction, "albedo": medium.albedo, "anisotropy": medium.anisotropy}


def _prim(volume: UsdVolume, velocity: str) -> str:
    path = f"/Smoke/{volume.name}"
    low, high = (_numbers(corner) for corner in (volume.domain.min, volume.domain.max))
    fields = "".join(f"        rel field:{grid} = <{path}/{grid}>\n" for grid in volume.grids)
    assets = "\n".join(_asset(grid, volume.files, vector=grid == velocity) for grid in volume.grids)
    return f"""    def Volume "{volume.name}" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {{
        uniform token purpose = "{volume.purpose}"
        float3[] extent = [({low}), ({high})]
        rel material:binding = <{MATERIAL}>
{fields}
{assets}    }}
"""


def _asset(grid: str, files: Mapping[int, str], *, vector: bool) -> str:
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


def _numbers(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.9g}" for value in values)
