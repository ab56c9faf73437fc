"""A scene in which nothing is left open: what a renderer needs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from smokelift.checks import require_kind
from smokelift.scene.camera import Camera
from smokelift.scene.checks import file_path
from smokelift.scene.description import Scene
from smokelift.scene.domain import Domain, Inlet, Side
from smokelift.scene.lights import Light
from smokelift.scene.medium import Medium, Scattering
from smokelift.scene.view import Background, ClipSource, View
from smokelift.scene.writing import write_file


@dataclass(frozen=True)
class CompleteScene:
    """A `Scene` with every choice made.

    Attributes
    ----------
    camera, domain, medium, lights
        As in `Scene`; without lights the smoke only absorbs.
    background
        Behind the smoke.
    scattering
        How light is scattered: ``"multiple"`` times, ``"single"`` with self-shadowing, ``"unshadowed"`` or
        ``"absorption"``.
    clip, views, closed, inlets
        As in `Scene`; a scene that was never filmed has no clip.
    """

    camera: Camera
    domain: Domain
    medium: Medium
    lights: tuple[Light, ...]
    background: Background
    scattering: Scattering
    clip: ClipSource | None = None
    views: tuple[View, ...] = ()
    closed: tuple[Side, ...] = ()
    inlets: tuple[Inlet, ...] = ()

    def save(self, path: str | Path) -> None:
        """Write a scene file that `Scene.load` and `completed` read back as an equal scene; see `Scene.save`."""
        write_file(self, file_path(path, "path"))

    def inflow(self) -> NDArray[np.bool_] | None:
        """Return the voxels where smoke enters, shape (nx, ny, nz); None if no inlet is marked."""
        if not self.inlets:
            return None
        entries: NDArray[np.bool_] = np.logical_or.reduce([inlet.voxels(self.domain) for inlet in self.inlets])
        return entries


def require_scene(scene: object) -> None:
    """Refuse what is no scene; ValueError."""
    require_kind(scene, Scene | CompleteScene, "scene", "a Scene (Scene.load reads one from a file)")


def completed(scene: Scene | CompleteScene, camera: Camera | None = None) -> CompleteScene:
    """Complete a description with defaults, without any footage.

    Parameters
    ----------
    scene
        Needs a domain, and a camera unless one is given. A complete scene stays as it is, but for the camera.
    camera
        Takes the place of the scene's.

    Raises
    ------
    ValueError
        If there is no camera or no domain.
    """
    require_scene(scene)
    camera = camera or scene.camera
    if camera is None:
        raise ValueError("The scene has no camera; give one.")
    if not isinstance(scene.domain, Domain):
        lacks = "no domain" if scene.domain is None else "a domain without a resolution"
        raise ValueError(f"The scene has {lacks}; give its corners and its resolution.")
    return CompleteScene(
        camera=camera,
        domain=scene.domain,
        medium=scene.medium or Medium(),
        lights=scene.lights,
        background=scene.background or Background(color=(0.0, 0.0, 0.0)),
        scattering=scene.scattering or "single",
        clip=scene.clip,
        views=scene.views,
        closed=scene.closed,
        inlets=scene.inlets,
    )
