"""A shot: a clip with everything about it decided."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from smokelift.checks import Finding
from smokelift.density import AxisEstimate, Observation
from smokelift.extraction.element import Element, clip_element
from smokelift.extraction.plate import Plate, uncovered
from smokelift.footage.clip import Clip
from smokelift.render import Image, Optics
from smokelift.scene import Camera, CompleteScene, Domain, Inlet
from smokelift.setup.geometry import Grid, WorkingPicture, working_picture
from smokelift.setup.settings import Quality, Settings


@dataclass(frozen=True, eq=False)
class ShotView:
    """A camera of a shot, which may move, with its clip and what it sees without smoke in each frame.

    Frame 0 of ``clip`` is of the same moment as the input's. The grid is fitted to the small picture ``working``; for a
    camera that moves it is that of the first frame that shows the domain. ``source`` (3,) is the usual source radiance
    of the smoke before a picture that shows its transmittance, or of a clip whose alpha says that; then its element is
    fitted. None of any other. ``light_assumed`` is whether the scene's lights are not given.
    """

    clip: Clip
    camera: Camera
    plate: Plate
    working: WorkingPicture
    source: Image | None = None
    light_assumed: bool = False

    @staticmethod
    def facing(
        domain: Domain, clip: Clip, camera: Camera, plate: Plate, source: Image | None, light_assumed: bool = False
    ) -> "ShotView":
        """Return a camera's view of a domain; ValueError if no frame shows it."""
        for frame in range(len(camera.matrices) or 1):
            if (working := working_picture(camera.at(frame), domain)) is not None:
                return ShotView(clip, camera, plate, working, source, light_assumed)
        raise ValueError("The camera does not see the domain; move the domain into the picture or turn the camera.")

    def observe(self, frame: int, domain: Domain) -> Observation | None:
        """What the camera saw in a frame, from 0, as a small picture; None if that shows nothing of the domain."""
        working = self.working_at(frame, domain)
        if working is None:
            return None
        if self.camera.moves:
            plate = self.plate.at(frame).through(working.cut, working.pixels)
        else:
            plate = self._plate_of_working_picture.at(frame)
        image = working.of(self.clip, frame)
        return Observation(working.camera, image, plate, self.element(frame, working), self.light_assumed)

    def element(self, frame: int, working: WorkingPicture) -> Element | None:
        """The smoke of a frame, from 0, without the plate, as a small picture; None where ``source`` is."""
        if self.source is None:
            return None
        return clip_element(self.clip, frame, self.plate, self.source, working.camera.size, working.part)

    def working_at(self, frame: int, domain: Domain) -> WorkingPicture | None:
        """The small picture of a frame, from 0; None if the frame shows nothing of the domain."""
        return working_picture(self.camera.at(frame), domain) if self.camera.moves else self.working

    @cached_property
    def _plate_of_working_picture(self) -> Plate:
        """The plate of a still camera's small picture."""
        return self.plate.through(self.working.cut, self.working.pixels)


@dataclass(frozen=True, eq=False)
class Shot:
    """A clip with everything about it decided.

    Attributes
    ----------
    scene
        With the camera of the clip's full pictures. Its background names no picture where it was found in the clip.
    optics
        How light travels through the domain.
    views
        The cameras, the input first.
    settings
        With all that was left open decided.
    findings
        What was given, measured, assumed and noticed, in the order in which it was found, with the doubts.
    qualities
        The grid that each quality would take of this clip.
    smoky
        Numbers of the frames, of those examined, that show smoke, those with the most first.
    place
        Where in depth the smoke stands, found or given; None by the paper's method, with several cameras, or with one
        that travels where no distance is given.
    fire
        The input's view, its clip replaced by the light that fire adds; None without fire.
    """

    scene: CompleteScene
    optics: Optics
    views: tuple[ShotView, ...]
    settings: Settings
    findings: tuple[Finding, ...]
    qualities: Mapping[Quality, Grid]
    smoky: tuple[int, ...]
    place: AxisEstimate | None
    fire: ShotView | None

    @property
    def clip(self) -> Clip:
        """The input."""
        return self.views[0].clip

    @cached_property
    def found_background(self) -> Image | None:
        """Picture (rows, columns, 3) behind the smoke; None where the scene has it, or one per frame, or one color."""
        plate, background = self.views[0].plate, self.scene.background
        painted = background.strokes is not None
        if plate.images is not None or (background.image is not None and not painted):
            return None
        shown = plate if self.moves else uncovered(plate, self.clip)
        one_color = background.color is not None and not painted and (self.moves or self.clip.mask is None)
        return None if one_color else shown.image

    @property
    def inlets(self) -> tuple[Inlet, ...]:
        """Where smoke is known to enter."""
        return self.scene.inlets

    @property
    def moves(self) -> bool:
        """Whether the camera moves."""
        return self.scene.camera.moves

    @property
    def length(self) -> int:
        """Number of frames."""
        return len(self.clip)

    def spread(self, count: int) -> tuple[int, ...]:
        """Numbers of so many frames at most, from 0, spread evenly over the clip."""
        return tuple(self.clip.spread(count))

    def observe(self, frame: int) -> tuple[Observation, ...]:
        """What the cameras saw in a frame, from 0, the input's first; empty if it shows nothing of the domain."""
        seen = [view.observe(frame, self.optics.domain) for view in self.views]
        return tuple(observation for observation in seen if observation is not None)

    def observe_fire(self, frame: int) -> Observation | None:
        """What the input's camera saw of fire in a frame, from 0, in place of smoke; None without fire or domain."""
        return None if self.fire is None else self.fire.observe(frame, self.optics.domain)
