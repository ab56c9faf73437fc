// Minima of the quadratic over velocities without divergence: by conjugate gradients, and by Chambolle and
// Pock's primal-dual splitting (2011), as in algorithm 5 of Cen, Zhang and Liang (2023).
#pragma once

#include "least_squares.h"
#include "projection.h"

namespace smokelift {

// Minimizes the quadratic from u, which has to be free of divergence and stays so. Stops when the projected
// gradient has fallen to `tolerance` times that of the fluid at rest, after `limit` iterations, or when
// rounding keeps it from falling any further. `b`, the right-hand side, gives its room to the residual in the
// meantime and is the same as before, to rounding, in the end.
Figures projected_cg(const LeastSquares &problem, StaggeredField &b, double tolerance, int limit,
                     const StaggeredOut &u, Workers &workers);

struct PrimalDual {
    double sigma, tau, theta;  // dual step, primal step (the paper's gamma), over-relaxation
    double absolute, relative; // stop at |u' - u| <= sqrt(3) absolute + relative |u'|
    int limit;                 // iterations
    double inner_tolerance;    // of the conjugate gradients in the proximal operator
    int inner_limit;
};

// Minimizes the quadratic with the right-hand side b over velocities without divergence, starting from u.
// Throws std::invalid_argument for steps that violate the condition for convergence.
Figures primal_dual(const LeastSquares &problem, const StaggeredField &b, Projection &projection,
                    const PrimalDual &settings, const StaggeredOut &u, Workers &workers);

} // namespace smokelift
