"""Fixtures of the renderer's tests."""

import numpy as np
import pytest

from smokelift.output.images import write_image
from smokelift.scene import EnvironmentLight


@pytest.fixture
def light_of(tmp_path):
    """Write a picture and make an environment light of it."""

    def write(radiance: np.ndarray, **options: float) -> EnvironmentLight:
        write_image(tmp_path / "environment.exr", radiance, half=False)
        return EnvironmentLight(tmp_path / "environment.exr", **options)

    return write
