"""A clip as files, reconstructed by a state of the code, and compared with what is known."""

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.background.clips import FPS, eight_bits
from benchmarks.clean_clip.rows import Film
from benchmarks.clean_clip.smoke import FRONT, SCORED, optical_mass
from benchmarks.file_kinds.film import BT2020, encode, hlg_signal, to_bt2020, wide
from benchmarks.process import environment, why_it_ended
from smokelift import Background, ClipSource, Scene
from smokelift.evaluation.frame_means import eight_bit_values
from smokelift.evaluation.metrics import psnr
from smokelift.output.images import write_image
from smokelift.render import scene_renderer
from smokelift.scene import completed

RUN = "balanced:detail=0"
"""The usual quality, without detail that is made up."""

HLG = {"color_trc": 18, "color_primaries": 9, "colorspace": 9, "color_range": 1}
"""Code points of ITU-T H.273 for hybrid log-gamma and BT.2020."""

Figures = dict[str, float | str]


def write(film: Film, folder: Path) -> Path:
    """Write the clip without loss, the plate if it is given, and the scene file, which is returned."""
    folder.mkdir(parents=True, exist_ok=True)
    if film.hlg:
        clip = wide(folder / "clip.mkv", hlg_signal(to_bt2020(film.pictures)), 10, BT2020, **HLG)
    else:
        clip = encode(folder / "clip.mkv", eight_bits(film.pictures), "ffv1", "bgr0", rate=int(FPS))
    background = None
    if film.plate is not None:
        write_image(folder / "plate.exr", film.plate, half=False)
        background = Background(image=folder / "plate.exr")
    medium = film.smoke.scene.medium if film.medium else None
    camera = film.smoke.cameras[FRONT].resized(*film.pictures.shape[2:0:-1])
    scene = replace(film.smoke.scene, clip=ClipSource(clip), background=background, medium=medium, camera=camera)
    path = folder / "scene.toml"
    scene.save(path)
    # what is not given needs no key, which earlier states of the code may not know
    path.write_text(re.sub(r"color = \[\s*1\.0,\s*1\.0,\s*1\.0,?\s*\]\n", "", path.read_text()))
    return path


def reconstruct(path: Path, frames: int, out: Path, checkout: Path) -> str | None:
    """Reconstruct a scene file by the code of a checkout; returns the sentence with which it refused, if it did."""
    out.mkdir(parents=True, exist_ok=True)
    homes = os.pathsep.join([str(checkout / "engine"), str(checkout)])
    ended = subprocess.run(
        [sys.executable, "-m", "benchmarks.accuracy.worker", str(path), RUN, "0", str(frames - 1), str(out)],
        env={**environment(), "PYTHONPATH": homes},
        cwd=checkout,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    return None if ended.returncode == 0 else why_it_ended(ended)


def score(film: Film, out: Path) -> Figures:
    """Compare the result of `reconstruct` with what is known.

    Returns
    -------
    ``views``: PSNR of the new views in dB, the mean over views and frames; ``front``: that of the clip's own; ``mass``:
    extinction times volume beside the truth's, of all scored frames together.
    """
    about = json.loads((out / "run.json").read_text())
    scene = completed(replace(Scene.load(out / "scene.toml"), scattering=about["scattering"]))
    densities = []
    for number in SCORED:
        with np.load(out / f"{number + 1:04d}.npz") as file:
            densities.append(file["density"].astype(np.float32))
    behind = np.full(3, film.behind, np.float32)
    colour = np.asarray(film.colour, np.float32)
    figures: dict[str, list[float]] = {"views": [], "front": []}
    for view, camera in film.smoke.cameras.items():
        renderer = scene_renderer(scene, camera, behind)
        for k, density in enumerate(densities):
            alone, through = film.smoke.radiance[view][k], film.smoke.transmittance[view][k]
            seen = alone[..., None] * colour + through[..., None] * behind
            agreement = psnr(eight_bit_values(renderer.image(density)), eight_bit_values(seen))
            figures["front" if view == FRONT else "views"].append(agreement)
    mass = optical_mass(Scene.load(out / "scene.toml"), np.stack(densities)) / film.smoke.mass()
    return {"views": float(np.mean(figures["views"])), "front": float(np.mean(figures["front"])), "mass": mass}
