// Pictures as they are stored, in codes of 8 bits, whose values a table tells.
#pragma once

#include <cstddef>

namespace smokelift {

// Lines of codes, `stride` bytes apart.
struct CodedLines {
    const unsigned char *codes = nullptr;
    std::ptrdiff_t stride = 0;
    int lines = 0, width = 0;
};

// Which lines a new one is the weighted sum of: those of `lines` and `weights` from `first[n]` to `first[n +
// 1]`.
struct LineWeights {
    const int *first, *lines;
    const float *weights;
    int count = 0;
};

// Writes the weighted sums of values, (count, width). Each is added up in the order of its weights, every
// product rounded by itself: as a sparse matrix would be multiplied with the values.
void sum_lines(const CodedLines &picture, const float *table, const LineWeights &weights, float *sums);

} // namespace smokelift
