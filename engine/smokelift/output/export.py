"""Writes what others need of a sequence: OpenVDB files that are as small as the picture allows, a proxy and a USD file.

What is left out or rounded does not show in a picture of 8 bits:

- Smoke that is so thin that a box full of it hides less than `THIN` of what is behind is left out.
- Quantised densities are multiples of a power of two; rounding errors along a ray are independent, so over n voxels of
  h metres they change the optical depth by extinction * h * sqrt(n / 12) steps (root mean square), which is kept below
  `SHADE`. Powers of two leave the last bits of a 16 bit float zero, which compresses well.
- Quantised velocities move smoke by at most half of `VELOCITY_STEP` voxels a frame.

Names, axes and the range of values are those of the program that reads the files (`smokelift.output.host`).
"""

from __future__ import annotations

import json
import math
import re
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from smokelift.output.archive import FLAME
from smokelift.output.atomic import atomic_path
from smokelift.output.host import HOSTS, HostName
from smokelift.output.index import SequenceError
from smokelift.output.layout import INDEX, frame_path, proxy_path
from smokelift.output.proxy_files import write_proxy
from smokelift.output.sequence import Sequence
from smokelift.output.usd import UsdVolume, usd_text
from smokelift.output.vdb import vdb_module, write_vdb
from smokelift.scene import Domain, Medium
from smokelift.transport import Array

NOTE = "export.json"
"""Says what an export is and how it was made; a folder without it is not overwritten."""

USD = "smoke.usda"

ASSET = "smoke.blend"
"""What the Blender extension adds; it stays when an export is replaced."""

THIN = 1e-3
"""Share of the light that smoke may hide and yet be left out."""

SHADE = 1 / 510
"""Half a step of a picture of 8 bits."""

VELOCITY_STEP = 1 / 16
"""Step of a quantised velocity in voxels a frame."""

SAMPLED_FRAMES = 5
"""Frames that are written to estimate the size of all."""

Precision = Literal["half", "quantised"]

_OWN = re.compile(r"(smoke|proxy)_\d{4,}\.vdb")


@dataclass(frozen=True)
class ExportSettings:
    """What is exported.

    Attributes
    ----------
    precision
        ``"half"`` for floats of 16 bits; ``"quantised"`` for as few bits as a picture of 8 bits needs.
    velocity
        Whether to export the velocity, which motion blur needs.
    proxy
        How many times coarser a second sequence for viewports is, of the density alone; 1 for none.
    host
        The program that reads the files: ``"blender"``, ``"houdini"`` or ``"unreal"``.

    Raises
    ------
    ValueError
        If the proxy is not 1 to 16.
    """

    precision: Precision = "half"
    velocity: bool = True
    proxy: int = 1
    host: HostName = "blender"

    def __post_init__(self) -> None:
        """Check the proxy."""
        if not 1 <= self.proxy <= 16:
            raise ValueError(f"the proxy must be 1 (none) to 16 times coarser, not {self.proxy}.")


def export_sequence(sequence: Sequence, out: str | Path, settings: ExportSettings) -> Iterator[tuple[int, int]]:
    """Export a sequence to a folder: `smoke_0001.vdb`, ..., `smoke.usda`, `export.json`, and `proxy_0001.vdb`, ...

    Files have the numbers of the sequence's own, and so do the times of the USD file.

    There is no USD file for a program whose axes are left-handed. An earlier export in the folder is replaced. The
    sequence stays as it is.

    Parameters
    ----------
    sequence
        What is exported, with all its frames.
    out
        The folder, which is made if it is missing.
    settings
        What of it.

    Yields
    ------
    The number of every frame, which is written already, and the bytes of its files.

    Raises
    ------
    SequenceError
        If there are no frames, the folder holds other files, or a file cannot be read or written.
    VdbUnavailable
        If there is no OpenVDB module.
    """
    out = Path(out)
    require_export(sequence, out)
    try:
        out.mkdir(parents=True, exist_ok=True)
        _clear(out)
        peak = _peak(sequence, sequence.frames, settings)
        note = {**_note(sequence, settings, peak), "complete": False}
        _write_text(out / NOTE, json.dumps(note, indent=1) + "\n")  # first: it says whose files these are
        for number in sequence.frames:
            yield number, _write_frame(sequence, number, out, settings, peak)
        if not HOSTS[settings.host].left_handed:  # USD has no such axes
            _write_text(out / USD, _usd(sequence, settings, peak))
        _write_text(out / NOTE, json.dumps({**note, "complete": True}, indent=1) + "\n")
    except OSError as error:
        raise SequenceError(f"{out}: cannot be written: {error}") from error


