// Values between the nodes of a lattice that repeats: the twin of density/lattice_noise.py.
#pragma once

#include "marked_voxels.h"

#include <array>

namespace smokelift {

// Where voxels lie in a lattice, in nodes: index x scale + shift + motion x stretch. The motion is that of
// all voxels along x, then along y and along z.
struct LatticePlaces {
    float scale;
    std::array<float, 3> shift;
    const float *motion;
    float stretch;
};

void read_lattice(In lattice, const LatticePlaces &places, const MarkedVoxels &voxels, float *values,
                  Workers &workers);

} // namespace smokelift
