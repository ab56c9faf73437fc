"""What stands behind the smoke of a clip, and how it is decided.

The first of these that applies: what an alpha channel says; what the scene gives, a color as it goes on beside the mask
(`given_background`); the color around the smoke, of a single picture; one color, if the whole file makes it the
likeliest; the picture that the clear frames show (`clean_plate`); black, if they show next to nothing. If the camera
moves before a picture, the frames are registered (`camera_motion`), or the clip is refused; one color is the same
wherever it points. Noise is measured on what cannot be smoke (`noise`). Strokes of the scene change what was found
(`stroked`); an alpha channel leaves nothing for them to say.

The likeliest of one color and a picture: a block of the picture is clear, and shows its background within the noise, or
it is smoke, and shows anything. Smoke goes on as it was, or jumps to any value. The cost of a background is the
negative logarithm of the blocks' probability in their likeliest states (Viterbi, "Error bounds for convolutional
codes", 1967). One color stands behind all blocks but a few objects. A picture has its own color in each block, which
costs as much as a jump: all colors are equally likely in either. A frame that is black everywhere says nothing against
a picture, since clips fade. All frames of the file up to the next cut decide, whatever part of it is used.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from smokelift.checks import Mask
from smokelift.extraction.camera_motion import MOVING_CAMERA, CameraMotion, Texture, find_motion, motion_before
from smokelift.extraction.clean_plate import CleanPlate, clean_plate, spread_out, whole_plate
from smokelift.extraction.given_background import (
    PAINTED,
    Strokes,
    continued_color,
    mean_of_frames,
    read_background,
    stroked,
)
from smokelift.extraction.plate import Plate, cleared, finest_detail, known_plate, uncovered, without_noise_light
from smokelift.extraction.proxy import PROXY_SIDE, Proxy
from smokelift.footage.clip import Clip
from smokelift.footage.images import (
    DETAIL,
    Picture,
    area_average,
    blurred,
    channel_mean,
    continuation_errors,
    linear_to_srgb,
    reduced_size,
    srgb_to_linear,
)
from smokelift.footage.noise import (
    EIGHT_BIT_STEP,
    Noise,
    lasting_noise,
    median_of_seen,
    noise_block_means,
    noise_of,
    spread_about,
)
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

BackgroundKind = Literal["alpha", "given", "color", "color around one frame", "black for want of a picture", "picture"]

BLOCKS = 64
"""Blocks along the longer side: means over so many pixels that white noise is gone."""

MAX_DEVIATION = 3.0
"""Standard deviations of noise up to which a block shows its background."""

MAX_LASTING_NOISE = np.float32(2 / 255)
"""Largest lasting noise of blocks, in sRGB values: H.264 at crf 45 has less than half of it
(docs/experiments/background.md)."""

STAY_PROBABILITY, SWITCH_PROBABILITY = 0.98, 0.03
"""Probabilities, from one examined frame to the next, that smoke stays as it is, and that a block becomes clear or
smoke. Jumps rank the backgrounds; these only break ties."""

OBJECT = 0.1
"""Probability that a block is an object before one color (a nozzle, a floor, a logo), and largest fraction of such
blocks. Public clips before one color have up to .02 (docs/clips.md)."""

MIN_SHOWN_FRACTION = 0.25
"""Smallest fraction of the blocks that must show the one color at some time."""

MIN_UNCHANGED_FRACTION = 0.9
"""Smallest fraction of the frames in which an object is within half of the limit of its median: smoke wavers more."""

MIN_SEEN_FRACTION = 0.99
"""Smallest fraction of a block that no mask hides."""

CANDIDATES = 4
"""Number of the commonest colors that are tried."""

MIN_BLACK_FRACTION = 0.98
"""Fraction of black blocks from which on a frame counts as black everywhere."""

CLEAR_FRAMES = 8
"""Frames that the clearest view of each pixel is taken from."""

DETAIL_QUANTILE, MAX_MIST_DETAIL = 0.99, np.float32(15 / 255)
"""Quantile of the detail before black, and the most that mist has there, in sRGB values. 26 clips of smoke have 1 to 13
of 255, walls and stages in the dark 17 to 40 (docs/experiments/background.md)."""

MAX_SIDE_DIFFERENCE, MIN_SIDE_FRACTION = np.float32(2 / 255), 0.5
"""Difference in sRGB values up to which a block has the color around a single picture, and fraction of such blocks
needed along each of three sides. 18 frames of public clips before one color have 0.56 to 1, others 0.2 at most, but for
stages in the dark (docs/experiments/background.md)."""


@dataclass(frozen=True, eq=False)
class FoundBackground:
    """What stands behind the smoke of a clip."""

    kind: BackgroundKind
    """What it is, and where it comes from."""
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
    """First and last of these in the file, or of the clip's and those that are named; None where it is of no frames."""
    cut: tuple[int, int] | None = None
    """Frames of the file before and after a cut within the clip, if there is one."""
    strokes: Strokes | None = None
    """What was painted over a frame, if that was used."""
    motion: CameraMotion | None = None
    """The motion of the camera by which the clip's frames are registered, if it moves."""

    def uncut_clip(self, clip: Clip) -> Clip:
        """Return the part of a clip's file that the background was taken from."""
        return clip if self.uncut_span is None else clip.part(*self.uncut_span)


