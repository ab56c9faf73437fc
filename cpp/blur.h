// Gaussian blur of volumes and of pictures.
#pragma once

#include "codes.h"
#include "grid.h"
#include "threads.h"

#include <vector>

namespace smokelift {

// Smooths an array (nx, ny, nz) with a Gaussian of the given standard deviation in cells, cut off at
// `truncate` of them; beyond its ends the array is its own mirror image. Input and output may not be the
// same.
void blur(In a, double width, double truncate, Out result, Workers &workers);

// Smooths a picture (lines, columns, channels) down and across. `weights` are those of a pixel itself and of
// its neighbors on either side, outwards; beyond its edges the picture is its own mirror image. Sums are of
// double precision and in SciPy's order, every product rounded by itself (CMakeLists.txt).
void blur_picture(const float *picture, const Extent &extent, const std::vector<double> &weights,
                  float *result);

} // namespace smokelift
