// Velocities made from others: pushed, refined, held back. All are free of divergence but for rounding.
#pragma once

#include "grid.h"
#include "projection.h"
#include "threads.h"

namespace smokelift {

// A push in the smoke: for each component a constant and, if there are slopes, three along x, y, z from -1
// to 1.
using Push = std::vector<std::array<float, 3>>;

// trust * prediction + P(density * push), with P the projection; the prediction is not looked at where trust
// is zero.
void pushed(In density, const Push &push, float trust, const In3 &prediction, const Closed &closed,
            const Out3 &result, Workers &workers);

// A velocity in the cells of a grid that is twice as fine: linear, ends continued, projected. Faces coincide
// along their own axis; across it centres lie a quarter of a coarse cell off.
void refine(const In3 &coarse, const Closed &closed, const Out3 &result, Workers &workers);

// Largest magnitude of the difference of two velocities.
float largest_difference(const In3 &a, const In3 &b, Workers &workers);

// u + (solution - u, every component cut to +- reach), projected, over the solution.
void hold_back(const In3 &u, float reach, const Closed &closed, const Out3 &solution, Workers &workers);

} // namespace smokelift
