// A volume on a turntable: its picture from any angle, a pixel a voxel, and factors along the rays of that
// picture.
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

// Of every column of voxels (i, j) the first that is not zero, and the end of those that are not.
void find_filled(In volume, int *spans, Workers &workers);

// Adds the voxels in some spans, beyond which all are zero, up along the rays into a picture (columns, nz). A
// pixel gets what it covers of the shadow of a voxel, a turned square, so that even smoke makes an even
// picture from every angle.
void project_turned(In volume, const int *spans, const Turned &turned, float *picture, Workers &workers);

// Multiplies the voxels in such spans by the exponential of a picture (columns, nz), read with the same
// weights.
void scale_turned(Out volume, const int *spans, const Turned &turned, const float *logarithm,
                  Workers &workers);

} // namespace smokelift
