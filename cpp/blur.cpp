#include "blur.h"

#include "vectors.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace smokelift {
namespace {

std::vector<float> gaussian(double width, double truncate) {
    const int radius = int(truncate * width + 0.5);
    std::vector<double> values;
    double sum = 0;
    for (int i = -radius; i <= radius; ++i) {
        values.push_back(std::exp(-0.5 * i * i / (width * width)));
        sum += values.back();
    }
    std::vector<float> weights;
    for (double value : values)
        weights.push_back(float(value / sum));
    return weights;
}

} // namespace

void blur(In a, double width, double truncate, Out result, Workers &workers) {
    const std::vector<float> weights = gaussian(width, truncate);
    const int radius = int(weights.size()) / 2;
    const auto [nx, ny, nz] = a.n;
    // What is zero adds nothing, and most of a box around smoke is: from the first to the last of the others.
    std::vector<Span> filled(std::size_t(nx) * ny);
    find_filled(a, filled.data(), workers);
    // Rows along x first, out of the array, then along y and z within a slab.
    workers.run(nx, [&, nx = nx, ny = ny, nz = nz](int i) {
        thread_local std::vector<float> slab, row;
        thread_local std::vector<Span> spans;
        slab.assign(a.slab_size(), 0);
        spans.assign(ny, Span{0, 0});
        for (int t = -radius; t <= radius; ++t) {
            const int from = mirrored(i + t, nx);
            for (int j = 0; j < ny; ++j) {
                const Span &span = filled[std::size_t(from) * ny + j];
                axpy(weights[radius + t], a.row(from, j) + span[0],
                     slab.data() + std::size_t(j) * nz + span[0], span[1] - span[0]);
                spans[j] = joined(spans[j], span);
            }
        }
        row.resize(nz + 2 * radius);
        for (int j = 0; j < ny; ++j) {
            float *out = result.row(i, j), *inner = row.data() + radius;
            std::fill_n(inner, nz, 0.0f);
            Span span{0, 0};
            for (int t = -radius; t <= radius; ++t) {
                const int from = mirrored(j + t, ny);
                const auto [first, end] = spans[from];
                axpy(weights[radius + t], slab.data() + std::size_t(from) * nz + first, inner + first,
                     end - first);
                span = joined(span, spans[from]);
            }
            std::fill_n(out, nz, 0.0f);
            if (span[0] == span[1])
                continue;
            for (int t = 1; t <= radius; ++t) {
                inner[-t] = inner[mirrored(-t, nz)];
                inner[nz - 1 + t] = inner[mirrored(nz - 1 + t, nz)];
            }
            const int first = std::max(span[0] - radius, 0), end = std::min(span[1] + radius, nz);
            for (int t = 0; t <= 2 * radius; ++t)
                axpy(weights[t], row.data() + t + first, out + first, end - first);
        }
    });
}

} // namespace smokelift
