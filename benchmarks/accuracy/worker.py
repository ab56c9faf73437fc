"""One run of the accuracy benchmark in a process of its own, so that its peak of memory is its own.

    python -m benchmarks.accuracy.worker scene.toml RUN FIRST LAST OUT

reads the clip's frames FIRST to LAST (and those of further views, if RUN names some: "balanced+90") and leaves
OUT/0001.npz, ... (density; velocity at centres in m/s, if the run has one), OUT/scene.toml with what was estimated, and
OUT/run.json. Only the reconstruction is clocked, from decoding the clip to OpenVDB files on disk; the arrays are
written between frames.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import peak_bytes, poisson_seconds
from smokelift import (
    Clip,
    ClipSource,
    Scene,
    Settings,
    Velocity,
    View,
    advect,
    reconstruct,
    reconstruct_density,
)
from smokelift.density import DensitySettings, evidence
from smokelift.output.images import write_image
from smokelift.setup.shot import Shot, prepare_shot
from smokelift.velocity import CoarseToFine

VIEWS = {"0": "front", "20": "nov20", "45": "nov45", "90": "side"}
"""Degrees about the vertical, and the files of picture.py."""

SMEAR = "smear"
SMEAR_SETTINGS = DensitySettings(fit_iterations=24, descent_iterations=0, tolerance=1e-3)
"""Only whole rays are scaled, so that a density which is constant along them stays so."""

STARTED = 2
"""Frames that are not clocked: the first two come together, and compilers work before them."""


def run_views(run: str) -> list[str]:
    """Names of the further views of a run, "90" and "45" of "balanced+90+45:transport=0"."""
    return run.partition(":")[0].split("+")[1:]


def further_view(name: str, scene_path: Path, last: int, folder: Path) -> View:
    """A view of a scene's folder: its camera's clip, or one of 8-bit pictures made of what the camera saw."""
    seen = Scene.load(scene_path.with_name(f"{VIEWS.get(name, name)}.toml"))
    if seen.clip is not None:
        return View(seen.camera, seen.clip)
    with np.load(scene_path.with_name(f"{VIEWS[name]}.npz")) as file:
        pictures = file["image"][: last + 1]
    for number, picture in enumerate(pictures):
        write_image(folder / f"{name}_{number:04d}.png", np.repeat(picture[..., None].astype(np.float32), 3, -1))
    return View(seen.camera, ClipSource(folder / f"{name}_####.png"))


def run_settings(run: str) -> Settings:
    """Settings of a run's name: a quality or "paper", then changes, "balanced:transport=0,without=hull"."""
    name, _, changes = run.partition(":")
    name = name.split("+")[0]
    settings = Settings.preset(method="paper") if name == "paper" else Settings.preset(name)
    for change in filter(None, changes.split(",")):
        key, _, text = change.partition("=")
        if key == "without":
            settings = leave_out(text, settings)
            continue
        if key == "resolution":
            x, y, z = (int(count) for count in text.split("x"))
            settings = replace(settings, resolution=(x, y, z))
            continue
        try:
            value: Any = json.loads(text)
        except json.JSONDecodeError:
            value = text
        group, _, inner = key.rpartition(".")
        changed = replace(getattr(settings, group), **{inner: value}) if group else value
        settings = replace(settings, **{group or inner: changed})
    return settings


def leave_out(part: str, settings: Settings) -> Settings:
    """Do without a part of the method: the settings for that, and what settings do not say, for the whole process.

    - transport: every frame begins with its own picture
    - hull: smoke may be wherever the camera looks
    - sources: smoke that enters is read as motion
    - projection: the prediction is the velocity carried along by itself, divergence and all
    - depth: the first guess is constant along the rays
    """
    if part == "transport":
        return replace(settings, transport=0.0)
    if part == "sources":
        return replace(settings, velocity=replace(settings.velocity, sources=None))
    if part == "hull":
        evidence.common_hull = lambda _masks, projections: np.any([p.visible for p in projections], axis=0)
    elif part == "projection":
        CoarseToFine.predict = carried_by_itself
    elif part == "depth":
        evidence.DepthProfile.at = lambda _profile, _projection, voxels: np.full(np.count_nonzero(voxels), 0.5)
    else:
        raise ValueError(f"without={part}: expected transport, hull, sources, projection or depth.")
    return settings


def carried_by_itself(_estimator: CoarseToFine, velocity: Velocity, dt: float) -> Velocity:
    """What is predicted without pressure projection."""
    return replace(advect(velocity, velocity, dt), residual=velocity.residual)


def smeared(clip: Clip, shot: Shot) -> Iterator[np.ndarray]:
    """The front fit with a density that is constant along the rays inside the domain."""
    domain, medium = shot.scene.domain, shot.scene.medium
    fog = np.full(domain.resolution, 0.5 / (medium.extinction * (domain.max[1] - domain.min[1])), np.float32)
    settings = replace(SMEAR_SETTINGS, scattering=shot.scattering)
    for index in range(len(clip)):
        image = shot.working.cut(clip.frame(index))
        yield reconstruct_density(image, shot.small_scene, fog, settings, plate=shot.plate).values


def main() -> None:
    """Do the run."""
    scene_path, run, first, last, out = (Path(sys.argv[1]), *sys.argv[2:5], Path(sys.argv[5]))
    scene = Scene.load(scene_path)
    source = replace(scene.clip, frames=(int(first), int(last)))
    settings = Settings.preset() if run == SMEAR else run_settings(run)
    seconds, units = [], []
    with tempfile.TemporaryDirectory() as folder, Clip.open(source) as clip:
        views = tuple(further_view(name, scene_path, int(last), Path(folder)) for name in run_views(run))
        scene = replace(scene, views=views)
        shot = prepare_shot(clip, scene, settings)
        shot.scene.save(out / "scene.toml")
        if run == SMEAR:
            found: Iterator[Any] = smeared(clip, shot)
        else:
            found = reconstruct(clip, scene, settings, Path(folder) / "smoke", shot=shot)
        began = time.perf_counter()
        for number, frame in enumerate(found, 1):
            seconds.append(time.perf_counter() - began)
            if run == SMEAR:
                arrays = {"density": frame}
            else:
                arrays = {"density": frame.density, "velocity": frame.velocity.centres()}
            units.append(poisson_seconds(arrays["density"].shape))
            np.savez(out / f"{number:04d}.npz", **arrays)
            began = time.perf_counter()
    clocked = seconds[STARTED:] or seconds
    peak = peak_bytes()
    result = {
        "frames": len(seconds),
        "seconds": float(np.median(clocked)),
        "solves": float(np.median(clocked) / np.median(units)),
        "memory_mib": None if peak is None else peak / 2**20,
        "scattering": shot.scattering,
        "resolution": list(shot.scene.domain.resolution),
        "method": "baseline" if run == SMEAR else settings.method,
    }
    (out / "run.json").write_text(json.dumps(result) + "\n")


if __name__ == "__main__":
    main()
