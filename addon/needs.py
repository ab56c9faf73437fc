"""What a button needs before it can be pressed, and what it says where that is missing."""

import bpy

from . import volume
from .smoke import active_smoke


class NeedsClip:
    """For operators that read the clip."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        smoke = active_smoke(context.scene)
        if smoke is None or smoke.smokelift.clip is None:
            cls.poll_message_set("Choose a clip first")
            return False
        return True


class NeedsResult:
    """For operators that do something with the result on show."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        smoke = active_smoke(context.scene)
        if smoke is None or volume.shown_take(smoke) is None:
            cls.poll_message_set("Make smoke first")
            return False
        return True


class NeedsClipAndResult(NeedsClip, NeedsResult):
    """For operators that bring the two together."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and super(NeedsClip, cls).poll(context)
