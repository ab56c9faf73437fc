// Poisson's equation on a box of unit cells, solved directly by fast diagonalisation (Lynch, Rice, Thomas
// 1964).
#pragma once

#include "grid.h"
#include "threads.h"
#include "trigonometric.h"

#include <vector>

namespace smokelift {

// -laplace p = f at cell centres, each side closed (no flux) or open (p = 0 on the side itself). Eigenvectors
// along y and z decouple the equations into one tridiagonal system along x for each pair of them.
class Poisson {
public:
    explicit Poisson(const Box &box);

    // Overwrites f with p. With all sides closed p is known up to a constant: the mean of f is removed first.
    void solve(Out f, Workers &workers) const;

private:
    void factorise(int j, std::vector<float> &pivots) const;

    Box box_;
    LineTransform y_, z_;
    std::vector<double> y_square_, z_square_; // eigenvalues of -laplace along y and z
};

} // namespace smokelift
