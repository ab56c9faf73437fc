// Blocks of voxels: the coarse grid on which light is followed once it has been scattered.
#pragma once

#include "voxels.h"

#include "threads.h"

namespace smokelift {

// Cubes of `size` voxels that cover a grid of voxels and reach half a block beyond it, so that every voxel
// lies between the centers of eight. `offset` is the index of the grid's first voxel among those of the
// first block.
struct Blocks {
    Shape n{};
    int size = 1;
    std::array<int, 3> offset{};

    static constexpr int FIELDS = 4; // of what is linear across a block: mean and slopes (by definition)

    std::size_t count() const { return volume(n); }
};

// Arrays over blocks are [field][x][y][z], one after the other, z fastest. What is linear across a block has
// four fields: the mean, and the slopes along x, y and z, which are the differences across a block. The
// docstrings in register_render.cpp say what each function does.

void average(const Voxels &medium, const Spans &spans, const Blocks &blocks, float *means, Workers &workers);

void average_adjoint(const Voxels &medium, const Spans &spans, const Blocks &blocks,
                     const float *means_gradient, const Voxels &gradient, Workers &workers);

void add_interpolated(const float *values, float factor, const Blocks &blocks, const Voxels &medium,
                      const Spans &spans, Workers &workers);

void interpolate_adjoint(const Voxels &gradient, const Spans &spans, float factor, const Blocks &blocks,
                         float *values_gradient, Workers &workers);

} // namespace smokelift
