#include "momentum.h"

#include "projection.h"
#include "vectors.h"

#include <algorithm>

namespace smokelift {
namespace {

// From -1 to 1 over n cells.
std::vector<float> axis(int n) {
    std::vector<float> x(n, -1);
    for (int i = 1; i < n; ++i)
        x[i] = float(-1 + 2.0 * i / (n - 1));
    return x;
}

SMOKELIFT_CLONES
void momentum_row(const float *__restrict density, float constant, float slope, const float *__restrict z,
                  float *__restrict out, int n) {
    for (int k = 0; k < n; ++k)
        out[k] = density[k] * (constant + slope * z[k]);
}

SMOKELIFT_CLONES
void mean_row(const float *__restrict a, const float *__restrict b, float *__restrict out, int n) {
    for (int k = 0; k < n; ++k)
        out[k] = 0.5f * (a[k] + b[k]);
}

} // namespace

void add_momentum(In density, const MomentumSource &source, float trust, const StaggeredIn &prediction,
                  const StaggeredOut &result, Workers &workers) {
    const auto [nx, ny, nz] = density.n;
    const std::vector<float> x = axis(nx), y = axis(ny), z = axis(nz);
    const auto momentum = [&, nz = nz](int c, int i, int j, std::vector<float> &row) {
        row.resize(nz);
        float constant = source[0][c], slope = 0;
        if (source.size() > 1) {
            constant += source[1][c] * x[i] + source[2][c] * y[j];
            slope = source[3][c];
        }
        momentum_row(density.row(i, j), constant, slope, z.data(), row.data(), nz);
    };
    // Faces on the sides of the box gain none.
    workers.run(nx + 1, [&, nx = nx, ny = ny, nz = nz](int i) {
        thread_local std::vector<float> a, b;
        for (int c = 0; c < 3; ++c)
            if (i < result[c].n[0])
                std::fill_n(result[c].row(i, 0), result[c].slab_size(), 0.0f);
        for (int j = 0; j < ny && i > 0 && i < nx; ++j) {
            momentum(0, i - 1, j, a);
            momentum(0, i, j, b);
            mean_row(a.data(), b.data(), result[0].row(i, j), nz);
        }
        for (int j = 0; j < ny && i < nx; ++j) {
            momentum(1, i, j, b);
            if (j > 0)
                mean_row(a.data(), b.data(), result[1].row(i, j), nz);
            std::swap(a, b);
        }
        for (int j = 0; j < ny && i < nx; ++j) {
            momentum(2, i, j, a);
            mean_row(a.data(), a.data() + 1, result[2].row(i, j) + 1, nz - 1);
        }
    });
    Projection(result.box).apply(result, workers);
    if (trust != 0)
        axpy(trust, prediction, result, workers);
}

} // namespace smokelift
