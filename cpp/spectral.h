// The solution of a constant-coefficient problem for a velocity without divergence, by expansion in the modes
// of the box.
#pragma once

#include "grid.h"
#include "threads.h"
#include "trigonometric.h"

namespace smokelift {

// With -laplace = k^2 in modes, applies the inverse of  zeroth + second k^2 + fourth k^4  after the
// orthogonal projection on fields without divergence, with which it commutes. Its inner product is that of
// Projection.
class Spectral {
public:
    Spectral(const Box &box, double zeroth, double second, double fourth);

    // Takes a derivative with respect to the faces (a plain one, without the weights of the inner product) to
    // a preconditioned gradient without divergence, which stays here as modes; returns the product of the
    // two.
    double precondition(const StaggeredIn &derivative, Workers &workers);

    // search = gradient + factor * search
    void descend(float factor, const StaggeredOut &search, Workers &workers);

    // Room for a velocity where the modes are: either overwrites the other.
    StaggeredOut room();

private:
    Box box_;
    Shape modes_;
    std::array<LineTransform, 3> cells_, faces_;
    std::array<std::vector<float>, 3> difference_;
    float zeroth_, second_, fourth_;
    std::array<Out, 3> expansion_; // modes along y and z, points along x
    std::array<Field, 3> memory_;
};

} // namespace smokelift
