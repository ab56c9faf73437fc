"""What the tests of the output share."""

import pytest

from smokelift.output import vdb, writer


@pytest.fixture
def no_vdb(monkeypatch) -> None:
    """No OpenVDB module can be found."""

    def missing() -> None:
        raise vdb.VdbUnavailable("no OpenVDB module was found")

    monkeypatch.setattr(writer, "vdb_module", missing)
