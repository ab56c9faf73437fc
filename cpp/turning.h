// A volume on a turntable: its picture from any angle, one pixel per voxel, and factors along the rays of
// that picture; see the docstrings in register_pictures.cpp.
#pragma once

#include "grid.h"
#include "threads.h"

namespace smokelift {

// Where the columns of voxels stand in the picture of a turned volume: that of (i, j) is centered on
// first + i step_x + j step_y, in pixels, pixel centers at integers; a voxel is as wide as a pixel.
struct Turned {
    double first, step_x, step_y;
    int columns; // of the picture
};

void project_turned(In volume, const Span *spans, const Turned &turned, float *picture, Workers &workers);
void scale_turned(Out volume, const Span *spans, const Turned &turned, const float *logarithm,
                  Workers &workers);

} // namespace smokelift
