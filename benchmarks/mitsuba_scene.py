"""Parts of a Mitsuba scene in the conventions of this repository. Needs Mitsuba 3 and nothing of Smokelift.

Cameras, lights and media are tables of a scene file; a camera has a ``matrix`` (4x4, camera to world).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")

# Mitsuba's environment has its pole along +Y and looks up atan2(x, -z).
ENVIRONMENT_TO_WORLD = mi.ScalarTransform4f(np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]))

ENDLESS = 1_000_000
"""Bounces before paths end at random. Mitsuba's roulette ends 5 % of all paths at least, so that in white smoke the
weight of those that go on grows by 4 % a bounce, and a few paths make a pixel."""


def volume(values: np.ndarray, low: np.ndarray, high: np.ndarray) -> dict[str, Any]:
    """Describe values [x, y, z] at voxel centers of a box, trilinear between them."""
    return {
        "type": "gridvolume",
        "grid": mi.VolumeGrid(np.ascontiguousarray(values.transpose(2, 1, 0)[..., None], np.float32)),
        "filter_type": "trilinear",
        "wrap_mode": "clamp",
        "raw": True,
        "to_world": mi.ScalarTransform4f().translate(low).scale(high - low),
    }


def smoke(
    density: np.ndarray, low: np.ndarray, high: np.ndarray, medium: dict[str, Any], phase: dict[str, Any]
) -> dict[str, Any]:
    """Describe a box of smoke for Mitsuba's own integrators; the medium has an extinction and an albedo."""
    return {
        "type": "cube",
        "to_world": mi.ScalarTransform4f().translate((low + high) / 2).scale((high - low) / 2),
        "bsdf": {"type": "null"},
        "interior": {
            "type": "heterogeneous",
            "sigma_t": volume(density, low, high),
            "scale": medium["extinction"],
            "albedo": medium["albedo"],
            "phase": phase,
        },
    }


def sensor(camera: dict[str, Any], block: int = 1) -> dict[str, Any]:
    """Describe a camera; Mitsuba's look along +Z. `block` makes pixels that much larger."""
    width, height = camera["size"]
    return {
        "type": "perspective",
        "fov": camera["fov_y_degrees"],
        "fov_axis": "y",
        "to_world": mi.ScalarTransform4f(np.array(camera["matrix"]) @ np.diag([-1.0, 1.0, -1.0, 1.0])),
        "film": {"type": "hdrfilm", "width": width // block, "height": height // block, "rfilter": {"type": "box"}},
    }


def emitter(light: dict[str, Any]) -> dict[str, Any]:
    """Describe a directional light, a point light or an environment."""
    if light["type"] == "directional":
        return {
            "type": "directional",
            "direction": light["direction"],
            "irradiance": {"type": "rgb", "value": light["irradiance"]},
        }
    if light["type"] == "point":
        return {
            "type": "point",
            "position": light["position"],
            "intensity": {"type": "rgb", "value": light["intensity"]},
        }
    return {
        "type": "envmap",
        "filename": light["image"],
        "scale": light["strength"],
        "to_world": mi.ScalarTransform4f().rotate([0, 0, 1], -light["rotation_degrees"]) @ ENVIRONMENT_TO_WORLD,
    }


def surroundings(light: dict[str, Any], directions: tuple[int, int]) -> Iterator[tuple[Any, Any]]:
    """Yield directions towards an environment, each with the irradiance from there (rgb).

    They are a product rule over the sphere: Gauss points in z, equal steps in azimuth.
    """
    source = mi.load_dict(emitter(light))
    heights, weights = np.polynomial.legendre.leggauss(directions[0])
    for z, weight in zip(heights.tolist(), weights.tolist(), strict=True):
        level = math.sqrt(1 - z * z)
        for azimuth in 2 * math.pi * (np.arange(directions[1]) + 0.5) / directions[1]:
            towards = mi.Vector3f(level * math.cos(azimuth), level * math.sin(azimuth), z)
            looking = dr.zeros(mi.SurfaceInteraction3f)
            looking.wi = -towards
            irradiance = source.eval(looking) * (weight * 2 * math.pi / directions[1])
            dr.make_opaque(towards, irradiance)  # one kernel for all directions
            yield towards, irradiance


def pixel_rays(camera: dict[str, Any]) -> Any:
    """Return Mitsuba's rays through the centers of the pixels, row by row."""
    width, height = camera["size"]
    index = dr.arange(mi.UInt32, width * height)
    pixel = mi.Point2f((mi.Float(index % width) + 0.5) / width, (mi.Float(index // width) + 0.5) / height)
    return mi.load_dict(sensor(camera)).sample_ray(0.0, 0.5, pixel, mi.Point2f(0.5))[0]


@dr.syntax
def integral(texture: Any, box: Any, points: Any, direction: Any, step: float) -> Any:
    """Integrate a volume from points to the edge of its box, in one direction, by the midpoint rule."""
    ray = mi.Ray3f(points, direction)
    _, _, far = box.ray_intersect(ray)
    count = dr.maximum(mi.UInt32(dr.ceil(far / step)), 1)
    width = far / mi.Float(count)
    where = dr.zeros(mi.Interaction3f, dr.width(points))
    total = mi.Float(0.0)
    i = mi.UInt32(0)
    while i < count:
        where.p = ray((mi.Float(i) + 0.5) * width)
        total += texture.eval_1(where)
        i += 1
    return total * width


@dr.syntax
def march(
    density: Any, source: Callable[[Any], Any], box: Any, ray: Any, step: float, extinction: float
) -> tuple[Any, Any]:
    """March along rays through smoke.

    Parameters
    ----------
    density
        The volume.
    source
        Returns what points scatter into the direction of the ray, per optical depth (the source function), gray or rgb.
    box
        Where there is smoke.
    ray
        The camera's rays.
    step
        Largest step (m).
    extinction
        1/m per unit of density.

    Returns
    -------
    radiance, transmittance
        Of the rays.
    """
    hit, near, far = box.ray_intersect(ray)
    length = dr.select(hit, far - near, 0.0)
    count = mi.UInt32(dr.ceil(length / step))
    width = length / mi.Float(dr.maximum(count, 1))
    where = dr.zeros(mi.Interaction3f, dr.width(ray))
    radiance, transmittance = dr.zeros(type(source(where)), dr.width(ray)), mi.Float(1.0)
    i = mi.UInt32(0)
    while i < count:
        where.p = ray(near + (mi.Float(i) + 0.5) * width)
        passed = dr.exp(-extinction * density.eval_1(where) * width)
        radiance += transmittance * (1.0 - passed) * source(where)
        transmittance *= passed
        i += 1
    return radiance, transmittance


def path_traced(scene: dict[str, Any], passes: int, samples: int) -> np.ndarray:
    """Return pictures [pass, row, column, rgb] of a scene by its own integrator."""
    loaded = mi.load_dict({"type": "scene", **scene})
    return np.stack([mi.render(loaded, spp=samples, seed=seed).numpy()[..., :3] for seed in range(passes)])
