"""How settings are declared: Blender's properties, of which name and description come first."""

from collections.abc import Callable
from typing import Any

from bpy import props

from ..core.contract import SIDES


def _named(kind: Callable[..., Any]) -> Callable[..., Any]:
    return lambda name, description, **options: kind(name=name, description=description, **options)


tick, number, whole, string, vector = map(
    _named,
    (props.BoolProperty, props.FloatProperty, props.IntProperty, props.StringProperty, props.FloatVectorProperty),
)
"""Something that is on or off, a number, a whole number, a text, and several numbers such as a color."""


def choice(name: str, description: str, *items: tuple[Any, ...], **options: Any) -> Any:
    """One of some items, by default the first."""
    return props.EnumProperty(name=name, description=description, items=items, **options)


def link(name: str, description: str, kind: type, **options: Any) -> Any:
    """A data-block of a kind."""
    return props.PointerProperty(name=name, description=description, type=kind, **options)


def automatic_unless(name: str, label: str, start: float | Callable[[Any], float]) -> Any:
    """A tick for a number that is chosen automatically where it is 0; ticked, the number begins with ``start``.

    It keeps nothing of its own, so it cannot contradict the number.
    """
    return tick(
        label,
        f"Choose {label} by hand; otherwise it is automatic",
        get=lambda settings: getattr(settings, name) > 0,
        set=lambda settings, on: setattr(settings, name, (start(settings) if callable(start) else start) if on else 0),
    )


def closed_sides(description: str) -> Any:
    """A row of buttons, one for each side of the box."""
    items = [(side, f"{side[1]}{side[0].upper()}", "", 1 << place) for place, side in enumerate(SIDES)]
    return choice("Closed Sides", description, *items, options={"ANIMATABLE", "ENUM_FLAG"})
