"""Modifiers of a smoke whose node group reads a second Volume, which is in no collection."""

from collections.abc import Callable
from dataclasses import dataclass

import bpy

from .nodes import get_input, own_group, set_input


@dataclass(frozen=True)
class SecondVolume:
    """A kind of modifier, of which a smoke has one or none.

    Attributes
    ----------
    name
        Of the modifier; the name of the second Volume ends in `socket`.
    mark
        Custom property by which its node group is known under any name.
    socket
        Input of the group that is the second Volume's object.
    new_group
        Makes a new node group with that mark.
    """

    name: str
    mark: str
    socket: str
    new_group: Callable[[], bpy.types.NodeTree]

    def modifier(self, smoke: bpy.types.Object) -> bpy.types.Modifier | None:
        """The modifier of a smoke."""
        groups = ((each, each.node_group) for each in smoke.modifiers if each.type == "NODES")
        return next((modifier for modifier, group in groups if group is not None and group.get(self.mark)), None)

    def volume(self, smoke: bpy.types.Object) -> bpy.types.Volume | None:
        """The second Volume of a smoke."""
        modifier = self.modifier(smoke)
        obj = get_input(modifier, self.socket) if modifier is not None else None
        return obj.data if obj is not None else None

    def add(self, smoke: bpy.types.Object) -> bpy.types.Modifier:
        """Give a smoke the modifier unless it has it, with a Volume of its own that has the smoke's materials."""
        modifier = self.modifier(smoke)
        if modifier is None:
            modifier = smoke.modifiers.new(self.name, "NODES")
            modifier.node_group = own_group(self.mark) or self.new_group()
            smoke.modifiers.move(len(smoke.modifiers) - 1, 0)  # those of the artist act on what it makes
        obj = get_input(modifier, self.socket)
        if obj is None or obj.users > 1:  # that of the smoke that this one is a duplicate of
            obj = bpy.data.objects.new(f"{smoke.name} {self.socket}", smoke.data.copy())
            set_input(modifier, self.socket, obj)
        if list(obj.data.materials) != list(smoke.data.materials):
            obj.data.materials.clear()
            for material in smoke.data.materials:
                obj.data.materials.append(material)
        return modifier

    def remove(self, smoke: bpy.types.Object) -> None:
        """Take the modifier and its Volume away."""
        modifier = self.modifier(smoke)
        if modifier is None:
            return
        obj = get_input(modifier, self.socket)
        set_input(modifier, self.socket, None)  # Blender 5.2 would go on counting it as used
        smoke.modifiers.remove(modifier)
        if obj is not None and obj.users == 0:  # else it is that of a duplicate, too
            bpy.data.volumes.remove(obj.data)  # takes the object with it