def find_background(clip: Clip, camera: Camera | None, background: Background | None) -> FoundBackground:
    """Find what stands behind the smoke of a clip, given what the scene says of it.

    ClipError or ImageError is raised if a frame or a picture cannot be read, ValueError if the camera moves, other
    than a similarity of the picture mends, and the background is neither given for every frame nor of one color, or
    strokes are given.
    """
    of_alpha = None if clip.alpha_background is None else Background(color=(clip.alpha_background,) * 3)
    said, moves = of_alpha or background or Background(), camera is not None and camera.moves
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
        if said.color is not None and of_alpha is None and clip.mask is not None and not moves:
            continued = continued_color(np.array(said.color, np.float32), clip)
            if continued is not None:
                given, filmed = continued, True

        def known(clip: Clip) -> tuple[Plate, Clip]:
            return known_plate(mean_of_frames(frames, clip) if frames else given, clip, filmed=filmed)

        plate, shown = known(clip)
        if of_alpha is not None:  # no camera filmed the color that alpha leaves open
            plate, shown = replace(plate, image=np.full_like(plate.image, clip.alpha_background)), clip
        quiet = clip if of_alpha is not None else without_noise_light(clip, plate.noise)
        if quiet is not clip:
            # the noise stays that of the filmed pictures: in the others, mean sRGB values are too low
            noise, (plate, shown) = plate.noise, known(quiet)
            plate = replace(plate, noise=noise)
        if said.color is None:
            # one that many frames show has lost as much detail to the codec as they have; one color has none
            plate = replace(plate, finest=finest_detail(clip))
        # turns find what is behind smoke in the frames that are named, too
        span = (min(*frames, clip.numbers[0]), max(*frames, clip.numbers[-1])) if frames else None
        found = FoundBackground("alpha" if of_alpha else "given", shown, plate, said, uncut_span=span, motion=motion)
    plate = uncovered(found.plate, found.clip) if found.kind == "picture" else found.plate
    found = replace(found, clip=cleared(found.clip, plate), plate=plate)
    if strokes is None:
        return found
    if moves or plate.images is not None:
        raise ValueError(
            "Strokes are painted over one frame, but what is behind the smoke changes from frame to frame. Leave them "
            "out, or stabilize the clip and give one picture as background."
        )
    one_color = said.estimated and found.kind != "picture"
    # a picture was found with what is painted as smoke; a color or a clean plate is given for what is behind it, but a
    # frame of the clip may hold smoke
    behind = found.kind == "picture" or said.color is not None or said.image is not None
    left = replace(strokes, smoke=np.zeros_like(strokes.smoke)) if behind else strokes
    plate, clip = stroked(left, plate, found.clip, one_color)
    return replace(found, clip=clip, plate=plate, background=said, strokes=strokes)


def _on_plate(clip: Clip, plate: Picture | Clip | None) -> tuple[Clip, CameraMotion | None]:
    """A clip, registered to a given picture if it does not lie on it, and the motion by which."""
    if plate is None or isinstance(plate, Clip) or plate.ndim == 1:
        return clip, None
    texture = Texture(area_average(plate, *reduced_size(*clip.size, PROXY_SIDE)))
    motion = motion_before(texture, Proxy.of(clip, beyond=False)) if texture.enough else None
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
    found = _likeliest(part, white)
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
        if shaken is not None:
            return _estimated(filmed.registered(shaken.at), moves, smoke, shaken)
    kind: BackgroundKind = "color"
    if color is None:
        # what a mask hides is no smoke: where it never changes, it is background
        shown, kind = part.with_unchanged(), "picture"
        plate = _picture(clip, shown, white, smoke)
        if plate.confidence.mean() < MIN_KNOWN * shown.seen.any(0).mean():
            # fog drifts over all of the file: treat it as filmed before black
            color, objects, kind = np.zeros(3, np.float32), np.zeros_like(objects), "black for want of a picture"
    if color is not None:
        plate = _of_one_color(clip, part, color, objects, white)
    span = part.numbers[0], part.numbers[-1]
    return FoundBackground(kind, clip.exposed(plate.gain), plate, None, len(part.numbers), span, cut, motion=motion)


