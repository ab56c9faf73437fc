"""The takes of a smoke: where they lie, how a new one is written, which can be resumed, deleted, and which is on show.

Several .blend files may keep their takes in one folder, since one is saved as another. Every take has a list of the
files that may show it, to which each of them adds itself when it is saved.
"""

from dataclasses import dataclass
from pathlib import Path

import bpy

from ..core import ShotError
from ..core.job import Job, engine_command
from ..core.take import Take, new_take, takes
from ..scene import shot_setup, volume
from ..scene.blender import absolute, file_of, preferred, relative, rpt_, thread_options
from ..scene.scene_file import options as engine_options
from ..scene.scene_file import shot_files, shot_tables
from ..scene.smoke import active_smoke, hide_default_cube, is_smoke, scene_of, separate_duplicate, smokes
from . import directing

_written_to: dict[int, tuple[str, Path]] = {}
"""Folders that this session wrote takes to, with their names, by the numbers of their smokes."""


@dataclass(eq=False)
class Run:
    """A run of this session in the panel, which is never saved."""

    take: Take  # what is made
    smoke: int  # number of its smoke
    job: Job  # the engine's process, which may wait
    shown: tuple[int, bool]  # how many frames of it are on show, and whether its end is
    settings: str = ""  # what it was begun with, until its forecast is taken for a check of that; empty without one
    first: bool = True  # whether nothing of it was shown yet
    before: Take | None = None  # what was on show when its first frame came
    seen: bool = False  # whether the playhead went to its first smoke
    left: bool = False  # whether the artist chose another result while it runs
    icon: int = 0  # of its thumbnail; 0 without one


runs: list[Run] = []  # the runs of this session, in the order of the queue


def output_folder(smoke: bpy.types.Object) -> Path:
    """The folder of a smoke's takes: the chosen one, its own, or one in that of the preferences, .blend or clip."""
    settings = smoke.smokelift
    if folder := settings.output or settings.results:
        return absolute(folder)
    if common := preferred("output"):  # a folder in which every smoke has one
        return absolute(common) / settings.folder
    if bpy.data.filepath:
        return Path(bpy.data.filepath).parent / "smokelift" / settings.folder
    return file_of(settings.clip).parent / f"{settings.folder}_smokelift"


def own_takes(smoke: bpy.types.Object) -> list[Take]:
    """The takes in a smoke's folder that this file shows or made, or that no file is known of; the oldest first."""
    here, shown, before = _names_of_file(smoke), volume.directories_on_show(), volume.take_before(smoke)

    def belongs(take: Take) -> bool:
        files = take.read().files
        if files is None or take == before or take.directory.resolve() in shown:
            return True
        return bool(files & here) or not any(file.is_file() for file in files)

    return [take for take in takes(output_folder(smoke)) if belongs(take)]


def _foreign_files(smoke: bpy.types.Object, take: Take) -> list[Path] | None:
    """Other .blend files that may show a take; None where that is unknown."""
    files = take.read().files
    return None if files is None else sorted(files - _names_of_file(smoke))


def _names_of_file(smoke: bpy.types.Object) -> set[Path]:
    """The open .blend, and what it was called when it was saved: it may have been copied or renamed."""
    return {Path(file).resolve() for file in (bpy.data.filepath, smoke.smokelift.saved_as) if file}


def takes_of_file() -> list[Take]:
    """All takes that belong to this file, those of other files that it links included."""
    with_clip = [obj for obj in bpy.data.objects if is_smoke(obj) and obj.smokelift.clip is not None]
    own = [take for obj in with_clip for take in own_takes(obj)]
    return [*own, *map(Take, volume.directories_on_show())]


def write_take(smoke: bpy.types.Object) -> Take:
    """Write the files of a new take; ShotError if the shot is unusable, or the folder cannot be written to."""
    tables = shot_tables(smoke)
    take = _next_take(smoke)
    if smoke.smokelift.drawn_mask is not None:
        tables["clip"]["mask"] = take.copy_mask(Path(tables["clip"]["mask"]))
    number = smoke.smokelift.start_number
    take.write(tables, [*engine_options(smoke), *([f"--start-number={number}"] if number != 1 else [])])
    _note_file(take)
    return take


def write_directed(smoke: bpy.types.Object) -> Take:
    """Write the files of a new take that is made of the one on show; ShotError if something is in the way."""
    source = volume.shown_take(smoke)
    if source is None:
        raise ShotError("Make smoke first: there is none yet to direct.")
    if busy(source):
        raise ShotError("The result on show is still being made: wait for its end, or cancel it.")
    direction, options, meshes = directing.engine_request(smoke)
    take = _next_take(smoke)
    take.write_directed(direction, source, options, meshes)
    _note_file(take, source)
    return take


def _next_take(smoke: bpy.types.Object) -> Take:
    """The next free take, in a folder that the smoke keeps; it takes the place of runs that ended without a frame."""
    separate_duplicate(smoke)
    folder, in_use = output_folder(smoke), directories_in_use()
    for take in own_takes(smoke):
        if take.log_file.is_file() and not take.read().frames and take.directory.resolve() not in in_use:
            take.remove()
    if not smoke.smokelift.output:
        smoke.smokelift.results = relative(folder)
        _written_to[smoke.session_uid] = smoke.smokelift.folder, folder
    return new_take(folder)


