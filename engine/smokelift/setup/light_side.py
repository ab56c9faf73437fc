"""From which side of the picture the light comes.

One view does not tell where a sun stands: how far it shines from before or behind the smoke is lost with the depth of
the smoke. From which side it shines in the picture's plane is seen, since smoke is brighter towards its sun. Where the
texture of the background tells how much smoke each part of a picture shows, a round body of that much smoke is lit from
directions all around. Each explains what the smoke adds as a sun from there and light from everywhere. The direction in
the picture's plane is their mean, weighted by how little each leaves. Figures: docs/experiments/light-direction.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.sparse import diags, identity, kron
from scipy.sparse.linalg import spsolve

from smokelift.render import Renderer
from smokelift.scene import Camera, DirectionalLight, Domain, Medium
from smokelift.setup.choice import Choice
from smokelift.setup.sphere import spread
from smokelift.setup.sun_and_rest import explained
from smokelift.setup.thickness import BlockMaps, Texture

Array = NDArray[np.float64]

DIRECTIONS = 64
"""Directions that light is tried from, spread evenly: neighbours are 25 degrees apart."""

SHOWN = 0.08
"""Optical depth from which a block is part of the smoke's outline."""

FORGIVEN = 0.1
"""Share by which a direction may leave more than the best one, for 1/e of its weight. What is left is mostly the
error of the round shape, which is the same from all sides."""

SIDEWAYS = 0.6
"""Part of the mean direction at least that lies in the picture's plane. The mean is short where directions from many
sides explain the smoke alike, and points along the line of sight where the light does."""

SUN = 0.5
"""Share of the light at least that is a sun's. Light from everywhere alone looks like a faint sun from anywhere."""

FRAMES = 8
"""Frames that are looked at."""

KNOWN = 0.5
"""Share of a frame's smoke at least whose background has texture."""

FEWEST = 3
"""Frames with smoke at least."""

SIDES = ("right", "upper right", "top", "upper left", "left", "lower left", "bottom", "lower right")
"""Names of angles, 45 degrees from one to the next."""


@dataclass(frozen=True)
class LightSide:
    """What is known of the side from which the light comes.

    Attributes
    ----------
    angle
        Of the direction towards the light in the picture's plane: degrees from the right, over the top of the picture.
    sideways
        Length of the mean direction in that plane, 0 to 1 (`SIDEWAYS`).
    sun
        Share of the light that comes from there, 0 to 1 (`SUN`).
    """

    angle: float
    sideways: float
    sun: float

    @property
    def told(self) -> bool:
        """Whether the angle is right to 20 degrees in nine of ten clips."""
        return self.sideways >= SIDEWAYS and self.sun >= SUN

    @property
    def choice(self) -> Choice[str]:
        """The same in words."""
        angle = round(self.angle) % 360
        name = SIDES[round(angle / 45) % 8]
        return Choice(
            "light side",
            f"{angle}",
            f"Light side: light comes from the {name} of the picture, {angle} degrees from its right over its top, "
            "give or take 20; how far from before or behind the smoke is undetermined.",
            {"angle": self.angle, "sideways": self.sideways, "sun": self.sun},
            SIDEWAYS,
        )


def light_side(frames: Sequence[Texture]) -> LightSide | None:
    """Find the side of the picture from which the light comes.

    Parameters
    ----------
    frames
        What frames of one still camera show of the texture behind the smoke.

    Returns
    -------
    side
        None where too little smoke is seen before texture.
    """
    maps = [frame.maps for frame in sorted(frames, key=lambda frame: -frame.hidden) if frame.smoke > 0]
    bodies = [_Body.round(m) for m in maps if np.mean(m.known[m.covered > 0]) > KNOWN][:FRAMES]
    if len(bodies) < FEWEST:
        return None
    towards = spread(DIRECTIONS)  # to the right, along the line of sight, up
    left, suns = _left(bodies, _lit(bodies, towards))
    weight = np.exp(-(left / max(left.min(), 1e-12) - 1) / FORGIVEN)
    weight /= weight.sum()
    right, _, up = weight @ towards
    return LightSide(float(np.degrees(np.arctan2(up, right))), float(np.hypot(right, up)), float(weight @ suns))


