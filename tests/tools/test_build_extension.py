"""What goes into the extension's zip is pinned to the byte."""

from __future__ import annotations

import re

import pytest

from build_extension import PLATFORMS, PYTHONS, pins, requirements_of


@pytest.mark.parametrize("python", PYTHONS)
@pytest.mark.parametrize("platform", PLATFORMS, ids=lambda platform: platform.name)
def test_every_wheel_has_a_version_and_hashes(platform, python) -> None:
    lines = requirements_of(platform, python, pins())
    names = [line.partition("==")[0] for line in lines]
    assert len(set(names)) == len(names) == 13
    assert all(re.fullmatch(r"[\w-]+==[\w.]+( --hash=sha256:[0-9a-f]{64})+", line) for line in lines)
