"""Image and gradient of one iteration: Smokelift and every peer at every size and in every scene, one after another.

Machines differ and are shared, so times are compared in pairs: Smokelift runs again between any two peers, and a peer's
ratio is its median over Smokelift's just before and just after. Times are also given relative to a copy of ten volumes.
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
"""The scenes, and their share of voxels with smoke."""

EXACT = 1e-3
"""Largest relative L2 error against float64 of an image or gradient that counts as exact."""

SHARES = (0.05, 0.1, 0.18, 0.35, 0.6, 1.0)
"""Shares of voxels with smoke at which Smokelift alone is timed."""

LIGHTS = (1, 16)
"""Numbers of directional lights with which Smokelift alone is timed."""

SWEEP_SIZE = 128
"""Voxels a side of the largest grid for the runs over shares and lights."""

LIBRARIES = ("numpy", "taichi", "drjit", "mitsuba")

Say = Callable[[str], None]
Array = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Row:
    """A peer at one size, in one scene. None stands for what was not measured.

    Attributes
    ----------
    peer
        Key in `PEERS`.
    size, scene, share, lights
        Voxels a side, name of the scene, share of its voxels with smoke, number of directional lights.
    milliseconds
        Time of every iteration.
    median
        Median of these times (ms).
    ratio
        The median over Smokelift's just before and after.
    floors
        The median over the time to copy ten volumes.
    compile_seconds, setup_seconds
        As in `Result`.
    peak_mib, peak_volumes
        Peak of memory (see `Result`), in MiB and in volumes of size^3 floats.
    image_error, gradient_error
        Relative L2 error against the float64 reference; of the gradient, where there is smoke.
    exact
        Whether both errors are at most `EXACT`.
    failure
        Why nothing was measured, one sentence; else empty.
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
        Keys of `PEERS`. Smokelift always runs.
    device
        Where Smokelift runs; the peers run on the processor.
    say
        Takes a sentence about each run.
    save
        Gets the results so far after each scene, in case the rest is cancelled.

    Returns
    -------
    dict
        ``date``, ``device``, ``machine``, ``versions``, ``floor_ms`` by size, and ``rows``, ``shares`` and ``lights``,
        lists of `Row`; the last two are of Smokelift alone. Ready for JSON.
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
    """One scene at one size with its exact answers, in a folder for the processes that run it."""

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
        """Return Smokelift's row, with all its iterations, and that of every peer between two runs of Smokelift."""
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
        """Run a peer in a process of its own and score its image and gradient, unless there are several lights."""
        row = replace(self._empty, peer=peer, lights=lights)
        if needs := PEERS[peer].needs:
            return replace(row, failure=needs)
        result = run_apart(peer, self._folder, lights, self._device)
        if result.failure:
            row = replace(row, failure=result.failure)
        else:
            row = self._timed(_figures(row, result), [1e3 * seconds for seconds in result.seconds])
            if lights == 1:
                row = self._scored(row)
        outcome = row.failure or f"{row.median:.4g} ms"
        self._say(f"{row.size}^3, smoke in {100 * row.share:.0f} %, {PEERS[peer].title}: {outcome}")
        return row

    def _timed(self, row: Row, milliseconds: list[float]) -> Row:
        if not milliseconds:
            return row
        median = float(np.median(milliseconds))
        return replace(row, milliseconds=tuple(milliseconds), median=median, floors=median / self._floor)

    def _scored(self, row: Row) -> Row:
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
