"""Clips of baked smoke before known backgrounds, as a camera would spoil them."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np
import numpy.typing as npt
from av.video.reformatter import Interpolation
from scipy import ndimage

from smokelift.checks import Finding
from smokelift.footage.clip import Clip
from smokelift.footage.frame_source import StoredPicture
from smokelift.footage.images import Picture, linear_to_srgb, srgb_to_linear

FPS = 24.0
BRIGHT = 0.75
"""Linear radiance of a bright sky."""

EXACT = int(Interpolation.BICUBIC) | int(Interpolation.ACCURATE_RND) | int(Interpolation.FULL_CHR_H_INT)
"""How FFmpeg converts colours without a shift: by default red, green and blue end up 1 to 2 codes of 8 bit too dark."""

COLUMN = 0.12
"""Width of smoke that never leaves its pixels, as a share of the picture's."""


@dataclass(frozen=True, eq=False)
class Smoke:
    """Smoke as a camera sees it.

    Attributes
    ----------
    radiance, transmittance : (frames, rows, columns)
        Of the smoke alone.
    """

    radiance: Picture
    transmittance: Picture

    @staticmethod
    def load(folder: Path, view: str = "front") -> Smoke:
        """Read what `benchmarks.truth.picture` wrote."""
        with np.load(folder / f"{view}.npz") as file:
            return Smoke(file["image"].astype(np.float32), file["transmittance"].astype(np.float32))

    def thinned(self, share: float) -> Smoke:
        """The smoke with a share of its optical depth; the source radiance of every pixel stays."""
        clear = np.clip(self.transmittance, 1e-6, 1) ** share
        return Smoke(self.radiance * (1 - clear) / np.maximum(1 - self.transmittance, 1e-6), clear)

    def darkened(self) -> Smoke:
        """Smoke that scatters a tenth of the light."""
        return Smoke(0.1 * self.radiance, self.transmittance)

    def standing(self) -> Smoke:
        """Return the smoke with a column from the floor to the top that wavers and never goes away.

        It is as bright as the smoke's brightest and lets a tenth to a half of the light through.
        """
        frames, rows, columns = self.radiance.shape
        across = (np.arange(columns) - columns / 2) / (0.5 * COLUMN * columns)
        shape = np.clip(1.5 - np.abs(across), 0, 1)
        y = np.arange(rows)[:, None] / rows
        times = np.arange(frames)[:, None, None]
        waver = np.sin(25 * y + 3 * across - 0.9 * times) + np.sin(11 * y - 2 * across - 0.47 * times + 1)
        column = np.exp(-shape * (1.25 + 0.3 * waver)).astype(np.float32)
        bright = np.float32(np.quantile(self.radiance[self.transmittance < 0.9], 0.95))
        return Smoke(self.radiance * column + bright * (1 - column), self.transmittance * column)

    def misty(self) -> Smoke:
        """Return the smoke with mist over two thirds of the picture that hardly moves and never goes away.

        It is a third as bright as the smoke's brightest, lets a half of the light through at least, and drifts by the
        picture's width in 600 frames.
        """
        frames, rows, columns = self.radiance.shape
        noise = np.random.default_rng(7).standard_normal((rows, columns))
        billows = np.zeros((rows, columns))
        for part in (8, 16, 32):  # parts of the width along a billow
            field = ndimage.gaussian_filter(noise, columns / part, mode="wrap")
            billows += field / field.std() / part
        billows /= billows.std()
        height = 1 - np.arange(rows)[:, None] / rows
        depth = np.clip(1 - height / 0.67, 0, 1) ** 2 * (3 - 2 * np.clip(1 - height / 0.67, 0, 1))
        drift = columns / 600 * np.arange(frames)
        opacity = np.stack([depth * np.clip(0.35 + 0.07 * np.roll(billows, round(x), 1), 0, 0.5) for x in drift])
        bright = np.float32(np.quantile(self.radiance[self.transmittance < 0.9], 0.95))
        clear = (1 - opacity).astype(np.float32)
        return Smoke(self.radiance * clear + bright * (1 - clear), self.transmittance * clear)

    def before(self, plate: Picture) -> Picture:
        """Linear pictures (frames, rows, columns, 3) before a plate (rows, columns, 3)."""
        return self.radiance[..., None] + self.transmittance[..., None] * plate


