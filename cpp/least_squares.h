// The linearised estimate of a velocity: a quadratic function of the face velocities, in cells per frame.
#pragma once

#include "grid.h"
#include "threads.h"

namespace smokelift {

struct Regularisation {
    float first_order = 0;  // times the squared differences of each component
    float second_order = 0; // times the squared differences of the vorticity
    float kinetic = 0;      // times the squared velocity
};

//     E(u) = sum over cells of weight (offset + direction . u)^2 + irrotational |curl u|^2 + R(u - centre),
//     R(v) = the three terms of Regularisation
//
// E(u) = u.Au - 2 b.u + constant with A symmetric and positive definite if kinetic > 0.
class LeastSquares {
public:
    LeastSquares(const In3 &direction, In offset, In weight, In irrotational, const In3 &centre,
                 const Regularisation &regularisation, const Closed &closed);

    void apply(const In3 &u, const Out3 &result, Workers &workers); // A u
    Field3 right_hand_side(Workers &workers);                       // b
    Field3 diagonal(Workers &workers) const;                        // of A, as it is away from the sides

    // Coefficients of k^0, k^2 and k^4 of a problem with constant coefficients that resembles this one.
    std::array<double, 3> symbol() const;

    const Shape &shape() const { return shape_; }
    const Closed &closed() const { return closed_; }
    std::array<Shape, 3> shapes() const { return face_shapes(shape_); }

private:
    void regularise(const In3 &u, const Out3 &result, Workers &workers, bool irrotational = true);

    Shape shape_;
    Closed closed_;
    Regularisation regularisation_;
    Field3 direction_, centre_, irrotational_; // the last on edges
    Field offset_, weight_;
    Field3 vorticity_, stress_; // scratch on edges, zero on the sides of the box
    Field along_;               // scratch: weight * (direction . u)
};

struct Figures {
    int iterations = 0; // of the outer method
    int products = 0;   // with A
    int projections = 0;
    double residual = 0; // relative, as the stopping rule of the method has it
};

} // namespace smokelift
