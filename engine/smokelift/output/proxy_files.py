"""Coarse copies of a sequence's frames, which a viewport reads in the place of files that are too large for it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from smokelift.output.files import proxy_path
from smokelift.output.index import SequenceError
from smokelift.output.sequence import Sequence
from smokelift.output.vdb import vdb_module, write_vdb
from smokelift.scene import Domain
from smokelift.transport import Array, block_means

TIMES = 4
"""How many times as large the voxels of a proxy are."""

MIN_PROXY_VOXELS = 4_000_000
"""Voxels of a box from which on a run writes proxies. Blender reads a frame of 41 million, a quarter of them smoke, in
1.2 s (`benchmarks/blender/heavy.py`, two cores), so of so many it reads 8 a second."""


def write_proxy(
    path: Path,
    density: Array,
    domain: Domain,
    times: int = TIMES,
    flame: Array | None = None,
    lattice: Domain | None = None,
) -> None:
    """Write the coarse copy of a frame: its density, and its emission where it has one, (nx, ny, nz) each.

    The voxels of the copy are `times` as large as those of the domain. A `lattice` as in `write_vdb` begins a multiple
    of `times` voxels before the domain, if it is not the same. It raises VdbUnavailable, and OSError if the file cannot
    be written.
    """
    fire = None if flame is None else block_means(flame, times)
    coarse_lattice = None if lattice is None else lattice.coarser(times)
    write_vdb(path, block_means(density, times), None, domain.coarser(times), flame=fire, lattice=coarse_lattice)


def write_proxies(sequence: Sequence) -> Iterator[int]:
    """Write the coarse copies of all frames of a sequence into its directory, and yield their numbers.

    It raises SequenceError if there are no frames, or a file cannot be read or written, and VdbUnavailable.
    """
    vdb_module()
    if not sequence.frames:
        raise SequenceError(f"{sequence.directory}: has no finished frame to make a proxy of yet.")
    for number in sequence.frames:
        path = proxy_path(sequence.directory, sequence.file_number(number))
        try:
            write_proxy(path, sequence.density(number), sequence.scene.domain, flame=sequence.flame(number))
        except OSError as error:
            raise SequenceError(f"{path}: cannot be written: {error}") from error
        yield number