@dataclass(frozen=True, eq=False)
class Case:
    """A clip with what is known of it.

    Attributes
    ----------
    clip
        As it was filmed.
    plate : (rows, columns, 3)
        The true background, linear.
    clean : (frames, rows, columns, 3)
        The true pictures, linear.
    given
        Whether the background is given.
    """

    clip: Clip
    plate: Picture
    clean: Picture
    given: bool


class Frames:
    """Frames in memory; a `smokelift.footage.frame_source.FrameSource`."""

    warning: Finding | None = None
    lens: float | None = None
    backdrop: float | None = None
    fps = FPS
    files: tuple[Path, ...] = ()
    notes: tuple[Finding, ...] = ()

    def __init__(self, codes: npt.NDArray[np.uint8]) -> None:
        self.codes, self.count = codes, len(codes)

    def read(self, n: int) -> StoredPicture:
        """Return a frame, linear."""
        return StoredPicture(srgb_to_linear(self.codes[n].astype(np.float32) / np.float32(255)))

    def damaged(self, first: int, last: int) -> tuple[int, ...]:
        """None."""
        return ()

    def close(self) -> None:
        """Nothing is open."""


def filmed(encoded: Picture, name: str) -> Clip:
    """The clip of sRGB pictures (frames, rows, columns, 3) at eight bits."""
    return Clip(Path(name), Frames(eight_bits(encoded)), FPS, None)


def eight_bits(encoded: Picture) -> npt.NDArray[np.uint8]:
    """Rounded to what a file holds."""
    return np.clip(encoded * 255 + 0.5, 0, 255).astype(np.uint8)


def compressed(encoded: Picture, crf: int) -> Picture:
    """What is left of sRGB pictures after H.264."""
    file = io.BytesIO()
    with av.open(file, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=24, options={"crf": str(crf)})
        stream.height, stream.width = encoded.shape[1:3]
        stream.pix_fmt = "yuv420p"
        for picture in eight_bits(encoded):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, "rgb24")))
        container.mux(stream.encode())
    file.seek(0)
    with av.open(file, "r") as coded:
        shown = [frame.reformat(format="rgb24", interpolation=EXACT) for frame in coded.decode(video=0)]
        pictures = [frame.to_ndarray() for frame in shown]
    return np.stack(pictures).astype(np.float32) / np.float32(255)


def noisy(encoded: Picture, share: float) -> Picture:
    """Return a clip with white noise of a share of the range."""
    noise = np.random.default_rng(0).standard_normal(encoded.shape, np.float32)
    return encoded + np.float32(share) * noise


def exposed(linear: Picture, gains: npt.ArrayLike) -> Picture:
    """Linear pictures in sRGB, each with a gain of its own, or one a channel."""
    gain = np.asarray(gains, np.float32)
    return linear_to_srgb(linear * gain.reshape(len(linear), 1, 1, -1))


