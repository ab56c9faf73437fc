"""The paper's own renderer and derivative (its equations 1-10, algorithm 2), the baseline beside the exact one.

Picture, equations 1-5: the Riemann sum over samples s from the camera on, a step d apart,

    L   = sum_s tau_s kappa_s J_s d + tau B,    tau_s = exp(-sum_{r<s} kappa_r d),   kappa = sigma_t rho
    J_s = albedo sum_l p_g(w, w_l) E_l V_l      V_l: transmittance to light l; tau: of the whole ray

Derivative, equations 6-10, to the letter. There is one "derivative with respect to density", kappa' = sigma_t: each
quantity is differentiated as if the density rose by the same amount everywhere in the box.

    equation 8          tau_s' = -tau_s sigma_t D_s     D_s: length of the way in the box from the sample to the camera
    equation 7          L_ri'  = -tau B sigma_t d       each sample's part of the sum over the path
    equations 10, 7, 8  J_s'   = -sigma_t albedo sum_l p_g E_l V_l P_l    P_l: way of light l in the box to the sample
    equation 9          L_ss'  = (tau_s' kappa_s + tau_s sigma_t) J_s d + tau_s kappa_s J_s' d    each sample's part

So equation 10 does hold the shadow along the light's path; it costs a known length and no sweep. Algorithm 2 credits
every term to the sample where it is evaluated (the record gradRec of positions and terms). Algorithm 3 adds the record
up in the voxels around. It follows that

- the voxels' sum is the derivative for density added alike everywhere, for every pixel and any density. It is exact to
  rounding but for P_l: that is a length, while the sweep for V_l fades over the last half voxel at the box's sides;
- absorption alone (equation 7) is exact voxel by voxel, and so is everything in the limit of thin smoke;
- else a voxel's number is not its partial derivative. What it does to the samples behind it and in its shadow is
  booked there, and what the voxels before it do to its own light is booked to it. Where kappa (D + P) > 1 the sign
  turns: a voxel in thick smoke seems to darken the picture whatever it does.

Slips of the listing that are mended: line 10 lacks d; line 12 lacks d and has tau(x_a, x_u) where equation 7 has
tau(x_a, x). The text leaves open what is chosen here: d is a voxel's edge, and samples lie in the middle of their
steps; the light's transmittance is a volume made once per picture, by the exact renderer's sweeps; volumes are read
trilinearly, and the record is spread with the same weights.
"""

import numpy as np
from numpy.typing import NDArray

from smokelift.baselines import paper_kernels
from smokelift.render import device, gpu_kernels
from smokelift.render import taichi_runtime as taichi
from smokelift.render.gpu_backend import LightSweeps
from smokelift.render.plan import ParallelSweep
from smokelift.render.renderer import Image, Optics, Volume
from smokelift.scene import Camera, Domain
from smokelift.scene.camera import ray_through_pixels


