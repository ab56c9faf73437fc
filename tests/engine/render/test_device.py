"""Which device renders, by itself or on request, and what it takes of the machine: large pages, one thread of BLAS."""

import json
import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest
from threadpoolctl import ThreadpoolController, threadpool_limits

from smokelift import Camera, DirectionalLight, Domain, Medium, Scene, _core, render_gradient
from smokelift.render import DeviceError, device
from smokelift.render.device import products_on_one_thread

LARGE_PAGE = 1 << 21


@pytest.mark.parametrize("shape", [(1, 1, 1, 1), (66, 66, 98, 1), (66, 66, 98, 2)])
def test_zeros_are_zero(shape):
    array = _core.zeros(shape)
    assert array.shape == shape
    assert array.dtype == np.float32
    assert not array.any()


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux is asked for large pages")
@pytest.mark.parametrize("size", [LARGE_PAGE, LARGE_PAGE + 4, 3 * LARGE_PAGE])
def test_arrays_from_one_large_page_on_begin_at_its_boundary(size):
    arrays = [_core.zeros((size // 4,)) for _ in range(4)]
    assert [array.ctypes.data % LARGE_PAGE for array in arrays] == [0, 0, 0, 0]


def threads() -> set[int]:
    """Those of all libraries that are loaded."""
    return {library["num_threads"] for library in ThreadpoolController().select(user_api="blas").info()}


@pytest.fixture
def two_threads() -> Iterator[None]:
    with threadpool_limits(2, user_api="blas"):
        if threads() != {2}:
            pytest.skip("This NumPy has no OpenBLAS that takes two threads.")
        yield


def test_products_take_one_thread_and_then_as_many_as_before(two_threads) -> None:
    with products_on_one_thread():
        assert threads() == {1}
        with products_on_one_thread():
            pass
        assert threads() == {1}
    assert threads() == {2}


SCENE = Scene(
    camera=Camera.look_at((1.0, -4.0, 2.0), (0.0, 0.0, 0.5), fov_y_degrees=30, size=(24, 32)),
    domain=Domain((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0), (12, 12, 12)),
    medium=Medium(4.0, 0.9, 0.3),
    lights=(DirectionalLight((0.5, 0.4, -0.7), (3.0, 2.0, 1.0)),),
)


def loss_gradient_and_image():
    density = np.random.default_rng(0).random((12, 12, 12)).astype(np.float32)
    return render_gradient(density, SCENE, np.full((32, 24, 3), 0.1, np.float32))


def test_gpu_and_cpu_agree():
    if device.available_gpu() is None:
        pytest.skip("neither a GPU nor Vulkan in software (Debian: mesa-vulkan-drivers) here")
    device.start("cpu")
    loss, gradient, image = loss_gradient_and_image()
    done = subprocess.run([sys.executable, __file__], capture_output=True, text=True, check=True)
    other = json.loads(done.stdout)  # nothing else may stand on standard output
    assert other["device"] != "cpu"
    assert other["loss"] == pytest.approx(loss, rel=1e-5)
    np.testing.assert_allclose(other["gradient"], gradient, rtol=1e-4, atol=1e-4 * float(np.abs(gradient).max()))
    np.testing.assert_allclose(other["image"], image, rtol=1e-5, atol=1e-7)


def test_one_process_has_one_device():
    assert device.start("cpu") == "cpu"
    assert device.start("auto") == "cpu"
    if device.available_gpu() is not None:
        with pytest.raises(DeviceError, match="cpu"):
            device.start("gpu")


def test_without_taichi(monkeypatch):
    monkeypatch.setattr(device, "_running", None)
    monkeypatch.setattr(device, "find_spec", lambda name: None)
    with pytest.raises(DeviceError):
        device.start("gpu")
    assert device.available_gpu() is None


def test_a_gpu_is_taken_by_name_alone(monkeypatch):
    monkeypatch.setattr(device, "_running", None)
    monkeypatch.setattr(device, "available_gpu", lambda: pytest.fail("a GPU is looked for"))
    assert device.start("auto") == "cpu"


if __name__ == "__main__":
    name = device.start("gpu")
    loss, gradient, image = loss_gradient_and_image()
    print(json.dumps({"device": name, "loss": loss, "gradient": gradient.tolist(), "image": image.tolist()}))
