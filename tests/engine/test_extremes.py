"""Numbers at the ends of what a float can hold, into every public function: a finite answer, or one sentence."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from smokelift import Velocity, advect, estimate_velocity, project, reconstruct_density, render, render_gradient
from smokelift.scene import Background, Camera, DirectionalLight, Domain, Inlet, Medium, PointLight, Scene, orbit
from tests.engine.transport.random_fields import random_faces

SHAPE = (8, 8, 8)
VALUES = [5e-324, 1e-45, 1e-38, 1e-20, 1e-9, 1e-3, 1e3, 1e9, 1e20, 3e38, 1e300]
SMOKE = np.random.default_rng(1).random(SHAPE).astype(np.float32)
FACES = random_faces(np.random.default_rng(2), SHAPE)
CAMERA = Camera.look_at((0.4, -3, 0.5), (0.4, 0.4, 0.4), fov_y_degrees=30, size=(10, 10))
SUN = DirectionalLight((0.3, 0.5, -0.8), (3.0, 3.0, 3.0))
SCENE = Scene(
    camera=CAMERA,
    domain=Domain((0, 0, 0), (0.8, 0.8, 0.8), SHAPE),
    medium=Medium(),
    lights=(SUN,),
    background=Background(color=(0.1, 0.1, 0.1)),
)


def scaled(array: np.ndarray, by: float) -> np.ndarray:
    with np.errstate(over="ignore", under="ignore"):
        return (array.astype(np.float64) * by).astype(np.float32)


def moving(by: float, voxel_size: float = 0.1) -> Velocity:
    x, y, z = (scaled(face, by) for face in FACES)
    return Velocity((x, y, z), voxel_size)


def pictured(**changes: Any) -> np.ndarray:
    return render(SMOKE, replace(SCENE, **changes))


def found(**changes: Any) -> np.ndarray:
    scene = replace(SCENE, **changes)
    return reconstruct_density(render(SMOKE, scene), scene).density


CALLS: dict[str, Callable[[float], Any]] = {
    "advect, speed": lambda v: advect(SMOKE, moving(v), 0.1),
    "advect, backwards": lambda v: advect(SMOKE, moving(-v), 0.1, conserve=True),
    "advect, time step": lambda v: advect(SMOKE, moving(1.0), v),
    "advect, voxels": lambda v: advect(SMOKE, moving(1.0, v), 0.1),
    "advect, density": lambda v: advect(scaled(SMOKE, v), moving(1.0), 0.1, conserve=True),
    "advect, velocity": lambda v: advect(moving(v), moving(1.0), 0.1),
    "project": lambda v: project(moving(v)),
    "estimate_velocity, densities": lambda v: estimate_velocity(scaled(SMOKE, v), scaled(SMOKE[::-1], v), 0.1, 0.1),
    "estimate_velocity, one density": lambda v: estimate_velocity(SMOKE, scaled(SMOKE[::-1], v), 0.1, 0.1),
    "estimate_velocity, time step": lambda v: estimate_velocity(SMOKE, SMOKE[::-1], v, 0.1),
    "estimate_velocity, voxels": lambda v: estimate_velocity(SMOKE, SMOKE[::-1], 0.1, v),
    "estimate_velocity, prediction": lambda v: estimate_velocity(SMOKE, SMOKE[::-1], 0.1, 0.1, prediction=moving(v)),
    "render, density": lambda v: render(scaled(SMOKE, v), SCENE),
    "render, extinction": lambda v: pictured(medium=Medium(extinction=v)),
    "render, albedo": lambda v: pictured(medium=Medium(albedo=v)),
    "render, anisotropy": lambda v: pictured(medium=Medium(anisotropy=1 - v)),
    "render, irradiance": lambda v: pictured(lights=(DirectionalLight((0, 0, -1), (v, v, v)),)),
    "render, intensity": lambda v: pictured(lights=(PointLight((0, 0, 2), (v, v, v)),)),
    "render, point": lambda v: pictured(lights=(PointLight((0.4, 0.4, 0.8 + v), (1, 1, 1)),)),
    "render, direction": lambda v: pictured(lights=(DirectionalLight((v, 0, -v), (1, 1, 1)),)),
    "render, background": lambda v: pictured(background=Background(color=(v, v, v))),
    "render, camera": lambda v: render(
        SMOKE, SCENE, Camera.look_at((0.4, -v, 0.4), (0.4, 0.4, 0.4), fov_y_degrees=30, size=(9, 9))
    ),
    "render, field of view": lambda v: render(SMOKE, SCENE, replace(CAMERA, fx=v, fy=v)),
    "render, center": lambda v: render(SMOKE, SCENE, replace(CAMERA, cx=v)),
    "render, orbit": lambda v: render(SMOKE, SCENE, orbit(CAMERA, SCENE.domain, v)),
    "render, box": lambda v: pictured(domain=Domain((0, 0, 0), (v, v, v), SHAPE)),
    "render_gradient": lambda v: render_gradient(SMOKE, SCENE, np.full((10, 10, 3), min(v, 1e20), np.float32)),
    "reconstruct_density, extinction": lambda v: found(medium=Medium(extinction=v)),
    "reconstruct_density, irradiance": lambda v: found(lights=(DirectionalLight((0, 1, -1), (v, v, v)),)),
    "reconstruct_density, picture": lambda v: reconstruct_density(np.full((10, 10, 3), v), SCENE).density,
    "reconstruct_density, start": lambda v: reconstruct_density(pictured(), SCENE, scaled(SMOKE, v)).density,
    "inlet": lambda v: Inlet((0, 0, 0), v).voxels(SCENE.domain),
}


def arrays(result: Any) -> Iterator[np.ndarray]:
    if isinstance(result, Velocity):
        yield from result.faces
    elif isinstance(result, tuple):
        for part in result:
            yield from arrays(part)
    else:
        yield np.asarray(result)


@pytest.mark.parametrize("name", CALLS)
def test_an_extreme_number_gives_a_finite_answer_or_a_sentence(name) -> None:
    answers = 0
    for value in VALUES:
        try:
            result = CALLS[name](value)
        except ValueError as error:
            assert str(error)
            assert "\n" not in str(error)
        except (OverflowError, Warning) as error:
            raise AssertionError(f"{value}: {error!r}") from error
        else:
            answers += 1
            assert all(np.isfinite(array).all() for array in arrays(result)), value
    assert answers
