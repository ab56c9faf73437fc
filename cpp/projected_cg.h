// Conjugate gradients on the velocities without divergence.
#pragma once

#include "least_squares.h"

namespace smokelift {

// Minimises the quadratic from u, which has to be free of divergence and stays so. Stops when the projected
// gradient has fallen to `tolerance` times that of the fluid at rest, after `limit` iterations, or when
// rounding keeps it from falling any further. `b`, the right-hand side, gives its room to the residual in the
// meantime and is the same as before, to rounding, in the end.
Figures projected_cg(const LeastSquares &problem, StaggeredField &b, double tolerance, int limit,
                     const StaggeredOut &u, Workers &workers);

} // namespace smokelift
