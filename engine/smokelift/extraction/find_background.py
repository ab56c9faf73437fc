"""What stands behind the smoke of a clip, and how it is decided.

The first of these that applies: what an alpha channel says; what the scene gives, a color as it goes on beside the mask
(`given_background`); one color, if the whole file makes it the likeliest (`background_kind`); the picture that the
clear frames show (`clear_picture`); black, if they show next to nothing. If the camera moves before a picture, the
frames are registered (`camera_motion`), or the clip is refused; one color is the same wherever it points. The clip's
noise is measured first, on what cannot be smoke (`noise`). Strokes of the scene change what was found (`strokes`); an
alpha channel leaves nothing for them to say.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from smokelift.checks import Mask
from smokelift.extraction.background_kind import MAX_DEVIATION, color_around, likeliest_background, within
from smokelift.extraction.camera_motion import CameraMotion, Texture, find_motion, motion_before
from smokelift.extraction.clear_picture import ClearPicture, clear_picture, spread_out, whole_plate
from smokelift.extraction.given_background import continued_color, mean_of_frames, read_background
from smokelift.extraction.plate import Plate, cleared, finest_detail, known_plate, uncovered, without_noise_light
from smokelift.extraction.proxy import PROXY_SIDE, Proxy
from smokelift.extraction.strokes import PAINTED, Strokes, stroked
from smokelift.footage.clip import Clip
from smokelift.footage.images import Picture, area_average, linear_to_srgb, reduced_size
from smokelift.footage.inpainting import continuation_errors
from smokelift.footage.noise import EIGHT_BIT_STEP, Noise, lasting_noise, median_of_seen, noise_of, spread_about
from smokelift.scene import Background, Camera

MOSTLY = 0.5
"""Mean fraction of the picture in one color from which on that color is no texture that passes by."""

MIN_KNOWN = 0.1
"""Smallest fraction of what no mask hides that must be seen clear: public clips before a picture show .2 and more
(docs/clips.md)."""

SEEN_OFTEN = 0.15
"""Fraction of the blocks of all frames in one color from which on that color is no texture that passes by. Public clips
have .2 and more, two walls before a moving camera .05 and .12 (docs/experiments/turning-camera.md)."""

TEXTURE = np.float32(6 / 255)
"""White noise, in sRGB values, above which it is texture that a moving camera sees."""

MOVING_CAMERA = (
    "The camera moves, so what is behind the smoke cannot be found from the clip. Stabilize the clip (Blender's Movie "
    "Clip Editor does), or track it and give a clean plate with a picture for every frame (a video or plate_####.png) "
    "as background. If the camera stood still, give one clean plate, or a color."
)
"""Message that refuses a clip."""

Source = Literal["alpha", "given", "color", "color around one frame", "black for want of a picture", "picture"]


@dataclass(frozen=True, eq=False)
class FoundBackground:
    """What stands behind the smoke of a clip."""

    source: Source
    """Where it comes from."""
    clip: Clip
    """The footage at its plate's exposure, without the light that noise adds, with the plate in place of what a mask
    hides and of what is painted as no smoke."""
    plate: Plate
    """What is behind it, at full size."""
    background: Background | None = None
    """The background as a scene gives it, with its strokes; None where it was estimated from the clip alone, unless the
    camera is known to move."""
    frames: int = 0
    """Number of the file's frames, up to the next cut, that it was estimated from."""
    uncut_span: tuple[int, int] | None = None
    """First and last of these in the file; None where it was not estimated from frames."""
    cut: tuple[int, int] | None = None
    """Frames of the file before and after a cut within the clip, if there is one."""
    strokes: Strokes | None = None
    """What was painted over a frame, if that was used."""
    motion: CameraMotion | None = None
    """The motion of the camera by which the clip's frames are registered, if it moves."""

    def uncut_clip(self, clip: Clip) -> Clip:
        """Return the part of a clip's file that the background was estimated from."""
        return clip if self.uncut_span is None else clip.part(*self.uncut_span)


