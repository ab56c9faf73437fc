"""What a user describes of a shot; whatever is left out is estimated or defaulted.

Conventions: right-handed world, Z up, meters. Cameras look along their local -Z with +Y up, as Blender's do.
Image coordinates are in pixels, x to the right and y down from the top left corner, pixel centers at half
integers. Directions of lights are directions of travel.

Every class of a scene checks its values where it is made, so a scene built in Python and one read from a file are
refused for the same reasons; `smokelift.scene.scene_file` adds the file and the line to the message.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from smokelift.checks import Mask, listed, one_of, require_kind, shown
from smokelift.scene.camera import Camera, sees
from smokelift.scene.checks import SceneError, file_path, integer, set_fields, unexpected
from smokelift.scene.domain import Box, Domain, Inlet, Side, checked_sides
from smokelift.scene.lights import SCATTERINGS, EnvironmentLight, Light, Medium, PointLight, Scattering
from smokelift.scene.scene_file import TomlFile, from_tables, read_toml, scene_to_dict, write_toml
from smokelift.scene.view import Background, ClipSource, View

MAX_LISTED = 256
"""Lights, inlets or views of a scene, at most: the time of a run grows with their number."""


@dataclass(frozen=True)
class Scene:
    """One shot. What is None (for lights: empty) is estimated or defaulted before a run, and the run notes how.

    Attributes
    ----------
    clip
        The footage.
    camera, domain, medium, lights, background
        What is in front of the lens. A `Box` in place of a `Domain` leaves the resolution to the quality.
    views
        Further cameras and their clips.
    closed
        Sides of the domain that are walls. Smoke and air pass freely through the others. A floor is ``"z-"``.
    inlets
        All the places where smoke enters. If there is none, they are estimated.
    scattering
        How light is scattered: any number of times (``"multiple"``), once with self-shadowing (``"single"``), once
        without (``"unshadowed"``) or not at all (``"absorption"``); None chooses by measurement.

    Raises
    ------
    SceneError
        If a camera can see the domain in no frame, a point light stands inside it or too far away, an inlet lies
        outside, a side or the kind of scattering is unknown, or there are too many lights, inlets or views.
    """

    clip: ClipSource | None = None
    camera: Camera | None = None
    domain: Box | None = None
    medium: Medium | None = None
    lights: tuple[Light, ...] = ()
    background: Background | None = None
    views: tuple[View, ...] = ()
    closed: tuple[Side, ...] = ()
    inlets: tuple[Inlet, ...] = ()
    scattering: Scattering | None = None

    def __post_init__(self) -> None:
        """Check what no table can check alone."""
        require_kind(self.clip, ClipSource | None, "clip", 'a ClipSource, such as ClipSource("clip.mp4")', SceneError)
        require_kind(self.camera, Camera | None, "camera", "a Camera", SceneError)
        require_kind(self.domain, Box | None, "domain", "a Domain", SceneError)
        require_kind(self.medium, Medium | None, "medium", "a Medium", SceneError)
        require_kind(self.background, Background | None, "background", "a Background", SceneError)
        set_fields(
            self,
            lights=listed(self.lights, Light, "lights", "a list of lights", SceneError),
            views=listed(self.views, View, "views", "a list of Views", SceneError),
            inlets=listed(self.inlets, Inlet, "inlets", "a list of Inlets", SceneError),
        )
        for table, given in (("inlet", self.inlets), ("lights", self.lights), ("views", self.views)):
            if len(given) > MAX_LISTED:
                raise SceneError(f"is given {len(given)} times; {MAX_LISTED} at most", table=table)
        set_fields(self, closed=checked_sides(self.closed))
        if self.scattering not in (None, *SCATTERINGS):
            raise unexpected(self.scattering, "scattering", f"one of {one_of(SCATTERINGS)}", "medium")
        if self.domain is not None:
            self._check_places(self.domain)

    def _check_places(self, domain: Box) -> None:
        """Refuse an inlet outside the domain, a light inside it, and a camera that does not see it."""
        for index, inlet in enumerate(self.inlets):
            if not inlet.reaches(domain):
                raise SceneError(
                    f"is outside the domain: nothing within {inlet.radius:g} m of centre {shown(list(inlet.centre))} "
                    "is in the box; move it in",
                    key="centre",
                    table=f"inlet.{index}",
                )
        for index, light in enumerate(self.lights):
            for sample in () if isinstance(light, EnvironmentLight) else light.samples():
                if isinstance(sample, PointLight):
                    try:
                        sample.require_place(domain)
                    except SceneError as error:
                        raise SceneError(str(error), key=error.key, table=f"lights.{index}") from error
        cameras = {f"views.{index}.camera": view.camera for index, view in enumerate(self.views)}
        if self.camera is not None:
            cameras = {"camera": self.camera, **cameras}
        for table, camera in cameras.items():
            if not any(sees(camera.at(frame), domain) for frame in range(len(camera.matrices) or 1)):
                raise SceneError(
                    "does not see the domain: no part of the box is in its picture; turn or move it", table=table
                )

    def with_frames(self, first: int, last: int) -> "Scene":
        """Return the scene with another range of its clip's frames; the ranges of further views move with it.

        Raises
        ------
        SceneError
            If the scene has no clip, or the range of a clip does not exist.
        """
        if self.clip is None:
            raise SceneError("a scene without a clip has no frames; give one", table="clip")
        first, last = integer(first, "first"), integer(last, "last")
        skipped = first - self.clip.first
        views = []
        for index, view in enumerate(self.views):
            if view.clip.frames is not None:
                start = view.clip.first + skipped
                if start < 0:
                    raise SceneError(
                        f"has no picture before frame {first - start} of the input; use the input from there on",
                        key="frames",
                        table=f"views.{index}.clip",
                    )
                view = replace(view, clip=replace(view.clip, frames=(start, start + last - first)))
            views.append(view)
        return replace(self, clip=replace(self.clip, frames=(first, last)), views=tuple(views))

    @staticmethod
    def load(path: str | Path) -> "Scene":
        """Read a scene file.

        Relative paths in it are relative to the file; the returned ones are absolute.

        Raises
        ------
        SceneError
            With the file, the line, the key, what was expected and what was found.
        """
        return _read(*read_toml(file_path(path, "path")))

    def save(self, path: str | Path, comments: Sequence[str] = ()) -> None:
        """Write a scene file that :meth:`load` reads back as an equal scene.

        Paths below the file's folder are written relative to it, all others absolute. Comments are lines at its top.

        Raises
        ------
        SceneError
            If the path is that of a folder.
        OSError
            If the file cannot be written.
        """
        path = file_path(path, "path")
        write_toml(path, scene_to_dict(self, path.absolute().parent), comments)


class CompleteScene(Scene):
    """A scene with every choice made, which is what a renderer needs: no part but the clip is None.

    It is made of a `Scene` that was checked, so what was not given is all that is refused; ValueError.
    """

    camera: Camera
    domain: Domain
    medium: Medium
    background: Background
    scattering: Scattering

    def __post_init__(self) -> None:
        """Check that nothing is left open."""
        for name in ("camera", "medium", "background", "scattering"):
            if getattr(self, name) is None:
                raise ValueError(f"The scene has no {name}; give one.")
        if not isinstance(self.domain, Domain):
            lacks = "no domain" if self.domain is None else "a domain without a resolution"
            raise ValueError(f"The scene has {lacks}; give its corners and its resolution.")

    def inflow(self) -> Mask | None:
        """Return the voxels where smoke enters, shape (nx, ny, nz); None if no inlet is marked."""
        if not self.inlets:
            return None
        return np.asarray(np.logical_or.reduce([inlet.voxels(self.domain) for inlet in self.inlets]))


def require_scene(scene: object) -> None:
    """Refuse what is no scene; ValueError."""
    require_kind(scene, Scene, "scene", "a Scene (Scene.load reads one from a file)")


def completed(scene: Scene, camera: Camera | None = None) -> CompleteScene:
    """Complete a description with defaults, without any footage; a given camera takes the place of the scene's.

    It is a ValueError if there is no domain, or no camera at all. A complete scene stays as it is, but for the
    camera.
    """
    require_scene(scene)
    given = {name: value for name, value in {**vars(scene), "camera": camera or scene.camera}.items() if value}
    defaults = {"medium": Medium(), "background": Background(color=(0.0, 0.0, 0.0)), "scattering": "single"}
    return CompleteScene(**{**defaults, **given})


def scene_from_dict(data: Mapping[str, Any], name: str = "scene", base: Path | None = None) -> Scene:
    """Return the scene that the tables of a scene file describe, as a sequence keeps them in its JSON.

    `name` is what messages call the source, and relative paths are relative to `base`, by default the current folder.
    It raises SceneError for the same reasons as `Scene.load`.
    """
    return _read(data, TomlFile(name, (base or Path()).absolute(), {}))


def _read(data: Mapping[str, Any], file: TomlFile) -> Scene:
    parts = from_tables(data, file)
    try:
        return Scene(**parts)
    except SceneError as error:
        place = tuple(int(part) if part.isdigit() else part for part in error.table.split("."))
        raise file.error(place, str(error), error.key) from error
