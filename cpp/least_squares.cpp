#include "least_squares.h"

#include "operators.h"
#include "vectors.h"

#include <algorithm>
#include <vector>

namespace smokelift {
namespace {

// Edges inside the box, the only ones that carry vorticity: [1, n) across, [0, n) along.
Shape first_edge(int axis) {
    Shape low{1, 1, 1};
    low[axis] = 0;
    return low;
}

SMOKELIFT_CLONES
void multiply(const float *__restrict a, float *__restrict out, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        out[i] *= a[i];
}

// Enough blocks of slabs (planes of voxels) for some threads, each of so many that the slabs computed twice
// at its ends hardly count.
constexpr int BLOCKS = 8, MIN_SLABS = 4, MAX_SLABS = 16;

} // namespace

// The few slabs that a sweep along x has in use. They start as zero, as edges on the sides of the box have to
// be.
class LeastSquares::Window {
public:
    explicit Window(const Box &box) : shapes_(box.edges()), cells_{1, box.cells[1], box.cells[2]} {
        for (int c = 0; c < 3; ++c)
            shapes_[c][0] = 1;
        plane_ = std::size_t(cells_[1] + 1) * (cells_[2] + 1);
        memory_.resize(20 * plane_);
    }

    Out3 vorticity(int i) { return edges(i % 3); }
    Out3 stress(int i) { return edges(3 + i % 2); }
    Out irrotational(int c) { return edges(5)[c]; }
    Out along(int i) { return {plane(18 + i % 2), cells_}; }

private:
    float *plane(int p) { return memory_.data() + p * plane_; }
    Out3 edges(int slot) {
        return {Out{plane(3 * slot), shapes_[0]}, Out{plane(3 * slot + 1), shapes_[1]},
                Out{plane(3 * slot + 2), shapes_[2]}};
    }

