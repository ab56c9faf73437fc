// exp(-x) and 1 - exp(-x), both to rounding, in a form that compilers turn into vector code.
#pragma once

#include "grid.h"

#include <cstdint>
#include <cstring>

namespace smokelift {

struct Attenuation {
    float transmittance, opacity;
};

// For an optical depth x >= 0: exp(-x) = 2^n exp(r) with |r| <= ln(2) / 2, and exp(r) - 1 by its Taylor
// series up to r^7, so that the opacity of a thin step keeps its digits. ln(2) is taken off in two parts, the
// first of so few digits that its product with n is exact (Cody and Waite 1980). Depths beyond 87 count as
// 87: 1e-38 is left, never a denormal.
SMOKELIFT_INLINE Attenuation attenuation(float x) {
    const float shifted = 1.5f * (1 << 23); // adding it rounds to an integer, which then lies in the low bits
    const float t = x < 87.0f ? -x : -87.0f;
    const float rounded = t * 1.44269504f + shifted;
    const float n = rounded - shifted;
    const float r = (t - n * 0.693359375f) + n * 2.12194440e-4f;
    const float series =
        0.5f + r * (1.66666667e-1f +
                    r * (4.16666667e-2f + r * (8.33333333e-3f + r * (1.38888889e-3f + r * 1.98412698e-4f))));
    const float minus_one = r + r * r * series;
    std::int32_t bits;
    std::memcpy(&bits, &rounded, 4);
    bits = static_cast<std::int32_t>((static_cast<std::uint32_t>(bits) - 0x4B400000u + 127u) << 23);
    float power;
    std::memcpy(&power, &bits, 4);
    return {power * minus_one + power, -(power * minus_one + (power - 1.0f))};
}

// exp(x), of any sign.
SMOKELIFT_INLINE float exponential(float x) {
    const float less = attenuation(x < 0 ? -x : x).transmittance;
    return x < 0 ? less : 1 / less;
}

} // namespace smokelift
