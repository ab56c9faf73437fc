#include "axis_modes.h"

#include <cmath>

namespace smokelift {

AxisModes::AxisModes(int n, bool closed_low, bool closed_high, int count) : n_(n), count_(count) {
    const bool symmetric = closed_low == closed_high;
    cells_ = symmetric ? (closed_low ? Transform::dct2 : Transform::dst2)
                       : (closed_low ? Transform::dct4 : Transform::dst4);
    faces_ = symmetric ? (closed_low ? Transform::dst1 : Transform::dct1)
                       : (closed_low ? Transform::dst3 : Transform::dct3);
    // Cells between open ends have no constant mode, so that n of them start with the next.
    first_ = symmetric && !closed_low && count == n;
    for (int k = first_; k < first_ + count; ++k) {
        const double angle = (k + (symmetric ? 0 : 0.5)) * std::acos(-1.0) / n;
        difference.push_back((closed_low ? 2 : -2) * std::sin(angle / 2));
    }
}

} // namespace smokelift
