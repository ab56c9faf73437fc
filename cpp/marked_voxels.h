// The marked voxels of a grid, and values (count) at them in their order in memory.
#pragma once

#include "grid.h"
#include "threads.h"

#include <cstddef>
#include <vector>

namespace smokelift {

// Neighbors along z are marked together, so that a stretch stands for many indices: what is read or written
// is copied from memory to memory.
class MarkedVoxels {
public:
    struct Stretch {
        int y, z, count;
    };

    MarkedVoxels(Mask voxels, Workers &workers);

    // Those of them at which either volume is above 0.
    MarkedVoxels above_zero(const float *a, const float *b, Workers &workers) const;

    const Shape &shape() const { return n_; }
    std::size_t count() const { return planes_.empty() ? 0 : planes_.back().first + planes_.back().count; }

    void take(const float *volume, float *values, Workers &workers) const;
    // Writes the values times a factor.
    void put(const float *values, float factor, float *volume, Workers &workers) const;

    // visit(y, z, count, at) for the stretches of plane x, `at` the number of the first voxel.
    template <class Visit> void in_plane(int x, const Visit &visit) const {
        std::size_t at = planes_[x].first;
        for (const Stretch &s : planes_[x].stretches) {
            visit(s.y, s.z, s.count, at);
            at += std::size_t(s.count);
        }
    }

private:
    struct Plane {
        std::vector<Stretch> stretches;
        std::size_t first = 0, count = 0; // number of its first voxel, and how many it has
    };

    explicit MarkedVoxels(const Shape &n) : n_(n), planes_(std::size_t(n[0])) {}
    void number();

    Shape n_;
    std::vector<Plane> planes_;
};

void smooth_in_cubes(const MarkedVoxels &voxels, int size, double weight, const float *values,
                     float *smoothed, Workers &workers);

} // namespace smokelift
