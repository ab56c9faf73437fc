// How likely smoke is at a voxel by its depth: exp(-(|depth - middle| / width)^flatness).
#pragma once

#include "grid.h"
#include "pictures.h"
#include "threads.h"

#include <array>
#include <vector>

namespace smokelift {

// Values by height and lateral place (m), both ascending; linear between, at the ends as there.
struct HeightTable {
    std::vector<double> heights, laterals;
    const double *values; // [height][lateral]
};

struct DepthProfile {
    std::array<std::vector<double>, 3> places;       // of the voxels along x, y and z, m from a centre
    std::array<std::array<double, 3>, 3> directions; // lateral, depth and height
    HeightTable middle;                              // depth, m
    // Standard deviations (m) across the picture, and of the middles of what stands behind one another.
    HeightTable across, apart;
    // Pictures (rows, columns): the same of the balls that fill the silhouette, and how far (m) each pixel's
    // smoke stands behind the middle.
    const double *balls, *aside;
    int rows, columns;
    double flatness, least, scale; // width = scale x max(least, (across x balls + apart^2)^(1/2))
};

// Shape and width (m) at the marked voxels in their order in memory, which the picture shows at some places;
// `first` is that of count_marked().
void find_profile(const DepthProfile &profile, Mask voxels, const std::vector<std::size_t> &first,
                  const SeenAt &seen_at, float *shapes, float *widths, Workers &workers);

} // namespace smokelift