def require_export(sequence: Sequence, out: Path) -> None:
    """Check, before anything is spent or written, that a sequence can be exported to a folder.

    It raises what `export_sequence` would.
    """
    vdb_module()
    if not sequence.frames:
        raise SequenceError(f"{sequence.directory}: has no finished frame to export yet.")
    if out.exists() and not out.is_dir():
        raise SequenceError(f"{out}: is a file; choose a folder for the export.")
    names = [file.name for file in out.iterdir() if not file.name.startswith(".")] if out.is_dir() else []
    foreign = [name for name in names if not (name in (NOTE, USD, ASSET) or _OWN.fullmatch(name))]
    if foreign or (names and NOTE not in names):
        other = INDEX if INDEX in names else sorted(foreign or names)[0]
        raise SequenceError(f"{out}: holds other files ({other}); nothing was overwritten, choose an empty folder.")


def export_size(sequence: Sequence, settings: ExportSettings) -> int:
    """Estimate the bytes of an export, from frames that are evenly spaced over the sequence."""
    places = np.unique(np.linspace(0, len(sequence.frames) - 1, SAMPLED_FRAMES).round().astype(int))
    numbers = [sequence.frames[place] for place in places]
    peak = _peak(sequence, numbers, settings)
    with tempfile.TemporaryDirectory() as folder:
        sizes = [_write_frame(sequence, number, Path(folder), settings, peak) for number in numbers]
    return round(float(np.interp(np.arange(len(sequence.frames)), places, sizes).sum()))


def require_space(out: Path, size: int) -> None:
    """Check that so many bytes are free where a folder will be; SequenceError if not."""
    there = next(folder for folder in (out, *out.absolute().parents) if folder.exists())
    free = shutil.disk_usage(there).free
    if free < size:
        raise SequenceError(
            f"{out}: the export takes {size / 1e6:.0f} MB, but only {free / 1e6:.0f} MB are free; choose another disk."
        )


def _peak(sequence: Sequence, numbers: Iterable[int], settings: ExportSettings) -> float:
    """What densities are divided by: the largest of these frames for a program that keeps 8 bits of them, else 1."""
    if not HOSTS[settings.host].eight_bits:
        return 1.0
    return max(float(sequence.density(number).max()) for number in numbers) or 1.0


def _write_frame(sequence: Sequence, number: int, out: Path, settings: ExportSettings, peak: float) -> int:
    """Write the files of a frame; returns their bytes."""
    domain, extinction, host = sequence.scene.domain, sequence.scene.medium.extinction, HOSTS[settings.host]
    thinned = _thinned(sequence.density(number), domain, extinction)
    velocity = sequence.velocity_at_centres(number) if settings.velocity else None
    paths = [frame_path(out, sequence.file_number(number), "vdb")]
    rho = thinned
    if settings.precision == "quantised":
        rho = _rounded(rho, density_step(domain, extinction))
        velocity = None if velocity is None else _rounded(velocity, velocity_step(domain, sequence.fps))
    if host.eight_bits:
        rho = _rounded(thinned / np.float32(peak), 1 / 255)
    flame = None
    if FLAME in _grids(sequence, settings):
        found = sequence.flame(number)
        flame = np.zeros_like(rho) if found is None else found
        if settings.precision == "quantised":
            flame = _rounded(flame, density_step(domain, 1.0))  # radiance adds up along a ray as optical depth does
    write_vdb(
        paths[0],
        host.turned(rho),
        None if velocity is None else host.turned(velocity),
        host.box(domain),
        sequence.settings,
        None if flame is None else host.turned(flame),
        velocity_name=host.velocity,
        facts=host.facts(sequence.fps, _medium(sequence, peak)),
        whole_box=host.whole_box,
    )
    if settings.proxy > 1:
        paths.append(proxy_path(out, sequence.file_number(number)))
        write_proxy(paths[1], host.turned(thinned / np.float32(peak)), host.box(domain), settings.proxy)
    return sum(path.stat().st_size for path in paths)


