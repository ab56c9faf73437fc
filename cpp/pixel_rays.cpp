#include "pixel_rays.h"

#include "voxels.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace smokelift {
namespace {

// Voxels a plane. Rays of less slope stay in one column of voxels, and dividing by this loses nothing.
constexpr double MIN_SLOPE = 1e-9;

// The footprint is open, so places are kept so many voxels inside (-1, n): floats then round to the same cell
// everywhere.
constexpr double INSIDE = 1e-3;

struct Range {
    double first, last;
};

// From where to where a ray at `offset + slope k` in plane k has its footprint among n voxels.
Range among(double offset, double slope, int n) {
    const double low = -1 + INSIDE - offset, high = n - INSIDE - offset;
    constexpr double never = std::numeric_limits<double>::infinity();
    if (slope == 0) // beside the grid in all planes or in none
        return low > 0 || high < 0 ? Range{never, -never} : Range{-never, never};
    const double steep = std::abs(slope) < MIN_SLOPE ? MIN_SLOPE : slope;
    return {std::min(low / steep, high / steep), std::max(low / steep, high / steep)};
}

void ray(const Lens &lens, double x, double y, const Shape &n, float *line, float *length, int *planes) {
    const Vector start = lens.start.at(x, y), direction = lens.direction.at(x, y);
    int axis = 0;
    for (int other = 1; other < 3; ++other)
        if (std::abs(direction[other]) > std::abs(direction[axis]))
            axis = other;
    const double along = direction[axis];
    double offset[2], slope[2];
    Range range{0, double(n[axis] - 1)};
    for (int side = 0; side < 2; ++side) {
        const int other = LATERAL[axis][side];
        slope[side] = direction[other] / along;
        offset[side] = start[other] - slope[side] * start[axis];
        const Range inside = among(offset[side], slope[side], n[other]);
        range = {std::max(range.first, inside.first), std::min(range.last, inside.last)};
    }
    range = {std::ceil(range.first), std::floor(range.last)};
    if (!lens.far && along > 0) // nothing behind the eye
        range.first = std::max(range.first, std::floor(start[axis]) + 1);
    if (!lens.far && along < 0)
        range.last = std::min(range.last, std::ceil(start[axis]) - 1);
    const bool hits = range.first <= range.last;
    for (int side = 0; side < 2; ++side) { // a ray that misses can pass at any distance
        line[2 * side] = hits ? float(offset[side]) : 0;
        line[2 * side + 1] = hits ? float(slope[side]) : 0;
    }
    *length = float(std::hypot(direction[0], direction[1], direction[2]) / std::abs(along));
    planes[0] = axis;
    planes[1] = along > 0 ? 1 : -1;
    planes[2] = hits ? int(range.first) : 0;
    planes[3] = hits ? int(range.last) : -1;
}

} // namespace

void pixel_rays(const Lens &lens, const std::vector<double> &columns, const std::vector<double> &rows,
                const Shape &n, float *lines, float *length, int *planes, Workers &workers) {
    workers.run(int(rows.size()), [&](int row) {
        std::size_t pixel = row * columns.size();
        for (double column : columns) {
            ray(lens, column, rows[row], n, lines + 4 * pixel, length + pixel, planes + 4 * pixel);
            ++pixel;
        }
    });
}

} // namespace smokelift
