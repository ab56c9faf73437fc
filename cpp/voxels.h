// The renderer's grid: voxels with a border of one around them, and where among them there can be smoke.
#pragma once

#include "grid.h"

#include "threads.h"

#include <algorithm>
#include <cstddef>
#include <type_traits>
#include <vector>

namespace smokelift {

using Stride = std::ptrdiff_t;

// The two other axes of each axis (by definition).
constexpr int LATERAL[3][2] = {{1, 2}, {0, 2}, {0, 1}};

// `width` floats per voxel: extinction (1/m), then in-scattered radiance J by channel (or derivatives by
// these). Indices run from -1, the border, to n. Extinction is 0 in the border, J that of the nearest voxel.
struct Voxels {
    float *data = nullptr;
    Shape n{};
    int width = 1;

    Stride stride(int axis) const {
        const Stride z = width, y = z * (n[2] + 2);
        return axis == 2 ? z : axis == 1 ? y : y * (n[1] + 2);
    }
    float *at(int x, int y, int z) const {
        return data + (x + 1) * stride(0) + (y + 1) * stride(1) + (z + 1) * stride(2);
    }
    // The voxel in plane k across an axis, at (i, j) of the two other axes.
    float *at(int axis, int k, int i, int j) const {
        return axis == 0 ? at(k, i, j) : axis == 1 ? at(i, k, j) : at(i, j, k);
    }
};

// The first floats of neighboring voxels of a row, `stride` apart.
SMOKELIFT_INLINE void load_row(const float *__restrict from, Stride stride, int count, float *__restrict to) {
    const auto load = [&](auto apart) SMOKELIFT_INLINE_LAMBDA {
        for (int c = 0; c < count; ++c)
            to[c] = from[c * apart];
    };
    if (stride == 1)
        load(std::integral_constant<int, 1>());
    else if (stride == 2)
        load(std::integral_constant<int, 2>());
    else if (stride == 4)
        load(std::integral_constant<int, 4>());
    else
        load(stride);
}

// Ranges of rows of voxels: along z by (x, y), and along y by (x, z).
struct Spans {
    std::vector<Span> along_z, along_y;
    Shape n{};

    // The row at lateral position i of plane k across an axis.
    const Span &row(int axis, int k, int i) const {
        return axis == 0   ? along_z[std::size_t(k) * n[1] + i]
               : axis == 1 ? along_z[std::size_t(i) * n[1] + k]
                           : along_y[std::size_t(i) * n[2] + k];
    }
};

// For every row the range in which voxels are marked, or lie beside a marked one, corners included.
Spans spans_around(const unsigned char *marked, const Shape &n);

// A box of somebody's array, with its strides.
template <class T> struct Part {
    T *data = nullptr;
    std::array<Stride, 3> stride{};
    Shape n{};

    T *row(int x, int y) const { return data + x * stride[0] + y * stride[1]; }
};

// Extinction of the marked voxels from their density.
void pack(const Part<const float> &density, const unsigned char *marked, float extinction, const Spans &spans,
          const Voxels &medium, Workers &workers);

// result = extinction x first channel at the marked voxels; the others are left as they are.
void unpack(const Voxels &gradient, const unsigned char *marked, float extinction, const Part<float> &result,
            Workers &workers);

void clear(const Voxels &voxels, Workers &workers);

// In-scattered radiance of the border: the nearest voxel's. And the adjoint, which leaves zeros there.
void extend_into_border(const Voxels &medium);
void fold_border(const Voxels &gradient);

} // namespace smokelift