class PaperRenderer:
    """The paper's differentiable renderer for one camera and one grid, in Taichi on the device of this process.

    A point light inside the domain is a ValueError. ``background`` is linear radiance, (rows, columns, 3) or (3,).
    ``"multiple"`` scattering is ``"single"``: the paper stops there.
    """

    def __init__(self, optics: Optics, camera: Camera, background: Image) -> None:
        taichi.start(device.start())
        domain = self.domain = optics.domain
        self.medium = optics.medium
        self._background = np.asarray(background, np.float64)
        setup = optics.plan(camera)
        self._shadows = setup.shadows
        self._lights = setup.lights
        # without lights a black one: kernels want a channel
        self._color = setup.color if self._lights else np.zeros((1, 3))
        self._channels = len(self._color)
        x, y, z = domain.resolution
        self._extinction = taichi.zeros((x + 2, y + 2, z + 2, 1))
        self._lit = taichi.zeros((x + 2, y + 2, z + 2, 1 + self._channels))
        self._inscatter = taichi.zeros((x, y, z, 2 * self._channels))
        self._voxels = taichi.upload(setup.marked)
        self._sweeps = LightSweeps(setup, self._voxels)
        if self._lights and not self._shadows:
            self._shade()  # with no extinction yet
        first, step, count = _samples(camera, domain)
        self._first, self._step = taichi.upload(first), taichi.upload(step)
        begin = np.cumsum(count).reshape(count.shape) - count
        self._samples = taichi.upload(np.stack([begin, count], -1))
        # gradRec: the stacks of all rays, one behind the other
        total = max(int(count.sum()), 1)
        self._position = taichi.zeros((total, 3))
        self._grad = taichi.zeros((total, self._channels))
        self._scattered = taichi.zeros((*count.shape, self._channels))
        self._depth = taichi.zeros(count.shape)

    def image(self, density: Volume) -> Image:
        """Render a density (nx, ny, nz) in linear radiance (rows, columns, 3), and record its derivatives."""
        gpu_kernels.pack(taichi.upload(density), self._voxels, self._extinction, self.medium.extinction)
        if self._shadows:
            self._shade()
        paper_kernels.march(
            self._extinction, self._inscatter, self._first, self._step, self._samples,
            self._position, self._grad, self._scattered, self._depth,
            self.medium.extinction, self.domain.voxel_size, self._shadows, self._channels,
        )  # fmt: skip
        scattered = taichi.download(self._scattered)
        return np.asarray(scattered @ self._color + self._transmittance[..., None] * self._background, np.float32)

    def gradient(self, image_gradient: Image) -> Volume:
        """The paper's densityGrad (nx, ny, nz) for dloss / dimage (rows, columns, 3), from the last image's record."""
        of_image = np.asarray(image_gradient, np.float64)
        of_transmittance = np.sum(of_image * self._background, -1)
        of_every_sample = -self.medium.extinction * self.domain.voxel_size * self._transmittance * of_transmittance
        gradient = taichi.zeros(self.domain.resolution)
        paper_kernels.accumulate(
            self._position, self._grad, self._samples,
            taichi.upload(of_image @ self._color.T), taichi.upload(of_every_sample), gradient, self._channels,
        )  # fmt: skip
        return np.asarray(taichi.download(gradient))

    @property
    def _transmittance(self) -> Image:
        return np.asarray(np.exp(-taichi.download(self._depth)))

    def _shade(self) -> None:
        """Make the volume of in-scattered radiance, by the exact renderer's sweeps."""
        for number, light in enumerate(self._lights):
            self._sweeps.scatter(light, self._extinction, self._lit, 0)
            place = light.direction if isinstance(light, ParallelSweep) else light.position
            paper_kernels.add_light(
                self._lit, self._inscatter, taichi.vector(place), isinstance(light, ParallelSweep),
                self.domain.voxel_size, self._channels, number,
            )  # fmt: skip


def _samples(camera: Camera, domain: Domain) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int64]]:
    """Nearest sample and step (rows, columns, 3) in voxels, and number of samples, of every ray.

    Rays are cut with the box (Hit of algorithm 2). Steps are a voxel's edge long and begin at the back of the box.
    """
    origin, direction = ray_through_pixels(camera)
    h = domain.voxel_size
    steep = np.where(np.abs(direction) < 1e-12, 1e-12, direction)
    at_low, at_high = ((np.array(side) - origin) / steep for side in (domain.min, domain.max))
    near = np.minimum(at_low, at_high).max(-1)
    far = np.maximum(at_low, at_high).min(-1)
    if camera.type == "perspective":
        near = np.maximum(near, 0)
    # rounding must not add a step where the box is a whole number of steps thick
    count = np.maximum(np.floor((far - near) / h + 0.5 - 1e-6), 0).astype(np.int64)
    nearest = origin + (far - (count - 0.5) * h)[..., None] * direction
    first = (nearest - np.array(domain.min)) / h - 0.5
    return first.astype(np.float32), direction.astype(np.float32), count
