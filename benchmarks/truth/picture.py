"""Picture a baked scene with Mitsuba 3: its clip, and linear pictures from four sides that no reconstruction may see.

    python -m benchmarks.truth.picture plume-1/truth.npz OUT [--light point] [--background wall] [--check 20]
        [--scattering multiple] [--linear] [--frames 24] [--smoke 18 0.9 6 front] [--scene SCENE.toml]

Nothing of Smokelift takes part. The pictures are single scattering, integrated at half-voxel steps over Mitsuba's own
sensor, emitters and trilinear grid, so they carry no noise; `--check` compares frames with `volpath`. Scattering is
isotropic, so that one source function serves all cameras. With multiple scattering `volpath` makes the pictures itself,
at half the size and with some noise. `--smoke` names the first frame, the albedo, the optical depth of the thickest
column seen from the front, and whence a sun shines, 35 degrees above; the sun is as strong as the clip can show.
`--scene` has the camera, the medium and the light that are otherwise drawn by the scene's name, and its own wall.
"""

from __future__ import annotations

import argparse
import json
import math
import tomllib
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from benchmarks.mitsuba_scene import (
    ENDLESS,
    emitter,
    integral,
    march,
    path_traced,
    pixel_rays,
    sensor,
    smoke,
    surroundings,
    volume,
)
from benchmarks.truth.clip import (
    CHECK_BLOCK,
    YAWS,
    blocks,
    crop,
    srgb_decode,
    srgb_encode,
    turned,
    wall,
    write_png,
    write_video,
)

PIXELS = 4  # a voxel
FOV = 30.0
DISTANCE = 7.0  # of the camera from the axis (m)
DIRECTIONS = (8, 16)  # of light from the surroundings: Gauss points in z, equal ones in azimuth
CHECK_PASSES, CHECK_SAMPLES = 4, 4096  # a block
ANY = -1  # number of bounces
SAMPLES = 512  # with multiple scattering
EXAMPLES_WALL = 3  # seed of the wall that --scene has
IRRADIANCE = 8.0  # of a light, at the middle of the box
LIGHT_DISTANCE = 2.5  # of a point light from there (m)
SUNS = {"front": (0.0, 0.819152, -0.573576), "back": (0.0, -0.819152, -0.573576)}  # directions of travel
BRIGHTEST = 0.9  # radiance of a clip with a sun of `SUNS`,
QUANTILE, THIN = 0.99, 0.99  # of the pixels that let less light through


def lights(kind: str, rng: np.random.Generator, folder: Path) -> dict[str, Any]:
    """Draw a light as a scene file has it; the surroundings are painted into the folder.

    It comes from 30 to 55 degrees above, and from anywhere in front or at the sides, up to 20 degrees behind.
    """
    azimuth, height = np.radians(rng.uniform(-20, 200)), np.radians(rng.uniform(30, 55))
    towards = np.array([np.cos(height) * np.cos(azimuth), -np.cos(height) * np.sin(azimuth), np.sin(height)])
    if kind == "directional":
        return {"type": kind, "direction": (-towards).round(6).tolist(), "irradiance": [IRRADIANCE] * 3}
    if kind == "point":
        position = np.array([0.0, 0.0, 1.5]) + LIGHT_DISTANCE * towards
        return {"type": kind, "position": position.round(6).tolist(), "intensity": [IRRADIANCE * LIGHT_DISTANCE**2] * 3}
    rows = 64
    elevation = np.pi * (0.5 - (np.arange(rows)[:, None] + 0.5) / rows)
    around = 2 * np.pi * (0.5 - (np.arange(2 * rows) + 0.5) / (2 * rows))
    cosine = np.cos(elevation) * (np.cos(around) * towards[0] + np.sin(around) * towards[1])
    cosine = cosine + np.sin(elevation) * towards[2]
    radiance = 0.3 + 0.2 * np.sin(elevation) + 5.0 * np.exp(6 * (cosine - 1))
    path = folder / "surroundings.exr"
    mi.Bitmap(np.repeat(radiance[..., None], 3, -1).astype(np.float32)).write(str(path))
    return {"type": kind, "image": str(path), "rotation_degrees": 0.0, "strength": 1.0}


def arriving(light: dict[str, Any], points: Any) -> list[tuple[Any, Any]]:
    """Return directions towards a light from points, each with the irradiance from there without smoke."""
    if light["type"] == "environment":
        return [(towards, irradiance[0]) for towards, irradiance in surroundings(light, DIRECTIONS)]
    scene = mi.load_dict({"type": "scene", "shape": {"type": "sphere"}, "light": emitter(light)})
    where = dr.zeros(mi.Interaction3f, dr.width(points))
    where.p = points
    sample, irradiance = scene.emitters()[0].sample_direction(where, mi.Point2f(0.5))
    return [(mi.Vector3f(sample.d), irradiance[0])]


