"""The competitors, one module each, and Smokelift.

Every module has one function, ``prepare(scene, *arguments) -> Iteration``, and imports its framework at its top: only
the process that runs it needs it. All but Mitsuba and the paper compute the same discrete sums (see
`benchmarks.renderer.reference`), each in the way that is fastest in its framework. What all of them may know beforehand
(rays, columns, the phase function) is tabulated before the clock starts.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.process import finds_llvm


@dataclass(frozen=True)
class Iteration:
    """One step of an optimization, ready to run.

    Attributes
    ----------
    upload
        Converts a density (n, n, n) float32 to what ``run`` takes. Not timed: an optimization keeps it where it is.
    run
        Returns the image and the derivative of the loss, both complete. This is timed.
    download
        Converts the two to arrays (rows, columns, 3) and (n, n, n). Not timed.
    """

    upload: Callable[[NDArray[np.float32]], Any]
    run: Callable[[Any], tuple[Any, Any]]
    download: Callable[[Any, Any], tuple[NDArray[np.float32], NDArray[np.float32]]]


@dataclass(frozen=True)
class Peer:
    """A way to do the work.

    Attributes
    ----------
    title
        Its name in the table.
    module
        Its module in this package.
    packages
        What pip has to install for it, by the names of import.
    arguments
        Arguments of its ``prepare`` after the scene.
    before_black
        Whether it renders, and is compared, without a background.
    """

    title: str
    module: str
    packages: tuple[str, ...] = ()
    arguments: tuple[Any, ...] = ()
    before_black: bool = False

    @property
    def needs(self) -> str:
        """What has to be installed before it can run, one sentence; else empty."""
        if missing := [name for name in self.packages if find_spec(name) is None]:
            return f"not installed: pip install {' '.join(missing)}"
        if self.packages and not finds_llvm():  # they all compile with Dr.Jit
            return "Dr.Jit finds no LLVM: install one (Debian: apt install llvm), or set DRJIT_LIBLLVM_PATH to libLLVM."
        return ""


OURS = "smokelift"

PEERS = {
    OURS: Peer("Smokelift", "ours"),
    "drjit": Peer("Dr.Jit, loops and adjoint by hand", "drjit_loops", ("drjit",)),
    "paper": Peer("The paper's algorithms 2 and 3", "paper"),
    "mitsuba-1": Peer("Mitsuba 3 prbvolpath, 1 sample", "mitsuba_prbvolpath", ("mitsuba",), (1,), True),
    "mitsuba-16": Peer("Mitsuba 3 prbvolpath, 16 samples", "mitsuba_prbvolpath", ("mitsuba",), (16,), True),
}
