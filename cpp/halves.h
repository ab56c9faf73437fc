// A grid and one half as fine: each of its voxels stands for two along every axis, the last of an odd number
// for one. The docstrings in register_pictures.cpp say what each function does. Boxes have consecutive
// elements along z.
#pragma once

#include "grid.h"
#include "marked_voxels.h"
#include "threads.h"
#include "voxels.h"

#include <optional>

namespace smokelift {

void means_of_two(const Part<const float> &fine, const std::optional<Part<const bool>> &marked,
                  const Out &coarse, Workers &workers);

void prolong_values(const Part<const float> &coarse, const MarkedVoxels &marked, float *values,
                    Workers &workers);

void scale_alike(const Part<const float> &fine, const Part<const bool> &marked,
                 const Part<const float> &before, const Part<const float> &after, float least,
                 const Part<float> &result, Workers &workers);

// A velocity in the cells of a grid that is twice as fine. Each fine cell has the divergence of its coarse
// one, and what goes through a coarse face goes through its four fine ones. Only the coarse cells beside one
// count (Toth and Roe 2002, J. Comput. Phys. 180, 736).
void prolong(const StaggeredIn &coarse, const StaggeredOut &fine, Workers &workers);

} // namespace smokelift
