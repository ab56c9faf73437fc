"""``smokelift render``: an image or video of a sequence."""

import argparse
import math

from smokelift.app.options import add_sequence, named_path, require_file
from smokelift.app.progress import Reporter
from smokelift.output.images import VIDEO_KINDS, write_image, write_video
from smokelift.output.sequence import Sequence, Viewer
from smokelift.render import device
from smokelift.scene import Camera, CompleteScene, Scene, orbit


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_sequence(parser)
    parser.add_argument(
        "--frame", type=int, metavar="N", help="the only frame (default: the first for an image, all for a video)"
    )
    parser.add_argument(
        "--camera",
        default="front",
        help="view: front (default), side, YAW,PITCH in degrees to the right of the front and upwards, or camera.toml",
    )
    parser.add_argument(
        "--out", type=named_path, required=True, help="file to write: image.exr, image.png or video.mp4"
    )


def run(options: argparse.Namespace, say: Reporter) -> None:
    """Render one frame, or all into a video."""
    sequence = Sequence.open(options.directory)
    scene = sequence.scene
    camera = _camera(options.camera, scene)
    require_file(options.out, (".exr", ".png", *VIDEO_KINDS))
    if not sequence.frames:
        raise ValueError(f"{options.directory}: there are no finished frames to render yet.")
    device.start(options.device)
    if options.out.suffix.lower() in VIDEO_KINDS:
        numbers = sequence.frames if options.frame is None else (options.frame,)
        viewer = Viewer(scene, camera)
        volumes = ((number, sequence.density(number), sequence.flame(number)) for number in numbers)
        write_video(options.out, (viewer.image(*each) for each in volumes), sequence.fps)
    else:
        number = sequence.frames[0] if options.frame is None else options.frame
        write_image(options.out, sequence.render(number, camera))
    say.finish(f"{options.out} written.", {"file": str(options.out)})


def _camera(name: str, scene: CompleteScene) -> Camera:
    """The camera that a word, two angles or a file says; ValueError if it is none of them."""
    if name == "front":
        return scene.camera
    if name == "side":
        return orbit(scene.camera, scene.domain, 90.0)
    if name.endswith(".toml"):
        camera = Scene.load(name).camera
        if camera is None:
            raise ValueError(f"{name}: has no [camera].")
        return camera
    try:
        yaw, pitch = (float(part) for part in name.split(","))
        if not (math.isfinite(yaw) and math.isfinite(pitch)):
            raise ValueError
    except ValueError:
        raise ValueError(
            f"--camera {name}: expected front, side, two angles YAW,PITCH in degrees, or a camera.toml."
        ) from None
    return orbit(scene.camera, scene.domain, yaw, pitch)
