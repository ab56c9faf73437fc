#include "motion.h"

#include "operators.h"

#include <algorithm>
#include <cmath>

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
void push_row(const float *__restrict density, float constant, float slope, const float *__restrict z,
              float *__restrict out, int n) {
    for (int k = 0; k < n; ++k)
        out[k] = density[k] * (constant + slope * z[k]);
}

SMOKELIFT_CLONES
void mean_row(const float *__restrict a, const float *__restrict b, float *__restrict out, int n) {
    for (int k = 0; k < n; ++k)
        out[k] = 0.5f * (a[k] + b[k]);
}

// Where the elements of a finer line lie between those of a coarse one.
struct Line {
    Line(int coarse, int fine, double shift) : low(fine), high(fine), weight(fine) {
        for (int i = 0; i < fine; ++i) {
            const double position = std::clamp(i / 2.0 + shift, 0.0, double(coarse - 1));
            low[i] = std::min(int(position), std::max(coarse - 2, 0));
            high[i] = std::min(low[i] + 1, coarse - 1);
            weight[i] = float(position - low[i]);
        }
    }

    std::vector<int> low, high;
    std::vector<float> weight;
};

SMOKELIFT_CLONES
void mix_rows(const float *__restrict a, const float *__restrict b, const float *__restrict c,
              const float *__restrict d, float x, float y, float *__restrict out, int n) {
    for (int k = 0; k < n; ++k)
        out[k] = (1 - y) * ((1 - x) * a[k] + x * b[k]) + y * ((1 - x) * c[k] + x * d[k]);
}

SMOKELIFT_CLONES
float difference_row(const float *__restrict a, const float *__restrict b, std::size_t n) {
    float largest = 0;
    for (std::size_t k = 0; k < n; ++k)
        largest = std::max(largest, std::abs(a[k] - b[k]));
    return largest;
}

SMOKELIFT_CLONES
void hold_row(const float *__restrict u, float reach, float *__restrict out, std::size_t n) {
    for (std::size_t k = 0; k < n; ++k)
        out[k] = u[k] + std::min(std::max(out[k] - u[k], -reach), reach);
}

Shape cells_between(const Out3 &faces) { return {faces[1].n[0], faces[0].n[1], faces[0].n[2]}; }

} // namespace

void pushed(In density, const Push &push, float trust, const In3 &prediction, const Closed &closed,
            const Out3 &result, Workers &workers) {
    const auto [nx, ny, nz] = density.n;
    const std::vector<float> x = axis(nx), y = axis(ny), z = axis(nz);
    const auto momentum = [&, nz = nz](int c, int i, int j, std::vector<float> &row) {
        row.resize(nz);
        float constant = push[0][c], slope = 0;
        if (push.size() > 1) {
            constant += push[1][c] * x[i] + push[2][c] * y[j];
            slope = push[3][c];
        }
        push_row(density.row(i, j), constant, slope, z.data(), row.data(), nz);
    };
    // Faces on the sides of the box are not pushed.
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
    Projection(density.n, closed).apply(result, workers);
    if (trust != 0)
        axpy(trust, prediction, result, workers);
}

void refine(const In3 &coarse, const Closed &closed, const Out3 &result, Workers &workers) {
    for (int c = 0; c < 3; ++c) {
        const In from = coarse[c];
        const Out to = result[c];
        const Line x(from.n[0], to.n[0], c == 0 ? 0 : -0.25), y(from.n[1], to.n[1], c == 1 ? 0 : -0.25),
            z(from.n[2], to.n[2], c == 2 ? 0 : -0.25);
        workers.run(to.n[0], [&](int i) {
            thread_local std::vector<float> row;
            row.resize(from.n[2]);
            for (int j = 0; j < to.n[1]; ++j) {
                mix_rows(from.row(x.low[i], y.low[j]), from.row(x.high[i], y.low[j]),
                         from.row(x.low[i], y.high[j]), from.row(x.high[i], y.high[j]), x.weight[i],
                         y.weight[j], row.data(), from.n[2]);
                float *out = to.row(i, j);
                for (int k = 0; k < to.n[2]; ++k)
                    out[k] = 2 * (row[z.low[k]] * (1 - z.weight[k]) + row[z.high[k]] * z.weight[k]);
            }
        });
    }
    Projection(cells_between(result), closed).apply(result, workers);
}

float largest_difference(const In3 &a, const In3 &b, Workers &workers) {
    std::vector<float> largest(a[0].n[0]);
    workers.run(a[0].n[0], [&](int i) {
        for (int c = 0; c < 3; ++c)
            if (i < a[c].n[0])
                largest[i] =
                    std::max(largest[i], difference_row(a[c].row(i, 0), b[c].row(i, 0), a[c].slab_size()));
    });
    return *std::max_element(largest.begin(), largest.end());
}

void hold_back(const In3 &u, float reach, const Closed &closed, const Out3 &solution, Workers &workers) {
    for (int c = 0; c < 3; ++c)
        workers.run(u[c].n[0],
                    [&](int i) { hold_row(u[c].row(i, 0), reach, solution[c].row(i, 0), u[c].slab_size()); });
    Projection(cells_between(solution), closed).apply(solution, workers);
}

} // namespace smokelift
