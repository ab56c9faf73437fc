"""The files that a shot is read from, with what tells them from others of the same names."""

from pathlib import Path
from typing import Any

from smokelift.output.files import checksum
from smokelift.scene import Background, EnvironmentLight
from smokelift.setup.shot import Shot, ShotView


def sources(shot: Shot) -> dict[str, dict[str, Any]]:
    """Return size and content of what a shot is read from, by its table in a scene file.

    Frames of the clip that are its background are named: the sequence keeps their picture alone.
    """
    files: dict[str, tuple[Path, ...]] = {}
    frames: dict[str, dict[str, Any]] = {}
    for number, view in enumerate(shot.views):
        table = f"views.{number - 1}." if number else ""
        files[f"{table}clip"] = view.clip.files
        files[f"{table}mask"] = () if view.clip.mask is None else view.clip.mask.files
        given = shot.scene.views[number - 1].background if number else shot.scene.background
        files[f"{table}background"] = _background(given, view)
        if given is not None and given.strokes is not None:
            files[f"{table}strokes"] = (given.strokes,)
        if given is not None and given.frame is not None:
            frames[f"{table}background"] = {"frame": list(given.frame)}
    for number, light in enumerate(shot.scene.lights):
        if isinstance(light, EnvironmentLight):
            files[f"lights.{number}"] = (light.image,)
    return frames | {
        table: {"bytes": sum(path.stat().st_size for path in paths), "sha256": checksum(paths)}
        for table, paths in files.items()
        if paths
    }


def _background(given: Background | None, view: ShotView) -> tuple[Path, ...]:
    """The files of a background; none where it is a color, or estimated."""
    return view.plate.files or (() if given is None or given.image is None else (given.image,))
