"""How settings are declared: Blender's properties, as ``number(name, limits)(tooltip)``."""

from collections.abc import Callable
from typing import Any

from bpy import props

from ..core.contract import SIDES

Declared = Callable[..., Any]  # makes a property of its tooltip


def _named(kind: Callable[..., Any]) -> Callable[..., Declared]:
    return lambda name, **options: lambda description: kind(name=name, description=description, **options)


tick, number, whole, string, vector = map(
    _named,
    (props.BoolProperty, props.FloatProperty, props.IntProperty, props.StringProperty, props.FloatVectorProperty),
)
"""Something that is on or off, a number, a whole number, a text, and several numbers such as a color."""


def choice(name: str, **options: Any) -> Declared:
    """One of some items, which follow the tooltip; by default the first."""
    return lambda tip, *items: props.EnumProperty(name=name, description=tip, items=items, **options)


def link(name: str, kind: type, **options: Any) -> Declared:
    """A data-block of a kind."""
    return _named(props.PointerProperty)(name, type=kind, **options)


def automatic_unless(name: str, label: str, start: float | Callable[[Any], float]) -> Any:
    """A tick for a number that is automatic where it is 0 and begins with ``start``; it keeps nothing of its own."""
    return tick(
        label,
        get=lambda settings: getattr(settings, name) > 0,
        set=lambda settings, on: setattr(settings, name, (start(settings) if callable(start) else start) if on else 0),
    )(f"Choose {label} by hand; otherwise it is automatic")


def closed_sides(description: str) -> Any:
    """A row of buttons, one for each side of the box."""
    items = [(side, f"{side[1]}{side[0].upper()}", "", 1 << place) for place, side in enumerate(SIDES)]
    return choice("Closed Sides", options={"ANIMATABLE", "ENUM_FLAG"})(description, *items)
