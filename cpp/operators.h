// Finite differences on the MAC grid, in units of one cell.
#pragma once

#include "grid.h"
#include "threads.h"

namespace smokelift {

// Net outflow of every cell.
void divergence(const In3 &faces, Out cells, Workers &workers);

// The same for the cells of one slab.
void divergence_slab(const In3 &faces, Out slab, int i);

// What follows computes slab i (the elements of one x) from whole arrays or from the slabs that it depends
// on, so that what lies in between never needs to be whole.

// Vorticity on the edges inside the box; edges on its sides are left as they are.
void curl_slab(const In3 &faces, const Out3 &edges, int i);

// The slab of faces += transpose of curl applied to edges, which have to be zero on the sides of the box:
// slab i of them and the one after it. Faces that do not reach to slab i have no data.
void add_curl_transposed_slab(const In3 &edges, const In3 &after, const Out3 &faces);

// result = weight (-laplace a) + pointwise * a on rows and columns [low, high) of a slab `a` with those
// before and after it; natural ends: the quadratic form of -laplace is the sum of squared differences between
// neighbors within the box, so that beside an end the slab is its own neighbor. `pointwise` may be empty.
void smoothness_slab(In before, In a, In after, const Shape &low, const Shape &high, float weight,
                     In pointwise, Out result);

// Velocity at cell centers times `direction`, that is, the mean of two faces per axis.
void directional_slab(const In3 &faces, const In3 &direction, Out cells, int i);

// The slab of faces += transpose of directional_slab, from slab i of the cells and the one before it; one of
// the two is empty at the sides of the box.
void add_directional_transposed_slab(In before, In cells, const In3 &direction, const Out3 &faces, int i);

// Values on edges in the direction c: the mean of the four cells around. Edges on the sides of the box are
// left.
void edge_means_slab(In cells, int c, Out edges, int i);

} // namespace smokelift
