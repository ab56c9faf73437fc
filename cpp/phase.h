// What a row of voxels scatters towards the camera.
#pragma once

#include "lighting.h"

#include <algorithm>
#include <cmath>

namespace smokelift {

constexpr float PI = 3.14159265f; // (by definition)
// Least square of a distance to the eye (m^2), and least 1 + g^2 - 2 g cosine: nothing is divided by 0.
constexpr float MIN_SQUARE = 1e-30f, MIN_BASE = 1e-6f;

// A value that changes linearly along the row: value(c) = at_0 + c step, in each of the three axes.
struct RowOfVectors {
    float at_0[3], step[3];
};

// From the voxels of row i of plane k across an axis to the eye, of any length.
SMOKELIFT_INLINE RowOfVectors eye_directions(const Phase &phase, int axis, int k, int i) {
    const int b = LATERAL[axis][0], c = LATERAL[axis][1];
    RowOfVectors row{};
    for (int m = 0; m < 3; ++m) {
        const auto &a = phase.to_eye[m];
        row.at_0[m] = a[3] + a[axis] * float(k) + a[b] * float(i);
        row.step[m] = a[c];
    }
    return row;
}

// Albedo times the numerator of Henyey and Greenstein's phase function (1941), 1/sr.
SMOKELIFT_INLINE float phase_norm(const Phase &phase) {
    const float g = phase.anisotropy;
    return phase.albedo * (1 - g * g) / (4 * PI);
}

// albedo x Henyey-Greenstein for voxels first ... end - 1 of a row into out[0 ...].
SMOKELIFT_INLINE void phase_row(const Phase &phase, const ParallelLight &light, int axis, int k, int i,
                                int first, int end, float *__restrict out) {
    const float g = phase.anisotropy, norm = phase_norm(phase);
    const RowOfVectors eye = eye_directions(phase, axis, k, i);
    const int count = end - first;
    if (g == 0) {
        std::fill_n(out, count, norm);
        return;
    }
    const float *l = light.direction.data();
    for (int c = 0; c < count; ++c) {
        const float at = float(first + c);
        const float x = eye.at_0[0] + at * eye.step[0], y = eye.at_0[1] + at * eye.step[1],
                    z = eye.at_0[2] + at * eye.step[2];
        const float cosine =
            (l[0] * x + l[1] * y + l[2] * z) / std::sqrt(std::max(x * x + y * y + z * z, MIN_SQUARE));
        const float base = std::max(1 + g * g - 2 * g * cosine, MIN_BASE);
        out[c] = norm / (base * std::sqrt(base));
    }
}

// The same times 1 / (distance to the light in voxels)^2.
SMOKELIFT_INLINE void phase_row(const Phase &phase, const PointLight &light, int axis, int k, int i,
                                int first, int end, float *__restrict out) {
    const float g = phase.anisotropy, norm = phase_norm(phase);
    const RowOfVectors eye = eye_directions(phase, axis, k, i);
    float from[3]{}, along[3]{};
    const int at_0[3] = {k, i, 0}, axes[3] = {axis, LATERAL[axis][0], LATERAL[axis][1]};
    for (int m = 0; m < 3; ++m)
        from[axes[m]] = float(at_0[m] - light.position[axes[m]]);
    along[axes[2]] = 1;
    for (int c = 0; c < end - first; ++c) {
        const float at = float(first + c);
        const float x = eye.at_0[0] + at * eye.step[0], y = eye.at_0[1] + at * eye.step[1],
                    z = eye.at_0[2] + at * eye.step[2];
        const float u = from[0] + at * along[0], v = from[1] + at * along[1], w = from[2] + at * along[2];
        const float square = u * u + v * v + w * w;
        const float cosine =
            (u * x + v * y + w * z) / std::sqrt(std::max(x * x + y * y + z * z, MIN_SQUARE) * square);
        const float base = std::max(1 + g * g - 2 * g * cosine, MIN_BASE);
        out[c] = norm / (base * std::sqrt(base) * square);
    }
}

// J of a row from what reaches it, by channel: J = E lit, or J += E lit.
SMOKELIFT_INLINE void write_inscatter(const Voxels &medium, float *voxel, Stride stride, const float *energy,
                                      const float *__restrict lit, int count, bool add) {
    for (int channel = 0; channel < medium.width - 1; ++channel) {
        float *out = voxel + 1 + channel;
        if (add)
            for (int c = 0; c < count; ++c)
                out[c * stride] += energy[channel] * lit[c];
        else
            for (int c = 0; c < count; ++c)
                out[c * stride] = energy[channel] * lit[c];
    }
}

} // namespace smokelift
