// The ray of every pixel of a picture, in grid coordinates.
#pragma once

#include "grid.h"
#include "threads.h"

namespace smokelift {

using Vector = std::array<double, 3>;

// a + x b + y c, at places (x, y) in a picture.
struct Affine {
    Vector a, b, c;

    Vector at(double x, double y) const {
        Vector result;
        for (int axis = 0; axis < 3; ++axis)
            result[axis] = a[axis] + x * b[axis] + y * c[axis];
        return result;
    }
};

// A camera: where in the grid, in voxels, its rays start, and which way they go. Samples are before the start
// or, of a camera that is far away, anywhere.
struct Lens {
    Affine start, direction;
    bool far;
};

// Lines and planes of `Rays`, [row][column][4], and the distance between samples in voxels, [row][column],
// where the bilinear footprint meets a grid of n voxels. Places of columns and of rows are given.
void pixel_rays(const Lens &lens, const std::vector<double> &columns, const std::vector<double> &rows,
                const Shape &n, float *lines, float *length, int *planes, Workers &workers);

} // namespace smokelift