def _picture(clip: Clip, proxy: Proxy, white: Picture, smoke: Mask | None) -> Plate:
    """The plate that the clear frames show; ``smoke`` (rows, columns) was painted."""
    rows, columns = proxy.seen.shape[1:]
    painted = None if smoke is None else area_average(smoke, columns, rows) >= PAINTED
    noise = proxy.noise_about(median_of_seen(proxy.pictures), white)
    picture = clean_plate(proxy, noise, painted)
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
        clear[:, objects] = _within(proxy.encoded[:, objects] - linear_to_srgb(own), limit)
        known = np.ones(objects.shape, np.bool_)
        picture = whole_plate(
            clip, proxy, CleanPlate(image, known, clear, known.astype(np.float32), np.zeros_like(image))
        )
        whole = np.where(spread_out(objects, clip.size)[..., None], picture, whole)
    return Plate(whole, np.ones(clip.size[::-1], np.float32), noise)


@dataclass(frozen=True, eq=False)
class _Hypothesis:
    """A background: one linear color (3,), or a picture if ``color`` is None.

    ``cost`` is the negative logarithm of the frames' probability before it, on the mean over blocks. ``objects`` (rows,
    columns) are the proxy's pixels where something hides the color all the time. ``clear`` is the fraction of all
    blocks and frames that show the color.
    """

    cost: float
    color: Picture | None
    objects: Mask
    clear: float


def _likeliest(proxy: Proxy, white: Picture) -> _Hypothesis:
    """Return the likeliest background of frames of one exposure; ``white`` (3,) is their pixels' noise."""
    values, visible = _blocks(proxy)
    rows, columns = proxy.seen.shape[1:]
    limit = _limit(values, white * np.float32(np.sqrt(visible.size / (rows * columns)) / proxy.scale))
    jump = -float(np.log(2 * limit.mean()))
    goes_on = _goes_on(values, limit, jump)
    empty = _within(values, limit)
    empty = empty & (empty.mean(1) > MIN_BLACK_FRACTION)[:, None]
    picture = np.full(values.shape[1], np.inf)
    for value in values:
        picture = np.minimum(picture, _cost(_within(values - value, limit) | empty, goes_on, jump))
    table = [_Hypothesis(float(picture.mean()) + jump, None, np.zeros((rows, columns), np.bool_), 0.0)]
    unchanged = _within(values - median_of_seen(values), limit / 2).mean(0) >= MIN_UNCHANGED_FRACTION
    for candidate in _candidates(values, limit):
        clear = _within(values - candidate, limit)
        shows = clear.any(0)
        cost, own = _cost(clear, goes_on, jump), picture + jump
        stands = ~shows & (own < cost)
        if candidate.max() <= EIGHT_BIT_STEP and not _sharp(proxy, white):
            stands[:] = False
        if stands.mean() > OBJECT or shows.mean() < MIN_SHOWN_FRACTION:
            continue
        cost = np.where(stands, np.minimum(own - np.log(OBJECT), cost), cost)
        # smoke of one brightness moves a color to one side only
        brighter = float((values[~clear].mean(-1) > candidate.mean()).mean()) if not clear.all() else 0.0
        sides = -sum(part * np.log(max(part, 1e-6)) for part in (brighter, 1 - brighter))
        color = srgb_to_linear(values[clear].mean(0, dtype=np.float64))
        color[linear_to_srgb(color) < EIGHT_BIT_STEP / 2] = 0
        objects = np.zeros_like(visible)
        objects[visible] = stands & unchanged
        total = float(cost.mean()) + sides * float((~clear).sum(0).mean())
        table.append(_Hypothesis(total, color, spread_out(objects, (columns, rows)), float(clear.mean())))
    return min(table, key=lambda each: each.cost)


def color_around(picture: Picture) -> tuple[float, float, float] | None:
    """Return the linear color along the sides of a single picture (rows, columns, 3), or None if they have several.

    One picture does not show what never changes, so all that has another color may be smoke. Smoke may enter from one
    side, and cover more of the picture than its background does.
    """
    linear = noise_block_means(picture[None])[0]
    blocks = linear_to_srgb(linear)
    sides = [(values[0], values[-1], values[:, 0], values[:, -1]) for values in (blocks, linear)]
    color = np.median(np.concatenate(sides[0]), axis=0)
    alike = [(np.abs(side - color) <= MAX_SIDE_DIFFERENCE).all(-1) for side in sides[0]]
    if sum(side.mean() >= MIN_SIDE_FRACTION for side in alike) < 3:
        return None
    red, green, blue = map(float, np.median(np.concatenate(sides[1])[np.concatenate(alike)], axis=0))
    return red, green, blue


