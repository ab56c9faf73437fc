"""A reconstruction continued in wind, by a fan and around a ball, in the clip's box and in one that grows; and looped.

    python -m benchmarks.direct.leaving SMOKE OUT [--frames 48] [--start 40] [--picture FILE.png]

It says how much smoke leaves by a face of the box, and how much dissolves before a side that cannot move, as fractions
of what there is at the start. The picture has eight frames of each in the box that grows, from the front and from 45
degrees.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.tables import markdown
from smokelift.direct.continuation import DISSOLVED, ROOM, Continuation, continue_sequence
from smokelift.direct.mesh import Mesh
from smokelift.direct.retiming import default_overlap, loop_sequence, steady_part
from smokelift.direct.state import open_source
from smokelift.direct.surroundings import Fan
from smokelift.evaluation.orbit import Orbit
from smokelift.output.images import eight_bit, write_sheet
from smokelift.output.sequence import Sequence, box_around_all
from smokelift.scene import Domain
from smokelift.transport import Velocity, faces_in
from smokelift.transport.advection import fraction_inside

HEADER = ["case", "room", "left by a face", "dissolved", "box at the end", "seconds per frame: first, last six"]

COLUMNS = 8


def cases(domain: Domain) -> dict[str, Continuation]:
    """Return what acts on the smoke, in places and speeds that go with the box."""
    (x, y, z), (a, b, c) = domain.min, domain.max
    width, height = a - x, c - z
    middle, left = (x + a) / 2, x + 0.1 * width
    depth = (y + b) / 2
    fan = Fan((left, depth, z + 0.2 * height), 0.125 * width, (1.25 * width, 0.0, 0.0))
    return {
        "wind": Continuation(1, wind=(0.4 * width, 0.0, 0.0)),
        "fan": Continuation(1, fans=(fan,)),
        "ball": Continuation(1, obstacles=(ball((middle, depth, z + 0.63 * height), 0.175 * width),)),
    }


def ball(center: tuple[float, float, float], radius: float) -> Mesh:
    """Return a ball of triangles between 17 circles of latitude and 32 meridians."""
    around = np.arange(33) % 32 * np.pi / 16
    up = np.linspace(-np.pi / 2, np.pi / 2, 17)[:, None]
    x, y, z = np.broadcast_arrays(np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up))
    points = np.array(center) + radius * np.stack([x, y, z], axis=-1)
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    triangles = np.concatenate([np.stack([a, b, c], axis=-2), np.stack([a, c, d], axis=-2)])
    return Mesh(triangles.reshape(-1, 3, 3).astype(np.float32))


def left_by_a_face(sequence: Sequence, start: int) -> float:
    """Return the mass that the velocity takes through the sides of the box after a frame, over that of the frame."""
    left, dt = 0.0, 1 / sequence.fps
    for number in sequence.frames:
        if number > start:
            box = sequence.box(number)
            part = box.slices_in(sequence.scene.domain)
            before = sequence.density(number - 1)[part]
            velocity = Velocity(faces_in(sequence.velocity(number).faces, part), box.voxel_size)
            left += float((before * (1 - fraction_inside(velocity.displacement(dt)))).sum(dtype=np.float64))
    return left / float(sequence.density(start).sum(dtype=np.float64))


def rows_of(sequence: Sequence, numbers: list[int], around: Domain) -> list[list[npt.NDArray[np.uint8]]]:
    """Return frames in a box from the front, and from 45 degrees."""
    part = sequence.within(around)
    orbit = Orbit(part.scene)
    return [[eight_bit(orbit.image(part.density(n), degrees)) for n in numbers] for degrees in (0.0, 45.0)]


def main() -> None:
    """Print the table and draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("smoke", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--frames", type=int, default=48)
    parser.add_argument("--start", type=int, default=40)
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    source = open_source(options.smoke)
    table, made = [], {}
    for name, case in cases(source.scene.domain).items():
        for room in (1.0, ROOM):
            out = options.out / f"{name}_{room:g}"
            continuation = replace(case, frames=options.frames, start=options.start, room=room)
            figures = [figures for number, figures in continue_sequence(source, out, continuation)][-options.frames :]
            made[name] = sequence = Sequence.open(out)
            seconds = [each["seconds_velocity"] for each in figures]
            last = sequence.frames[-1]
            mass = sequence.figures(options.start)["mass"]
            dissolved = sum(each[DISSOLVED] * each["mass"] for each in figures) / mass
            grown = np.prod(sequence.box(last).resolution) / np.prod(source.scene.domain.resolution)
            cells = [f"{left_by_a_face(sequence, options.start):.3f}", f"{dissolved:.3f}", f"{grown:.1f}"]
            table.append([name, f"{room:g}", *cells, f"{np.mean(seconds[:6]):.2f}, {np.mean(seconds[-6:]):.2f}"])
    print(markdown(HEADER, table), flush=True)
    if options.picture:
        first, last = steady_part(source)
        overlap = default_overlap(last - first + 1)
        list(loop_sequence(source, options.out / "loop", first, last, overlap))
        loop = Sequence.open(options.out / "loop")
        wide = box_around_all(source.scene.domain, [sequence.scene.domain for sequence in made.values()])
        steps = np.round(np.linspace(0, options.frames, COLUMNS)).astype(int).tolist()
        rows, labels = [], []
        for name, sequence in made.items():
            rows += rows_of(sequence, [options.start + step for step in steps], wide)
            labels += [f"{name}, front", f"{name}, 45 degrees"]
        numbers = [loop.frames[-1], *np.round(np.linspace(1, overlap + 1, COLUMNS - 1)).astype(int).tolist()]
        rows += rows_of(loop, numbers, wide)
        labels += ["loop's last frame and its seam, front", "loop, 45 degrees"]
        write_sheet(options.picture, rows, [f"+{step}" for step in steps], labels)


if __name__ == "__main__":
    main()
