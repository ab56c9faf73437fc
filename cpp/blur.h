// Gaussian blur.
#pragma once

#include "grid.h"
#include "threads.h"

namespace smokelift {

// Smooths an array (nx, ny, nz) with a Gaussian of the given standard deviation in cells, cut off at
// `truncate` of them; beyond its ends the array is its own mirror image. Input and output may not be the
// same.
void blur(In a, double width, double truncate, Out result, Workers &workers);

} // namespace smokelift
