"""The GPU's kernels against the processor's code, run by Taichi on the processor: no GPU is needed for that."""

import numpy as np
import pytest

from smokelift.render import Optics, taichi_runtime
from smokelift.render.cpu_backend import CpuBackend
from smokelift.render.gpu_backend import GpuBackend
from smokelift.scene import Camera, DirectionalLight, Domain, Medium, PointLight

SHAPE = (9, 10, 12)
DOMAIN = Domain((0.0, 0.0, 0.0), (0.9, 1.0, 1.2), SHAPE)
SUN = DirectionalLight((0.57, 0.45, -0.68), (3.0, 2.0, 1.0))
LIGHTS = {
    "directional": (SUN,),
    "point close by": (PointLight((-0.06, 0.5, 0.9), (1.5, 1.0, 0.5)),),
    "all, in color": (SUN, PointLight((4.0, -3.0, 5.0), (60, 50, 40)), DirectionalLight((0, 1, 0.1), (0, 1, 2))),
    "none": (),
}


@pytest.fixture(scope="module", autouse=True)
def taichi_on_the_processor():
    try:
        taichi_runtime.start("cpu")
    except RuntimeError as busy:
        pytest.skip(str(busy))


@pytest.mark.parametrize("lights", LIGHTS.values(), ids=LIGHTS.keys())
@pytest.mark.parametrize(("scattering", "anisotropy"), [("multiple", 0.0), ("single", 0.3), ("unshadowed", 0.3)])
@pytest.mark.parametrize("hull", [False, True])
def test_both_backends_agree(lights, scattering, anisotropy, hull):
    rng = np.random.default_rng(1)
    density = (rng.random(SHAPE) * (rng.random(SHAPE) > 0.3)).astype(np.float32)
    support = None
    if hull:
        support = density > 0
        support[:2], support[:, -3:] = False, False
        density = np.where(support, density, 0).astype(np.float32)
    camera = Camera.look_at((2.5, -1.2, 2.4), (0.45, 0.5, 0.6), fov_y_degrees=40, size=(14, 16))
    plan = Optics(DOMAIN, Medium(4.0, 0.9, anisotropy), lights, scattering).plan(camera, support)
    backends = CpuBackend(plan), GpuBackend(plan)
    for values in (density / 2, density):
        results = []
        for backend in backends:
            scattered, depth = (part.copy() for part in backend.image(values, True))
            slope = backend.gradient(np.full(scattered.shape, 0.7, np.float32), np.full(depth.shape, 0.3, np.float32))
            results.append((scattered, depth, slope))
        for ours, theirs in zip(*results, strict=True):
            np.testing.assert_allclose(ours, theirs, rtol=1e-4, atol=1e-6 * float(np.abs(theirs).max(initial=0)))
