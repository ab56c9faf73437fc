"""Clips of unusual kinds: a few of the files of the benchmark, read and compared with what was encoded."""

from pathlib import Path

import pytest

from benchmarks.file_kinds.judge import misread
from benchmarks.file_kinds.kinds import kinds
from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import ClipError

KINDS = {f"{group}: {name}": make for group, files in kinds(1).items() for name, make in files.items()}

SOUND = (
    "shape: odd sides, 4:2:0",
    "shape: turned by 90",
    "shape: pixels 16:15 (DV)",
    "shape: pixels 4:3, turned",
    "shape: interlaced H.264",
    "time: varying rate, Matroska",
    "time: first frame at 5 s",
    "time: B-frames, open groups",
    "colour: BT.2020, 8 bit",
    "colour: full range",
    "colour: BT.709, 12 bit",
    "colour: HLG BT.2020, 10 bit",
    "colour: PQ BT.2020, 12 bit",
    "colour: grey, 10 bit",
    "alpha: straight, ProRes 4444",
    "alpha: premultiplied, EXR pictures",
    "container and codec: MPEG-2",
    "name: `50% #1 smoke.mp4`",
    "pictures: PNG, 16 bit",
    "pictures: JPEG, turned by EXIF",
    "pictures: a hole and an empty file",
    "broken: three frames zeroed",
)

REFUSED = (
    "pictures: a stray picture far behind",
    "pictures: one picture of another size",
    "broken: sound only",
    "broken: MP4, cut at 300 bytes",
    "broken: six frames of eight zeroed",
    "broken: says it is 30000 x 30000",
)


@pytest.mark.parametrize("name", SOUND)
def test_a_clip_is_read_as_it_was_encoded(tmp_path: Path, name: str) -> None:
    assert misread(KINDS[name](tmp_path))[1] == ""


@pytest.mark.parametrize("name", REFUSED)
def test_a_clip_that_cannot_be_used_is_refused_in_a_sentence(tmp_path: Path, name: str) -> None:
    kind = KINDS[name](tmp_path)
    with pytest.raises(ClipError, match=r"^\S*: ") as refused, Clip.open(kind.path) as clip:
        for _ in clip:
            pass
    assert "\n" not in str(refused.value)


def test_there_are_as_many_kinds_as_the_page_says() -> None:
    assert len(KINDS) >= 100
