"""Runs commands in this process, and reads what they say."""

import json
import os
import sys
from pathlib import Path
from typing import Any

import pytest

import smokelift
from smokelift.app.cli import main

MODULE = [sys.executable, "-m", "smokelift"]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(smokelift.__file__).parents[1])}
QUICK = ("--quality", "draft", "--detail", "0")


def command(*words: object) -> int:
    """Run a command; also when its options are refused, which argparse does by leaving."""
    try:
        return main([str(word) for word in words])
    except SystemExit as leaving:
        assert isinstance(leaving.code, int)
        return leaving.code


def refused(capsys: pytest.CaptureFixture[str], *words: object, status: int = 2) -> str:
    """The one sentence that a command ends with."""
    capsys.readouterr()
    assert command(*words) == status
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err
    lines = captured.err.strip().splitlines()
    assert len(lines) == 1, lines
    return lines[0]


def events(text: str) -> list[dict[str, Any]]:
    """Every line as JSON, strictly."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    return [json.loads(line, parse_constant=refuse) for line in text.splitlines()]


def events_of(capsys: pytest.CaptureFixture[str], *words: object) -> list[dict[str, Any]]:
    """The events of a command that comes to its end."""
    capsys.readouterr()
    assert command(*words, "--progress", "json") == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    return events(captured.out)


def names(directory: Path) -> list[str]:
    return sorted(path.name for path in directory.iterdir())
