#include "blur.h"

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

// The element of a line of n whose mirror image is at i.
int mirrored(int i, int n) {
    i = (i % (2 * n) + 2 * n) % (2 * n);
    return i < n ? i : 2 * n - 1 - i;
}

SMOKELIFT_CLONES
void add(const float *__restrict a, float factor, float *__restrict out, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        out[i] += factor * a[i];
}

} // namespace

void blur(In a, double width, double truncate, Out result, Workers &workers) {
    const std::vector<float> weights = gaussian(width, truncate);
    const int radius = int(weights.size()) / 2;
    const auto [nx, ny, nz] = a.n;
    // Rows along x first, out of the array, then along y and z within a slab.
    workers.run(nx, [&, nx = nx, ny = ny, nz = nz](int i) {
        thread_local std::vector<float> slab, row;
        const std::size_t size = a.slab_size();
        slab.assign(size, 0);
        for (int t = -radius; t <= radius; ++t)
            add(a.row(mirrored(i + t, nx), 0), weights[radius + t], slab.data(), size);
        row.resize(nz + 2 * radius);
        for (int j = 0; j < ny; ++j) {
            float *out = result.row(i, j), *inner = row.data() + radius;
            std::fill_n(inner, nz, 0.0f);
            for (int t = -radius; t <= radius; ++t)
                add(slab.data() + std::size_t(mirrored(j + t, ny)) * nz, weights[radius + t], inner, nz);
            for (int t = 1; t <= radius; ++t) {
                inner[-t] = inner[mirrored(-t, nz)];
                inner[nz - 1 + t] = inner[mirrored(nz - 1 + t, nz)];
            }
            std::fill_n(out, nz, 0.0f);
            for (int t = 0; t <= 2 * radius; ++t)
                add(row.data() + t, weights[t], out, nz);
        }
    });
}

} // namespace smokelift
