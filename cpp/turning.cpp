#include "turning.h"

#include "compiler.h"
#include "exponential.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace smokelift {
namespace {

constexpr int taps = 3;   // a square's shadow is at most sqrt(2) pixels wide
constexpr int chunk = 32; // voxels of a column at a time

double ramp(double x) { return x > 0 ? x * x / 2 : 0; }

// The integral up to x of the shadow of a square whose sides appear a and b wide: the convolution of two
// boxes.
double shadow_up_to(double x, double a, double b) {
    const double outer = (a + b) / 2, inner = (a - b) / 2;
    return (ramp(x + outer) - ramp(x + inner) - ramp(x - inner) + ramp(x - outer)) / (a * b);
}

struct Taps {
    int first; // column of the first weight, which may lie outside the picture
    std::array<float, taps> weights;
};

std::vector<Taps> find_taps(const Shape &n, const Turned &turned) {
    const double thinnest = 1e-3; // of a square seen from its side
    const double a = std::max(std::abs(turned.step_x), thinnest),
                 b = std::max(std::abs(turned.step_y), thinnest);
    std::vector<Taps> found;
    for (int i = 0; i < n[0]; ++i)
        for (int j = 0; j < n[1]; ++j) {
            const double centre = turned.first + i * turned.step_x + j * turned.step_y;
            Taps one{int(std::lround(centre)) - 1, {}};
            for (int t = 0; t < taps; ++t) {
                const double at = one.first + t - centre;
                const int column = one.first + t;
                if (column >= 0 && column < turned.columns)
                    one.weights[t] = float(shadow_up_to(at + 0.5, a, b) - shadow_up_to(at - 0.5, a, b));
            }
            found.push_back(one);
        }
    return found;
}

int chunks_of(int nz) { return (nz + chunk - 1) / chunk; }

SMOKELIFT_CLONES
void add(const float *__restrict a, float factor, float *__restrict out, int n) {
    for (int k = 0; k < n; ++k)
        out[k] += factor * a[k];
}

SMOKELIFT_CLONES
void multiply_by_exponential(const float *__restrict logarithm, float *__restrict out, int n) {
    for (int k = 0; k < n; ++k) {
        const float x = logarithm[k];
        const float less = attenuation(x < 0 ? -x : x).transmittance;
        out[k] *= x < 0 ? less : 1 / less;
    }
}

} // namespace

void project_turned(In volume, const Turned &turned, float *picture, Workers &workers) {
    const auto [nx, ny, nz] = volume.n;
    const std::vector<Taps> all = find_taps(volume.n, turned);
    std::fill_n(picture, std::size_t(turned.columns) * nz, 0.0f);
    workers.run(chunks_of(nz), [&, nx = nx, ny = ny, nz = nz](int part) {
        const int k = part * chunk, count = std::min(chunk, nz - k);
        for (int i = 0; i < nx; ++i)
            for (int j = 0; j < ny; ++j) {
                const Taps &one = all[std::size_t(i) * ny + j];
                for (int t = 0; t < taps; ++t)
                    if (one.weights[t] != 0)
                        add(volume.row(i, j) + k, one.weights[t],
                            picture + std::size_t(one.first + t) * nz + k, count);
            }
    });
}

void scale_turned(Out volume, const Turned &turned, const float *logarithm, Workers &workers) {
    const auto [nx, ny, nz] = volume.n;
    const std::vector<Taps> all = find_taps(volume.n, turned);
    workers.run(nx, [&, ny = ny, nz = nz](int i) {
        std::vector<float> read(nz);
        for (int j = 0; j < ny; ++j) {
            const Taps &one = all[std::size_t(i) * ny + j];
            std::fill(read.begin(), read.end(), 0.0f);
            for (int t = 0; t < taps; ++t)
                if (one.weights[t] != 0)
                    add(logarithm + std::size_t(one.first + t) * nz, one.weights[t], read.data(), nz);
            multiply_by_exponential(read.data(), volume.row(i, j), nz);
        }
    });
}

} // namespace smokelift
