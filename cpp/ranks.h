// Order statistics over time.
#pragma once

#include <cstddef>
#include <vector>

namespace smokelift {

// Writes, for each of some ranks from 0 and each of `width` places, the value (ranks, width) that has this
// rank among those of the place in `lines` lines (lines, width), none of which is NaN.
void at_ranks(const float *values, int lines, std::size_t width, const std::vector<int> &ranks,
              float *result);

} // namespace smokelift
