// Velocities from a coarse grid on a fine one.
#pragma once

#include "grid.h"
#include "threads.h"

namespace smokelift {

// A velocity in the cells of a grid that is twice as fine: linear, ends continued, projected. Faces coincide
// along their own axis; across it centres lie a quarter of a coarse cell off. Velocities are in cells per
// frame, so that the numbers double.
void refine(const StaggeredIn &coarse, const StaggeredOut &result, Workers &workers);

} // namespace smokelift
