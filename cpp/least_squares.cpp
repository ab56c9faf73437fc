#include "least_squares.h"

#include "operators.h"

#include <algorithm>

namespace smokelift {
namespace {

void copy(In from, Out to) { std::copy_n(from.data, volume(from.n), to.data); }

std::array<Shape, 3> cell_shapes(const Shape &n) { return {n, n, n}; }

// Edges inside the box, the only ones that carry vorticity: [1, n) across, [0, n) along.
Shape first_edge(int axis) {
    Shape low{1, 1, 1};
    low[axis] = 0;
    return low;
}

SMOKELIFT_CLONES
void product(const float *__restrict a, const float *__restrict b, float *__restrict out, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        out[i] = a[i] * b[i];
}

SMOKELIFT_CLONES
void scaled(const float *__restrict a, float factor, float *__restrict out, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        out[i] = factor * a[i];
}

} // namespace

LeastSquares::LeastSquares(const In3 &direction, In offset, In weight, In irrotational, const In3 &centre,
                           const Regularisation &regularisation, const Closed &closed)
    : shape_(offset.n), closed_(closed), regularisation_(regularisation), direction_(cell_shapes(shape_)),
      centre_(face_shapes(shape_)), irrotational_(edge_shapes(shape_)), offset_(shape_), weight_(shape_),
      vorticity_(edge_shapes(shape_)), stress_(edge_shapes(shape_)), along_(shape_) {
    copy(offset, offset_);
    copy(weight, weight_);
    for (int c = 0; c < 3; ++c) {
        copy(direction[c], direction_.out()[c]);
        copy(centre[c], centre_.out()[c]);
        // An edge has the mean of the four cells around it.
        const Out edges = irrotational_.out()[c];
        const Shape low = first_edge(c);
        for (int i = low[0]; i < shape_[0]; ++i)
            for (int j = low[1]; j < shape_[1]; ++j) {
                const float *rows[4] = {irrotational.row(i, j), irrotational.row(i - low[0], j),
                                        irrotational.row(i, j - low[1]),
                                        irrotational.row(i - low[0], j - low[1])};
                float *out = edges.row(i, j);
                if (c == 2)
                    for (int k = 0; k < shape_[2]; ++k)
                        out[k] = 0.25f * (rows[0][k] + rows[1][k] + rows[2][k] + rows[3][k]);
                else
                    for (int k = 1; k < shape_[2]; ++k)
                        out[k] = 0.25f * (rows[0][k] + rows[0][k - 1] + rows[3][k] + rows[3][k - 1]);
            }
    }
}

void LeastSquares::regularise(const In3 &u, const Out3 &result, Workers &workers, bool irrotational) {
    for (int c = 0; c < 3; ++c)
        if (regularisation_.first_order > 0) {
            smoothness(u[c], {0, 0, 0}, u[c].n, regularisation_.first_order, {}, result[c], workers);
            axpy(regularisation_.kinetic, u[c].data, result[c].data, volume(u[c].n), workers);
        } else {
            workers.run(u[c].n[0], [&](int i) {
                scaled(u[c].row(i, 0), regularisation_.kinetic, result[c].row(i, 0), u[c].slab_size());
            });
        }
    curl(u, vorticity_.out(), workers);
    for (int c = 0; c < 3; ++c)
        smoothness(vorticity_.in()[c], first_edge(c), shape_, regularisation_.second_order,
                   irrotational ? irrotational_.in()[c] : In{}, stress_.out()[c], workers);
    add_curl_transposed(stress_.in(), result, workers);
}

void LeastSquares::apply(const In3 &u, const Out3 &result, Workers &workers) {
    regularise(u, result, workers);
    directional(u, direction_.in(), along_, workers);
    const Out along = along_;
    workers.run(shape_[0], [&](int i) {
        product(along.row(i, 0), weight_.in().row(i, 0), along.row(i, 0), along.slab_size());
    });
    add_directional_transposed(along_, direction_.in(), result, workers);
}

Field3 LeastSquares::right_hand_side(Workers &workers) {
    Field3 b(shapes());
    regularise(centre_.in(), b.out(), workers, false);
    const Out along = along_;
    workers.run(shape_[0], [&](int i) {
        product(offset_.in().row(i, 0), weight_.in().row(i, 0), along.row(i, 0), along.slab_size());
        scaled(along.row(i, 0), -1, along.row(i, 0), along.slab_size());
    });
    add_directional_transposed(along_, direction_.in(), b.out(), workers);
    return b;
}

std::array<double, 3> LeastSquares::symbol() const {
    double evidence = 0, irrotational = 0;
    const In3 g = direction_.in();
    for (std::size_t i = 0; i < volume(shape_); ++i) {
        double square = 0;
        for (const In &component : g)
            square += double(component.data[i]) * component.data[i];
        evidence += weight_.in().data[i] * square / 3;
    }
    for (std::size_t i = 0; i < volume(irrotational_.in()[2].n); ++i)
        irrotational += irrotational_.in()[2].data[i];
    const double cells = double(volume(shape_));
    return {regularisation_.kinetic + evidence / cells, regularisation_.first_order + irrotational / cells,
            regularisation_.second_order};
}

Field3 LeastSquares::diagonal(Workers &workers) const {
    Field3 diagonal(shapes());
    const Out3 out = diagonal.out();
    const In3 g = direction_.in();
    for (int c = 0; c < 3; ++c) {
        const Shape n = out[c].n;
        const int step[3] = {c == 0, c == 1, c == 2};
        workers.run(n[0], [&](int i) {
            for (int j = 0; j < n[1]; ++j)
                for (int k = 0; k < n[2]; ++k) {
                    // Differences of the vorticity: 4 edges times 6 neighbours, and 4 for pairs of edges.
                    float sum = 6 * regularisation_.first_order + 28 * regularisation_.second_order +
                                regularisation_.kinetic;
                    for (int side = 0; side < 2; ++side) {
                        const int x = i - side * step[0], y = j - side * step[1], z = k - side * step[2];
                        if (x < 0 || y < 0 || z < 0 || x >= shape_[0] || y >= shape_[1] || z >= shape_[2])
                            continue;
                        const float along = 0.5f * g[c].row(x, y)[z];
                        sum += weight_.in().row(x, y)[z] * along * along;
                    }
                    out[c].row(i, j)[k] = sum;
                }
        });
        // A face turns around four edges: two in each of the directions across it.
        for (int e = 0; e < 3; ++e) {
            if (e == c)
                continue;
            const int across = 3 - c - e;
            const In edges = irrotational_.in()[e];
            workers.run(n[0], [&](int i) {
                for (int j = 0; j < n[1]; ++j)
                    for (int k = 0; k < n[2]; ++k)
                        out[c].row(i, j)[k] +=
                            edges.row(i, j)[k] +
                            edges.row(i + (across == 0), j + (across == 1))[k + (across == 2)];
            });
        }
    }
    return diagonal;
}

} // namespace smokelift
