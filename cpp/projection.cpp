#include "projection.h"

#include "operators.h"
#include "vectors.h"

#include <algorithm>

namespace smokelift {
namespace {

// Row number i of faces += the change of the pressure from the row of cells before it to that after it. There
// are n of these, and beyond them two sides. On an open side the pressure is zero on the side itself, half a
// cell away.
SMOKELIFT_INLINE void add_change(float *__restrict faces, const float *__restrict before,
                                 const float *__restrict after, int i, int n, const bool *closed,
                                 int length) {
    if (i > 0 && i < n) {
        for (int k = 0; k < length; ++k)
            faces[k] += after[k] - before[k];
    } else if (!closed[i > 0]) {
        const float *__restrict beside = i > 0 ? before : after;
        const float sign = i > 0 ? -2.0f : 2.0f;
        for (int k = 0; k < length; ++k)
            faces[k] += sign * beside[k];
    }
}

SMOKELIFT_CLONES
void subtract_gradient_slab(In p, const StaggeredOut &u, int i) {
    const bool *const closed = u.box.closed.data();
    const auto [nx, ny, nz] = p.n;
    for (int j = 0; j < ny; ++j)
        add_change(u[0].row(i, j), p.row(std::max(i - 1, 0), j), p.row(std::min(i, nx - 1), j), i, nx, closed,
                   nz);
    if (i == nx)
        return;
    for (int j = 0; j <= ny; ++j)
        add_change(u[1].row(i, j), p.row(i, std::max(j - 1, 0)), p.row(i, std::min(j, ny - 1)), j, ny,
                   closed + 2, nz);
    for (int j = 0; j < ny; ++j) {
        float *__restrict z = u[2].row(i, j);
        const float *__restrict q = p.row(i, j);
        add_change(z, q, q, 0, nz, closed + 4, 1);
        add_change(z + 1, q, q + 1, 1, nz, closed + 4, nz - 1);
        add_change(z + nz, q + nz - 1, q + nz - 1, nz, nz, closed + 4, 1);
    }
}

// Walls let nothing through.
void stop_at_walls(const StaggeredOut &u) {
    for (int side = 0; side < 6; ++side) {
        if (!u.box.closed[side])
            continue;
        const int axis = side / 2;
        Shape first{}, last = u[axis].n;
        first[axis] = side % 2 ? last[axis] - 1 : 0;
        last[axis] = first[axis] + 1;
        for (int i = first[0]; i < last[0]; ++i)
            for (int j = first[1]; j < last[1]; ++j)
                std::fill(u[axis].row(i, j) + first[2], u[axis].row(i, j) + last[2], 0.0f);
    }
}

} // namespace

void Projection::apply(const StaggeredOut &u, Workers &workers) {
    stop_at_walls(u);
    divergence(read(u), pressure_, workers);
    // div u = -laplace p here, so that u - (-grad p) loses its divergence.
    poisson_.solve(pressure_, workers);
    workers.run(u.box.cells[0] + 1, [&](int i) { subtract_gradient_slab(pressure_, u, i); });
}

double relative_divergence(const StaggeredIn &u, Workers &workers) {
    const auto [nx, ny, nz] = u.box.cells;
    std::vector<float> outflows(nx);
    workers.run(nx, [&, ny = ny, nz = nz](int i) {
        Field cells(Shape{1, ny, nz});
        divergence_slab(u, cells, i);
        outflows[i] = largest_size(cells.data().data(), cells.data().size());
    });
    const float speed = largest_size(u, workers);
    const float outflow = *std::max_element(outflows.begin(), outflows.end());
    return speed > 0 ? double(outflow) / double(speed) : 0;
}

} // namespace smokelift
