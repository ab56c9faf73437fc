"""Pictures laid along the rays of many azimuths, filtered so that their sum has no level layers.

What changes smoke alike along level rays has no detail along them: its Fourier transform lies in the plane through the
vertical that faces these rays. The planes of all azimuths share the vertical. So the energy of independent changes adds
up as 1 / k at a wave number k across the vertical, and smoke is drawn up in level layers (backprojection without its
ramp filter: Kak and Slaney, "Principles of Computerized Tomographic Imaging", 1988, ch. 3). Here every wave of a
picture is weighed by the root of the sine of its angle with the vertical. That undoes the layers and keeps how much of
each size there is (docs/experiments/every-view.md).
"""

from __future__ import annotations

import numpy as np
import scipy.fft
from numpy.typing import NDArray

GAIN = (np.pi / 2) ** 0.5
"""Root of one over the mean sine of all angles, so that a picture whose detail has no direction keeps its energy."""


def isotropic(picture: NDArray[np.float32]) -> NDArray[np.float32]:
    """Weigh the waves of a picture (columns, voxels along the axis); see the module.

    What is constant across counts as half a wave in twice the columns.
    """
    waves = scipy.fft.dctn(picture)
    across, along = (np.arange(count, dtype=np.float32) / count for count in picture.shape)
    across[0] = 0.5 / picture.shape[0]
    waves *= np.float32(GAIN) * np.sqrt(across[:, None] / np.hypot(across[:, None], along))
    return np.asarray(scipy.fft.idctn(waves, overwrite_x=True), np.float32)
