#include "projection.h"

namespace smokelift {
namespace {

// Reciprocal pivots of the systems along x, from the diagonals less 2.
SMOKELIFT_CLONES
void eliminate(float *__restrict pivots, double *__restrict last, const double *__restrict square,
               double y_square, double end, int nz) {
    for (int k = 0; k < nz; ++k) {
        last[k] = 1 / (2 + y_square + end + square[k] - last[k]);
        pivots[k] = float(last[k]);
    }
}

// Forward elimination and back substitution along x for one y, all z at once.
SMOKELIFT_CLONES
void tridiagonal(float *f, const float *pivots, int nx, std::size_t slab, int nz) {
    for (int k = 0; k < nz; ++k)
        f[k] *= pivots[k];
    for (int i = 1; i < nx; ++i) {
        float *__restrict row = f + i * slab;
        const float *__restrict before = row - slab;
        const float *__restrict pivot = pivots + std::size_t(i) * nz;
        for (int k = 0; k < nz; ++k)
            row[k] = (row[k] + before[k]) * pivot[k];
    }
    for (int i = nx - 2; i >= 0; --i) {
        float *__restrict row = f + i * slab;
        const float *__restrict after = row + slab;
        const float *__restrict pivot = pivots + std::size_t(i) * nz;
        for (int k = 0; k < nz; ++k)
            row[k] += pivot[k] * after[k];
    }
}

void subtract_mean(Out f, Workers &workers) {
    const int nx = f.n[0];
    const std::size_t slab = f.slab_size();
    const double mean = workers.sum(nx, [&](int i) {
        double sum = 0;
        for (const float *p = f.row(i, 0), *end = p + slab; p != end; ++p)
            sum += *p;
        return sum;
    }) / double(volume(f.n));
    workers.run(nx, [&](int i) {
        for (float *p = f.row(i, 0), *end = p + slab; p != end; ++p)
            *p -= float(mean);
    });
}

} // namespace

Poisson::Poisson(const Box &box) : box_(box) {
    const auto &[n, closed] = box;
    const AxisModes y(n[1], closed[2], closed[3], n[1]), z(n[2], closed[4], closed[5], n[2]);
    y_ = y.cells();
    z_ = z.cells();

    for (double difference : y.difference)
        y_square_.push_back(difference * difference);
    for (double difference : z.difference)
        z_square_.push_back(difference * difference);
}

// Reciprocal pivots [x][z] of the systems along x of the modes with number j along y.
void Poisson::factorize(int j, std::vector<float> &pivots) const {
    const auto [nx, ny, nz] = box_.cells;
    thread_local std::vector<double> last;
    pivots.resize(std::size_t(nx) * nz);
    last.assign(nz, 0);
    for (int i = 0; i < nx; ++i) {
        // A missing neighbor takes 1 from the diagonal at a wall and adds 1 at an open side.
        double end = 0;
        if (i == 0)
            end += box_.closed[0] ? -1 : 1;
        if (i == nx - 1)
            end += box_.closed[1] ? -1 : 1;
        eliminate(pivots.data() + std::size_t(i) * nz, last.data(), z_square_.data(), y_square_[j], end, nz);
    }
    // The constant mode has no equation of its own: pin its last value to zero.
    if (box_.sealed() && j == 0)
        pivots[std::size_t(nx - 1) * nz] = 0;
}

void Poisson::solve(Out f, Workers &workers) const {
    const auto [nx, ny, nz] = box_.cells;
    const std::size_t slab = f.slab_size();
    if (box_.sealed())
        subtract_mean(f, workers);
    workers.run(nx, [&, ny = ny, nz = nz](int i) {
        thread_local std::vector<float> scratch;
        z_.to_modes({f.row(i, 0), 1, nz}, ny, {f.row(i, 0), 1, nz}, scratch);
        y_.to_modes({f.row(i, 0), nz, 1}, nz, {f.row(i, 0), nz, 1}, scratch);
    });
    workers.run(ny, [&, nx = nx, nz = nz](int j) {
        thread_local std::vector<float> pivots;
        factorize(j, pivots);
        tridiagonal(f.row(0, j), pivots.data(), nx, slab, nz);
    });
    workers.run(nx, [&, ny = ny, nz = nz](int i) {
        thread_local std::vector<float> scratch;
        y_.from_modes({f.row(i, 0), nz, 1}, nz, {f.row(i, 0), nz, 1}, scratch);
        z_.from_modes({f.row(i, 0), 1, nz}, ny, {f.row(i, 0), 1, nz}, scratch);
    });
}

} // namespace smokelift
