"""A run that is killed goes on to the same result, bit for bit, wherever it was killed."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import QUICK

from smokelift.app.cli import main
from smokelift.output.sequence import Sequence

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs fork")


def killed(words: list[str], renames: int) -> int:
    """Run a command in a fork that is killed after it has renamed so many files; its status."""
    child = os.fork()
    if child == 0:
        rename, left = Path.replace, renames

        def counted(path: Path, target: Path) -> Path:
            nonlocal left
            if left == 0:
                os.kill(os.getpid(), signal.SIGKILL)
            left -= 1
            return rename(path, target)

        Path.replace = counted  # type: ignore[method-assign]
        os._exit(main(words))
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


@pytest.mark.parametrize(
    "renames", sorted(np.random.default_rng(17).choice(np.arange(1, 18), 5, replace=False).tolist())
)
def test_a_killed_run_goes_on_to_the_same_bits(shot, finished, tmp_path, renames) -> None:
    """Between any two of the files that it writes."""
    out = tmp_path / "out"
    words = ["reconstruct", str(shot), "--out", str(out), "--npz", *QUICK]
    assert killed(words, renames) == -signal.SIGKILL
    begun = Sequence.open(out)
    assert not begun.complete
    assert all(begun.density(number).shape == (24, 24, 32) for number in begun.frames)
    assert main([*words, "--resume"]) == 0
    whole, gone_on = Sequence.open(finished), Sequence.open(out)
    assert gone_on.complete
    assert gone_on.frames == whole.frames
    assert [path.name for path in sorted(out.iterdir())] == [path.name for path in sorted(finished.iterdir())]
    for path in sorted(finished.glob("*.npz")):
        with np.load(path) as wanted, np.load(out / path.name) as found:
            for name in wanted.files:
                np.testing.assert_array_equal(found[name], wanted[name], err_msg=f"{path.name} {name}")