def _grids(sequence: Sequence, settings: ExportSettings) -> tuple[str, ...]:
    """Names of the grids in the files of all frames."""
    burns = sequence.scene.medium.flame_color is not None
    return ("density", *[HOSTS[settings.host].velocity] * settings.velocity, *[FLAME] * burns)


def density_step(domain: Domain, extinction: float) -> float:
    """Step of a quantised density: the largest power of two whose rounding does not show (see the module)."""
    longest = max(domain.resolution)
    return _power_of_two(SHADE / (extinction * domain.voxel_size * math.sqrt(longest / 12)))


def velocity_step(domain: Domain, fps: float) -> float:
    """Step of a quantised velocity in m/s (see the module)."""
    return _power_of_two(VELOCITY_STEP * domain.voxel_size * fps)


def _thinned(density: Array, domain: Domain, extinction: float) -> Array:
    longest = max(domain.resolution) * domain.voxel_size
    return np.where(density < THIN / (extinction * longest), np.float32(0.0), density)


def _rounded(values: Array, step: float) -> Array:
    rounded: Array = np.round(values / np.float32(step)) * np.float32(step)
    return rounded


def _power_of_two(value: float) -> float:
    return 2.0 ** math.floor(math.log2(value))


def _medium(sequence: Sequence, peak: float) -> Medium:
    """Optical properties of smoke of density 1, as the files have it."""
    medium = sequence.scene.medium
    return replace(medium, extinction=medium.extinction * peak)


def _usd(sequence: Sequence, settings: ExportSettings, peak: float) -> str:
    host, grids = HOSTS[settings.host], _grids(sequence, settings)
    domain, numbers = host.box(sequence.scene.domain), [sequence.file_number(number) for number in sequence.frames]
    purpose = "default" if settings.proxy == 1 else "render"
    files = {number: frame_path(Path(), number, "vdb").name for number in numbers}
    volumes = [UsdVolume("Volume", purpose, files, grids, domain)]
    if settings.proxy > 1:
        proxies = {number: proxy_path(Path(), number).name for number in numbers}
        volumes.append(UsdVolume("Proxy", "proxy", proxies, ("density",), domain))
    medium = _medium(sequence, peak)
    return usd_text(volumes, sequence.fps, medium, host.velocity, host.up_axis)


def _note(sequence: Sequence, settings: ExportSettings, peak: float) -> dict[str, Any]:
    domain = HOSTS[settings.host].box(sequence.scene.domain)
    return {
        "host": settings.host,
        "precision": settings.precision,
        "grids": list(_grids(sequence, settings)),
        "proxy": settings.proxy,
        "frames": [sequence.file_number(sequence.frames[0]), sequence.file_number(sequence.frames[-1])],
        "fps": sequence.fps,
        "medium": {key: value for key, value in vars(_medium(sequence, peak)).items() if value is not None},
        "domain": {"min": list(domain.min), "max": list(domain.max), "resolution": list(domain.resolution)},
        "provenance": [dict(part) for part in sequence.provenance],
    }


def _clear(out: Path) -> None:
    """Delete the frames of an earlier export."""
    for path in out.iterdir():
        if _OWN.fullmatch(path.name) or path.name == USD:
            path.unlink()


def _write_text(path: Path, text: str) -> None:
    with atomic_path(path) as aside:
        aside.write_text(text, encoding="utf-8")