def _goes_on(values: Picture, limit: Picture, jump: float) -> Picture:
    """The cost of smoke going on from one frame to the next (frames - 1, blocks), at most that of a jump.

    Smoke stays within the noise, or its change is exponentially distributed with the clip's own mean.
    """
    changes = np.diff(values, axis=0)
    alike = _within(changes, np.float32(np.sqrt(2)) * limit)
    size = np.abs(changes).mean(-1)
    usual = float(size[~alike].mean()) if not alike.all() else 1.0
    change = np.log(max(usual / float(limit.mean()), 1)) + size / usual
    return np.asarray(np.where(alike, -np.log(STAY_PROBABILITY), np.minimum(change, jump)), np.float32)


def _cost(clear: Mask, goes_on: Picture, jump: float) -> Picture:
    """The cost of blocks (n,) in their likeliest states, where ``clear`` (frames, n) says which may be clear."""
    switch, leave = -np.log(SWITCH_PROBABILITY), -np.log(1 - SWITCH_PROBABILITY)
    is_clear, is_smoke = np.where(clear[0], 0, np.inf), np.full(clear.shape[1], jump)
    for now, going in zip(clear[1:], goes_on, strict=True):
        before = is_clear
        is_clear = np.where(now, np.minimum(is_clear + leave, is_smoke + switch), np.inf)
        is_smoke = np.minimum(is_smoke + leave, before + switch) + going
    return np.asarray(np.minimum(is_clear, is_smoke), np.float32)


def _blocks(proxy: Proxy) -> tuple[Picture, Mask]:
    """The colors (frames, n, 3) of blocks, in sRGB values, and which of all (rows, columns) those n are.

    No mask hides them in any frame; if there are none, one frame at least shows them.
    """
    rows, columns = proxy.seen.shape[1:]
    size = reduced_size(columns, rows, BLOCKS)
    seen = np.stack([area_average(shown, *size) > MIN_SEEN_FRACTION for shown in proxy.seen])
    visible = seen.all(0) if seen.all(0).any() else seen.any(0)
    values = [linear_to_srgb(area_average(picture, *size))[visible] for picture in proxy.pictures]
    return np.stack(values), visible


def _limit(values: Picture, white: Picture) -> Picture:
    """Largest deviation (3,) at which a block still shows the value that most of its frames agree on."""
    limit = np.asarray(MAX_DEVIATION * np.hypot(white, EIGHT_BIT_STEP), np.float32)
    most, usual = np.zeros(values.shape[1]), values[0].copy()
    for value in values:
        count = _within(values - value, limit).sum(0)
        more = count > most
        most[more], usual[more] = count[more], value[more]
    near = _within(values - usual, limit)[..., None]
    usual = np.where(near, values, 0).sum(0) / near.sum(0)
    spread = spread_about(values - usual, np.hypot(MAX_LASTING_NOISE, white).max())
    return np.asarray(MAX_DEVIATION * np.maximum(spread, np.hypot(white, EIGHT_BIT_STEP)), np.float32)


def _candidates(values: Picture, limit: Picture) -> list[Picture]:
    """Black, and the commonest colors of all blocks."""
    left = values.reshape(-1, 3)
    found = [np.zeros(3, np.float32)]
    while len(left) and len(found) <= CANDIDATES:
        cells = np.floor(left / (2 * limit)).astype(np.int64) @ np.array([1, 1 << 20, 1 << 40])
        _, which, counts = np.unique(cells, return_inverse=True, return_counts=True)
        color = np.median(left[which == counts.argmax()], axis=0)
        for _ in range(3):  # mean shift settles it
            near = _within(left - color, limit)
            color = left[near].mean(0) if near.any() else color
        found.append(color)
        left = left[~_within(left - color, 2 * limit)]
    return found


def _sharp(proxy: Proxy, white: Picture) -> bool:
    """Whether the clearest view of the picture has edges: objects before black do, mist does not."""
    # smoke brightens black; one frame may be astray
    some = proxy.pictures[:: -(-len(proxy.pictures) // CLEAR_FRAMES)]
    clearest = np.sort([channel_mean(linear_to_srgb(picture)) for picture in some], axis=0)[min(1, len(some) - 1)]
    detail = np.abs(clearest - blurred(clearest, DETAIL))[proxy.seen.any(0)]
    return bool(
        np.quantile(detail, DETAIL_QUANTILE) > MAX_MIST_DETAIL + MAX_DEVIATION * float(white.max()) / proxy.scale
    )


def _within(deviations: Picture, limit: Picture) -> Mask:
    """Return where deviations (..., 3) are within a limit (3,)."""
    red, green, blue = (np.abs(deviations[..., channel]) <= limit[channel] for channel in range(3))
    return np.asarray(red & green & blue)
