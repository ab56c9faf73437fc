#include "poisson.h"

#include "waves.h"

namespace smokelift {
namespace {

// Forward elimination and back substitution along x for one y, all z at once.
SMOKELIFT_CLONES
void tridiagonal(float *f, const float *pivots, int nx, std::size_t slab, int nz) {
    for (int k = 0; k < nz; ++k)
        f[k] *= pivots[k];
    for (int i = 1; i < nx; ++i) {
        float *__restrict row = f + i * slab;
        const float *__restrict before = row - slab;
        const float *__restrict pivot = pivots + i * slab;
        for (int k = 0; k < nz; ++k)
            row[k] = (row[k] + before[k]) * pivot[k];
    }
    for (int i = nx - 2; i >= 0; --i) {
        float *__restrict row = f + i * slab;
        const float *__restrict after = row + slab;
        const float *__restrict pivot = pivots + i * slab;
        for (int k = 0; k < nz; ++k)
            row[k] += pivot[k] * after[k];
    }
}

} // namespace

Poisson::Poisson(const Shape &n, const Closed &closed) : n_(n), closed_(closed), pivots_(n) {
    singular_ = true;
    for (bool side : closed)
        singular_ = singular_ && side;
    const Waves y(n[1], closed[2], closed[3], n[1]), z(n[2], closed[4], closed[5], n[2]);
    y_ = y.cells();
    z_ = z.cells();

    Out pivots = pivots_;
    std::vector<double> last(n[2]);
    for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i) {
            // A missing neighbour takes 1 from the diagonal at a wall and adds 1 at an open side.
            double diagonal = 2 + y.difference[j] * y.difference[j];
            if (i == 0)
                diagonal += closed[0] ? -1 : 1;
            if (i == n[0] - 1)
                diagonal += closed[1] ? -1 : 1;
            for (int k = 0; k < n[2]; ++k) {
                const double pivot = diagonal + z.difference[k] * z.difference[k] - (i ? last[k] : 0);
                // The constant mode has no equation of its own: pin its last value to zero.
                last[k] = singular_ && i == n[0] - 1 && j == 0 && k == 0 ? 0 : 1 / pivot;
                pivots.row(i, j)[k] = float(last[k]);
            }
        }
}

void Poisson::solve(Out f, Workers &workers) const {
    const auto [nx, ny, nz] = n_;
    const std::size_t slab = f.slab_size();
    if (singular_) {
        const double mean = workers.sum(nx, [&](int i) {
            double sum = 0;
            for (const float *p = f.row(i, 0), *end = p + slab; p != end; ++p)
                sum += *p;
            return sum;
        }) / double(volume(n_));
        workers.run(nx, [&](int i) {
            for (float *p = f.row(i, 0), *end = p + slab; p != end; ++p)
                *p -= float(mean);
        });
    }
    workers.run(nx, [&](int i) {
        thread_local std::vector<float> scratch;
        z_.rows_to_modes(f.row(i, 0), ny, f.row(i, 0), scratch);
        y_.columns_to_modes(f.row(i, 0), nz, nz, f.row(i, 0), nz, scratch);
    });
    workers.run(ny, [&](int j) { tridiagonal(f.row(0, j), pivots_.in().row(0, j), nx, slab, nz); });
    workers.run(nx, [&](int i) {
        thread_local std::vector<float> scratch;
        y_.columns_from_modes(f.row(i, 0), nz, nz, f.row(i, 0), nz, scratch);
        z_.rows_from_modes(f.row(i, 0), ny, f.row(i, 0), scratch);
    });
}

} // namespace smokelift
