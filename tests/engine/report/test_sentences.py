"""Every remark and every estimate has a sentence, and every sentence a remark."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import smokelift
from smokelift.checks import Doubt, Remark
from smokelift.report import sentences
from smokelift.report.sentences import SENTENCES, sentence
from smokelift.setup.estimate import Estimate

ENGINE = Path(smokelift.__file__).parent
SOURCES = [path for path in ENGINE.rglob("*.py") if path != Path(sentences.__file__)]
TREES = [ast.parse(path.read_text(encoding="utf-8")) for path in SOURCES]
MAKERS = ("Remark", "Doubt", "Estimate", "measured", "undetermined")


def texts(node: ast.AST) -> Iterator[str]:
    """Patterns of the strings below a node; what is filled in may be anything."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield re.escape(node.value)
    elif isinstance(node, ast.JoinedStr):
        yield "".join(re.escape(part.value) if isinstance(part, ast.Constant) else ".+" for part in node.values)
    else:
        for child in ast.iter_child_nodes(node):
            yield from texts(child)


def kinds() -> set[str]:
    """Patterns of the kinds of all remarks that are made in the code."""
    calls = [node for tree in TREES for node in ast.walk(tree) if isinstance(node, ast.Call) and node.args]
    made = [call for call in calls if getattr(call.func, "id", "") in MAKERS]
    return {pattern for call in made for pattern in texts(call.args[0])}


def test_every_remark_has_its_sentence() -> None:
    found = kinds()
    assert len(found) > 60
    assert [kind for kind in found if not any(re.fullmatch(kind, known) for known in SENTENCES)] == []


def test_every_sentence_is_said() -> None:
    written = re.compile("|".join({pattern for tree in TREES for pattern in texts(tree) if pattern != ".+"}))
    assert [kind for kind in SENTENCES if not written.fullmatch(kind)] == []


def test_sentences_are_whole_and_know_no_scene_file() -> None:
    assert [words for words in SENTENCES.values() if not re.match(r"[A-Z{]", words) or not words.endswith(".")] == []
    assert [words for words in SENTENCES.values() if re.search(r"\[[a-z]|--[a-z]|scene file|[cC]olour", words)] == []


def estimate(kind: str, value: str | int | tuple[int, int, int], **figures: float | str) -> Estimate:
    return Estimate(kind, figures, what="anything", value=value, source="measured", spread=0.123, tolerance=0.02)


@pytest.mark.parametrize(
    ("remark", "said"),
    [
        (Remark("black background", {"view": 2}), "View 2: Background not given: it is black."),
        (Doubt("no smoke examined", {"frames": 1}), "No smoke found in 1 examined frame, so nothing"),
        (Doubt("no smoke examined", {"frames": 4}), "No smoke found in 4 examined frames, so nothing"),
        (Remark("background of one colour", {"color": (0.1, 0.25, 1.0)}), "it is of one color, 0.1, 0.25, 1 (linear)."),
        (Estimate("given", what="resolution", value=(60, 60, 90), source="given"), "Resolution by hand: 60 x 60 x 90."),
        (
            estimate("compared scattering", "absorption", error=0.02, other="single", other_error=0.0149),
            "Scattering: absorption only; pixels that the fit leaves out differ by 2.0% of the smoke's contrast, with "
            "single scattering with shadows by 1.5%.",
        ),
    ],
)
def test_a_sentence_fills_its_figures_in(remark: Remark, said: str) -> None:
    assert said in sentence(remark)
