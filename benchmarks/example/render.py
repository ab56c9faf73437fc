"""Render baked smoke with Mitsuba 3: the example's clip, its clean plate, reference images from four sides.

    python -m benchmarks.example.render TRUTH.npz SCENE.toml [--views DIR] [--check 12 30 46]

The pictures are single scattering, integrated at half-voxel steps instead of sampled, so they carry no noise; what
arrives of the light is kept at the voxels' centres. The camera's rays, the light and the trilinear density are
Mitsuba's own. `--check` compares with `volpath`.
"""

import argparse
import math
import tomllib
from pathlib import Path
from typing import Any

import av
import drjit as dr
import mitsuba as mi
import numpy as np
from av.video.reformatter import Interpolation
from scipy import ndimage

from benchmarks.mitsuba_scene import emitter, integral, march, path_traced, pixel_rays, sensor, smoke, volume

YAWS = {"front": 0, "nov20": 20, "nov45": 45, "side": 90}  # degrees about the vertical, towards +x
CHECK_BLOCK = 16  # pixels; volpath's noise is averaged over such blocks
CHECK_PASSES, CHECK_SAMPLES = 16, 8192  # a block
# FFmpeg's conversion of colours is a code value too dark unless it is asked to round.
EXACT = int(
    Interpolation.BICUBIC | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INT | Interpolation.FULL_CHR_H_INP
)


