"""What several tests of scenes need: a file that uses every table, and cameras that stand and move."""

from pathlib import Path

import numpy as np

from smokelift.scene import Camera, Domain, Scene, look_at_matrix

FRONT = ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, -1.0, -7.0), (0.0, 1.0, 0.0, 1.5), (0.0, 0.0, 0.0, 1.0))

DOMAIN = Domain((-0.6, -0.6, 0), (0.6, 0.6, 1.6), (24, 24, 32))
CENTER = np.array([0, 0, 0.8])
PERSPECTIVE = Camera.look_at((0, -4, 0.8), (0, 0, 0.8), fov_y_degrees=30, size=(160, 224))
ORTHOGRAPHIC = Camera("orthographic", PERSPECTIVE.matrix, (160, 224), 103.0, 103.0, 80.0, 112.0)
TILTED = Camera.look_at((1, -4, 2.0), (0, 0, 0.8), fov_y_degrees=30, size=(160, 224))
"""Cameras that face the middle of a domain, and see all of it."""

GOOD = """\
# a shot
[clip]
path = "smoke.mp4"
fps = 24
frames = [0, 10]

[camera]
position = [0, -7, 1.5]
target = [0, 0, 1.5]
fov_y_degrees = 30
size = [256, 384]

[domain]
min = [-1, -1, 0]
max = [1, 1, 3]
resolution = [
  64, 64,  # across
  96,
]

[medium]
albedo = 0.5

[[lights]]
type = "directional"
direction = [0, 3, -4]
irradiance = [1, 2, 3]

[[lights]]
type = "point"
position = [0, -5, 5]
intensity = [9, 9, 9]

[background]
color = [0.1, 0.2, 0.3]

[[views]]
[views.camera]
type = "orthographic"
position = [7, 0, 1.5]
target = [0, 0, 1.5]
height = 3
size = [200, 300]
[views.clip]
path = "side/frame_####.exr"
"""


def load(folder: Path, text: str) -> Scene:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return Scene.load(path)


def moving_camera(*positions: tuple[float, float, float]) -> Camera:
    """A camera that looks along +Y from one position after the other."""
    poses = [look_at_matrix(p, (p[0], p[1] + 1, p[2]), (0, 0, 1)) for p in positions]
    return Camera("perspective", poses[0], (256, 384), 700.0, 700.0, 128.0, 192.0, tuple(poses))
