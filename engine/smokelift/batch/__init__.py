"""Many shots: a list of clips, each reconstructed by a process of its own, on one machine or on many.

What is finished is on the storage and nowhere else, so every part of a batch may be ended and started again.
"""

from smokelift.batch.cluster import run_on_cluster
from smokelift.batch.local import Room, run_here
from smokelift.batch.record import Frames, Record, ShotState, finished_frames, read_record, read_state
from smokelift.batch.report import write_report
from smokelift.batch.schedule import Remaining, duration, remaining_work
from smokelift.batch.shots import BatchShot, read_shots
from smokelift.batch.work import finish_shot, look_at_shot

__all__ = [
    "BatchShot",
    "Frames",
    "Record",
    "Remaining",
    "Room",
    "ShotState",
    "duration",
    "finish_shot",
    "finished_frames",
    "look_at_shot",
    "read_record",
    "read_shots",
    "read_state",
    "remaining_work",
    "run_here",
    "run_on_cluster",
    "write_report",
]
