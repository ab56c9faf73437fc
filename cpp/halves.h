// A grid and one half as fine: each of its voxels stands for two along every axis, the last of an odd number
// for one.
#pragma once

#include "grid.h"
#include "threads.h"
#include "voxels.h"

#include <optional>
#include <vector>

namespace smokelift {

// A box of somebody's array, with consecutive elements along z.
template <class T> struct Part {
    Strided<T> at;
    Shape n{};

    T *row(int x, int y) const { return at.row(x, y); }
};

// Means of the voxels that each coarse one stands for; beyond the fine grid there is nothing. Rows along z
// without marked voxels are not read, and count as zero; without any marks all are read.
void means_of_two(const Part<const float> &fine, const std::optional<Part<const bool>> &marked,
                  const Out &coarse, Workers &workers);

// The coarse values, linear between the voxels' middles, at the marked fine voxels in their order in memory;
// `first` is where those of each plane across x begin.
void prolong_values(const Part<const float> &coarse, const Part<const bool> &marked,
                    const std::vector<std::size_t> &first, float *values, Workers &workers);

// result = fine x (after / before) at the marked voxels, with coarse values as above, `before` at least
// `least`; the others are left as they are.
void scale_alike(const Part<const float> &fine, const Part<const bool> &marked,
                 const Part<const float> &before, const Part<const float> &after, float least,
                 const Part<float> &result, Workers &workers);

// A velocity in the cells of a grid that is twice as fine. Each fine cell has the divergence of its coarse
// one, and what goes through a coarse face goes through its four fine ones. Only the coarse cells beside one
// count (Toth and Roe 2002, J. Comput. Phys. 180, 736).
void prolong(const StaggeredIn &coarse, const StaggeredOut &fine, Workers &workers);

} // namespace smokelift
