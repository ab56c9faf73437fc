// The increment that one linearisation may add to a velocity.
#pragma once

#include "grid.h"
#include "threads.h"

namespace smokelift {

// Largest magnitude of the difference of two velocities, over all components.
float largest_difference(const StaggeredIn &a, const StaggeredIn &b, Workers &workers);

// u + (solution - u, every component clamped to +- largest), projected, over the solution.
void clamp_increment(const StaggeredIn &u, float largest, const StaggeredOut &solution, Workers &workers);

} // namespace smokelift
