"""How the camera turned in each frame of a clip, and whether it did at all.

Every frame is laid on a key frame (`smokelift.footage.alignment`), the first on the clip's middle one. Where too little
of the key frame is left in the picture, the last frame that was laid becomes the next key.

A camera moves if some frames show the same as the key only once they are turned. For a still camera the turn that is
found is zero up to noise, so as much is the same with it as without it, however much smoke there is. The smoke's own
motion is no turn, because smoke does not keep its shape from the middle of a clip to its ends. A camera that moves,
but does not turn in its place, is refused (`smokelift.footage.parallax`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from smokelift.footage.alignment import Lens, align, judged, levels, points_of, shift
from smokelift.footage.clip import Clip
from smokelift.footage.parallax import travels
from smokelift.scene import Camera, as_matrix

HELD = 0.5
"""Share of the cells with texture that have to show the same in most frames: less is no rigid background."""

MOVED = 0.5
"""Frames in which at most this share of the same is the same without a turn show that the camera moved."""

MOVING_FRAMES = 0.1
"""Share of the frames that have to: a knock is not worth a mosaic."""

LEAST = 1.0
"""Pixels that the picture has to be off its mean place in some frame: less blurs it no more than a lens does."""

IN_KEY = 0.6
"""Share of the key frame's points that have to be in a picture that is laid on it."""


@dataclass(frozen=True, eq=False)
class Turns:
    """How a camera turned about its centre.

    Attributes
    ----------
    lens
        Of the frames.
    rotations
        Turn directions of each frame into those of the camera's mean pose; x right, y down, z forward.
    """

    lens: Lens
    rotations: Rotation

    @property
    def farthest(self) -> float:
        """Pixels by which the middle or a corner of the picture is off its mean place, at most."""
        width, height = self.lens.size
        places = np.array([self.lens.centre, (0, 0), (width, 0), (0, height), (width, height)])
        rays = self.lens.rays(places)
        seen = np.stack([self.lens.pixels(turn.apply(rays)) for turn in self.rotations])
        return float(np.linalg.norm(seen - places, axis=-1).max())

    def carried(self, camera: Camera) -> Camera:
        """Return a camera that stands in the mean pose with a matrix for every frame."""
        axes = np.diag([1.0, -1.0, -1.0])  # a camera's y is up, and it looks along -z
        matrices = []
        for turn in self.rotations.as_matrix():
            matrix = np.array(camera.matrix)
            matrix[:3, :3] = matrix[:3, :3] @ axes @ turn @ axes
            matrices.append(as_matrix(matrix))
        return replace(camera, matrix=matrices[0], matrices=tuple(matrices))


def find_turns(clip: Clip, lens: Lens) -> Turns | None:
    """Find how the camera of a clip turned; None if it stood still or if nothing in the picture tells.

    Parameters
    ----------
    clip
        The footage.
    lens
        Of its frames.

    Raises
    ------
    ClipError
        If a frame cannot be read.
    ValueError
        If the camera travels or zooms.
    """
    middle = len(clip) // 2
    ahead, back = range(middle + 1, len(clip)), range(middle - 1, -1, -1)
    found = _followed(clip, lens, middle, ahead) | _followed(clip, lens, middle, back)
    if not found:
        return None
    if np.median([each.same for each in found.values()]) < HELD:
        if travels(clip, lens, {number for number, each in found.items() if each.same < HELD}):
            raise ValueError(
                "The camera travels or zooms, so near and far move unlike each other and no turn steadies the clip; "
                "track it in Blender, and give its matrices in [camera] and what is behind the smoke in [background]."
            )
        return None
    if np.mean([each.as_it_stands <= MOVED * each.same for each in found.values()]) < MOVING_FRAMES:
        return None
    found[middle] = _Found(Rotation.identity(), 1.0, 1.0)
    rotations = Rotation.concatenate([found[number].turn for number in range(len(clip))])
    turns = Turns(lens, rotations.mean().inv() * rotations)
    return turns if turns.farthest >= LEAST else None


@dataclass(frozen=True, eq=False)
class _Found:
    """How a frame lies on the clip's middle one.

    Attributes
    ----------
    turn
        Of its directions into those of the middle frame.
    same, as_it_stands
        Share of the cells that show the same once it is turned, and as it stands.
    """

    turn: Rotation
    same: float
    as_it_stands: float


def _followed(clip: Clip, lens: Lens, middle: int, numbers: Iterable[int]) -> dict[int, _Found]:
    """Lay frames that follow one another on the middle frame, or on those that succeed it as the key."""
    found: dict[int, _Found] = {}
    before = levels(clip.frame(middle), lens)
    key = first = points_of(before)
    of_key = onto = Rotation.identity()  # the key into the middle frame; the key into the frame before
    for number in numbers:
        picture = levels(clip.frame(number), lens)
        lain = align(key, picture, onto)
        if lain.same < HELD:  # it may have moved too far to be found from where the one before was
            lain = max(lain, align(key[-2:], picture[-2:], shift(before, picture) * onto), key=lambda each: each.same)
        if lain.shared < IN_KEY:
            key, of_key = points_of(before), of_key * onto.inv()
            lain = align(key, picture, Rotation.identity())
        onto, before = lain.turn, picture
        stands = judged(first[-1], picture[-1], Rotation.identity())
        found[number] = _Found(of_key * onto.inv(), lain.same, stands.same)
    return found
