// The motion that a momentum source in the smoke sets off.
#pragma once

#include "grid.h"
#include "threads.h"

#include <vector>

namespace smokelift {

// Velocity in cells per frame that smoke of density 1 gains: for each component a constant and, if there are
// slopes, three along x, y, z from -1 to 1 across the box.
using MomentumSource = std::vector<std::array<float, 3>>;

// trust * prediction + P(density * source), with P the pressure projection; the prediction is not read
// where trust is zero.
void add_momentum(In density, const MomentumSource &source, float trust, const StaggeredIn &prediction,
                  const StaggeredOut &result, Workers &workers);

} // namespace smokelift
