"""Runs by their names: which settings a reconstruction has, and which cameras it may see.

A name is a quality or "paper", then further views, then changes:

- ``balanced``, ``paper``
- ``balanced+90``, ``balanced+90+45``: the views 90 and 45 are input too; of a capture ``balanced+camera00``
- ``balanced:transport=0``, ``fine:velocity.coarsening=1``, ``draft:resolution=32x32x48``: settings that differ
- ``fine:resolution=auto``: as many voxels as the clip's detail deserves and the quality allows
- ``balanced:velocity.solver=primal-dual``: the other solver
- ``balanced:detail=0``, ``balanced:seed=1``: the smooth density; another plausible one
- ``balanced:without=depth``: a part of the method is left out, see `ablations.leave_out`
- ``smear``: the front picture alone is fitted, with a density that is constant along the rays
- ``billboard``, ``blurred``: the front picture in every view, as it is or blurred
"""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

from benchmarks.accuracy.ablations import leave_out, smear
from benchmarks.accuracy.scenes import baked_scene
from benchmarks.baked import VIEWS, camera_of
from benchmarks.tables import sizes_of
from smokelift import ClipSource, Scene, Settings
from smokelift.density import DensitySettings, GradientFit, ViewSet
from smokelift.output.images import write_image
from smokelift.pipeline import Method, compose
from smokelift.render import Volume
from smokelift.scene import View
from smokelift.setup.settings import Quality
from smokelift.setup.shot import Shot
from smokelift.velocity import PrimalDual, ProjectedCG

SMEAR = "smear"
SMEAR_FIT = GradientFit(DensitySettings(fit_iterations=24, descent_iterations=0, tolerance=1e-3))
"""Only whole rays are scaled, so that a density which is constant along them stays so."""

SOLVERS = {"primal-dual": PrimalDual(), "projected-cg": ProjectedCG()}


def run_name(run: str) -> str:
    """Return a run's name without its views and changes: "balanced" of "balanced+90:transport=0"."""
    return run.partition(":")[0].split("+")[0]


def run_views(run: str) -> list[str]:
    """Return the names of the further views of a run: "90" and "45" of "balanced+90+45:transport=0"."""
    return run.partition(":")[0].split("+")[1:]


def further_view(name: str, scene_path: Path, last: int, folder: Path) -> View:
    """Return a further view of a scene.

    Parameters
    ----------
    name
        Key of `VIEWS`, or the name of a scene file beside the scene's.
    scene_path
        The scene's file.
    last
        The last frame that is needed, from 0.
    folder
        Gets 8-bit pictures of what the camera saw, if there is no clip of it.
    """
    path = scene_path.with_name(f"{VIEWS.get(name, name)}.toml")
    source = Scene.load(path).clip
    if source is None:
        known = baked_scene(scene_path.parent, last + 1)
        for number in range(last + 1):
            write_image(folder / f"{name}_{number:04d}.png", known.seen(name, number))
        source = ClipSource(folder / f"{name}_####.png")
    return View(camera_of(path), source)


def run_settings(run: str) -> Settings:
    """Return the settings of a run's name.

    Raises
    ------
    ValueError
        If there is no such quality.
    """
    name = run_name(run)
    qualities: dict[str, Quality] = {quality: quality for quality in get_args(Quality)}
    if name != "paper" and name not in qualities:
        raise ValueError(f"{run}: expected paper or one of {', '.join(qualities)} before a colon.")
    settings = Settings.preset(method="paper") if name == "paper" else Settings.preset(qualities[name])
    for key, text in _changes(run):
        if key == "without":
            continue
        if key == "resolution":
            settings = replace(settings, resolution="auto" if text == "auto" else sizes_of(text)[0])
        else:
            settings = _changed(settings, key, text)
    return settings


def run_method(run: str, settings: Settings) -> Method:
    """Return the composition of a run's name, for settings with nothing left open.

    Raises
    ------
    ValueError
        If a part that is left out is none of the method's.
    """
    method = compose(settings)
    for key, text in _changes(run):
        if key == "without":
            method = leave_out(text, method)
    return method


def smeared(shot: Shot) -> Iterator[Volume]:
    """Yield densities that are constant along the rays and fit the front picture."""
    for index in range(len(shot.clip)):
        yield smear(ViewSet.of(shot.observe(index), shot.optics), SMEAR_FIT)


def _changes(run: str) -> list[tuple[str, str]]:
    """Return the keys and values behind the colon of a run's name."""
    pairs = [change.partition("=") for change in run.partition(":")[2].split(",") if change]
    return [(key, text) for key, _, text in pairs]


def _changed(settings: Settings, key: str, text: str) -> Settings:
    """Return settings with a field, or with a field of a group ("velocity.coarsening"), read from text."""
    try:
        value: Any = json.loads(text)
    except json.JSONDecodeError:
        value = SOLVERS.get(text, text)
    group, _, field = key.rpartition(".")
    if group:
        field, value = group, replace(getattr(settings, group), **{field: value})
    return replace(settings, **{field: value})
