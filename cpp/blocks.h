// Blocks of voxels: the coarse grid on which light is followed once it has been scattered.
#pragma once

#include "voxels.h"

#include "threads.h"

namespace smokelift {

// Cubes of `size` voxels that cover a grid of voxels and reach half a block beyond it, so that every voxel
// lies between the centres of eight. `offset` is the index of the grid's first voxel among those of the
// first block.
struct Blocks {
    Shape n{};
    int size = 1;
    std::array<int, 3> offset{};

    std::size_t count() const { return volume(n); }
};

// Arrays over blocks are [channel][x][y][z], one after the other, z fastest.

// Means over blocks: extinction kappa, then kappa J by channel.
void average(const Voxels &medium, const Spans &spans, const Blocks &blocks, float *means, Workers &workers);

// Adds to `gradient` what the derivatives by these means say of kappa and J.
void average_adjoint(const Voxels &medium, const Spans &spans, const Blocks &blocks, const float *of_means,
                     const Voxels &gradient, Workers &workers);

// J += factor x values, trilinear between the centres of blocks.
void add_interpolated(const float *values, float factor, const Blocks &blocks, const Voxels &medium,
                      const Spans &spans, Workers &workers);

// Derivative by these values, from that by J.
void interpolate_adjoint(const Voxels &gradient, const Spans &spans, float factor, const Blocks &blocks,
                         float *of_values, Workers &workers);

} // namespace smokelift
