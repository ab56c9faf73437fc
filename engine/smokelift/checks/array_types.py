"""Types of arrays, by what they hold; shapes and units stand where they are used."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]
"""Single precision: densities, velocities, radiance."""

Doubles = NDArray[np.float64]
"""Double precision: places, directions, sums."""

Mask = NDArray[np.bool_]
"""Whether something holds of a pixel or a voxel."""

Indices = NDArray[np.intp]
"""Places in other arrays."""
