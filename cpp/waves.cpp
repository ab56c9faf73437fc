#include "waves.h"

#include <cmath>

namespace smokelift {

Waves::Waves(int n, bool closed_low, bool closed_high, int count) : n_(n), even_(0), closed_low_(closed_low) {
    const double pi = std::acos(-1.0);
    const bool symmetric = closed_low == closed_high;
    // Cells between open ends have no constant wave, so that n of them start with the next.
    const double shift = !symmetric ? 0.5 : !closed_low && count == n ? 1 : 0;
    for (int parity = 0; parity < 2; ++parity)
        for (int k = parity; k < count; k += 2) {
            angles_.push_back((k + shift) * pi / n);
            difference.push_back((closed_low ? 2 : -2) * std::sin(angles_.back() / 2));
            even_ += symmetric && parity == 0;
        }
}

Basis Waves::basis(int length, double offset, bool cosine) const {
    std::vector<double> vectors;
    for (double angle : angles_) {
        double norm = 0;
        for (int i = 0; i < length; ++i) {
            const double phase = angle * (i + offset);
            const double value = cosine ? std::cos(phase) : std::sin(phase);
            const bool half = offset == 0 && (i == 0 || i == length - 1);
            vectors.push_back(value);
            norm += (half ? 0.5 : 1) * value * value;
        }
        // A wave that is zero on these points comes out as rounding error.
        const double factor = norm > 1e-6 ? 1 / std::sqrt(norm) : 0;
        for (auto v = vectors.end() - length; v != vectors.end(); ++v)
            *v *= factor;
    }
    return Basis(length, even_, vectors);
}

} // namespace smokelift