    std::array<Shape, 3> shapes_;
    Shape cells_;
    std::size_t plane_;
    std::vector<float> memory_;
};

// What the terms in the curl ask of the vorticity on the edges of slab i; without `irrotational` only R's
// part.
void LeastSquares::stress(Window &window, bool irrotational, int i) const {
    const int nx = box_.cells[0];
    for (int c = 0; c < 3; ++c) {
        const Shape low = first_edge(c);
        const Out out = window.stress(i)[c];
        if (i < low[0] || i >= nx) {
            std::fill_n(out.data, out.slab_size(), 0.0f);
            continue;
        }
        In pointwise;
        if (irrotational) {
            edge_means_slab(irrotational_, c, window.irrotational(c), i);
            pointwise = window.irrotational(c);
        }
        smoothness_slab(window.vorticity(std::max(i - 1, low[0]))[c], window.vorticity(i)[c],
                        window.vorticity(std::min(i + 1, nx - 1))[c], low, box_.cells,
                        regularization_.second_order, pointwise, out);
    }
}

// weight direction . u in the cells of slab i; with an offset, - weight offset.
void LeastSquares::along(Window &window, const StaggeredIn &u, In offset, int i) const {
    const Out out = window.along(i);
    if (offset.data)
        scale(-1, offset.row(i, 0), out.data, out.slab_size());
    else
        directional_slab(u, direction_, out, i);
    multiply(weight_.row(i, 0), out.data, out.slab_size());
}

// Slab i of the result from what the window holds around it; returns its scalar product with u.
double LeastSquares::finish(Window &window, const StaggeredIn &u, const StaggeredOut &result, int i) const {
    const Regularization &r = regularization_;
    Out3 out{};
    for (int c = 0; c < 3; ++c)
        if (i < u[c].n[0]) {
            const In a = slab(u[c], i);
            out[c] = slab(result[c], i);
            if (r.first_order > 0) {
                smoothness_slab(slab(u[c], std::max(i - 1, 0)), a, slab(u[c], std::min(i + 1, u[c].n[0] - 1)),
                                {0, 0, 0}, u[c].n, r.first_order, {}, out[c]);
                axpy(r.kinetic, a.data, out[c].data, a.slab_size());
            } else {
                scale(r.kinetic, a.data, out[c].data, a.slab_size());
            }
        }
    add_curl_transposed_slab(read(window.stress(i)), read(window.stress(i + 1)), out);
    add_directional_transposed_slab(i > 0 ? In(window.along(i - 1)) : In{},
                                    i < box_.cells[0] ? In(window.along(i)) : In{}, direction_, out, i);
    double product = 0;
    for (int c = 0; c < 3; ++c)
        if (out[c].data)
            product += dot(u[c].row(i, 0), out[c].data, out[c].slab_size());
    return product;
}

// A u with its scalar product with u; with an offset, R's part of A u less direction^T (weight offset).
// Everything between u and the result is done slab by slab while it lies in the cache.
double LeastSquares::sweep(const StaggeredIn &u, In offset, const StaggeredOut &result,
                           Workers &workers) const {
    const int nx = box_.cells[0], slabs = nx + 1;
    const int size = std::clamp(nx / BLOCKS, MIN_SLABS, MAX_SLABS), blocks = (slabs + size - 1) / size;
    return workers.sum(blocks, [&](int block) {
        const int first = block * size, last = std::min(first + size, slabs);
        Window window(box_);
        double product = 0;
        if (first > 0) {
            curl_slab(u, window.vorticity(first - 1), first - 1);
            along(window, u, offset, first - 1);
        }
        curl_slab(u, window.vorticity(first), first);
        for (int i = first; i <= last; ++i) {
            if (i + 1 < nx)
                curl_slab(u, window.vorticity(i + 1), i + 1);
            stress(window, !offset.data, i);
            if (i > first)
                product += finish(window, u, result, i - 1);
            if (i < std::min(last, nx))
                along(window, u, offset, i);
        }
        return product;
    });
}

double LeastSquares::apply(const StaggeredIn &u, const StaggeredOut &result, Workers &workers) const {
    return sweep(u, {}, result, workers);
}

StaggeredField LeastSquares::right_hand_side(In offset, const StaggeredIn &center, Workers &workers) const {
    StaggeredField b(box_);
    sweep(center, offset, b.out(), workers);
    return b;
}

std::array<double, 3> LeastSquares::symbol(Workers &workers) const {
    const double cells = double(volume(box_.cells));
    const double data = workers.sum(box_.cells[0], [&](int i) {
        double sum = 0;
        for (std::size_t k = 0; k < weight_.slab_size(); ++k) {
            double square = 0;
            for (const In &component : direction_) {
                const double value = component.row(i, 0)[k];
                square += value * value;
            }
            sum += weight_.row(i, 0)[k] * square / 3;
        }
        return sum;
    });
    const double irrotational = workers.sum(std::max(box_.cells[0] - 1, 0), [&](int i) {
        Field edges(Shape{1, box_.cells[1] + 1, box_.cells[2]});
        std::fill(edges.data().begin(), edges.data().end(), 0.0f);
        edge_means_slab(irrotational_, 2, edges, i + 1);
        double sum = 0;
        for (float value : edges.data())
            sum += value;
        return sum;
    });
    return {regularization_.kinetic + data / cells, regularization_.first_order + irrotational / cells,
            regularization_.second_order};
}

// Of the data term's part in the diagonal what cell (x, y, z) adds for each of its faces across axis c.
// Nothing outside the box.
float LeastSquares::data_diagonal(int c, int x, int y, int z) const {
    if (x < 0 || y < 0 || z < 0 || x >= box_.cells[0] || y >= box_.cells[1] || z >= box_.cells[2])
        return 0;
    const float along = 0.5f * direction_[c].row(x, y)[z];
    return weight_.row(x, y)[z] * along * along;
}

void LeastSquares::find_diagonal(const StaggeredOut &diagonal, Workers &workers) const {
    const Regularization &r = regularization_;
    // Differences of the vorticity: 4 edges times 6 neighbors, and 4 for pairs of edges.
    const float everywhere = 6 * r.first_order + 28 * r.second_order + r.kinetic;
    for (int c = 0; c < 3; ++c) {
        const Out out = diagonal[c];
        workers.run(out.n[0], [&](int i) {
            for (int j = 0; j < out.n[1]; ++j)
                for (int k = 0; k < out.n[2]; ++k)
                    out.row(i, j)[k] = everywhere + data_diagonal(c, i, j, k) +
                                       data_diagonal(c, i - (c == 0), j - (c == 1), k - (c == 2));
        });
    }
}

} // namespace smokelift