def find_background(clip: Clip, camera: Camera | None, background: Background | None) -> FoundBackground:
    """Find what stands behind the smoke of a clip, given what the scene says of it.

    ClipError or ImageError is raised if a frame or a picture cannot be read, ValueError if the camera moves, other
    than a similarity of the picture mends, and the background is neither given for every frame nor of one color, or
    strokes are given.
    """
    gray = None if clip.alpha_background is None else Background(color=(clip.alpha_background,) * 3)
    said, moves = gray or background or Background(), camera is not None and camera.moves
    frames = said.frame
    if moves and frames:
        raise ValueError(MOVING_CAMERA)
    strokes = None if said.strokes is None else Strokes.read(said.strokes, clip.size)
    given = mean_of_frames(frames[:1], clip) if frames else read_background(said, camera)
    clip, motion = _on_plate(clip, given)
    if given is None:
        found = _estimated(clip, moves, None if strokes is None else strokes.smoke)
    else:
        filmed = bool(frames)
        if said.color is not None and gray is None and clip.mask is not None and not moves:
            continued = continued_color(np.array(said.color, np.float32), clip)
            if continued is not None:
                given, filmed = continued, True

        def known(clip: Clip) -> tuple[Plate, Clip]:
            return known_plate(mean_of_frames(frames, clip) if frames else given, clip, filmed=filmed)

        plate, shown = known(clip)
        quiet = without_noise_light(clip, plate.noise)
        if quiet is not clip:
            # the noise stays that of the filmed pictures: in the others, mean sRGB values are too low
            noise, (plate, shown) = plate.noise, known(quiet)
            plate = replace(plate, noise=noise)
        if said.color is None:
            # one that many frames show has lost as much detail to the codec as they have; one color has none
            plate = replace(plate, finest=finest_detail(clip))
        found = FoundBackground("alpha" if gray else "given", shown, plate, said, motion=motion)
    plate = uncovered(found.plate, found.clip) if found.source == "picture" else found.plate
    found = replace(found, clip=cleared(found.clip, plate), plate=plate)
    if strokes is None:
        return found
    if moves or plate.images is not None:
        raise ValueError(
            "Strokes are painted over one frame, but what is behind the smoke changes from frame to frame. Leave them "
            "out, or stabilize the clip and give one picture as background."
        )
    one_color = said.estimated and found.source != "picture"
    # a picture was found with what is painted as smoke, and a color is given for what is behind it
    behind = found.source == "picture" or said.color is not None
    left = replace(strokes, smoke=np.zeros_like(strokes.smoke)) if behind else strokes
    plate, clip = stroked(left, plate, found.clip, one_color)
    return replace(found, clip=clip, plate=plate, background=said, strokes=strokes)


def _on_plate(clip: Clip, plate: Picture | Clip | None) -> tuple[Clip, CameraMotion | None]:
    """A clip, registered to a given picture if it does not lie on it, and the motion by which."""
    if plate is None or isinstance(plate, Clip) or plate.ndim == 1:
        return clip, None
    texture = Texture(area_average(plate, *reduced_size(*clip.size, PROXY_SIDE)))
    motion = motion_before(texture, Proxy.of(clip, beyond=False)) if texture.enough else None
    if motion == "other":
        raise ValueError(
            "The clean plate does not lie on the clip: what both show is in other places, and no shift, rotation or "
            "zoom mends that. Give a plate that the clip's camera filmed from the same place, or frames of the clip "
            "without smoke."
        )
    return (clip, None) if motion is None else (clip.registered(motion.at), motion)


