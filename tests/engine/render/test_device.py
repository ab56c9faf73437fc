"""Which device renders: the processor by itself, and a GPU, or Vulkan in software, on request."""

import json
import subprocess
import sys

import numpy as np
import pytest

from smokelift import Camera, DirectionalLight, Domain, Medium, Scene, render_gradient
from smokelift.render import DeviceError, device

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
