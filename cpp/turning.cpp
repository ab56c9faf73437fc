#include "turning.h"

#include "compiler.h"
#include "exponential.h"
#include "vectors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace smokelift {
namespace {

constexpr int taps = 3;   // pixels of a square's shadow, at most sqrt(2) wide (by definition)
constexpr int chunk = 64; // voxels of a column at a time
constexpr std::size_t columns_per_task = 4096; // of voxels

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

Taps taps_of(const Turned &turned, int i, int j) {
    const double thinnest = 1e-3; // of a square seen from its side
    const double a = std::max(std::abs(turned.step_x), thinnest),
                 b = std::max(std::abs(turned.step_y), thinnest);
    const double center = turned.first + i * turned.step_x + j * turned.step_y;
    Taps one{int(std::lround(center)) - 1, {}};
    for (int t = 0; t < taps; ++t) {
        const double at = one.first + t - center;
        const int column = one.first + t;
        if (column >= 0 && column < turned.columns)
            one.weights[t] = float(shadow_up_to(at + 0.5, a, b) - shadow_up_to(at - 0.5, a, b));
    }
    return one;
}

int chunks_of(int nz) { return (nz + chunk - 1) / chunk; }

SMOKELIFT_CLONES
void multiply_by_exponential(const float *__restrict logarithm, float *__restrict out, int n) {
    for (int k = 0; k < n; ++k) {
        out[k] *= exponential(logarithm[k]);
    }
}

} // namespace

void project_turned(In volume, const Span *spans, const Turned &turned, float *picture, Workers &workers) {
    const auto [nx, ny, nz] = volume.n;
    struct Filled {
        int i, j;
        Taps taps;
    };
    std::vector<Filled> filled;
    for (int i = 0; i < nx; ++i)
        for (int j = 0; j < ny; ++j)
            if (const auto [first, end] = spans[std::size_t(i) * ny + j]; first < end)
                filled.push_back({i, j, {}});
    workers.run_ranges(filled.size(), columns_per_task, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n)
            filled[n].taps = taps_of(turned, filled[n].i, filled[n].j);
    });
    std::fill_n(picture, std::size_t(turned.columns) * nz, 0.0f);
    workers.run(chunks_of(nz), [&, ny = ny, nz = nz](int part) {
        for (const auto &[i, j, one] : filled) {
            const Span &span = spans[std::size_t(i) * ny + j];
            const int k = std::max(part * chunk, span[0]), end = std::min((part + 1) * chunk, span[1]);
            for (int t = 0; t < taps && k < end; ++t)
                if (one.weights[t] != 0)
                    axpy(one.weights[t], volume.row(i, j) + k, picture + std::size_t(one.first + t) * nz + k,
                         end - k);
        }
    });
}

void scale_turned(Out volume, const Span *spans, const Turned &turned, const float *logarithm,
                  Workers &workers) {
    const auto [nx, ny, nz] = volume.n;
    workers.run(nx, [&, ny = ny, nz = nz](int i) {
        std::vector<float> read(nz);
        for (int j = 0; j < ny; ++j) {
            const Span &span = spans[std::size_t(i) * ny + j];
            const int k = span[0], count = span[1] - k;
            if (count <= 0)
                continue;
            const Taps one = taps_of(turned, i, j);
            std::fill_n(read.begin(), count, 0.0f);
            for (int t = 0; t < taps; ++t)
                if (one.weights[t] != 0)
                    axpy(one.weights[t], logarithm + std::size_t(one.first + t) * nz + k, read.data(), count);
            multiply_by_exponential(read.data(), volume.row(i, j) + k, count);
        }
    });
}

} // namespace smokelift