@dataclass(frozen=True, eq=False)
class _Body:
    """Smoke of a frame as a round body, with a block as the unit of length.

    Attributes
    ----------
    depth : (rows, columns)
        Optical depth.
    half : (rows, columns)
        Half of the body's extent along the line of sight, in blocks.
    added : (rows, columns)
        Radiance that the smoke adds, mean of the channels.
    compared : (rows, columns) bool
        Blocks that show it.
    """

    depth: Array
    half: Array
    added: Array
    compared: NDArray[np.bool_]

    @staticmethod
    def round(maps: BlockMaps) -> _Body:
        """As deep as it is wide: a disc becomes a ball."""
        smoky = maps.covered > 0
        depth = np.where(smoky, -np.log(np.clip(maps.passed, 0.01, 1)), 0.0)
        # blocks without texture take the depth of their neighbours
        known, said = maps.known.astype(np.float64), np.where(maps.known, depth, 0.0)
        weight, total = (gaussian_filter(v, 0.5) + 1e-3 * gaussian_filter(v, 2.0) for v in (known, said))
        depth = np.where(smoky, total / np.maximum(weight, 1e-12), 0.0)
        return _Body(depth, _inflated(depth > SHOWN), maps.added, smoky & maps.known)

    def density(self, layers: int) -> NDArray[np.float32]:
        """Density (columns, layers, rows) along x, y and z, an optical depth a block."""
        y = np.arange(layers) - (layers - 1) / 2
        profile = np.maximum(1 - (y / (self.half[..., None] + 0.5)) ** 2, 0)
        density = self.depth[..., None] * profile / profile.sum(-1, keepdims=True)
        return np.ascontiguousarray(density[::-1].transpose(1, 2, 0), np.float32)


def _inflated(inside: NDArray[np.bool_]) -> Array:
    """Half the depth (rows, columns) of a body with an outline, in blocks.

    It is sqrt(u) with laplace(u) = -4 inside and u = 0 outside: in a disc u is R^2 - r^2.
    """
    half = np.zeros(inside.shape)
    if inside.any():
        down, across = (diags([1.0, -2.0, 1.0], [-1, 0, 1], shape=(n, n)) for n in inside.shape)
        laplace = kron(down, identity(inside.shape[1])) + kron(identity(inside.shape[0]), across)
        within = np.flatnonzero(inside)
        matrix = laplace.tocsr()[within][:, within].tocsc()
        half[inside] = np.sqrt(np.maximum(spsolve(matrix, np.full(len(within), -4.0)), 0))
    return half


def _lit(bodies: Sequence[_Body], towards: Array) -> list[NDArray[np.float32]]:
    """What each body adds (directions, rows, columns) in the same light from each direction."""
    rows, columns = bodies[0].depth.shape
    layers = 2 * int(np.ceil(max(body.half.max() for body in bodies))) + 1
    low, size = (-columns / 2, -layers / 2, -rows / 2), (columns, rows)
    domain = Domain(low, (-low[0], -low[1], -low[2]), (columns, layers, rows))
    matrix = ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, -1.0, -float(layers)), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    camera = Camera("orthographic", matrix, size, 1.0, 1.0, columns / 2, rows / 2)
    medium, irradiance = Medium(extinction=1.0, albedo=1.0), (4 * np.pi,) * 3
    densities = [body.density(layers) for body in bodies]
    lit = []
    for x, y, z in -towards:
        light = DirectionalLight((float(x), float(y), float(z)), irradiance)
        renderer = Renderer(camera, domain, medium, (light,), np.zeros(3, np.float32))
        lit.append([renderer.image(density)[..., 0] for density in densities])
    return [np.stack(pictures) for pictures in zip(*lit, strict=True)]


def _left(bodies: Sequence[_Body], lit: Sequence[NDArray[np.float32]]) -> tuple[Array, Array]:
    """Squared radiance that a sun from each direction and light from everywhere leave, and the sun's share."""
    seen = np.concatenate([body.added[body.compared] for body in bodies])
    sun = np.concatenate([pictures[:, body.compared] for body, pictures in zip(bodies, lit, strict=True)], 1)
    found = explained(sun, sun.mean(0), seen)
    return found.left, found.share
