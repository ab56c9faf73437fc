// Chambolle and Pock's primal-dual splitting (2011), as in algorithm 5 of Cen, Zhang and Liang (2023).
#pragma once

#include "least_squares.h"
#include "projection.h"

namespace smokelift {

struct PrimalDual {
    double sigma, tau, theta;  // dual step, primal step (the paper's gamma), over-relaxation
    double absolute, relative; // stop at |u' - u| <= sqrt(3) absolute + relative |u'|
    int limit;                 // iterations
    double inner_tolerance;    // of the conjugate gradients in the proximal operator
    int inner_limit;
};

// Minimises the quadratic with the right-hand side b over velocities without divergence, starting from u.
// Throws std::invalid_argument for steps that violate the condition for convergence.
Figures primal_dual(const LeastSquares &problem, const StaggeredField &b, Projection &projection,
                    const PrimalDual &settings, const StaggeredOut &u, Workers &workers);

} // namespace smokelift
