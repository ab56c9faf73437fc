#include "operators.h"

#include <algorithm>

namespace smokelift {

SMOKELIFT_CLONES
void divergence_slab(const In3 &u, Out cells, int i) {
    const int ny = cells.n[1], nz = cells.n[2];
    for (int j = 0; j < ny; ++j) {
        const float *__restrict x0 = u[0].row(i, j), *__restrict x1 = u[0].row(i + 1, j);
        const float *__restrict y0 = u[1].row(i, j), *__restrict y1 = u[1].row(i, j + 1);
        const float *__restrict z = u[2].row(i, j);
        float *__restrict out = cells.row(0, j);
        for (int k = 0; k < nz; ++k)
            out[k] = (x1[k] - x0[k]) + (y1[k] - y0[k]) + (z[k + 1] - z[k]);
    }
}

namespace {

// out (+)= (a1 - a0) - (b1 - b0)
template <bool Add>
SMOKELIFT_INLINE void rotation(const float *a0, const float *a1, const float *b0, const float *b1, int n,
                               float *__restrict out) {
    for (int k = 0; k < n; ++k) {
        const float value = (a1[k] - a0[k]) - (b1[k] - b0[k]);
        out[k] = Add ? out[k] + value : value;
    }
}

} // namespace

SMOKELIFT_CLONES
void curl_slab(const In3 &u, const Out3 &w, int i) {
    const int nx = u[1].n[0], ny = u[0].n[1], nz = u[0].n[2];
    if (i < nx)
        for (int j = 1; j < ny; ++j) {
            const float *y = u[1].row(i, j);
            rotation<false>(u[2].row(i, j - 1) + 1, u[2].row(i, j) + 1, y, y + 1, nz - 1, w[0].row(0, j) + 1);
        }
    if (i < 1 || i >= nx)
        return;
    for (int j = 0; j < ny; ++j) {
        const float *x = u[0].row(i, j);
        rotation<false>(x, x + 1, u[2].row(i - 1, j) + 1, u[2].row(i, j) + 1, nz - 1, w[1].row(0, j) + 1);
    }
    for (int j = 1; j < ny; ++j)
        rotation<false>(u[1].row(i - 1, j), u[1].row(i, j), u[0].row(i, j - 1), u[0].row(i, j), nz,
                        w[2].row(0, j));
}

SMOKELIFT_CLONES
void add_curl_transposed_slab(const In3 &w, const In3 &after, const Out3 &u) {
    const int ny = u[0].n[1], nz = u[0].n[2];
    for (int j = 0; j < ny; ++j) {
        const float *y = w[1].row(0, j);
        rotation<true>(y + 1, y, w[2].row(0, j + 1), w[2].row(0, j), nz, u[0].row(0, j));
    }
    if (!u[1].data)
        return;
    for (int j = 0; j <= ny; ++j) {
        const float *x = w[0].row(0, j);
        rotation<true>(after[2].row(0, j), w[2].row(0, j), x + 1, x, nz, u[1].row(0, j));
    }
    for (int j = 0; j < ny; ++j)
        rotation<true>(w[0].row(0, j + 1), w[0].row(0, j), after[1].row(0, j), w[1].row(0, j), nz + 1,
                       u[2].row(0, j));
}

SMOKELIFT_CLONES
void smoothness_slab(In before, In a, In after, const Shape &low, const Shape &high, float weight,
                     In pointwise, Out result) {
    const int first = low[2], last = high[2] - 1;
    if (first > last)
        return;
    for (int j = low[1]; j < high[1]; ++j) {
        const float *__restrict c = a.row(0, j);
        const float *__restrict x0 = before.row(0, j), *__restrict x1 = after.row(0, j);
        const float *__restrict y0 = a.row(0, std::max(j - 1, low[1]));
        const float *__restrict y1 = a.row(0, std::min(j + 1, high[1] - 1));
        float *__restrict out = result.row(0, j);
        for (int k = first + 1; k < last; ++k)
            out[k] = weight * (6 * c[k] - ((x0[k] + x1[k]) + (y0[k] + y1[k]) + (c[k - 1] + c[k + 1])));
        for (int k : {first, last}) {
            const float ends = c[std::max(k - 1, first)] + c[std::min(k + 1, last)];
            out[k] = weight * (6 * c[k] - ((x0[k] + x1[k]) + (y0[k] + y1[k]) + ends));
        }
        if (pointwise.data) {
            const float *__restrict extra = pointwise.row(0, j);
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
        float *__restrict out = cells.row(0, j);
        for (int k = 0; k < nz; ++k)
            out[k] = 0.5f * (gx[k] * (x0[k] + x1[k]) + gy[k] * (y0[k] + y1[k]) + gz[k] * (z[k] + z[k + 1]));
    }
}

namespace {

SMOKELIFT_INLINE void add_half_product(const float *__restrict a, const float *__restrict b, int n,
                                       float *__restrict out) {
    for (int k = 0; k < n; ++k)
        out[k] += 0.5f * a[k] * b[k];
}

} // namespace

SMOKELIFT_CLONES
void add_directional_transposed_slab(In before, In q, const In3 &g, const Out3 &u, int i) {
    const int ny = g[0].n[1], nz = g[0].n[2];
    for (int j = 0; j < ny; ++j) {
        if (before.data)
            add_half_product(g[0].row(i - 1, j), before.row(0, j), nz, u[0].row(0, j));
        if (q.data)
            add_half_product(g[0].row(i, j), q.row(0, j), nz, u[0].row(0, j));
    }
    if (!q.data)
        return;
    for (int j = 0; j < ny; ++j) {
        add_half_product(g[1].row(i, j), q.row(0, j), nz, u[1].row(0, j));
        add_half_product(g[1].row(i, j), q.row(0, j), nz, u[1].row(0, j + 1));
        add_half_product(g[2].row(i, j), q.row(0, j), nz, u[2].row(0, j));
        add_half_product(g[2].row(i, j), q.row(0, j), nz, u[2].row(0, j) + 1);
    }
}

SMOKELIFT_CLONES
void edge_means_slab(In a, int c, Out edges, int i) {
    const int x = c != 0, y = c != 1, z = c != 2; // one where an edge lies between two cells
    for (int j = y; j < a.n[1]; ++j) {
        const float *__restrict r0 = a.row(i, j), *__restrict r1 = a.row(i - x, j);
        const float *__restrict r2 = a.row(i, j - y), *__restrict r3 = a.row(i - x, j - y);
        float *__restrict out = edges.row(0, j);
        if (z)
            for (int k = 1; k < a.n[2]; ++k)
                out[k] = 0.25f * (r0[k] + r0[k - 1] + r3[k] + r3[k - 1]);
        else
            for (int k = 0; k < a.n[2]; ++k)
                out[k] = 0.25f * (r0[k] + r1[k] + r2[k] + r3[k]);
    }
}

void divergence(const In3 &faces, Out cells, Workers &workers) {
    workers.run(cells.n[0], [&](int i) { divergence_slab(faces, slab(cells, i), i); });
}

} // namespace smokelift
