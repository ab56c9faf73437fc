"""The text of a USD file; that Blender reads it is asked in tests/addon/inside/export.py."""

from __future__ import annotations

from smokelift.output.usd import UsdVolume, usd_text
from smokelift.scene import Domain, Medium

DOMAIN = Domain((-1, -1, 0), (1, 1, 3), (8, 8, 12))


def test_every_frame_has_its_file() -> None:
    files = {3: "smoke_0003.vdb", 4: "smoke_0004.vdb"}
    volumes = [
        UsdVolume("Volume", "render", files, ("density", "velocity"), DOMAIN),
        UsdVolume("Proxy", "proxy", {n: f"proxy_{n:04d}.vdb" for n in files}, ("density",), DOMAIN),
    ]
    text = usd_text(volumes, 23.976, Medium(5.0, 0.8, 0.1, color=(1.0, 0.5, 0.25)))
    assert text.startswith("#usda 1.0\n")
    for line in (
        "startTimeCode = 3",
        "endTimeCode = 4",
        "timeCodesPerSecond = 23.976",
        "double extinction = 5",
        'uniform token purpose = "proxy"',
        "rel field:velocity = </Smoke/Volume/velocity>",
        "4: @./smoke_0004.vdb@,",
        "3: @./proxy_0003.vdb@,",
        "float3[] extent = [(-1, -1, 0), (1, 1, 3)]",
        "rel material:binding = </Smoke/Material>",
        "float3 inputs:in1 = (4, 2, 1)",
        "float3 inputs:in1 = (1, 3, 4)",
        "float inputs:anisotropy = 0.1",
    ):
        assert line in text
    assert text.count("field:velocity") == 1
    assert text.count("{") == text.count("}")
