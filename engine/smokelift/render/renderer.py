"""Optics, and one camera before one grid: a density in, an image out, and the derivative back.

Smoke takes the same fraction of all colors away, so a picture is scattered radiance S, in one channel where all that is
scattered has the same color and in three otherwise, and transmittance T = exp(-optical depth). Colors are a matter of
the last line:

    L_rgb = S color + T background_rgb.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, get_args

import numpy as np
from numpy.typing import NDArray

from smokelift.checks import Doubles, Mask
from smokelift.render import device
from smokelift.render.cpu_backend import CpuBackend
from smokelift.render.device import products_on_one_thread
from smokelift.render.plan import RenderPlan, camera_rays, light_sweeps, to_eye
from smokelift.scene import SHADOWED, Camera, Domain, FiniteLight, Medium, PointLight, Scattering
from smokelift.scene.domain import box_around

if TYPE_CHECKING:
    from smokelift.render.gpu_backend import GpuBackend

Image = NDArray[np.float32]
Volume = NDArray[np.float32]


@dataclass(frozen=True)
class Optics:
    """How light travels through the smoke of a domain."""

    domain: Domain
    medium: Medium
    """Where the smoke is, and what it does to light."""
    lights: tuple[FiniteLight, ...]
    """Directional and point lights only; an environment is split into many. Without any there is absorption only."""
    scattering: Scattering = "single"
    """``"multiple"``: of all orders, isotropic smoke only; ``"single"``, with self-shadowing; ``"unshadowed"``: light
    reaches every voxel unattenuated; or ``"absorption"``: the background attenuated, nothing else."""

    def renderer(self, camera: Camera, background: Image, support: Mask | None = None) -> Renderer:
        """The renderer of a camera before a background; see `Renderer` for the parameters."""
        return Renderer(self, camera, background, support)

    def plan(self, camera: Camera, support: Mask | None = None) -> RenderPlan:
        """Plan the rendering for a camera; see `Renderer` for the support."""
        scattering, medium = self.scattering, self.medium
        if scattering not in get_args(Scattering):
            raise ValueError(f"scattering must be one of {', '.join(get_args(Scattering))}, not {scattering!r}.")
        if scattering == "multiple" and medium.anisotropy != 0.0:
            raise ValueError(
                f'Scattering "multiple" needs anisotropy 0, not {medium.anisotropy:g}; take scattering "single", or '
                "smoke that scatters alike in all directions."
            )
        if support is None:
            support = np.broadcast_to(np.True_, self.domain.resolution)
        # with the neighbors of the voxels that may hold smoke; one voxel if none may
        x, y, z = part = box_around(support, 1) if support.any() else (slice(0, 1),) * 3
        corner, box = (x.start, y.start, z.start), self.domain.part(part)
        scatters = () if scattering == "absorption" else self.lights
        # light that is scattered again takes on more of the smoke's color
        split = scattering == "multiple" and not medium.is_gray
        sweeps, color = light_sweeps(scatters, self.domain, corner, box.resolution, medium.color, split)
        return RenderPlan(
            domain=self.domain,
            corner=corner,
            marked=support[part].astype(np.uint8),
            medium=medium,
            rays=camera_rays(camera, box),
            to_eye=to_eye(camera, box),
            lights=sweeps,
            color=color,
            shadows=scattering in SHADOWED and len(color) > 0,
            diffuse=scattering == "multiple" and len(color) > 0,
        )

    def unshadowed_source(self) -> Doubles:
        """Source radiance (3,), W/m^2/sr, of isotropic smoke in the middle of the domain, with nothing before it.

        Light that is scattered many times raises it as it raises that of the surface of a half-space, on the mean over
        all directions of the light: 2 / (1 + sqrt(1 - albedo)), the mean of Chandrasekhar's H function (1950,
        Radiative Transfer, section 38).
        """
        total = np.zeros(3)
        for light in self.lights:
            if isinstance(light, PointLight):
                total += np.array(light.intensity) / np.sum((np.array(self.domain.centre) - light.position) ** 2)
            else:
                total += light.irradiance
        albedos = np.array(self.medium.albedos)
        orders = 2 / (1 + np.sqrt(1 - albedos)) if self.scattering == "multiple" else 1.0
        return np.asarray(orders * albedos / (4 * np.pi) * total)


class Renderer:
    """A differentiable renderer for one camera, which stands still, and one grid.

    The background, (rows, columns, 3) or (3,), is linear radiance; a fourth channel, in which smoke sends nothing,
    shows the smoke's transmittance. Only voxels of the support (nx, ny, nz) may hold smoke: what the density says
    elsewhere does not count, the gradient is zero there, and the work follows their number. It is a ValueError if a
    point light stands inside the domain, or anisotropic smoke is to scatter many times.
    """

    def __init__(self, optics: Optics, camera: Camera, background: Image, support: Mask | None = None) -> None:
        self.optics, self.camera = optics, camera
        plan = optics.plan(camera, support)
        self._background = np.asarray(background, np.float32)
        sent = np.asarray(plan.color, np.float32)
        self._color = np.pad(sent, ((0, 0), (0, self._background.shape[-1] - sent.shape[1])))
        self._backend = _backend(plan)
        self._depth: Image = np.zeros(camera.size[::-1], np.float32)

    def image(self, density: Volume, *, keep_record: bool = False) -> Image:
        """Render a density (nx, ny, nz) at voxel centers, finite and >= 0.

        The picture (rows, columns, channels) is linear radiance in the background's channels, row 0 at the top. The
        record is what `gradient` needs: channels + 1 numbers a sample of every ray.
        """
        scattered, self._depth = self._backend.image(density, keep_record)
        with products_on_one_thread():
            colored = scattered @ self._color
        return np.asarray(colored + self.transmittance[..., None] * self._background)

    @property
    def absorbs_only(self) -> bool:
        """Whether no light is scattered: pictures are the attenuated background."""
        return not self._color.size

    @property
    def transmittance(self) -> Image:
        """Transmittance (rows, columns) of the last image's rays."""
        return np.asarray(np.exp(-self._depth))

    def gradient(self, image_gradient: Image, out: Volume | None = None) -> Volume:
        """Pull the derivative of a loss back through the last `image` made with ``keep_record``; uses its record up.

        Of dloss / dimage (rows, columns, channels) it makes dloss / ddensity (nx, ny, nz), 0 outside the support. If
        ``out`` (nx, ny, nz) is given, it is written where there is support, and returned: new memory takes as long as a
        sweep. Elsewhere it is zero, as what an earlier call has returned is.
        """
        image_gradient = np.asarray(image_gradient, np.float32)
        background = np.broadcast_to(self._background, image_gradient.shape)
        transmittance_gradient = np.einsum("...c,...c", image_gradient, background)
        with products_on_one_thread():
            scattered_gradient = np.ascontiguousarray(image_gradient @ self._color.T)
        return self._backend.gradient(scattered_gradient, transmittance_gradient, out)


def _backend(plan: RenderPlan) -> CpuBackend | GpuBackend:
    """What renders a plan on the device of this process."""
    if device.start() == "cpu":
        return CpuBackend(plan)
    from smokelift.render.gpu_backend import GpuBackend  # here, because Taichi takes long to import

    return GpuBackend(plan)
