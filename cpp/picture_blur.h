// Gaussian blur of pictures.
#pragma once

#include "codes.h"

#include <vector>

namespace smokelift {

// Smooths a picture (lines, columns, channels) down and across. `weights` are those of a pixel itself and of
// its neighbours on either side, outwards; beyond its edges the picture is its own mirror image. Sums are of
// double precision and in SciPy's order, every product rounded by itself (CMakeLists.txt).
void blur_picture(const float *picture, const Extent &extent, const std::vector<double> &weights,
                  float *result);

} // namespace smokelift
