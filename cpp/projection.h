// Orthogonal projection of face velocities on those without divergence (Chorin 1968), in
// any unit.
#pragma once

#include "poisson.h"

namespace smokelift {

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

// Multiplies the normal velocities on the sides of the box, by `open` or by `wall`.
void scale_sides(const StaggeredOut &u, float open, float wall);

// max |div u| / max |u|, both in units of one cell; zero for a fluid at rest.
double relative_divergence(const StaggeredIn &u, Workers &workers);

} // namespace smokelift
