"""Image and gradient of one iteration: us, every peer, every size and scene, one after another.

The machine may be anything and noisy, so nothing stands alone: between any two peers we run again, and a peer's ratio
is its median over ours just before and just after; times are also given in copies of ten volumes of that size.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import machine
from benchmarks.errors import relative_error
from benchmarks.renderer import reference
from benchmarks.renderer.peers import OURS, PEERS
from benchmarks.renderer.scene import PLUME, bench_scene, plume
from benchmarks.renderer.worker import Result, run_apart
from smokelift.render.device import DeviceName

SCENES = {"plume": PLUME, "full": 1.0}
"""Names of the scenes, and their share of voxels with smoke."""

EXACT = 1e-3
"""Relative L2 error against float64 up to which image and gradient count as exact."""

SHARES = (0.05, 0.1, 0.18, 0.35, 0.6, 1.0)
LIGHTS = (1, 16)
SWEEP_SIZE = 128
"""The largest grid for the runs over shares and lights."""

LIBRARIES = ("numpy", "taichi", "drjit", "torch", "jax", "mitsuba")

Say = Callable[[str], None]
Array = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Row:
    """A peer at one size, in one scene. What is None was not measured.

    Attributes
    ----------
    peer
        Key in `PEERS`.
    size, scene, share, lights
        Voxels a side, name of the scene, share of its voxels with smoke, number of directional lights.
    milliseconds
        Of every iteration.
    median
        Of them.
    ratio
        Median over ours just before and after.
    floors
        Median over the time to copy ten volumes.
    compile_seconds, setup_seconds
        As in `Result`.
    peak_mib, peak_volumes
        Peak of memory (see `Result`), also in volumes of size^3 floats.
    image_error, gradient_error
        Relative L2 distance from the float64 reference, the gradient's where there is smoke.
    exact
        Whether both are at most `EXACT`.
    failure
        Why nothing was measured.
    """

    peer: str
    size: int
    scene: str
    share: float
    lights: int = 1
    milliseconds: tuple[float, ...] = ()
    median: float | None = None
    ratio: float | None = None
    floors: float | None = None
    compile_seconds: float | None = None
    setup_seconds: float | None = None
    peak_mib: float | None = None
    peak_volumes: float | None = None
    image_error: float | None = None
    gradient_error: float | None = None
    exact: bool = False
    failure: str = ""


def run(
    sizes: Sequence[int],
    peers: Collection[str],
    device: DeviceName,
    say: Say,
    save: Callable[[dict[str, Any]], None],
) -> dict[str, Any]:
    """Run the whole benchmark.

    Parameters
    ----------
    sizes
        Voxels a side.
    peers
        Keys of `PEERS`. We always run.
    device
        Where our own renderer runs; the peers run on the processor.
    say
        Is told what happens.
    save
        Gets the results so far after each scene, should the rest be cancelled.

    Returns
    -------
    dict
        ``date``, ``device``, ``machine``, ``versions``, ``floor_ms`` by size, ``rows``, ``shares`` and ``lights``, the
        last three lists of `Row`, of us alone in the last two. Ready for JSON.
    """
    results: dict[str, Any] = {
        **machine.provenance(LIBRARIES),
        "device": device,
        "floor_ms": {},
        "rows": [],
        "shares": [],
        "lights": [],
    }
    chosen = [key for key in PEERS if key in peers and key != OURS]
    for size in sizes:
        results["floor_ms"][str(size)] = floor = machine.copy_milliseconds(size)
        for scene, share in SCENES.items():
            with tempfile.TemporaryDirectory() as folder:
                stage = _Stage(Path(folder), size, scene, share, floor, device, say)
                results["rows"] += [asdict(row) for row in stage.compare(chosen)]
            save(results)
    size = min(max(sizes), SWEEP_SIZE)
    floor = machine.copy_milliseconds(size)
    for share in SHARES:
        with tempfile.TemporaryDirectory() as folder:
            stage = _Stage(Path(folder), size, "sweep", share, floor, device, say)
            results["shares"].append(asdict(stage.row(OURS)))
            if share == PLUME:
                results["lights"] = [asdict(stage.row(OURS, lights)) for lights in LIGHTS]
    save(results)
    return results


class _Stage:
    """One scene at one size, in a folder for the processes that run it, with the right answers."""

    def __init__(
        self, folder: Path, size: int, name: str, share: float, floor: float, device: DeviceName, say: Say
    ) -> None:
        self._folder, self._floor, self._device, self._say = folder, floor, device, say
        self._empty = Row("", size, name, share)
        density = plume(size, share)
        turned = bench_scene(np.ascontiguousarray(density[::-1, ::-1]), np.zeros((size, size, 3), np.float32))
        self._scene = bench_scene(density, reference.image(turned).astype(np.float32))
        self._answers: dict[bool, tuple[Array, Array]] = {}
        np.save(folder / "density.npy", density)
        np.save(folder / "target.npy", self._scene.target)

    def compare(self, peers: Sequence[str]) -> list[Row]:
        """Us, and every peer between two runs of us; our row has all our iterations."""
        ours = [self.row(OURS)]
        others = []
        for key in peers:
            row = self.row(key)
            if row.median is not None:
                ours.append(self.row(OURS))
                around = [*ours[-2].milliseconds, *ours[-1].milliseconds]
                row = replace(row, ratio=row.median / float(np.median(around)) if around else None)
            others.append(row)
        return [self._timed(ours[0], [time for row in ours for time in row.milliseconds]), *others]

    def row(self, peer: str, lights: int = 1) -> Row:
        """Run a peer in a process of its own and compare what it made, unless there are several lights."""
        row = replace(self._empty, peer=peer, lights=lights)
        missing = PEERS[peer].missing
        if missing:
            return replace(row, failure=f"not installed: pip install {' '.join(missing)}")
        result = run_apart(peer, self._folder, lights, self._device)
        if result.failure:
            row = replace(row, failure=result.failure)
        else:
            row = self._timed(_figures(row, result), [1e3 * seconds for seconds in result.seconds])
            if lights == 1:
                row = self._judged(row)
        outcome = row.failure or f"{row.median:.4g} ms"
        self._say(f"{row.size}^3, smoke in {100 * row.share:.0f} %, {PEERS[peer].title}: {outcome}")
        return row

    def _timed(self, row: Row, milliseconds: list[float]) -> Row:
        if not milliseconds:
            return row
        median = float(np.median(milliseconds))
        return replace(row, milliseconds=tuple(milliseconds), median=median, floors=median / self._floor)

    def _judged(self, row: Row) -> Row:
        image, gradient = self._answer(PEERS[row.peer].before_black)
        smoke = self._scene.density > 0
        of_image = relative_error(np.load(self._folder / "image.npy"), image)
        of_gradient = relative_error(np.load(self._folder / "gradient.npy")[smoke], gradient[smoke])
        exact = of_image <= EXACT and of_gradient <= EXACT
        return replace(row, image_error=of_image, gradient_error=of_gradient, exact=exact)

    def _answer(self, before_black: bool) -> tuple[Array, Array]:
        if before_black not in self._answers:
            scene = replace(self._scene, background=(0.0, 0.0, 0.0)) if before_black else self._scene
            self._answers[before_black] = reference.image_and_gradient(scene)
        return self._answers[before_black]


def _figures(row: Row, result: Result) -> Row:
    peak = result.peak_bytes
    return replace(
        row,
        compile_seconds=result.compile_seconds,
        setup_seconds=result.setup_seconds,
        peak_mib=None if peak is None else peak / 2**20,
        peak_volumes=None if peak is None else peak / (4 * row.size**3),
    )
