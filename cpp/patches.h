// Square patches of a picture, and their distribution; the docstrings in register_pictures.cpp say what each
// function does.
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

void unfold(const float *picture, int columns, const Patches &patches, float *pixels, Workers &workers);
// Not parallel: patches overlap.
void fold(const float *pixels, const Patches &patches, int rows, int columns, float *picture);
void to_quantiles(float *values, int lines, std::size_t count, const float *wanted, std::size_t known,
                  Workers &workers);

} // namespace smokelift
