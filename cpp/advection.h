// Semi-Lagrangian transport. Displacements are in cells and belong to the point of arrival: what is at x came
// from x - u(x), the convention in which the estimated velocity is defined.
#pragma once

#include "grid.h"
#include "threads.h"

namespace smokelift {

// Values at x - u(x). From outside the box comes zero, or the nearest value inside if `extend`. `corrected`:
// with MacCormack's correction of the interpolation error (Selle et al. 2008), limited to the values around
// the origin.
void advect_cells(In field, const StaggeredIn &displacement, bool extend, bool corrected, Out result,
                  Workers &workers);

// A velocity on faces, each component at its own positions; values are extended beyond the box.
void advect_faces(const StaggeredIn &field, const StaggeredIn &displacement, bool corrected,
                  const StaggeredOut &result, Workers &workers);

} // namespace smokelift
