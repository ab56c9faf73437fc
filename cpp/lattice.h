// Values between the nodes of a lattice that repeats.
#pragma once

#include "grid.h"
#include "threads.h"

#include <cstddef>

namespace smokelift {

// Values, linear between nodes at whole numbers, at `count` finite places: all along x, then along y and
// along z.
void read_lattice(In lattice, const float *places, std::size_t count, float *values, Workers &workers);

} // namespace smokelift
