#include "projection.h"

#include "operators.h"
#include "vectors.h"

#include <algorithm>

namespace smokelift {
namespace {

SMOKELIFT_CLONES
void subtract_gradient_slab(In p, const StaggeredOut &u, int i) {
    const Box::Closed &closed = u.box.closed;
    const auto [nx, ny, nz] = p.n;
    for (int j = 0; j < ny; ++j) {
        float *__restrict x = u[0].row(i, j);
        if (i > 0 && i < nx) {
            const float *__restrict p0 = p.row(i - 1, j), *__restrict p1 = p.row(i, j);
            for (int k = 0; k < nz; ++k)
                x[k] += p1[k] - p0[k];
        } else if (!closed[i > 0]) {
            // Pressure is zero on the side itself, half a cell away.
            const float *__restrict p0 = p.row(i > 0 ? nx - 1 : 0, j);
            const float sign = i > 0 ? -2.0f : 2.0f;
            for (int k = 0; k < nz; ++k)
                x[k] += sign * p0[k];
        }
    }
    if (i == nx)
        return;
    for (int j = 0; j <= ny; ++j) {
        float *__restrict y = u[1].row(i, j);
        if (j > 0 && j < ny) {
            const float *__restrict p0 = p.row(i, j - 1), *__restrict p1 = p.row(i, j);
            for (int k = 0; k < nz; ++k)
                y[k] += p1[k] - p0[k];
        } else if (!closed[2 + (j > 0)]) {
            const float *__restrict p0 = p.row(i, j > 0 ? ny - 1 : 0);
            const float sign = j > 0 ? -2.0f : 2.0f;
            for (int k = 0; k < nz; ++k)
                y[k] += sign * p0[k];
        }
    }
    for (int j = 0; j < ny; ++j) {
        float *__restrict z = u[2].row(i, j);
        const float *__restrict q = p.row(i, j);
        for (int k = 1; k < nz; ++k)
            z[k] += q[k] - q[k - 1];
        if (!closed[4])
            z[0] += 2 * q[0];
        if (!closed[5])
            z[nz] -= 2 * q[nz - 1];
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
