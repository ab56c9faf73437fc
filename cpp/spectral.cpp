#include "spectral.h"

#include "waves.h"

namespace smokelift {
namespace {

// Removes the part along d = (dx, dy, dz[k]) and divides by the symbol; adds the products of before
// and after.
SMOKELIFT_CLONES
void filter_row(float *__restrict x, float *__restrict y, float *__restrict z, int n, float dx, float dy,
                const float *__restrict dz, float zeroth, float second, float fourth,
                float *__restrict products) {
    for (int k = 0; k < n; ++k) {
        const float square = dx * dx + dy * dy + dz[k] * dz[k];
        const float along = square > 0 ? (dx * x[k] + dy * y[k] + dz[k] * z[k]) / square : 0;
        const float inverse = 1 / (zeroth + square * (second + square * fourth));
        const float fx = inverse * (x[k] - along * dx), fy = inverse * (y[k] - along * dy);
        const float fz = inverse * (z[k] - along * dz[k]);
        products[k] += x[k] * fx + y[k] * fy + z[k] * fz;
        x[k] = fx;
        y[k] = fy;
        z[k] = fz;
    }
}

SMOKELIFT_CLONES
void xpay_row(const float *__restrict x, float factor, float *__restrict y, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        y[i] = x[i] + factor * y[i];
}

} // namespace

Spectral::Spectral(const Shape &n, const Closed &closed, double zeroth, double second, double fourth)
    : n_(n), zeroth_(float(zeroth)), second_(float(second)), fourth_(float(fourth)) {
    for (int axis = 0; axis < 3; ++axis) {
        const bool low = closed[2 * axis], high = closed[2 * axis + 1];
        modes_[axis] = Waves::modes(n[axis], low, high);
        const Waves waves(n[axis], low, high, modes_[axis]);
        cells_[axis] = waves.cells();
        faces_[axis] = waves.faces();
        difference_[axis].assign(waves.difference.begin(), waves.difference.end());
    }
    for (int c = 0; c < 3; ++c) {
        const Shape faces = face_shapes(n)[c], waves{faces[0], modes_[1], modes_[2]};
        memory_[c] = Field(volume(faces) > volume(waves) ? faces : waves);
        waves_[c] = {memory_[c].out().data, waves};
    }
}

Out3 Spectral::room() {
    Out3 faces = waves_;
    for (int c = 0; c < 3; ++c)
        faces[c].n = face_shapes(n_)[c];
    return faces;
}

double Spectral::precondition(const In3 &derivative, Workers &workers) {
    const int my = modes_[1], mz = modes_[2], plane = my * mz;
    for (int c = 0; c < 3; ++c) {
        const In from = derivative[c];
        const Out to = waves_[c];
        const Basis &y = c == 1 ? faces_[1] : cells_[1], &z = c == 2 ? faces_[2] : cells_[2];
        workers.run(from.n[0], [&](int i) {
            thread_local std::vector<float> scratch, rows;
            rows.resize(std::size_t(from.n[1]) * mz);
            z.rows_to_modes(from.row(i, 0), from.n[1], rows.data(), scratch);
            y.columns_to_modes(rows.data(), mz, mz, to.row(i, 0), mz, scratch);
        });
    }
    return workers.sum(my, [&](int j) {
        thread_local std::vector<float> scratch, modes, products;
        const std::size_t size = std::size_t(modes_[0]) * mz;
        modes.resize(3 * size);
        products.assign(mz, 0);
        for (int c = 0; c < 3; ++c) {
            const Basis &x = c == 0 ? faces_[0] : cells_[0];
            x.columns_to_modes(waves_[c].row(0, j), plane, mz, modes.data() + c * size, mz, scratch);
        }
        for (int i = 0; i < modes_[0]; ++i) {
            float *row = modes.data() + std::size_t(i) * mz;
            filter_row(row, row + size, row + 2 * size, mz, difference_[0][i], difference_[1][j],
                       difference_[2].data(), zeroth_, second_, fourth_, products.data());
        }
        for (int c = 0; c < 3; ++c) {
            const Basis &x = c == 0 ? faces_[0] : cells_[0];
            x.columns_from_modes(modes.data() + c * size, mz, mz, waves_[c].row(0, j), plane, scratch);
        }
        double sum = 0;
        for (float product : products)
            sum += product;
        return sum;
    });
}

void Spectral::descend(float factor, const Out3 &search, Workers &workers) {
    const int mz = modes_[2];
    for (int c = 0; c < 3; ++c) {
        const Out from = waves_[c], to = search[c];
        const Basis &y = c == 1 ? faces_[1] : cells_[1], &z = c == 2 ? faces_[2] : cells_[2];
        workers.run(to.n[0], [&](int i) {
            thread_local std::vector<float> scratch, rows, gradient;
            rows.resize(std::size_t(to.n[1]) * mz);
            gradient.resize(to.slab_size());
            y.columns_from_modes(from.row(i, 0), mz, mz, rows.data(), mz, scratch);
            z.rows_from_modes(rows.data(), to.n[1], gradient.data(), scratch);
            xpay_row(gradient.data(), factor, to.row(i, 0), to.slab_size());
        });
    }
}

} // namespace smokelift
