"""What knows nothing of Blender: the files of a run, the engine's process and its messages, what is repeated of it."""


class ShotError(ValueError):
    """A setting, a file or the engine is in the way of what was asked for; says in one sentence what to do."""
