// Orthogonal projection of face velocities on those without divergence (Chorin 1968), in
// any unit.
#pragma once

#include "grid.h"
#include "threads.h"
#include "trigonometric.h"

#include <vector>

namespace smokelift {

// Poisson's equation on a box of unit cells, solved directly by fast diagonalization (Lynch, Rice, Thomas
// 1964). -laplace p = f at cell centers, each side closed (no flux) or open (p = 0 on the side itself).
// Eigenvectors along y and z decouple the equations into one tridiagonal system along x for each pair of
// them.
class Poisson {
public:
    explicit Poisson(const Box &box);

    // Overwrites f with p. With all sides closed p is known up to a constant: the mean of f is removed first.
    void solve(Out f, Workers &workers) const;

private:
    void factorize(int j, std::vector<float> &pivots) const;

    Box box_;
    LineTransform y_, z_;
    std::vector<double> y_square_, z_square_; // eigenvalues of -laplace along y and z
};

// The inner product is sum of w u v over the faces with w = 1 inside the box and w = 1/2 on open sides, where
// a face belongs to half a cell only. Closed sides have no normal velocity.
class Projection {
public:
    explicit Projection(const Box &box) : poisson_(box), pressure_(box.cells) {}

    void apply(const StaggeredOut &u, Workers &workers);

private:
    Poisson poisson_;
    Field pressure_;
};

// max |div u| / max |u|, both in units of one cell; zero for a fluid at rest.
double relative_divergence(const StaggeredIn &u, Workers &workers);

} // namespace smokelift
