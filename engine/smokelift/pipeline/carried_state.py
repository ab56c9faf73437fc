"""What a frame hands on to the next, in memory and as an interrupted run keeps it."""

from dataclasses import dataclass, replace

from smokelift.footage.images import Picture
from smokelift.output.archive import ResumeState
from smokelift.render import Volume
from smokelift.setup.shot import Shot
from smokelift.transport import Velocity, halved


@dataclass(frozen=True, eq=False)
class CarriedState:
    """What the next frame needs of a frame.

    Attributes
    ----------
    number
        Of the frame, 1 for the clip's first.
    density : (nx, ny, nz) float32
    velocity
        In m/s, on the grid of its estimate, all over the domain.
    smooth_density : (nx, ny, nz) float32, optional
        The density without made-up detail, from which velocity is estimated; None if nothing was made up.
    for_advection : (nx, ny, nz) float32, optional
        What the next frame carries along, if not the density: see `smokelift.density.FittedDensity`.
    picture : (rows, columns), optional
        The picture from which optical flow to the next one is found; None where it is not used. It is not stored.
    """

    number: int
    density: Volume
    velocity: Velocity
    smooth_density: Volume | None = None
    for_advection: Volume | None = None
    picture: Picture | None = None

    def stored(self) -> ResumeState:
        """What a run that is resumed after the frame reads."""
        volumes = {"smooth": self.smooth_density, "steady": self.for_advection}
        kept = {name: volume for name, volume in volumes.items() if volume is not None}
        return ResumeState(self.number, self.density, self.velocity.faces, kept)

    @staticmethod
    def read(state: ResumeState, shot: Shot) -> "CarriedState":
        """The inverse of `stored`."""
        velocity = Velocity(state.velocity, shot.optics.domain.voxel_size, shot.scene.closed)
        shape = shot.optics.domain.resolution
        while shape != velocity.shape:
            shape, velocity = halved(shape), replace(velocity, voxel_size=2 * velocity.voxel_size)
        smooth, for_advection = (state.extra.get(name) for name in ("smooth", "steady"))
        return CarriedState(state.number, state.density, velocity, smooth, for_advection)