def steps(count: int) -> npt.NDArray[np.float64]:
    """Gains of an exposure that steps up by a quarter, down by a third, and back."""
    return np.repeat([1.0, 1.25, 0.67, 1.0], -(-count // 4))[:count]


def drift(count: int) -> npt.NDArray[np.float64]:
    """Gains of an exposure that drifts by a quarter and of a white balance that goes with it."""
    along = np.linspace(0, 1, count)
    return np.stack([1 + 0.25 * along, 1 + 0.1 * along, 1 - 0.1 * along], 1)


def flash(count: int) -> npt.NDArray[np.float64]:
    """Gains of a clip with one frame three times as bright."""
    gains = np.ones(count)
    gains[count // 2] = 3
    return gains


def backdrop(shape: tuple[int, int], colour: float | tuple[float, float, float]) -> Picture:
    """One colour everywhere, (rows, columns, 3)."""
    return np.broadcast_to(np.asarray(colour, np.float32), (*shape, 3)).copy()


def sky(shape: tuple[int, int]) -> Picture:
    """A bright sky that darkens upwards, with clouds, (rows, columns, 3)."""
    clouds = np.random.default_rng(1).standard_normal(shape)
    clouds = ndimage.gaussian_filter(clouds, (4, 10))
    up = np.linspace(0.75, 1, shape[0])[:, None]
    grey = BRIGHT * np.clip(up * (1 + 0.08 * clouds / clouds.std()), 0, 1.3)
    return np.asarray(grey[..., None] * np.array([0.85, 0.95, 1.1]), np.float32)


def wall(shape: tuple[int, int]) -> Picture:
    """Bricks in uneven light, from dark to middling, (rows, columns, 3)."""
    random = np.random.default_rng(3)
    y, x = np.mgrid[: shape[0], : shape[1]]
    row = y // 16
    brick = (x + 18 * (row % 2)) // 36
    tone = random.uniform(0.6, 1.3, (row.max() + 1, brick.max() + 1))[row, brick]
    joint = (y % 16 < 2) | ((x + 18 * (row % 2)) % 36 < 2)
    grain = ndimage.gaussian_filter(random.standard_normal(shape), 1)
    light = ndimage.gaussian_filter(random.standard_normal(shape), 60)
    grey = np.where(joint, 1.6, tone) * (1 + 0.15 * grain / grain.std()) * (1 + 0.2 * light / light.std())
    return np.asarray(0.12 * np.clip(grey, 0.05, 4)[..., None] * np.array([1.2, 0.95, 0.8]), np.float32)


def cases(smoke: Smoke) -> dict[str, Callable[[], Case]]:
    """All cases by name, each made when it is asked for."""
    count, rows, columns = smoke.radiance.shape
    black, painted = backdrop((rows, columns), 0), wall((rows, columns))
    grey, green = backdrop((rows, columns), 0.18), backdrop((rows, columns), (0.05, 0.4, 0.08))
    column, dark, one = smoke.standing(), smoke.darkened(), np.ones(count)
    mist = Smoke(0.15 * column.radiance, 1 - 0.15 * (1 - column.transmittance))

    def made(
        plate: Picture,
        of: Smoke = smoke,
        gains: npt.ArrayLike = one,
        spoil: Callable[[Picture], Picture] = lambda encoded: encoded,
        given: bool = False,
        part: slice = slice(None),
    ) -> Callable[[], Case]:
        def case() -> Case:
            clean = of.before(plate)[part]
            encoded = np.clip(exposed(clean, np.asarray(gains)[part]), 0, 1)
            return Case(filmed(spoil(encoded), "baked"), plate, clean, given)

        return case

    noises = {f"noise {share:.0%}": (lambda x, s=share: noisy(x, s)) for share in (0.02, 0.05, 0.1)}
    rates = {f"crf {crf}": (lambda x, c=crf: compressed(x, c)) for crf in (20, 32, 45)}
    found = {
        "wall, given": made(painted, given=True),
        "wall": made(painted),
        "wall, 12 frames": made(painted, part=slice(14, 26)),
        "wall, column": made(painted, column),
        "wall, flash": made(painted, gains=flash(count)),
        "wall, flash, given": made(painted, gains=flash(count), given=True),
        "wall, steps": made(painted, gains=steps(count)),
        "wall, steps, given": made(painted, gains=steps(count), given=True),
        "wall, drift": made(painted, gains=drift(count)),
    }
    found |= {f"wall, {name}": made(painted, spoil=spoil) for name, spoil in (noises | rates).items()}
    found |= {f"wall, {name}, given": made(painted, spoil=spoil, given=True) for name, spoil in noises.items()}
    found |= {
        "black": made(black),
        "black, 12 frames": made(black, part=slice(14, 26)),
        "black, column": made(black, column),
        "black, mist": made(black, mist),
        "black, mist everywhere": made(black, smoke.misty()),
        "black, flash": made(black, gains=flash(count)),
        "black, noise 2%": made(black, spoil=noises["noise 2%"]),
        "black, noise 10%": made(black, spoil=noises["noise 10%"]),
        "black, crf 45": made(black, spoil=rates["crf 45"]),
        "grey, column": made(grey, column),
        "green, column": made(green, column),
        "sky, dark": made(sky((rows, columns)), dark),
        "sky, dark column": made(sky((rows, columns)), dark.standing()),
        "white, dark column": made(backdrop((rows, columns), 0.9), column.darkened()),
        "both ways": made(np.where(np.arange(columns)[:, None] < columns // 2, 0.02, 0.8) * np.ones_like(black), smoke),
    }
    return found
