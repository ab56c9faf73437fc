"""Many shots: a list of clips, each reconstructed by a process of its own, on one machine or on many.

What is finished is on the storage and nowhere else, so every part of a batch may be ended and started again.
"""

from smokelift.batch.cluster import run_on_cluster
from smokelift.batch.local import Room, run_here
from smokelift.batch.plan import Expected, duration, expected
from smokelift.batch.record import Frames, Record, finished_frames, is_finished, read_record
from smokelift.batch.report import write_report
from smokelift.batch.shots import Shot, read_shots
from smokelift.batch.work import finish_shot, look_at_shot

__all__ = [
    "Expected",
    "Frames",
    "Record",
    "Room",
    "Shot",
    "duration",
    "expected",
    "finish_shot",
    "finished_frames",
    "is_finished",
    "look_at_shot",
    "read_record",
    "read_shots",
    "run_here",
    "run_on_cluster",
    "write_report",
]
