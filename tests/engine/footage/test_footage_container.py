"""Files opened with FFmpeg."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from smokelift.footage import container
from smokelift.output.images import write_image


def test_memory_that_lacks_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "picture.png"
    write_image(path, np.zeros((2, 2, 3), np.float32))
    container.open_container(path).close()
    monkeypatch.setattr(container, "ENOUGH", 2**62)
    with pytest.raises(MemoryError):
        container.open_container(path)
