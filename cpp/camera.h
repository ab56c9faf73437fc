// Camera rays through the grid: the picture, and its derivative. Eq. 1 to 5 of Cen, Zhang and Liang (2023),
// with the opacity of a step as 1 - exp(-optical depth); the derivative is that of the sums over samples.
#pragma once

#include "voxels.h"

#include "threads.h"

#include <vector>

namespace smokelift {

// Neighboring pixels of a row whose rays have the same dominant axis and travel the same way along it.
struct Run {
    int row, column, count;
    int axis, travel;
    int first, last;        // planes that any of them crosses
    std::size_t before = 0; // planes that the runs before it cross

    int planes() const { return last - first + 1; }
};

// One ray per pixel. A ray crosses plane k of its dominant axis at (b0 + b1 k, c0 + c1 k), in grid
// coordinates.
struct Rays {
    static constexpr int LANES = 16; // pixels of a run, at most

    const float *lines = nullptr;  // [row][column][4]: b0, b1, c0, c1
    const float *length = nullptr; // [row][column]: distance between samples, m
    // [row][column][4]: dominant axis, travel, first and last plane. Last < first: none.
    int *planes = nullptr;
    int rows = 0, columns = 0;
    std::vector<Run> runs;

    void find_runs();
    // Planes that the runs cross, all together.
    std::size_t planes_of_runs() const {
        return runs.empty() ? 0 : runs.back().before + runs.back().planes();
    }
    std::size_t pixels() const { return std::size_t(rows) * columns; }
};

// What the samples held, or the derivatives of the loss by that: run after run [plane][channel][lane], the
// channels those of the voxels. A ray without a sample in a plane of its run has zeros there.
struct Record {
    float *data = nullptr;

    float *at(const Run &run, int plane, int channels) const {
        return data + (run.before + std::size_t(plane - run.first)) * channels * Rays::LANES;
    }
};

// Shortens every ray to where the voxels around it hold anything, and finds the runs again.
void clip(const Voxels &medium, Rays &rays, Workers &workers);

// Radiance scattered towards the camera (W/m^2/sr), [row][column][channel], and optical depth of every ray,
// [row][column]. The record is optional.
void march(const Voxels &medium, const Rays &rays, float *scattered, float *depth, const Record &record,
           Workers &workers);

// Turns the recorded samples into derivatives of the loss, in place, and adds them to the voxels of
// `gradient`. Given are its derivatives by the radiance scattered along every ray and by the ray's
// transmittance.
void march_adjoint(const Rays &rays, const float *depth, const float *scattered_gradient,
                   const float *transmittance_gradient, const Record &record, const Voxels &gradient,
                   Workers &workers);

} // namespace smokelift
