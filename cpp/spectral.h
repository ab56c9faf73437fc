// The solution of a constant-coefficient problem for a velocity without divergence, by expansion in waves.
#pragma once

#include "dense.h"
#include "grid.h"
#include "threads.h"

namespace smokelift {

// With -laplace = k^2 in waves, applies the inverse of  zeroth + second k^2 + fourth k^4  after the
// orthogonal projection on fields without divergence, with which it commutes. Its inner product is that of
// Projection.
class Spectral {
public:
    Spectral(const Shape &n, const Closed &closed, double zeroth, double second, double fourth);

    // Takes a derivative with respect to the faces (a plain one, without the weights of the inner product) to
    // a preconditioned gradient without divergence, which stays here as waves; returns the product of the
    // two.
    double precondition(const In3 &derivative, Workers &workers);

    // search = gradient + factor * search
    void descend(float factor, const Out3 &search, Workers &workers);

    // Room for a velocity where the waves are: either overwrites the other.
    Out3 room();

private:
    Shape n_, modes_;
    std::array<Basis, 3> cells_, faces_;
    std::array<std::vector<float>, 3> difference_;
    float zeroth_, second_, fourth_;
    std::array<Out, 3> waves_; // waves along y and z, points along x
    std::array<Field, 3> memory_;
};

} // namespace smokelift