def _estimated(clip: Clip, moves: bool, smoke: Mask | None, motion: CameraMotion | None = None) -> FoundBackground:
    """The background of a clip when none is given; ``smoke`` (rows, columns) was painted over one of its frames.

    ``motion`` is that by which the frames are registered.
    """
    filmed = clip
    if len(clip) == len(clip.whole()) == 1 and (around := color_around(clip.frame(0))) is not None:
        plate, clip = known_plate(around, clip)
        return FoundBackground("color around one frame", clip, plate, frames=1)
    proxy = Proxy.of(clip)
    white = proxy.white_noise()
    quiet = without_noise_light(clip, Noise(white, lasting_noise(EIGHT_BIT_STEP).lasting))
    if quiet is not clip:
        clip, proxy = quiet, Proxy.of(quiet)
    part, cut = proxy.shot(clip)
    part = part.evened
    found = likeliest_background(part, white)
    color, objects = found.color, found.objects
    if moves:
        passes_by = found.clear < MOSTLY or white.max() > TEXTURE
        if color is None or objects.any() or passes_by:
            raise ValueError(MOVING_CAMERA)
        red, green, blue = map(float, color)
        plate, clip = known_plate(color, clip)
        return FoundBackground("color", clip, plate, Background(color=(red, green, blue)), len(proxy.numbers))
    # black, or a color seen often, is the same wherever the camera points; any other may be texture that passes by
    often = found.clear > SEEN_OFTEN and white.max() <= TEXTURE
    plain = color is not None and (often or not color.any())
    if not plain and motion is None:
        shaken = find_motion(proxy.with_own(part))
        if shaken == "other":
            raise ValueError(MOVING_CAMERA)
        if shaken is not None:
            return _estimated(filmed.registered(shaken.at), moves, smoke, shaken)
    source: Source = "color"
    if color is None:
        # what a mask hides is no smoke: where it never changes, it is background
        shown, source = part.with_still(), "picture"
        plate = _picture(clip, shown, white, smoke)
        if plate.confidence.mean() < MIN_KNOWN * shown.seen.any(0).mean():
            # fog drifts over all of the file: treat it as filmed before black
            color, objects, source = np.zeros(3, np.float32), np.zeros_like(objects), "black for want of a picture"
    if color is not None:
        plate = _of_one_color(clip, part, color, objects, white)
    span = part.numbers[0], part.numbers[-1]
    return FoundBackground(source, clip.exposed(plate.gain), plate, None, len(part.numbers), span, cut, motion=motion)


def _picture(clip: Clip, proxy: Proxy, white: Picture, smoke: Mask | None) -> Plate:
    """The plate that the clear frames show; ``smoke`` (rows, columns) was painted."""
    rows, columns = proxy.seen.shape[1:]
    painted = None if smoke is None else area_average(smoke, columns, rows) >= PAINTED
    noise = proxy.noise_about(median_of_seen(proxy.pictures), white)
    picture = clear_picture(proxy, noise, painted)
    known = spread_out(picture.known, clip.size).astype(np.float32)
    image, noise = whole_plate(clip, proxy, picture), proxy.noise_about(picture.image, white)
    return Plate(image, known, noise, continuation_errors(picture.image, picture.known))


def _of_one_color(clip: Clip, proxy: Proxy, color: Picture, objects: Mask, white: Picture) -> Plate:
    """The plate of one color with the objects before it."""
    image = np.tile(color, (*objects.shape, 1))
    deviations = proxy.deviations(image)
    # smoke moves a color to one side: deviations to the other side are noise alone
    sides = (np.where(beyond, np.float32(np.nan), deviations) for beyond in (deviations > 0, deviations < 0))
    noise = noise_of(white, np.minimum(*map(spread_about, sides)), proxy.scale**2)
    whole = np.tile(color, (*clip.size[::-1], 1))
    if objects.any():
        own = np.median(proxy.pictures[:, objects], axis=0)
        image[objects] = own
        clear = np.zeros(proxy.seen.shape, np.bool_)
        limit = MAX_DEVIATION * noise.averaged(proxy.scale**2).total
        clear[:, objects] = within(proxy.encoded[:, objects] - linear_to_srgb(own), limit)
        known = np.ones(objects.shape, np.bool_)
        picture = whole_plate(
            clip, proxy, ClearPicture(image, known, clear, known.astype(np.float32), np.zeros_like(image))
        )
        whole = np.where(spread_out(objects, clip.size)[..., None], picture, whole)
    return Plate(whole, np.ones(clip.size[::-1], np.float32), noise)
