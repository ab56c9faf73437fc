#include "operators.h"

#include <algorithm>

namespace smokelift {
namespace {

SMOKELIFT_CLONES
void divergence_slab(const In3 &u, Out cells, int i) {
    const int ny = cells.n[1], nz = cells.n[2];
    for (int j = 0; j < ny; ++j) {
        const float *__restrict x0 = u[0].row(i, j), *__restrict x1 = u[0].row(i + 1, j);
        const float *__restrict y0 = u[1].row(i, j), *__restrict y1 = u[1].row(i, j + 1);
        const float *__restrict z = u[2].row(i, j);
        float *__restrict out = cells.row(i, j);
        for (int k = 0; k < nz; ++k)
            out[k] = (x1[k] - x0[k]) + (y1[k] - y0[k]) + (z[k + 1] - z[k]);
    }
}

SMOKELIFT_CLONES
void gradient_slab(In a, const Out3 &g, int i) {
    const auto [nx, ny, nz] = a.n;
    const int before = std::max(i - 1, 0), after = std::min(i + 1, nx - 1);
    const float wx = after > before ? 1.0f / float(after - before) : 0;
    for (int j = 0; j < ny; ++j) {
        const int below = std::max(j - 1, 0), above = std::min(j + 1, ny - 1);
        const float wy = above > below ? 1.0f / float(above - below) : 0;
        const float *__restrict x0 = a.row(before, j), *__restrict x1 = a.row(after, j);
        const float *__restrict y0 = a.row(i, below), *__restrict y1 = a.row(i, above);
        const float *__restrict c = a.row(i, j);
        float *__restrict gx = g[0].row(i, j), *__restrict gy = g[1].row(i, j),
                          *__restrict gz = g[2].row(i, j);
        for (int k = 0; k < nz; ++k) {
            gx[k] = wx * (x1[k] - x0[k]);
            gy[k] = wy * (y1[k] - y0[k]);
        }
        for (int k = 1; k < nz - 1; ++k)
            gz[k] = 0.5f * (c[k + 1] - c[k - 1]);
        gz[0] = nz > 1 ? c[1] - c[0] : 0;
        gz[nz - 1] = nz > 1 ? c[nz - 1] - c[nz - 2] : 0;
    }
}

// Slab i of each edge array; i may be one past the last cell.
SMOKELIFT_CLONES
void curl_slab(const In3 &u, const Out3 &w, int i) {
    const int nx = u[1].n[0], ny = u[0].n[1], nz = u[0].n[2];
    if (i < nx)
        for (int j = 1; j < ny; ++j) {
            const float *__restrict z0 = u[2].row(i, j - 1), *__restrict z1 = u[2].row(i, j);
            const float *__restrict y = u[1].row(i, j);
            float *__restrict out = w[0].row(i, j);
            for (int k = 1; k < nz; ++k)
                out[k] = (z1[k] - z0[k]) - (y[k] - y[k - 1]);
        }
    if (i < 1 || i >= nx)
        return;
    for (int j = 0; j < ny; ++j) {
        const float *__restrict z0 = u[2].row(i - 1, j), *__restrict z1 = u[2].row(i, j);
        const float *__restrict x = u[0].row(i, j);
        float *__restrict out = w[1].row(i, j);
        for (int k = 1; k < nz; ++k)
            out[k] = (x[k] - x[k - 1]) - (z1[k] - z0[k]);
    }
    for (int j = 1; j < ny; ++j) {
        const float *__restrict y0 = u[1].row(i - 1, j), *__restrict y1 = u[1].row(i, j);
        const float *__restrict x0 = u[0].row(i, j - 1), *__restrict x1 = u[0].row(i, j);
        float *__restrict out = w[2].row(i, j);
        for (int k = 0; k < nz; ++k)
            out[k] = (y1[k] - y0[k]) - (x1[k] - x0[k]);
    }
}

SMOKELIFT_CLONES
void add_curl_transposed_slab(const In3 &w, const Out3 &u, int i) {
    const int nx = u[1].n[0], ny = u[0].n[1], nz = u[0].n[2];
    for (int j = 0; j < ny; ++j) {
        float *__restrict out = u[0].row(i, j);
        const float *__restrict y = w[1].row(i, j);
        const float *__restrict z0 = w[2].row(i, j), *__restrict z1 = w[2].row(i, j + 1);
        for (int k = 0; k < nz; ++k)
            out[k] += (y[k] - y[k + 1]) - (z0[k] - z1[k]);
    }
    if (i >= nx)
        return;
    for (int j = 0; j <= ny; ++j) {
        float *__restrict out = u[1].row(i, j);
        const float *__restrict x = w[0].row(i, j);
        const float *__restrict z0 = w[2].row(i, j), *__restrict z1 = w[2].row(i + 1, j);
        for (int k = 0; k < nz; ++k)
            out[k] += (z0[k] - z1[k]) - (x[k] - x[k + 1]);
    }
    for (int j = 0; j < ny; ++j) {
        float *__restrict out = u[2].row(i, j);
        const float *__restrict x0 = w[0].row(i, j), *__restrict x1 = w[0].row(i, j + 1);
        const float *__restrict y0 = w[1].row(i, j), *__restrict y1 = w[1].row(i + 1, j);
        for (int k = 0; k <= nz; ++k)
            out[k] += (x0[k] - x1[k]) - (y0[k] - y1[k]);
    }
}

SMOKELIFT_CLONES
void smoothness_slab(In a, const Shape &low, const Shape &high, float weight, In pointwise, Out result,
                     int i) {
    const int first = low[2], last = high[2] - 1;
    for (int j = low[1]; j < high[1]; ++j) {
        const float *__restrict c = a.row(i, j);
        const float *__restrict x0 = a.row(std::max(i - 1, low[0]), j);
        const float *__restrict x1 = a.row(std::min(i + 1, high[0] - 1), j);
        const float *__restrict y0 = a.row(i, std::max(j - 1, low[1]));
        const float *__restrict y1 = a.row(i, std::min(j + 1, high[1] - 1));
        float *__restrict out = result.row(i, j);
        for (int k = first + 1; k < last; ++k)
            out[k] = weight * (6 * c[k] - ((x0[k] + x1[k]) + (y0[k] + y1[k]) + (c[k - 1] + c[k + 1])));
        for (int k : {first, last}) {
            const float ends = c[std::max(k - 1, first)] + c[std::min(k + 1, last)];
            out[k] = weight * (6 * c[k] - ((x0[k] + x1[k]) + (y0[k] + y1[k]) + ends));
        }
        if (pointwise.data) {
            const float *__restrict extra = pointwise.row(i, j);
            for (int k = first; k <= last; ++k)
                out[k] += extra[k] * c[k];
        }
    }
}

SMOKELIFT_CLONES
void directional_slab(const In3 &u, const In3 &g, Out cells, int i) {
    const int ny = cells.n[1], nz = cells.n[2];
    for (int j = 0; j < ny; ++j) {
        const float *__restrict x0 = u[0].row(i, j), *__restrict x1 = u[0].row(i + 1, j);
        const float *__restrict y0 = u[1].row(i, j), *__restrict y1 = u[1].row(i, j + 1);
        const float *__restrict z = u[2].row(i, j);
        const float *__restrict gx = g[0].row(i, j), *__restrict gy = g[1].row(i, j);
        const float *__restrict gz = g[2].row(i, j);
        float *__restrict out = cells.row(i, j);
        for (int k = 0; k < nz; ++k)
            out[k] = 0.5f * (gx[k] * (x0[k] + x1[k]) + gy[k] * (y0[k] + y1[k]) + gz[k] * (z[k] + z[k + 1]));
    }
}

SMOKELIFT_INLINE void add_half_product(const float *__restrict a, const float *__restrict b, int n,
                                       float *__restrict out) {
    for (int k = 0; k < n; ++k)
        out[k] += 0.5f * a[k] * b[k];
}

SMOKELIFT_CLONES
void add_directional_transposed_slab(In q, const In3 &g, const Out3 &u, int i) {
    const auto [nx, ny, nz] = q.n;
    for (int j = 0; j < ny; ++j)
        for (int side = std::max(i - 1, 0); side <= std::min(i, nx - 1); ++side)
            add_half_product(g[0].row(side, j), q.row(side, j), nz, u[0].row(i, j));
    if (i >= nx)
        return;
    for (int j = 0; j < ny; ++j) {
        add_half_product(g[1].row(i, j), q.row(i, j), nz, u[1].row(i, j));
        add_half_product(g[1].row(i, j), q.row(i, j), nz, u[1].row(i, j + 1));
        add_half_product(g[2].row(i, j), q.row(i, j), nz, u[2].row(i, j));
        add_half_product(g[2].row(i, j), q.row(i, j), nz, u[2].row(i, j) + 1);
    }
}

constexpr std::size_t chunk = 1 << 14;

int chunks(std::size_t n) { return int((n + chunk - 1) / chunk); }

SMOKELIFT_CLONES
double dot_chunk(const float *__restrict a, const float *__restrict b, std::size_t n) {
    // Sixteen running sums keep the vector units busy; a fixed number keeps the result the same everywhere.
    constexpr int lanes = 16;
    float sums[lanes] = {};
    std::size_t i = 0;
    for (; i + lanes <= n; i += lanes)
        for (int l = 0; l < lanes; ++l)
            sums[l] += a[i + l] * b[i + l];
    double total = 0;
    for (; i < n; ++i)
        total += double(a[i]) * b[i];
    for (float value : sums)
        total += value;
    return total;
}

SMOKELIFT_CLONES
void axpy_chunk(float factor, const float *__restrict x, float *__restrict y, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        y[i] += factor * x[i];
}

SMOKELIFT_CLONES
void xpay_chunk(const float *__restrict x, float factor, float *__restrict y, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        y[i] = x[i] + factor * y[i];
}

} // namespace

void divergence(const In3 &faces, Out cells, Workers &workers) {
    workers.run(cells.n[0], [&](int i) { divergence_slab(faces, cells, i); });
}

void gradient(In cells, const Out3 &result, Workers &workers) {
    workers.run(cells.n[0], [&](int i) { gradient_slab(cells, result, i); });
}

void curl(const In3 &faces, const Out3 &edges, Workers &workers) {
    workers.run(faces[0].n[0], [&](int i) { curl_slab(faces, edges, i); });
}

void add_curl_transposed(const In3 &edges, const Out3 &faces, Workers &workers) {
    workers.run(faces[0].n[0], [&](int i) { add_curl_transposed_slab(edges, faces, i); });
}

void smoothness(In a, const Shape &low, const Shape &high, float weight, In pointwise, Out result,
                Workers &workers) {
    if (low[1] >= high[1] || low[2] >= high[2])
        return;
    workers.run(std::max(high[0] - low[0], 0),
                [&](int i) { smoothness_slab(a, low, high, weight, pointwise, result, low[0] + i); });
}

void directional(const In3 &faces, const In3 &direction, Out cells, Workers &workers) {
    workers.run(cells.n[0], [&](int i) { directional_slab(faces, direction, cells, i); });
}

void add_directional_transposed(In cells, const In3 &direction, const Out3 &faces, Workers &workers) {
    workers.run(faces[0].n[0], [&](int i) { add_directional_transposed_slab(cells, direction, faces, i); });
}

double dot(const float *a, const float *b, std::size_t n, Workers &workers) {
    return workers.sum(chunks(n), [&](int c) {
        const std::size_t start = c * chunk;
        return dot_chunk(a + start, b + start, std::min(chunk, n - start));
    });
}

void axpy(float factor, const float *x, float *y, std::size_t n, Workers &workers) {
    workers.run(chunks(n), [&](int c) {
        const std::size_t start = c * chunk;
        axpy_chunk(factor, x + start, y + start, std::min(chunk, n - start));
    });
}

void xpay(const float *x, float factor, float *y, std::size_t n, Workers &workers) {
    workers.run(chunks(n), [&](int c) {
        const std::size_t start = c * chunk;
        xpay_chunk(x + start, factor, y + start, std::min(chunk, n - start));
    });
}

} // namespace smokelift
