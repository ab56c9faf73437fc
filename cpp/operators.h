// Finite differences on the MAC grid, in units of one cell.
#pragma once

#include "grid.h"
#include "threads.h"

namespace smokelift {

// Net outflow of every cell.
void divergence(const In3 &faces, Out cells, Workers &workers);

// Central differences at cell centres, one-sided at the sides of the box.
void gradient(In cells, const Out3 &result, Workers &workers);

// Vorticity on the edges inside the box; edges on its sides are left as they are.
void curl(const In3 &faces, const Out3 &edges, Workers &workers);

// faces += transpose of curl applied to edges, which have to be zero on the sides of the box.
void add_curl_transposed(const In3 &edges, const Out3 &faces, Workers &workers);

// result = weight (-laplace a) + pointwise * a on the index box [low, high), natural ends: the quadratic form
// of -laplace is the sum of squared differences between neighbours within the box. `pointwise` may be empty.
void smoothness(In a, const Shape &low, const Shape &high, float weight, In pointwise, Out result,
                Workers &workers);

// Velocity at cell centres times `direction`, that is, the mean of two faces per axis.
void directional(const In3 &faces, const In3 &direction, Out cells, Workers &workers);

// faces += transpose of directional().
void add_directional_transposed(In cells, const In3 &direction, const Out3 &faces, Workers &workers);

// Long vectors in chunks of a fixed size, so that sums do not depend on the number of threads.
double dot(const float *a, const float *b, std::size_t n, Workers &workers);
void axpy(float factor, const float *x, float *y, std::size_t n, Workers &workers); // y += factor x
void xpay(const float *x, float factor, float *y, std::size_t n, Workers &workers); // y = x + factor y

} // namespace smokelift
