// Square patches of a picture, and their distribution.
#pragma once

#include "threads.h"

#include <cstddef>

namespace smokelift {

// Some patches of a picture.
struct Patches {
    const int *rows, *columns; // of their middle pixels, so that every patch lies in the picture
    std::size_t count;
    int size; // pixels along a side, odd
};

// Writes the pixels of the patches (size * size, count) of a picture with so many columns.
void unfold(const float *picture, int columns, const Patches &patches, float *pixels, Workers &workers);

// Writes the mean, for each pixel of a picture (rows, columns), of what the patches that cover it hold there;
// 0 where none does. Not parallel: patches overlap.
void fold(const float *pixels, const Patches &patches, int rows, int columns, float *picture);

// Replaces each value of some lines (lines, count) by its distance to the wanted line's quantile of the same
// rank: `wanted` (lines, known) is sorted. This is the one-dimensional optimal transport between the two.
void to_quantiles(float *values, int lines, std::size_t count, const float *wanted, std::size_t known,
                  Workers &workers);

} // namespace smokelift
