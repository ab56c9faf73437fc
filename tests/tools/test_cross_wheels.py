"""Wheels for other systems: what they may need, and that zips are made of them."""

import build_extension
from cross_wheels import SYSTEMS

WINDOWS, MACOS = SYSTEMS


def test_a_module_needs_nothing_but_its_system_and_python() -> None:
    own = ["python311.dll", "KERNEL32.dll", "api-ms-win-crt-heap-l1-1-0.dll"]
    foreign = ["libstdc++-6.dll", "libwinpthread-1.dll"]
    assert WINDOWS.missing([*own, *foreign]) == foreign
    assert MACOS.missing(["/usr/lib/libSystem.B.dylib", "/opt/lib/libomp.dylib"]) == ["/opt/lib/libomp.dylib"]


def test_zips_are_made_of_these_wheels(tmp_path) -> None:
    for system in SYSTEMS:
        tag = system.platform.replace("-", "_").replace(".", "_")
        (tmp_path / f"smokelift-1.0.0-cp313-cp313-{tag}.whl").touch()
    found = build_extension.find_engines([tmp_path], "1.0.0")
    assert set(found) == {("windows-x64", "3.13"), ("macos-arm64", "3.13")}
