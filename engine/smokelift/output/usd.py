"""A USD file, as text, of a sequence of OpenVDB files beside it: every renderer and program that knows USD opens it.

Source: the schemas UsdVol Volume and OpenVDBAsset, the purposes ``render`` and ``proxy`` of UsdGeom Imageable, and for
the material, which USD has no shader of its own for, the nodes of MaterialX 1.39 (`pbrlib`).
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

from smokelift.output.files import frame_path, proxy_path
from smokelift.output.vdb import Host
from smokelift.scene import Domain, Medium

MATERIAL = "/Smoke/Material"


def usd_text(
    numbers: Sequence[int], grids: Sequence[str], domain: Domain, medium: Medium, fps: float, host: Host, *, proxy: bool
) -> str:
    """Return the text of a ``.usda`` file of the frames of an export, whose files have these numbers and lie beside it.

    The grids in them are ``"density"``, and that of the velocity and ``"flame"`` if there are such. The box is in
    the host's axes, and the medium is that of smoke of density 1. With a ``proxy`` there is a coarse copy of each
    frame, which viewports show.
    """
    properties = "".join(
        f"            double {name} = {value:.9g}\n" for name, value in light_properties(medium).items()
    )
    files = {number: frame_path(Path(), number, "vdb").name for number in numbers}
    prims = [_prim("Volume", "render" if proxy else "default", files, grids, domain, host.velocity)]
    if proxy:
        files = {number: proxy_path(Path(), number).name for number in numbers}
        prims.append(_prim("Proxy", "proxy", files, ("density",), domain, host.velocity))
    volumes = "\n".join(prims)
    return f"""#usda 1.0
(
    defaultPrim = "Smoke"
    metersPerUnit = 1
    upAxis = "{host.up_axis}"
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
{volumes}
{_material(medium)}}}
"""


def light_properties(medium: Medium) -> dict[str, float]:
    """Return what smoke of density 1 does to light, by the name of the property."""
    return {"extinction": medium.extinction, "albedo": medium.albedo, "anisotropy": medium.anisotropy}


def _prim(
    name: str, purpose: str, files: Mapping[int, str], grids: Sequence[str], domain: Domain, velocity: str
) -> str:
    """A volume with a purpose: ``"render"``, ``"proxy"``, or ``"default"`` for both; ``files`` are by frame number."""
    path = f"/Smoke/{name}"
    low, high = _numbers(domain.min), _numbers(domain.max)
    fields = "".join(f"        rel field:{grid} = <{path}/{grid}>\n" for grid in grids)
    assets = "\n".join(_asset(grid, files, vector=grid == velocity) for grid in grids)
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


def _numbers(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.9g}" for value in values)
