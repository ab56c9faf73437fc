"""How the camera turned in each frame of a clip, and whether it did at all.

Every frame is laid on a key frame (`smokelift.footage.alignment`), the first on the clip's middle one. Where too little
of the key frame is left in the picture, the last frame that was laid becomes the next key.

A camera moves if some frames show the same as the key only once they are turned. For a still camera the turn that is
found is zero up to noise, so as much is the same with it as without it, however much smoke there is. The smoke's own
motion is no turn, because smoke does not keep its shape from the middle of a clip to its ends. A camera that moves,
but does not turn in its place, is refused (`smokelift.footage.parallax`).

Most cameras stand still, and a few frames prove it: where as much as can be the same is the same as it stands, no turn
is looked for.

What the rest of the file shows around a clip is followed from its first and last frame, until the shot ends.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from smokelift.footage.alignment import Lens, align, judged, level_size, levels, points_of, shift
from smokelift.footage.clip import Clip, ClipError
from smokelift.footage.images import Picture
from smokelift.footage.parallax import travels
from smokelift.scene import Camera, as_matrix

HELD = 0.5
"""Share of the cells with texture that have to show the same in most frames: less is no rigid background."""

MOVED = 0.5
"""Frames in which at most this share of the same is the same without a turn show that the camera moved."""

MOVING_FRAMES = 0.1
"""Share of the frames that have to: a knock is not worth a mosaic."""

FIRST_FRAMES = 12
"""Frames that are examined first: less than `MOVING_FRAMES` of a clip lie between two of them."""

MIN_OFFSET = 1.0
"""Pixels that the picture has to be off its mean place in some frame: less blurs it no more than a lens does."""

IN_KEY = 0.6
"""Share of the key frame's points that have to be in a picture that is laid on it."""

BEYOND = 24
"""Frames of the file before a clip, and as many after it, that are examined: the 32 of a plate are chosen of them."""


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


def find_turns(clip: Clip, *lenses: Lens) -> Turns | None:
    """Find how the camera of a clip turned; None if it stood still or if nothing in the picture tells.

    Parameters
    ----------
    clip
        The footage.
    lenses
        Of its frames; of several that it may be, the first with which turns explain them is taken.

    Raises
    ------
    ClipError
        If a frame cannot be read.
    ValueError
        If the camera travels or zooms.
    """
    if len(clip) == 1 or _stands_still(clip, lenses[0]):
        return None
    middle = len(clip) // 2
    ahead, back = range(middle + 1, len(clip)), range(middle - 1, -1, -1)
    for lens in lenses:
        found = dict(_followed(clip, lens, middle, ahead)) | dict(_followed(clip, lens, middle, back))
        if np.median([each.same for each in found.values()]) >= HELD:
            break
    else:
        if travels(clip, lens, {number for number, each in found.items() if each.same < HELD}):
            raise ValueError(
                "The camera travels or zooms, so near and far move unlike each other and no turn steadies the clip; "
                "track it in Blender, and give its camera and a clean plate."
            )
        return None
    if np.mean([each.as_it_stands <= MOVED * each.same for each in found.values()]) < MOVING_FRAMES:
        return None
    found[middle] = _Found(Rotation.identity(), 1.0, 1.0)
    rotations = Rotation.concatenate([found[number].turn for number in range(len(clip))])
    turns = Turns(lens, rotations.mean().inv() * rotations)
    return turns if turns.farthest >= MIN_OFFSET else None


def file_turns(clip: Clip, turns: Turns) -> dict[int, Rotation]:
    """Return how the camera turned in frames of a clip's file, by their numbers in it.

    The clip's own are among them. Others are taken before and after it for as long as they show what it does, at which
    the camera may look from anywhere in front of it.

    Parameters
    ----------
    clip
        The footage.
    turns
        Of its frames. The others' are into the same mean pose.
    """
    whole, first, last = clip.whole(), clip.first, clip.first + len(clip) - 1
    found = {first + number: turn for number, turn in enumerate(turns.rotations)}
    width, height = turns.lens.size
    corners = turns.lens.rays(np.array([[0, 0], [width, 0], [0, height], [width, height]], np.float64))
    sides = ((last, range(last + 1, len(whole))), (first, range(first - 1, -1, -1)))
    for start, numbers in sides:
        apart = -(-len(numbers) // BEYOND) or 1
        with suppress(ClipError):  # what cannot be read ends the shot
            for number, each in _followed(whole, turns.lens, start, numbers[::apart]):
                turn = found[start] * each.turn
                if each.same < HELD or (turn.apply(corners)[:, 2] <= 0).any():
                    break
                found[number] = turn
    return found


def _stands_still(clip: Clip, lens: Lens) -> bool:
    """Whether none of the frames that are examined shows more of the same once it is turned."""
    numbers = clip.spread(FIRST_FRAMES)

    def seen(number: int) -> Picture:
        return clip.area_average(number, *level_size(lens))

    key = levels(seen(numbers.pop(len(numbers) // 2)), lens)
    first, same = points_of(key), []
    for number in numbers:
        picture = seen(number)
        stands = judged(first[-1], levels(picture, lens, 1)[0], Rotation.identity()).same
        # a turn cannot make so much of more than all
        same.append(stands if stands > MOVED else align(first, levels(picture, lens), Rotation.identity()).same)
        if stands <= MOVED * same[-1]:
            return False
    return bool(np.median(same) >= HELD) if same else False


@dataclass(frozen=True, eq=False)
class _Found:
    """How a frame lies on the one from which it was followed, the clip's middle one mostly.

    Attributes
    ----------
    turn
        Of its directions into those of that frame.
    same, as_it_stands
        Share of the cells that show the same once it is turned, and as it stands.
    """

    turn: Rotation
    same: float
    as_it_stands: float


def _followed(clip: Clip, lens: Lens, start: int, numbers: Iterable[int]) -> Iterator[tuple[int, _Found]]:
    """Lay frames that follow one another on that from which they start, or on those that succeed it as the key."""
    before = levels(clip.frame(start), lens)
    key = first = points_of(before)
    of_key = onto = Rotation.identity()  # the key into the first one; the key into the frame before
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
        yield number, _Found(of_key * onto.inv(), lain.same, stands.same)
