"""How much of a clip each quality shows, at the clip's own pixels, and what a frame takes.

    python -m benchmarks.pipeline.clip_pixels CLIP --frames 60:72 --runs draft balanced fine:resolution=76x76x128

CLIP is a video or a scene file, a run is named as in `benchmarks.accuracy.runs`. The first `UNTIMED` frames do not
count. A grid that needs more memory than there is is not refused.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import ndimage

from benchmarks.accuracy.runs import run_settings
from benchmarks.tables import markdown, number, size_text
from benchmarks.timing import UNTIMED
from smokelift import Clip, ClipSource, Scene, Settings, reconstruct
from smokelift.app.options import frame_range
from smokelift.pipeline.clip_fit import BesideClip, beside_clip

SCALES = ((1.0, 2.0), (2.0, 4.0))
"""Sizes of detail in pixels: what a Gaussian of the smaller standard deviation leaves and one of the larger takes away.
Its wavelengths are about six times as long; pixels hold none of 1 to 2 pixels along a row."""


@dataclass(frozen=True)
class Row:
    """Medians over the frames of a run.

    Attributes
    ----------
    size
        Voxels along x, y and z.
    psnr, psnr_working
        As in the figures of a frame (dB).
    shares
        Energy of the density's picture inside the smoke over the clip's, of each of `SCALES`.
    lost
        Share of the clip's contrast that the grid is said to lose; None where the grid was given.
    seconds
        Processor time of a frame.
    """

    size: tuple[int, ...]
    psnr: float
    psnr_working: float
    shares: tuple[float, ...]
    lost: float | None
    seconds: float


def detail_shares(beside: BesideClip) -> tuple[float, ...]:
    """Return the energy of a density's picture inside the smoke, over that of the clip's, of each of `SCALES`."""
    smoke = [(picture - beside.behind).mean(-1) for picture in (beside.shown, beside.seen)]
    shares = []
    for low, high in SCALES:
        bands = [ndimage.gaussian_filter(each, low) - ndimage.gaussian_filter(each, high) for each in smoke]
        ours, clips = (float(np.sum(np.square(band[beside.inside], dtype=np.float64))) for band in bands)
        shares.append(ours / clips if clips > 0 else 0.0)
    return tuple(shares)


def measure(scene: Scene, settings: Settings) -> Row:
    """Reconstruct a scene's clip and compare each frame with all pixels of the clip's."""
    assert scene.clip is not None
    psnr, working, shares, seconds = [], [], [], []
    with Clip.open(scene.clip) as clip:
        reconstruction = reconstruct(clip, scene, settings)
        shot = reconstruction.shot
        began = time.process_time()
        for frame in reconstruction:
            spent = time.process_time() - began
            beside = beside_clip(shot.views[0], shot.optics, frame.number - 1, frame.density, step=1)
            # the first frame comes with the second
            if frame.number > UNTIMED and beside is not None and "psnr" in frame.figures:
                seconds.append(spent)
                psnr.append(frame.figures["psnr"])
                working.append(frame.figures["psnr_working"])
                shares.append(detail_shares(beside))
            del frame
            began = time.process_time()
        grid = shot.qualities.get(shot.settings.quality)
    return Row(
        size=shot.scene.domain.resolution,
        psnr=float(np.median(psnr)),
        psnr_working=float(np.median(working)),
        shares=tuple(map(float, np.median(shares, 0))),
        lost=None if grid is None else grid.lost,
        seconds=float(np.median(seconds)),
    )


def text(rows: Sequence[tuple[str, Row]]) -> str:
    """Return the table of some runs."""
    bands = [f"energy, {low:g} to {high:g} pixels" for low, high in SCALES]
    header = ["run", "voxels", "contrast lost", "psnr", "psnr_working", *bands, "processor s a frame"]
    return markdown(
        header,
        [
            [
                name,
                size_text(row.size),
                "" if row.lost is None else f"{row.lost:.1%}",
                f"{row.psnr:.1f}",
                f"{row.psnr_working:.1f}",
                *(f"{share:.2f}" for share in row.shares),
                number(row.seconds),
            ]
            for name, row in rows
        ],
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table, a row as soon as it is there."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clip", type=Path)
    parser.add_argument("--frames", type=frame_range, metavar="A:B")
    parser.add_argument("--runs", nargs="+", default=["draft", "balanced", "fine"])
    options = parser.parse_args(arguments)
    path: Path = options.clip
    scene = Scene.load(path) if path.suffix.lower() == ".toml" else Scene(clip=ClipSource(path))
    scene = scene if options.frames is None else scene.with_frames(*options.frames)
    rows = []
    for run in options.runs:
        rows.append((run, measure(scene, run_settings(run))))
        print(text(rows[-1:]).splitlines()[-1] if rows[:-1] else text(rows), flush=True)


if __name__ == "__main__":
    main()
