"""Every finding has its words, and all words have their finding."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import smokelift
from smokelift.checks import Finding
from smokelift.report import sentences
from smokelift.report.sentences import SENTENCES, SHORT, VALUES, choices, fact, message, sentence

ENGINE = Path(smokelift.__file__).parent
MAKERS = ("Finding", "background", "camera", "doubt", "source")
"""The class, and what holds some of its arguments, where findings are made."""

WORDS = {**SENTENCES, **VALUES, **SHORT}


@cache
def modules() -> list[ast.Module]:
    """Every module of the engine but that of the sentences."""
    paths = (path for path in ENGINE.rglob("*.py") if path != Path(sentences.__file__))
    return [ast.parse(path.read_text(encoding="utf-8")) for path in paths]


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
    """Patterns of the kinds of all findings that are made in the code."""
    nodes = (node for module in modules() for node in ast.walk(module))
    calls = (node for node in nodes if isinstance(node, ast.Call) and node.args)
    made = (call for call in calls if getattr(call.func, "id", "") in MAKERS)
    return {pattern for call in made for pattern in texts(call.args[0])}


def test_every_finding_has_its_words_and_all_words_are_said() -> None:
    found = kinds()
    assert len(found) > 60
    assert [kind for kind in found if not any(re.fullmatch(kind, known) for known in WORDS)] == []
    written = {pattern for module in modules() for pattern in texts(module)} - {".+"}
    # longer ones are messages of errors
    filled_in = [re.compile(pattern) for pattern in written if ".+" in pattern and len(pattern) < 80]
    unsaid = [kind for kind in WORDS if re.escape(kind) not in written]
    assert [kind for kind in unsaid if not any(pattern.fullmatch(kind) for pattern in filled_in)] == []


def test_sentences_are_whole_and_know_no_scene_file() -> None:
    assert [words for words in SENTENCES.values() if not re.match(r"[A-Z{]", words) or not words.endswith(".")] == []
    assert [words for words in SENTENCES.values() if re.search(r"\[[a-z]|--[a-z]|scene file|[cC]olour", words)] == []


CHOSEN = Finding(
    "compared scattering",
    {"error": 0.02, "other": "single", "other_error": 0.01492, "tolerance": 0.02},
    about="scattering", value="absorption", source="measured",
)  # fmt: skip
GIVEN = Finding("given", about="resolution", value=(60, 60, 90), source="given")
PLACE = Finding(
    "axis depth by box", {"depth": -0.21234}, about="axis depth", value="undetermined", source="assumed", spread=0.123
)


@pytest.mark.parametrize(
    ("finding", "said"),
    [
        (Finding("black background", {"view": 2}), "View 2: Background not given: it is black."),
        (Finding("no smoke examined", {"frames": 1}), "No smoke found in 1 examined frame, so nothing"),
        (Finding("no smoke examined", {"frames": 4}), "No smoke found in 4 examined frames, so nothing"),
        (Finding("background of one color", {"color": (0.1, 0.25, 1.0)}), "of one color, 0.1, 0.25, 1 (linear)."),
        (GIVEN, "Resolution by hand: 60 x 60 x 90."),
        (
            CHOSEN,
            "Scattering: absorption only; pixels that the fit leaves out differ by 2.0% of the smoke's contrast, with "
            "single scattering with shadows by 1.5%.",
        ),
        (PLACE, "taken to be 0.21 m before the middle of the box, give or take 0.12 m."),
    ],
)
def test_a_sentence_fills_its_figures_in(finding, said) -> None:
    assert said in sentence(finding)


def test_a_line_of_a_table_has_a_short_value_for_a_sidebar() -> None:
    line = fact(PLACE)
    assert line == {
        "what": "axis depth", "value": "0.21 m before the middle of the box, give or take 0.12 m",
        "short": "0.21 m before the middle", "origin": "undetermined", "how": sentence(PLACE),
    }  # fmt: skip
    assert (fact(GIVEN)["value"], fact(GIVEN)["short"], fact(GIVEN)["how"]) == ("60 x 60 x 90", "60 x 60 x 90", "")
    color = Finding(
        "measured smoke color", {"degrees": 20.0}, about="smoke color", value=(1.0, 0.5, 0.25), source="measured"
    )
    assert fact(color)["short"] == "1.00, 0.50, 0.25"


def test_a_choice_has_the_figures_that_decided_it() -> None:
    chosen, given, place = choices([CHOSEN, Finding("open box"), GIVEN, PLACE])
    assert chosen == {
        "what": "scattering", "chosen": "absorption", "kind": "compared scattering", "reason": sentence(CHOSEN),
        "measured": {"error": 0.02, "other_error": 0.01492}, "tolerance": 0.02, "by_hand": False,
    }  # fmt: skip
    assert (given["chosen"], given["by_hand"], given["measured"]) == ([60, 60, 90], True, {})
    assert (place["chosen"], place["measured"]) == ("undetermined", {"depth": -0.2123, "spread": 0.123})


def test_an_event_has_what_programs_make_their_own_words_of() -> None:
    said = message(PLACE)
    assert (said["text"], said["kind"]) == (sentence(PLACE), "axis depth by box")
    assert said["figures"] == {"depth": -0.21234, "what": "Axis depth", "value": "undetermined", "spread": 0.123}
