"""Nothing is lost on the way into a file and back."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smokelift.scene import (
    SCATTERINGS,
    SIDES,
    Background,
    Camera,
    ClipSource,
    DirectionalLight,
    Domain,
    EnvironmentLight,
    Inlet,
    Medium,
    PointLight,
    Scene,
    View,
    scene_from_dict,
    scene_to_dict,
)

numbers = st.floats(-1e6, 1e6, allow_subnormal=False)
positive = st.floats(1e-6, 1e6)
vectors = st.tuples(numbers, numbers, numbers)
colors = st.tuples(*[st.floats(0, 1e6, allow_subnormal=False)] * 3)
paths = st.text(st.characters(codec="utf-8", exclude_characters="/\\\0"), min_size=1, max_size=12).filter(
    lambda name: name not in (".", "..") and name == name.strip()
)
clips = st.builds(
    ClipSource,
    paths.map(lambda name: Path("/footage") / name),
    st.none() | positive,
    st.none() | st.tuples(st.integers(0, 9), st.integers(10, 99)),
    st.sampled_from([None, "srgb", "linear"]),
)


@st.composite
def cameras(draw: st.DrawFn) -> Camera:
    angles = draw(st.tuples(*[st.floats(-3, 3, allow_subnormal=False)] * 3))
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles), np.sin(angles)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    matrix = np.eye(4)
    matrix[:3, :3] = about_z @ about_y @ about_x
    matrix[:3, 3] = draw(vectors)
    moved = matrix.copy()
    moved[:3, 3] = draw(vectors)
    matrices = draw(st.sampled_from([(), (matrix,), (matrix, moved)]))
    kind = draw(st.sampled_from(["perspective", "orthographic"]))
    size = draw(st.tuples(st.integers(1, 9999), st.integers(1, 9999)))
    lens = draw(st.tuples(positive, positive, numbers, numbers))
    return Camera(kind, matrix, size, *lens, matrices)  # type: ignore[arg-type]


lights = st.one_of(
    st.builds(DirectionalLight, vectors.filter(lambda v: math.hypot(*v) > 1e-3), colors),
    st.builds(PointLight, vectors, colors),
    st.builds(EnvironmentLight, paths.map(lambda name: Path("/sky") / f"{name}.exr"), numbers, positive),
)
domains = st.builds(
    lambda low, edge, counts: Domain(low, tuple(a + edge * n for a, n in zip(low, counts, strict=True)), counts),
    st.tuples(*[st.floats(-100, 100, allow_subnormal=False)] * 3),
    st.floats(0.01, 10),
    st.tuples(*[st.integers(1, 500)] * 3),
)
strokes = st.none() | paths.map(lambda name: Path("/strokes") / f"{name}.png")
backgrounds = (
    st.none()
    | st.builds(Background, color=colors | st.none(), strokes=strokes)
    | st.builds(Background, frame=st.lists(st.integers(0, 10**6), min_size=1).map(tuple), strokes=strokes)
)
walls = st.lists(st.sampled_from(SIDES), max_size=6).map(tuple)


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    if draw(st.booleans()):  # whatever cameras see and lights hit is refused or not elsewhere
        domain = draw(domains)
        inlets = draw(st.lists(st.builds(Inlet, st.just(domain.centre), positive), max_size=2))
        return Scene(domain=domain, clip=draw(clips), closed=draw(walls), inlets=inlets)
    return Scene(
        closed=draw(walls),
        inlets=draw(st.lists(st.builds(Inlet, vectors, positive), max_size=2)),
        clip=draw(st.none() | clips),
        camera=draw(st.none() | cameras()),
        medium=draw(
            st.none()
            | st.builds(
                Medium,
                positive,
                st.floats(0, 1, allow_subnormal=False),
                st.floats(-0.99, 0.99, allow_subnormal=False),
                st.tuples(*[st.floats(0, 1, allow_subnormal=False)] * 2, st.floats(0.01, 1)),
            )
        ),
        scattering=draw(st.sampled_from([None, *SCATTERINGS])),
        lights=tuple(draw(st.lists(lights, max_size=3))),
        background=draw(backgrounds),
        views=tuple(draw(st.lists(st.builds(View, cameras(), clips, backgrounds), max_size=2))),
    )


@settings(max_examples=60, deadline=None, derandomize=True)
@given(scenes())
def test_a_scene_comes_back_as_it_was_saved(tmp_path_factory: pytest.TempPathFactory, scene: Scene) -> None:
    path = tmp_path_factory.getbasetemp() / "round.toml"
    scene.save(path)
    assert Scene.load(path) == scene
    assert scene_from_dict(scene_to_dict(scene)) == scene


def test_paths_move_with_the_scene_file(tmp_path: Path) -> None:
    old, new = tmp_path / "old", tmp_path / "new"
    old.mkdir()
    Scene(
        clip=ClipSource(old / "clips" / "a.mp4", mask=old / "mask.png"),
        background=Background(image=tmp_path / "plate.png", strokes=old / "strokes.png"),
        domain=Domain((0, 0, 0), (1, 1, 1), (4, 4, 4)),
    ).save(old / "scene.toml")
    old.rename(new)
    scene = Scene.load(new / "scene.toml")
    assert scene.clip == ClipSource(new / "clips" / "a.mp4", mask=new / "mask.png")
    assert scene.background == Background(image=tmp_path / "plate.png", strokes=new / "strokes.png")
