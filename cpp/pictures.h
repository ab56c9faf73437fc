// Where voxels lie in a camera's picture, and what the picture shows there; the docstrings in
// register_pictures.cpp and register_density.cpp say what each function does.
#pragma once

#include "grid.h"
#include "marked_voxels.h"
#include "threads.h"

#include <array>
#include <vector>

namespace smokelift {

// A camera before a grid.
struct PictureMap {
    // From the world (m) to (x depth, y depth, depth), x and y in pixels.
    std::array<std::array<double, 4>, 3> to_pixel{};
    std::array<std::vector<double>, 3> centers; // of the voxels along x, y and z, m
    int rows = 0, columns = 0;                  // of the picture

    Shape shape() const { return {int(centers[0].size()), int(centers[1].size()), int(centers[2].size())}; }
};

// Places in a picture, pixel centers at integers, and whether they are in it and before the camera.
struct Places {
    float *rows, *columns;
    bool *visible;
};

void find_places(const PictureMap &map, const MarkedVoxels &voxels, const Places &places, Workers &workers);

void mark_shown(const PictureMap &map, const unsigned char *picture, bool *shown, Workers &workers);

// How the smoke of voxels is scaled along the rays of a picture.
struct RayScale {
    const double *logarithm; // (rows, columns): of each pixel's factor
    const float *plausible;  // smoke towards which a step leads; without it steps are even
    float floor, max_gain;
    float fraction; // of the step that is made
};

void scale_along_rays(const RayScale &scale, const PictureMap &map, const MarkedVoxels &voxels,
                      const float *values, float *scaled, Workers &workers);

void read_bilinearly(const double *picture, int rows, int columns, const float *at_rows,
                     const float *at_columns, std::size_t count, float *values, Workers &workers);

// How likely smoke is at a voxel by its depth: exp(-(|depth - middle| / width)^(halves / 2)).
struct DepthProfile {
    std::array<std::vector<double>, 3> places; // of the voxels along x, y and z, m from a center
    std::array<double, 3> depth;               // direction
    const double *middle, *width;              // pictures (rows, columns) of each ray's, m
    int rows, columns;
    int halves;
};

// Shape and width (m) at the marked voxels, which the picture shows at some rows and columns.
void find_profile(const DepthProfile &profile, const MarkedVoxels &voxels, const float *at_rows,
                  const float *at_columns, float *shapes, float *widths, Workers &workers);

} // namespace smokelift
