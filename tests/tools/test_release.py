"""The checklist of a release refuses what is not ready."""

import re
import zipfile

import pytest

import release
import smokelift
from engine_wheels import VERSION


def test_the_version_stands_in_one_place() -> None:
    assert smokelift.__version__ == VERSION
    for name in ("pyproject.toml", "blender_manifest.toml"):
        assert not re.search("^version =", (release.ROOT / name).read_text(encoding="utf-8"), re.MULTILINE)


def test_the_changelog_dates_the_version(tmp_path) -> None:
    path = tmp_path / "CHANGELOG.md"
    path.write_text(f"# Changelog\n\n## {VERSION} (2026-11-22)\n")
    assert VERSION in release.changelog_has_the_version(path)
    for heading in ("Unreleased", f"{VERSION} (unreleased)", "0.1.0 (2026-11-22)"):
        path.write_text(f"# Changelog\n\n## {heading}\n\n## {VERSION} (2026-11-22)\n")
        with pytest.raises(release.NotReadyError, match=re.escape(heading)):
            release.changelog_has_the_version(path)


def zipped(folder, names=("manual/index.html",), content=b"x") -> None:
    with zipfile.ZipFile(
        folder / f"smokelift-{VERSION}-blender5.1-linux_x64.zip", "w", zipfile.ZIP_DEFLATED
    ) as archive:
        for name in names:
            archive.writestr(name, content)


def test_zips_have_to_be_there_whole_and_small(tmp_path) -> None:
    with pytest.raises(release.NotReadyError, match="make extension"):
        release.zips_are_small_and_whole(tmp_path)
    zipped(tmp_path, names=("__init__.py",))
    with pytest.raises(release.NotReadyError, match="manual"):
        release.zips_are_small_and_whole(tmp_path)
    zipped(tmp_path)
    assert release.zips_are_small_and_whole(tmp_path).startswith("1 zips")
    with pytest.raises(release.NotReadyError, match="MB"):
        release.zips_are_small_and_whole(tmp_path, largest_installed=0)


def test_a_zip_carries_the_license_of_all_that_is_in_it(tmp_path) -> None:
    inside = "python3.13/mdurl-0.1.2.dist-info"
    own, about = ("LICENSE", f"{inside}/METADATA"), f"{inside}/licenses/COPYING"
    zipped(tmp_path, own[1:])
    with pytest.raises(release.NotReadyError, match="LICENSE"):
        release.licenses_are_carried(tmp_path)
    zipped(tmp_path, own)
    with pytest.raises(release.NotReadyError, match="mdurl"):
        release.licenses_are_carried(tmp_path)
    zipped(tmp_path, (*own, about))
    assert release.licenses_are_carried(tmp_path) == "licenses of 1 packages: mdurl"


def test_checksums_name_what_is_released(tmp_path) -> None:
    zipped(tmp_path)
    (tmp_path / "smokelift-0.0.1.tar.gz").touch()
    release.checksums(tmp_path)
    (line,) = (tmp_path / "SHA256SUMS").read_text().splitlines()
    assert line.endswith(f"  smokelift-{VERSION}-blender5.1-linux_x64.zip") and len(line.split()[0]) == 64
