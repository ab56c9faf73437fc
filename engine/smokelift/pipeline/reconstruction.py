"""A clip's reconstruction: checked and prepared when it is made, computed when it is iterated over or written."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from smokelift.checks import require_kind
from smokelift.footage.clip import Clip
from smokelift.output.index import checksum, directory_path
from smokelift.output.sequence import Sequence
from smokelift.output.writer import SequenceWriter
from smokelift.pipeline.loop import CarriedState, Frame, Method, compose, frames_after, other_parts
from smokelift.report.facts import provenance
from smokelift.report.sentences import choices, part
from smokelift.scene import EnvironmentLight, Scene
from smokelift.setup.prepare import prepare_shot
from smokelift.setup.settings import Settings
from smokelift.setup.shot import Shot


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """What is to be reconstructed, and how. Its clip has to stay open while it is computed.

    Iterating over it yields a `Frame` for each of the clip's, in its order; every time anew.

    Attributes
    ----------
    shot
        The clip with everything about it decided.
    method
        The parts that compute it, as `compose` takes them from the shot's settings, or others for an experiment.
    """

    shot: Shot
    method: Method

    def __post_init__(self) -> None:
        """Refuse parts of another kind."""
        require_kind(self.shot, Shot, "shot", "a Shot (prepare_shot makes one)")
        require_kind(self.method, Method, "method", "a Method (compose makes one)")

    def __iter__(self) -> Iterator[Frame]:
        for frame, _ in frames_after(None, self.shot, self.method):
            yield frame
            del frame  # nothing holds it while the next is computed

    def write(
        self,
        directory: str | Path,
        *,
        npz: bool = False,
        resume: bool = False,
        start_number: int = 1,
        on_frame: Callable[[Frame], object] | None = None,
    ) -> Sequence:
        """Compute and write all frames, as the command line does.

        Parameters
        ----------
        directory
            For the sequence. It must be empty, or hold the same run unfinished with ``resume``.
        npz
            Write NumPy twins as well.
        resume
            Go on after the frames that are finished in the directory.
        start_number
            Number in the names of the first frame's files, 1001 for the clip's own, say. The frame itself stays 1.
        on_frame
            Is called with each frame once it is written, but not with those that were finished before. What it raises
            ends the run; the finished frames stay.

        Raises
        ------
        SequenceError
            If the directory cannot be written to or holds something else, or no file could be written because there is
            no OpenVDB module.
        ValueError
            If there can be no file with the start number.
        """
        shot = self.shot
        others = other_parts(self.method, shot.settings)
        directory = directory_path(directory)
        with SequenceWriter(
            directory,
            shot.scene,
            {**shot.settings.as_dict(), **({"parts": others} if others else {})},
            npz=npz,
            resume=resume,
            background=shot.found_background,
            start_number=start_number,
            choices=choices(shot.findings),
            provenance=[part(finding) for finding in provenance(shot)],
            sources=sources(shot),
        ) as writer:
            last = None if writer.state is None else CarriedState.read(writer.state, shot)
            rest = frames_after(last, shot, self.method) if last is not None or not writer.finished else iter(())
            # no name here holds a frame or its velocities while the next is computed: they take most of the memory
            del last
            for frame, carried in rest:
                writer.write(
                    frame.number,
                    frame.density,
                    frame.velocity.faces,
                    frame.figures,
                    flame=frame.flame,
                    state=carried.stored(),
                )
                if on_frame is not None:
                    on_frame(frame)
                del frame, carried
        return Sequence.open(directory)


def reconstruct(
    clip: Clip, scene: Scene, settings: Settings | None = None, *, method: Method | None = None
) -> Reconstruction:
    """Prepare the reconstruction of a clip: everything is checked and decided here, frames are computed later.

    Parameters
    ----------
    clip
        The footage; it has to stay open while frames are computed.
    scene
        Whatever is known of the shot; the rest is estimated (see `prepare_shot`).
    settings
        `Settings.preset` of a quality and a method; balanced by default.
    method
        Another composition than that of the settings, for an experiment.

    Returns
    -------
    Reconstruction
        Iterate over it for frames in memory, or `Reconstruction.write` a sequence.

    Raises
    ------
    ValueError
        For bad input (`SceneError` and `ClipError` are ValueErrors too).
    """
    require_kind(method, Method | None, "method", "a Method (compose makes one)")
    shot = prepare_shot(clip, scene, settings)
    return Reconstruction(shot, method or compose(shot.settings))


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
        picture = None if given is None else given.image
        files[f"{table}background"] = view.plate.files or (() if picture is None else (picture,))
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
