"""``smokelift bench``: where the benchmarks are found, and what is said where they are not."""

from __future__ import annotations

import sys

import pytest

from smokelift.app.cli import main


@pytest.mark.parametrize("words", [["--help"], ["renderer", "--help"], ["velocity", "-h"]])
def test_every_word_goes_to_the_benchmarks(words, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["bench", *words])
    assert ended.value.code == 0
    assert capsys.readouterr().out.startswith("usage: smokelift bench")


def test_without_the_source_one_sentence_says_where_they_are(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "benchmarks", None)
    assert main(["bench", "renderer", "--sizes", "8"]) == 2
    (sentence,) = capsys.readouterr().err.strip().splitlines()
    assert "python -m benchmarks" in sentence and "source" in sentence
