"""The fuzzer of the readers, where Atheris is installed."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HERE = importlib.util.find_spec("atheris") is not None


def fuzz(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "benchmarks.stability.fuzz", str(folder), *words]
    return subprocess.run(command, cwd=ROOT, env=os.environ, capture_output=True, text=True, timeout=60, check=False)


@pytest.mark.skipif(HERE, reason="Atheris is installed")
def test_what_is_missing_is_said(tmp_path: Path) -> None:
    done = fuzz(tmp_path)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].endswith("Atheris is missing: pip install '.[fuzz]'")


@pytest.mark.skipif(not HERE, reason="needs Atheris")
def test_a_reader_is_fuzzed(tmp_path: Path) -> None:
    done = fuzz(tmp_path, "--seconds", "1", "--readers", "scene")
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.startswith("scene: ")
    assert (tmp_path / "scene" / "kept" / "sound").is_file()