def move_results(smoke: bpy.types.Object, folder: Path) -> None:
    """Show the result on show from the folder that its files were moved to, which holds all of the smoke's from now on.

    The folder may be the result itself. ShotError if that is not there.
    """
    settings, name = smoke.smokelift, volume.shown_take(smoke).directory.name
    take = Take(folder if folder.name == name else folder / name)
    if not take.read().frames:
        raise ShotError(rpt_("There is no {:s} in {:s}: choose the folder that holds it.").format(name, str(folder)))
    before = Path(settings.before).name
    volume.show(smoke, take)
    setattr(settings, "output" if settings.output else "results", relative(take.directory.parent))
    settings.before = relative(take.directory.with_name(before)) if before else ""


def find_results_again(smoke: bpy.types.Object) -> None:
    """Have a smoke know the folder of its results where an undo took that back: the results themselves stay."""
    name, folder = _written_to.get(smoke.session_uid, ("", None))
    if folder is not None and name == smoke.smokelift.folder and not smoke.smokelift.results:
        smoke.smokelift.results = relative(folder)


def _note_file(*used: Take) -> None:
    """Keep in mind that the open .blend may show these takes; one that was never saved does so when it is."""
    if bpy.data.filepath:
        for take in used:
            take.note_file(Path(bpy.data.filepath))


def engine_job(smoke: bpy.types.Object, take: Take) -> Job:
    """The engine's process that makes or resumes a take; ShotError if that cannot be."""
    words = engine_command(take.arguments() + thread_options())
    return Job(words, take.log_file, volume.frames_before(smoke, take), take.read().frames)


def update_moved_files(smoke: bpy.types.Object, take: Take) -> None:
    """Write today's paths into a resumed take's scene file, if the project was moved; ShotError if it is damaged."""
    if take.read().direction is None:
        take.update_moved_files(shot_files(smoke))


def unfinished(smoke: bpy.types.Object) -> Take | None:
    """The take that can be resumed: the one on show, else the newest."""
    if smoke.smokelift.clip is None:
        return None
    newest = own_takes(smoke)[-1:]
    candidates = [take for take in (volume.shown_take(smoke), *newest) if take is not None]
    return next((take for take in candidates if take.read().resumable), None)


def present(smoke: bpy.types.Object, take: Take) -> str:
    """Show a take's finished frames, and the camera that was assumed; returns a sentence on what else has changed."""
    now, first = take.read(), volume.shown_take(smoke) is None
    if not volume.show(smoke, take):
        return ""
    assumed = shot_setup.assumed_camera(smoke) is not None
    if now.complete or now.direction is None:  # how long a directed one becomes is not known before
        shot_setup.follow_range(smoke)
    hidden = first and assumed and hide_default_cube(scene_of(smoke))
    return rpt_("The cube of the new file is hidden: it stands where the smoke does.") if hidden else ""


def choose(smoke: bpy.types.Object, take: Take) -> None:
    """Show the take that the artist chose; a run that goes on does not take it back."""
    present(smoke, take)
    for run in runs:
        if run.smoke == smoke.session_uid and run.job.outcome == "running":
            run.left = run.take != take


def show_while_made(smoke: bpy.types.Object, run: Run) -> str:
    """Show the frames of a run while it is made, unless the artist has chosen another result meanwhile; as `present`.

    What was on show before is shown again if the run fails or is stopped. An undo may bring it back, too.
    """
    if run.left or volume.shown_take(smoke) not in (run.before, run.take):
        return ""
    stopped = run.job.outcome in ("failed", "cancelled")
    return present(smoke, run.before if stopped and run.before is not None else run.take)


def busy(take: Take) -> bool:
    """Whether a take runs or waits."""
    return any(run.take == take and not run.job.ended for run in runs)


def earlier_takes(context: bpy.types.Context) -> list[Take]:
    """The results of this file before the one on show that nothing needs: no Volume, no run, no other result or file.

    What an earlier version of the add-on made stays too, since nothing says which files show it.
    """
    smoke = active_smoke(context.scene)
    own, shown, in_use = own_takes(smoke), volume.shown_take(smoke), directories_in_use()
    earlier = own[: own.index(shown)] if shown in own else []
    removable = [
        take for take in earlier if take.directory.resolve() not in in_use and _foreign_files(smoke, take) == []
    ]
    while True:  # what is made of a result that goes needs nothing
        needed = {source for take in _known_takes() if take not in removable and (source := take.read().source)}
        if not needed.intersection(removable):
            return removable
        removable = [take for take in removable if take not in needed]


def consequences(context: bpy.types.Context, take: Take) -> list[str]:
    """What the loss of a result would mean for other results and files, a sentence each."""
    said = []
    made = [other.read().title for other in _known_takes() if other.read().source == take]
    if made:
        said.append(rpt_("Made of it: {:s}.").format(", ".join(made)))
    files = _foreign_files(active_smoke(context.scene), take)
    if files is None:
        said.append(rpt_("An earlier version of Smokelift made it: other files may show it."))
    elif files:
        said.append(rpt_("It may be shown by {:s}.").format(", ".join(file.name for file in files)))
    return said


def _known_takes() -> list[Take]:
    """All results in the folders of the file's smokes, also those of other files."""
    found = [smoke for scene in bpy.data.scenes for smoke in smokes(scene) if smoke.smokelift.clip is not None]
    folders = {output_folder(smoke) for smoke in found}
    return [take for folder in folders for take in takes(folder)]


def directories_in_use() -> set[Path]:
    """Directories of the takes that Volumes of this file show or that runs write; a link may lead to the same one."""
    queued = {run.take for run in runs if not run.job.ended}
    read = {source for take in queued if (source := take.read().source) is not None}
    return volume.directories_on_show() | {take.directory.resolve() for take in queued | read}
