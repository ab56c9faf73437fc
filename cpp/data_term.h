// The data term: the change between two densities as a linear function of the velocity u, in cells per frame,
// around a known u_k. Arrays at cell centres, (nx, ny, nz).
#pragma once

#include "grid.h"
#include "threads.h"

namespace smokelift {

// residual + gradient . (u - u_k) = scale (offset + direction . u)
struct Linearisation {
    Out3 direction;            // mean gradient of the two densities over scale
    Out offset;                // over scale too
    Out residual;              // after less carried, not over scale
    Out carried;               // the density before, moved by u_k, over scale
    Out density;               // the larger of the two, not over scale
    Grid<unsigned char> smoke; // whether that exceeds the threshold, as a fraction of its maximum
};

// Returns the scale: the root mean square of the gradient inside the smoke. Where that is zero nothing else
// is defined.
double linearise(In before, In after, const StaggeredIn &u, float threshold, const Linearisation &result,
                 Workers &workers);

// Sums over the cells: weight (offset)^2, weight (offset + direction . u)^2, and weight inside the smoke.
std::array<double, 3> residual_sums(const In3 &direction, In offset, In weight, Mask smoke,
                                    const StaggeredIn &u, Workers &workers);

// Sums over the cells of weight a b for all pairs of the columns, row after row.
std::vector<double> weighted_products(const std::vector<In> &columns, In weight, Workers &workers);

} // namespace smokelift