class Renderer:
    """Pictures of densities in the light and medium of a scene, from several cameras.

    Parameters
    ----------
    scene
        Domain, medium and light as in a scene file.
    cameras
        What `benchmarks.mitsuba_scene.sensor` takes.
    multiple
        Whether light is scattered more than once.
    """

    def __init__(self, scene: dict[str, Any], cameras: list[dict[str, Any]], multiple: bool = False) -> None:
        self.medium, self.light, self.cameras, self.multiple = scene["medium"], scene["light"], cameras, multiple
        self.low, self.high = (np.array(scene["domain"][key], float) for key in ("min", "max"))
        self.rays = [pixel_rays(camera) for camera in cameras]

    def images(self, density: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Radiance of the smoke alone and transmittance, each [row, column], a camera."""
        voxel = float((self.high - self.low)[0] / density.shape[0])
        part, low, high = crop(density, self.low, voxel)
        box = mi.BoundingBox3f(mi.ScalarPoint3f(low), mi.ScalarPoint3f(high))
        texture = mi.load_dict(volume(part, low, high))
        source = mi.load_dict(volume(self.scattered(texture, box, part.shape, low, voxel), low, high))
        found = []
        for camera, ray in zip(self.cameras, self.rays, strict=True):
            width, height = camera["size"]
            views = march(texture, source.eval_1, box, ray, voxel / 2, self.medium["extinction"])
            radiance, transmittance = (view.numpy().reshape(height, width) for view in views)
            if self.multiple:
                radiance = self.path_traced(density, camera, 1, ANY, 1, SAMPLES)
            found.append((radiance, transmittance))
        return found

    def scattered(self, texture: Any, box: Any, shape: tuple[int, ...], low: np.ndarray, voxel: float) -> np.ndarray:
        """Source function of the smoke, on its grid; on one twice as fine for lights with sharp shadows."""
        fine = 1 if self.light["type"] == "environment" else 2
        axes = [a + (np.arange(fine * n) + 0.5) * voxel / fine for a, n in zip(low, shape, strict=True)]
        points = mi.Point3f(*(p.ravel() for p in np.meshgrid(*axes, indexing="ij")))
        total = mi.Float(0.0)
        for towards, irradiance in arriving(self.light, points):
            depth = integral(texture, box, points, towards, voxel / fine)
            total += irradiance * dr.exp(-self.medium["extinction"] * depth)
            dr.eval(total)
        return self.medium["albedo"] / (4 * math.pi) * total.numpy().reshape([fine * n for n in shape])

    def path_traced(
        self, density: np.ndarray, camera: dict[str, Any], block: int, depth: int, passes: int, samples: int
    ) -> np.ndarray:
        """A picture by `volpath` with paths of a depth, 2 for single scattering; pixels are blocks of the camera's."""
        scene = {
            "integrator": {"type": "volpath", "max_depth": depth, "rr_depth": ENDLESS, "hide_emitters": True},
            "camera": sensor(camera, block),
            "domain": smoke(density, self.low, self.high, self.medium, {"type": "isotropic"}),
            "light": emitter(self.light),
        }
        return np.mean(path_traced(scene, passes, samples)[..., 0], axis=0)


def table(name: str, values: dict[str, Any]) -> str:
    """Lay out a table of a scene file."""
    return "\n".join([name, *(f"{key} = {json.dumps(value)}" for key, value in values.items())]) + "\n"


def main() -> None:
    """Render a scene's clip, views and plate."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("truth", type=Path, help="baked by bake.py")
    parser.add_argument("out", type=Path, help="folder")
    parser.add_argument("--light", choices=("directional", "point", "environment"), default="directional")
    parser.add_argument("--background", choices=("black", "wall"), default="black")
    parser.add_argument("--scattering", choices=("single", "multiple"), default="single")
    parser.add_argument("--linear", action="store_true", help="the clip as linear EXR pictures instead of a video")
    parser.add_argument("--frames", type=int, help="how many, from the first")
    parser.add_argument("--smoke", nargs=4, metavar=("FIRST", "ALBEDO", "DEPTH", "LIGHT"), help="instead of drawn ones")
    parser.add_argument("--scene", type=Path, help="scene file with a camera by its position, a medium and one light")
    parser.add_argument("--check", type=int, nargs="*", default=[], help="frames to compare with volpath")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)

    with np.load(options.truth) as file:
        start = int(options.smoke[0]) if options.smoke else 0
        densities = file["density"][start:][: options.frames]
        voxel, fps = float(file["voxel_size"]), float(file["fps"])
        name = json.loads(str(file["made_by"]))["name"]
    nx, ny, nz = shape = densities.shape[1:]
    rng = np.random.default_rng(list(name.encode()))
    light = lights(options.light, rng, options.out)
    if options.smoke:
        light = {"type": "directional", "direction": list(SUNS[options.smoke[3]]), "irradiance": [IRRADIANCE] * 3}
    high = [nx * voxel / 2, ny * voxel / 2, nz * voxel]
    scene = {
        "domain": {"min": [-high[0], -high[1], 0.0], "max": high, "resolution": list(shape)},
        "medium": {
            "extinction": round(rng.uniform(4.0, 7.0), 2),
            "albedo": round(rng.uniform(0.7, 0.95), 2),
            "anisotropy": 0.0,
        },
        "light": light,
    }
    if options.smoke:
        albedo, depth = float(options.smoke[1]), float(options.smoke[2])
        column = float(densities.sum(2, dtype=np.float32).max()) * voxel
        scene["medium"] |= {"extinction": round(depth / column, 2), "albedo": albedo}
    middle = high[2] / 2
    multiple = options.scattering == "multiple"
    pixels = PIXELS // 2 if multiple else PIXELS
    camera = {
        "position": [0.0, -DISTANCE, middle],
        "target": [0.0, 0.0, middle],
        "up": [0.0, 0.0, 1.0],
        "fov_y_degrees": FOV,
        "size": [pixels * nx, pixels * nz],
    }
    if options.scene:
        given = tomllib.loads(options.scene.read_text())
        camera, scene["medium"], (light,) = given["camera"], given["medium"], given["lights"]
        scene["light"] = light
    views = {view: turned(camera, yaw) for view, yaw in YAWS.items()}
    renderer = Renderer(scene, [camera | {"matrix": matrix.tolist()} for matrix, _ in views.values()], multiple)
    for frame in options.check:
        density = densities[frame].astype(np.float32)
        traced = renderer.path_traced(density, renderer.cameras[0], CHECK_BLOCK, 2, CHECK_PASSES, CHECK_SAMPLES)
        marched = blocks(renderer.images(density)[0][0][..., None])[..., 0]
        difference = np.sqrt(np.mean((marched - traced) ** 2) / np.mean(traced**2))
        print(f"frame {frame}: against volpath {difference:.2%} RMS, {marched.sum() / traced.sum() - 1:+.2%} in all")

    walled = options.background == "wall"
    behind = wall(*camera["size"], EXAMPLES_WALL if options.scene else len(name)) if walled else 0.0
    plate = srgb_encode(np.broadcast_to(behind, (*camera["size"][::-1], 3)))
    stored: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {view: [] for view in views}
    for density in densities:
        for view, pair in zip(views, renderer.images(density.astype(np.float32)), strict=True):
            stored[view].append(pair)
    if options.smoke:
        radiance, transmittance = (np.stack(half) for half in zip(*stored["front"], strict=True))
        factor = BRIGHTEST / float(np.quantile(radiance[transmittance < THIN], QUANTILE))
        light["irradiance"] = [round(factor * IRRADIANCE, 4)] * 3
        stored = {view: [(factor * one, other) for one, other in pairs] for view, pairs in stored.items()}
    pictures = [one[..., None] + other[..., None] * srgb_decode(plate) for one, other in stored["front"]]
    if options.linear:
        for number, picture in enumerate(pictures, 1):
            mi.Bitmap(picture.astype(np.float32)).write(str(options.out / f"front_{number:04d}.exr"))
        clip = {"path": "front_####.exr", "fps": fps, "transfer": "linear"}
    else:
        write_video(options.out / "front.mp4", [srgb_encode(picture) for picture in pictures], fps, crf=12)
        clip = {"path": "front.mp4", "fps": fps, "transfer": "srgb"}
    for view, pairs in stored.items():
        image, transmittance = (np.stack(half).astype(np.float16) for half in zip(*pairs, strict=True))
        np.savez_compressed(options.out / f"{view}.npz", image=image, transmittance=transmittance)
        (options.out / f"{view}.toml").write_text(views[view][1])
    if walled:
        write_png(options.out / "plate.png", plate)
        np.savez_compressed(options.out / "background_plate.npz", plate=srgb_decode(plate).astype(np.float16))
    said = light | {"image": Path(light["image"]).name} if "image" in light else light
    text = [
        table("[clip]", clip),
        views["front"][1],
        table("[domain]", scene["domain"]),
        table("[medium]", scene["medium"]),
        table("[[lights]]", said),
        table("[background]", {"image": "plate.png"} if walled else {"color": [0.0, 0.0, 0.0]}),
    ]
    (options.out / "scene.toml").write_text("\n".join(text))
    brightest = max(float(radiance.max()) for radiance, _ in stored["front"])
    print(f"{options.out}: {len(densities)} frames, smoke up to {brightest:.3f}")


if __name__ == "__main__":
    main()
