#include "waves.h"

#include <cmath>

namespace smokelift {

Waves::Waves(int n, bool closed_low, bool closed_high, int count) : n_(n), count_(count) {
    const bool symmetric = closed_low == closed_high;
    cells_ = symmetric ? (closed_low ? Wave::cos2 : Wave::sin2) : (closed_low ? Wave::cos4 : Wave::sin4);
    faces_ = symmetric ? (closed_low ? Wave::sin1 : Wave::cos1) : (closed_low ? Wave::sin3 : Wave::cos3);
    // Cells between open ends have no constant wave, so that n of them start with the next.
    first_ = symmetric && !closed_low && count == n;
    for (int k = first_; k < first_ + count; ++k) {
        const double angle = (k + (symmetric ? 0 : 0.5)) * std::acos(-1.0) / n;
        difference.push_back((closed_low ? 2 : -2) * std::sin(angle / 2));
    }
}

} // namespace smokelift
