// Velocities from a coarse grid on a fine one, cell by cell.
#pragma once

#include "grid.h"
#include "threads.h"

namespace smokelift {

// A velocity in the cells of a grid that is twice as fine. Each fine cell has the divergence of its coarse
// one, and what goes through a coarse face goes through its four fine ones. Only the coarse cells beside one
// count (Toth and Roe 2002, J. Comput. Phys. 180, 736).
void prolong(const StaggeredIn &coarse, const StaggeredOut &fine, Workers &workers);

} // namespace smokelift
