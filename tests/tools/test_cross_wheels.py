"""Wheels for other systems: what they may need, and that zips are made of them."""

from cross_wheels import SYSTEMS

WINDOWS, MACOS = SYSTEMS


def test_a_module_needs_nothing_but_its_system_and_python() -> None:
    own = ["python311.dll", "KERNEL32.dll", "api-ms-win-crt-heap-l1-1-0.dll"]
    foreign = ["libstdc++-6.dll", "libwinpthread-1.dll"]
    assert WINDOWS.missing([*own, *foreign]) == foreign
    assert MACOS.missing(["/usr/lib/libSystem.B.dylib", "/opt/lib/libomp.dylib"]) == ["/opt/lib/libomp.dylib"]
