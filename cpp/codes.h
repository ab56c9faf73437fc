// Pictures as they are stored, in codes of 8 bits, whose values a table tells, and means of them. Every
// product is rounded by itself (CMakeLists.txt): sums are those of the same steps in NumPy, to the last bit.
// The docstrings in register_pictures.cpp say what each function does.
#pragma once

#include <cstddef>

namespace smokelift {

// Lines of codes [line][column and channel], `stride` bytes apart.
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

void sum_lines(const CodedLines &picture, const float *table, const LineWeights &weights, float *sums);

struct Extent {
    int lines = 0, columns = 0, channels = 0;
};

void sum_columns(const float *values, const Extent &picture, const LineWeights &weights, float *sums);

// Parts of a picture: `rows` x `columns` of them, with a weight for each channel of each. The n-th part down
// has the lines from `first_line[n]` to `first_line[n + 1]`; across, columns likewise.
struct PartWeights {
    const float *weights;
    const int *first_line, *first_column;
    int rows = 0, columns = 0;
};

void add_weighted(const CodedLines &picture, const float *table, const PartWeights &weights, float *sums);

} // namespace smokelift
