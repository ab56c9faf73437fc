// How likely smoke is at a voxel by its depth: exp(-(|depth - middle| / width)^flatness).
#pragma once

#include "grid.h"
#include "pictures.h"
#include "threads.h"

#include <array>
#include <vector>

namespace smokelift {

struct DepthProfile {
    std::array<std::vector<double>, 3> places; // of the voxels along x, y and z, m from a centre
    std::array<double, 3> depth;               // direction
    const double *middle, *width;              // pictures (rows, columns) of each ray's, m
    int rows, columns;
    double flatness;
};

// Shape and width (m) at the marked voxels in their order in memory, which the picture shows at some places;
// `first` is that of count_marked().
void find_profile(const DepthProfile &profile, Mask voxels, const std::vector<std::size_t> &first,
                  const SeenAt &seen_at, float *shapes, float *widths, Workers &workers);

} // namespace smokelift
