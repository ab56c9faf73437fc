// The linearized estimate of a velocity (equations 11 to 13): a quadratic function of the face velocities, in
// cells per frame.
#pragma once

#include "grid.h"
#include "threads.h"

namespace smokelift {

struct Regularization {
    float first_order = 0;  // times the squared differences of each component
    float second_order = 0; // times the squared differences of the vorticity
    float kinetic = 0;      // times the squared velocity
};

//     E(u) = sum over cells of weight (offset + direction . u)^2 + irrotational |curl u|^2 + R(u - center),
//     R(v) = the three terms of Regularization
//
// with `direction`, `offset`, `weight` and `irrotational` at cell centers, (nx, ny, nz).
//
// E(u) = u.Au - 2 b.u + constant with A symmetric and positive definite if kinetic > 0.
class LeastSquares {
public:
    // What is passed here has to outlive this object.
    LeastSquares(const Box &box, const In3 &direction, In weight, In irrotational,
                 const Regularization &regularization)
        : box_(box), regularization_(regularization), direction_(direction), weight_(weight),
          irrotational_(irrotational) {}

    double apply(const StaggeredIn &u, const StaggeredOut &result,
                 Workers &workers) const; // A u; returns u.Au
    StaggeredField right_hand_side(In offset, const StaggeredIn &center, Workers &workers) const; // b
    // The diagonal of A, as it is away from the sides, without what `irrotational` adds.
    void find_diagonal(const StaggeredOut &diagonal, Workers &workers) const;

    // Coefficients of k^0, k^2 and k^4 of a problem with constant coefficients that resembles this one.
    std::array<double, 3> symbol(Workers &workers) const;

    const Box &box() const { return box_; }

private:
    class Window;

    double sweep(const StaggeredIn &u, In offset, const StaggeredOut &result, Workers &workers) const;
    void stress(Window &window, bool irrotational, int i) const;
    void along(Window &window, const StaggeredIn &u, In offset, int i) const;
    double finish(Window &window, const StaggeredIn &u, const StaggeredOut &result, int i) const;
    float data_diagonal(int c, int x, int y, int z) const;

    Box box_;
    Regularization regularization_;
    In3 direction_;
    In weight_, irrotational_;
};

struct Figures {
    int iterations = 0; // of the outer method
    int products = 0;   // with A
    int projections = 0;
    double residual = 0; // relative, as the stopping rule of the method has it
};

// Minimizes the quadratic over velocities without divergence by conjugate gradients, from u, which has to be
// free of divergence and stays so. Stops when the projected gradient has fallen to `tolerance` times that of
// the fluid at rest, after `limit` iterations, or when rounding keeps it from falling any further. `b`, the
// right-hand side, gives its room to the residual in the meantime and is the same as before, to rounding, in
// the end.
Figures projected_cg(const LeastSquares &problem, StaggeredField &b, double tolerance, int limit,
                     const StaggeredOut &u, Workers &workers);

} // namespace smokelift
