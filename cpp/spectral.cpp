#include "spectral.h"

#include "vectors.h"

namespace smokelift {
namespace {

// Of modes (x, y, z)[k] of a velocity: removes the part along d = (dx, dy, dz[k]), the differences that make
// its divergence, and divides by the symbol; adds the products of before and after.
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

} // namespace

Spectral::Spectral(const Box &box, double zeroth, double second, double fourth)
    : box_(box), zeroth_(float(zeroth)), second_(float(second)), fourth_(float(fourth)) {
    for (int axis = 0; axis < 3; ++axis) {
        const int n = box.cells[axis];
        const bool low = box.closed[2 * axis], high = box.closed[2 * axis + 1];
        modes_[axis] = AxisModes::complete(n, low, high);
        const AxisModes modes(n, low, high, modes_[axis]);
        cells_[axis] = modes.cells();
        faces_[axis] = modes.faces();
        difference_[axis].assign(modes.difference.begin(), modes.difference.end());
    }
    for (int c = 0; c < 3; ++c) {
        const Shape faces = box.faces()[c], modes{faces[0], modes_[1], modes_[2]};
        memory_[c] = Field(volume(faces) > volume(modes) ? faces : modes);
        expansion_[c] = {memory_[c].out().data, modes};
    }
}

StaggeredOut Spectral::room() {
    StaggeredOut result{expansion_, box_};
    for (int c = 0; c < 3; ++c)
        result.faces[c].n = box_.faces()[c];
    return result;
}

double Spectral::precondition(const StaggeredIn &derivative, Workers &workers) {
    const int my = modes_[1], mz = modes_[2], plane = my * mz;
    for (int c = 0; c < 3; ++c) {
        const In from = derivative[c];
        const Out to = expansion_[c];
        const LineTransform &y = c == 1 ? faces_[1] : cells_[1], &z = c == 2 ? faces_[2] : cells_[2];
        workers.run(from.n[0], [&](int i) {
            thread_local std::vector<float> scratch, rows;
            rows.resize(std::size_t(from.n[1]) * mz);
            z.to_modes({from.row(i, 0), 1, from.n[2]}, from.n[1], {rows.data(), 1, mz}, scratch);
            y.to_modes({rows.data(), mz, 1}, mz, {to.row(i, 0), mz, 1}, scratch);
        });
    }
    return workers.sum(my, [&](int j) {
        thread_local std::vector<float> scratch, modes, products;
        const std::size_t size = std::size_t(modes_[0]) * mz;
        modes.resize(3 * size);
        products.assign(mz, 0);
        for (int c = 0; c < 3; ++c) {
            const LineTransform &x = c == 0 ? faces_[0] : cells_[0];
            x.to_modes({expansion_[c].row(0, j), plane, 1}, mz, {modes.data() + c * size, mz, 1}, scratch);
        }
        for (int i = 0; i < modes_[0]; ++i) {
            float *row = modes.data() + std::size_t(i) * mz;
            filter_row(row, row + size, row + 2 * size, mz, difference_[0][i], difference_[1][j],
                       difference_[2].data(), zeroth_, second_, fourth_, products.data());
        }
        for (int c = 0; c < 3; ++c) {
            const LineTransform &x = c == 0 ? faces_[0] : cells_[0];
            x.from_modes({modes.data() + c * size, mz, 1}, mz, {expansion_[c].row(0, j), plane, 1}, scratch);
        }
        double sum = 0;
        for (float product : products)
            sum += product;
        return sum;
    });
}

void Spectral::descend(float factor, const StaggeredOut &search, Workers &workers) {
    const int mz = modes_[2];
    for (int c = 0; c < 3; ++c) {
        const Out from = expansion_[c], to = search[c];
        const LineTransform &y = c == 1 ? faces_[1] : cells_[1], &z = c == 2 ? faces_[2] : cells_[2];
        workers.run(to.n[0], [&](int i) {
            thread_local std::vector<float> scratch, rows, gradient;
            rows.resize(std::size_t(to.n[1]) * mz);
            gradient.resize(to.slab_size());
            y.from_modes({from.row(i, 0), mz, 1}, mz, {rows.data(), mz, 1}, scratch);
            z.from_modes({rows.data(), 1, mz}, to.n[1], {gradient.data(), 1, to.n[2]}, scratch);
            xpay(gradient.data(), factor, to.row(i, 0), to.slab_size());
        });
    }
}

} // namespace smokelift