def srgb_encode(linear: np.ndarray) -> np.ndarray:
    """Return 8-bit sRGB values of linear ones."""
    linear = np.clip(linear, 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(255.0 * encoded).astype(np.uint8)


def srgb_decode(picture: np.ndarray) -> np.ndarray:
    """Return linear values of 8-bit sRGB ones."""
    encoded = picture / 255.0
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def wall(width: int, height: int, seed: int) -> np.ndarray:
    """Paint what stands behind the smoke: plaster, a rail, boards, the floor, and a bowl that it rises from.

    Parameters
    ----------
    width, height : int
        Size of the picture (pixels).
    seed : int
        Of the noise.

    Returns
    -------
    numpy.ndarray
        Linear picture [row, column, rgb].
    """
    rng = np.random.default_rng(seed)
    fine = 3  # painted that much larger, so that edges are smooth
    scale = fine * height / 384  # the sizes below are for 384 rows
    y, x = (np.mgrid[: fine * height, : fine * width] + 0.5) / scale

    def noise(*sigma: float) -> np.ndarray:
        field = ndimage.gaussian_filter(rng.normal(size=x.shape), np.multiply(sigma, scale), mode="wrap")
        return field / field.std()

    def paint(rgb: tuple[float, float, float], shade: np.ndarray) -> np.ndarray:
        return np.array(rgb) * shade[..., None]

    blotches = 0.10 * noise(40, 40) + 0.07 * noise(12, 12) + 0.05 * noise(4, 4) + 0.04 * noise(0.8, 0.8)
    plaster = np.exp(blotches + 0.05 * noise(1, 9))
    warp_x, warp_y = 7 * noise(9, 9), 7 * noise(9, 9)
    for offset, slope in ((51, 0.55), (238, -0.35)):
        crack = np.exp(-(((x + warp_x - offset - slope * (y + warp_y)) / 0.9) ** 2))
        plaster *= 1 - 0.45 * crack * (y < 172)
    picture = paint((0.170, 0.146, 0.118), plaster)

    board, across = np.divmod(x + 12, 34.0)
    tone = rng.normal(0.0, 0.16, 64)[board.astype(int)]
    rings = np.sin(0.9 * x + rng.uniform(0, 6, 64)[board.astype(int)] + 2.2 * noise(30, 5))
    boards = np.exp(tone + 0.10 * rings + 0.07 * noise(14, 0.7) + 0.06 * noise(5, 0.6))
    boards *= np.interp(across, [1.6, 1.7, 2.8, 2.9], [0.30, 1.35, 1.35, 1.0])
    boards *= np.interp(y, [238, 242, 249], [0.35, 0.55, 1.0])
    picture = np.where((y > 238)[..., None], paint((0.155, 0.088, 0.048), boards), picture)

    timber = np.exp(0.10 * noise(0.7, 16))
    profile = np.interp(y, [229, 230, 235, 238], [1.7, 1.1, 1.0, 0.9])
    picture = np.where((abs(y - 233) < 5)[..., None], paint((0.150, 0.095, 0.060), timber * profile), picture)
    profile = np.interp(y, [328, 329.5, 331, 346], [1.8, 1.6, 1.0, 0.8])
    picture = np.where((y > 328)[..., None], paint((0.110, 0.066, 0.042), timber * profile), picture)
    floor = np.exp(0.12 * noise(1.5, 22) + 0.06 * noise(0.7, 3))
    floor *= np.interp(y, [346, 349, 384], [0.4, 0.8, 1.3])
    picture = np.where((y > 346)[..., None], paint((0.095, 0.082, 0.072), floor), picture)
    picture *= (1.25 - 0.45 * np.hypot(x / 256 - 0.2, y / 384 - 0.15))[..., None]

    u, v = (x - 114) / 31, y - 336  # the bowl; v = 0 is its rim
    picture *= (1 - 0.75 * np.exp(-(((x - 122) / 36) ** 2) - ((y - 369) / 5) ** 2))[..., None]
    feet = (abs(abs(u) - 0.45 - 0.006 * v) < 0.045) & (v > 15) & (v < 34)
    body = (v > 0) & (u**2 + (v / 27) ** 2 < 1)
    gleam = 0.35 + 2.2 * np.exp(-(((u + 0.45) / 0.28) ** 2)) + 0.5 * np.exp(-(((u - 0.75) / 0.15) ** 2))
    iron = np.where(body, gleam, 0.5) * np.exp(0.06 * noise(0.8, 0.8))
    picture = np.where((body | feet)[..., None], paint((0.034, 0.031, 0.030), iron), picture)
    rim, mouth = u**2 + (v / 5.5) ** 2, (u / 0.92) ** 2 + (v / 4.0) ** 2
    picture = np.where((rim < 1)[..., None], paint((0.085, 0.078, 0.074), 1 - 0.6 * u), picture)
    picture = np.where((mouth < 1)[..., None], paint((0.012, 0.011, 0.010), np.ones_like(u)), picture)
    return picture.reshape(height, fine, width, fine, 3).mean(axis=(1, 3))


def look_at(position: np.ndarray, target: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Return the 4x4 camera-to-world matrix; the camera looks along its -Z."""
    back = (position - target) / np.linalg.norm(position - target)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.stack([right, np.cross(back, right), back, position], axis=1)
    return matrix


def turned(camera: dict[str, Any], degrees: float) -> tuple[np.ndarray, str]:
    """Turn a scene's camera about the world's vertical axis.

    Returns
    -------
    matrix : numpy.ndarray
        Camera to world, 4x4.
    text : str
        The camera's own scene file.
    """
    position, target, up = (np.array(camera[key], float) for key in ("position", "target", "up"))
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    matrix = look_at(turn @ position, turn @ target, turn @ up)
    rows = ",\n          ".join(str([round(float(v), 9) + 0.0 for v in row]) for row in matrix)
    text = f"""[camera]
type = "perspective"
matrix = [{rows}]
fov_y_degrees = {camera["fov_y_degrees"]}
size = {camera["size"]}
"""
    return matrix, text


def crop(density: np.ndarray, low: np.ndarray, voxel: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut the smoke out, with a voxel of clear air around it; return it with the corners of its box."""
    filled = np.nonzero(density)
    first = np.array([max(i.min() - 1, 0) for i in filled])
    last = np.array([min(i.max() + 2, n) for i, n in zip(filled, density.shape, strict=True)])
    part = density[tuple(slice(a, b) for a, b in zip(first, last, strict=True))]
    return part, low + first * voxel, low + last * voxel


class Renderer:
    """Renders densities in the light and medium of a scene file.

    Parameters
    ----------
    scene : dict
        The parsed scene file; its lights are directional.
    """

    def __init__(self, scene: dict[str, Any]) -> None:
        self.camera, self.medium, self.lights = scene["camera"], scene["medium"], scene["lights"]
        self.low, self.high = (np.array(scene["domain"][key], float) for key in ("min", "max"))
        self.mitsuba = mi.load_dict({"type": "scene", **self.scene(np.zeros((2, 2, 2), np.float32), np.eye(4))})

    def scene(self, density: np.ndarray, matrix: np.ndarray, block: int = 1) -> dict[str, Any]:
        """Describe Mitsuba's own scene."""
        phase = {"type": "hg", "g": self.medium["anisotropy"]}
        return {
            "integrator": {"type": "volpath", "max_depth": 2, "hide_emitters": True},
            "camera": sensor(self.camera | {"matrix": matrix}, block),
            "domain": smoke(density, self.low, self.high, self.medium, phase),
            **{f"light{number}": emitter(light) for number, light in enumerate(self.lights)},
        }

    def images(self, density: np.ndarray, matrices: list[np.ndarray]) -> list[tuple[np.ndarray, np.ndarray]]:
        """Render a density from several cameras.

        Parameters
        ----------
        density : numpy.ndarray
            [x, y, z] over the whole domain.
        matrices : list of numpy.ndarray
            Camera to world.

        Returns
        -------
        list of tuple
            Radiance [row, column, rgb] of the smoke alone, and transmittance [row, column], a camera.
        """
        width, height = self.camera["size"]
        if not density.any():
            clear = np.zeros((height, width, 3), np.float32), np.ones((height, width), np.float32)
            return [clear] * len(matrices)
        voxel = float((self.high - self.low)[0] / density.shape[0])
        part, low, high = crop(density, self.low, voxel)
        box = mi.BoundingBox3f(mi.ScalarPoint3f(low), mi.ScalarPoint3f(high))
        texture = mi.load_dict(volume(part, low, high))
        step, extinction, g = voxel / 2, self.medium["extinction"], self.medium["anisotropy"]

        axes = [a + (np.arange(n) + 0.5) * voxel for a, n in zip(low, part.shape, strict=True)]
        nodes = mi.Point3f(*(p.ravel() for p in np.meshgrid(*axes, indexing="ij")))
        views = [
            (pixel_rays(self.camera | {"matrix": matrix}), np.zeros((height, width, 3)), None) for matrix in matrices
        ]
        for source in self.mitsuba.emitters():
            sample, irradiance = source.sample_direction(dr.zeros(mi.Interaction3f), mi.Point2f(0.5))
            to_light = mi.Vector3f(sample.d)
            depth = integral(texture, box, nodes, to_light, voxel).numpy()
            shade = mi.load_dict(volume(depth.reshape(part.shape), low, high))

            def arriving(where: Any, shade: Any = shade) -> Any:
                return dr.exp(-extinction * shade.eval_1(where))

            colour = irradiance.numpy().ravel() * self.medium["albedo"]
            for number, (ray, radiance, _) in enumerate(views):
                scattered, transmittance = march(texture, arriving, box, ray, step, extinction)
                cosine = dr.dot(ray.d, to_light)
                phase = (1 - g * g) / (4 * math.pi * (1 + g * g - 2 * g * cosine) ** 1.5)
                picture = (scattered * phase).numpy().reshape(height, width, 1) * colour
                views[number] = ray, radiance + picture, transmittance.numpy().reshape(height, width)
        return [(radiance.astype(np.float32), transmittance) for _, radiance, transmittance in views]

    def path_traced(self, density: np.ndarray, matrix: np.ndarray) -> np.ndarray:
        """Render with Mitsuba's `volpath` at single scattering; pixels are blocks of the camera's."""
        return np.mean(path_traced(self.scene(density, matrix, CHECK_BLOCK), CHECK_PASSES, CHECK_SAMPLES), axis=0)


def blocks(image: np.ndarray) -> np.ndarray:
    """Average over blocks of pixels."""
    height, width = image.shape[:2]
    b = CHECK_BLOCK
    return image.reshape(height // b, b, width // b, b, -1).mean(axis=(1, 3))


def write_png(path: Path, picture: np.ndarray) -> None:
    """Write an 8-bit picture."""
    with av.open(str(path), "w", format="image2", options={"update": "1"}) as container:
        stream = container.add_stream("png", options={"pred": "mixed", "compression_level": "9"})
        stream.height, stream.width = picture.shape[:2]
        stream.pix_fmt = "rgb24"
        for packet in (*stream.encode(av.VideoFrame.from_ndarray(picture, "rgb24")), *stream.encode()):
            container.mux(packet)


def write_video(path: Path, pictures: list[np.ndarray], fps: float, crf: int) -> None:
    """Write 8-bit pictures as H.264, BT.709."""
    with av.open(str(path), "w", options={"movflags": "faststart"}) as container:
        stream = container.add_stream("libx264", rate=round(fps), options={"crf": str(crf), "preset": "veryslow"})
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = "yuv420p"
        context = stream.codec_context
        context.colorspace = context.color_primaries = context.color_trc = 1
        context.color_range = 1
        for picture in pictures:
            frame = av.VideoFrame.from_ndarray(picture, "rgb24")
            frame = frame.reformat(
                format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG", interpolation=EXACT
            )
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def main() -> None:
    """Render a clip and its plate beside the scene file, and whatever else is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("truth", type=Path, help="baked by benchmarks.truth.bake")
    parser.add_argument("scene", type=Path)
    parser.add_argument("--views", type=Path, help="folder for linear reference images from four sides")
    parser.add_argument("--check", type=int, nargs="*", default=[], help="frames to compare with volpath")
    parser.add_argument("--wall-seed", type=int, default=3)
    parser.add_argument("--crf", type=int, default=12, help="the clip's quality; less is better")
    options = parser.parse_args()

    scene = tomllib.loads(options.scene.read_text())
    densities = np.load(options.truth)["density"]
    renderer = Renderer(scene)
    views = {name: turned(scene["camera"], yaw) for name, yaw in YAWS.items()}
    if options.views is None:
        views = {"front": views["front"]}
    matrices = [matrix for matrix, _ in views.values()]
    front = matrices[0]

    for frame in options.check:
        traced = renderer.path_traced(np.float32(densities[frame]), front)
        marched = blocks(renderer.images(np.float32(densities[frame]), [front])[0][0])
        difference = np.sqrt(np.mean((marched - traced) ** 2) / np.mean(traced**2))
        total = marched.sum() / traced.sum() - 1
        print(f"frame {frame}: against volpath {difference:.2%} RMS over blocks, {total:+.2%} in all")

    plate = srgb_encode(wall(*scene["camera"]["size"], options.wall_seed))
    folder = options.scene.parent
    write_png(folder / scene["background"]["image"], plate)
    pictures, stored = [], {name: [] for name in views}
    for frame, density in enumerate(densities):
        rendered = renderer.images(np.float32(density), matrices)
        radiance, transmittance = rendered[0]
        seen = radiance + transmittance[..., None] * srgb_decode(plate)
        pictures.append(srgb_encode(seen))
        for name, (image, _) in zip(views, rendered, strict=True):
            stored[name].append(image.mean(axis=-1).astype(np.float16))
        print(f"frame {frame}: smoke up to {radiance.max():.3f}, picture up to {seen.max():.3f}", flush=True)
    write_video(folder / scene["clip"]["path"], pictures, scene["clip"]["fps"], options.crf)

    if options.views is not None:
        options.views.mkdir(parents=True, exist_ok=True)
        for name, images in stored.items():
            np.savez_compressed(options.views / f"{name}.npz", image=np.stack(images))
            (options.views / f"{name}.toml").write_text(views[name][1])
        linear = srgb_decode(plate).astype(np.float16)
        np.savez_compressed(options.views / "background_plate.npz", plate=linear)


if __name__ == "__main__":
    main()
