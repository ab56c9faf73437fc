"""How the command ends: its exit statuses, and the signal that ends it."""

from types import FrameType

DONE, BAD_INPUT, NO_DEVICE, CANCELLED = 0, 2, 3, 130
"""Exit statuses; a run that was cancelled can be resumed."""


class Termination:
    """SIGTERM from a parent, which means the same as Ctrl-C on a terminal.

    Attributes
    ----------
    came
        Whether it did: a library may turn the interrupt into an error of its own.
    """

    came = False

    @classmethod
    def handle(cls, _number: int, _frame: FrameType | None) -> None:
        """Interrupt the program."""
        cls.came = True
        raise KeyboardInterrupt
