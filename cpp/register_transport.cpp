#include "advection.h"
#include "operators.h"
#include "projection.h"
#include "python.h"
#include "vectors.h"

namespace smokelift {

void register_transport(py::module_ &module) {
    using namespace py::literals;

    module.def(
        "solve_poisson",
        [](const Array &f, const Box::Closed &closed) {
            const In right = view(f);
            return filled(right.n, [&](Out p, Workers &workers) {
                std::copy_n(right.data, volume(right.n), p.data);
                Poisson({right.n, closed}).solve(p, workers);
            });
        },
        "f"_a, "closed"_a);

    module.def(
        "project",
        [](const Array3 &faces, const Box::Closed &closed, int passes) {
            const StaggeredIn from = view(faces, closed);
            double residual = 0;
            Array3 result = filled(from.box, [&](const StaggeredOut &u, Workers &workers) {
                copy(from, u, workers);
                Projection projection(u.box);
                for (int pass = 0; pass < passes; ++pass)
                    projection.apply(u, workers);
                residual = relative_divergence(read(u), workers);
            });
            return std::pair(result, residual);
        },
        "faces"_a, "closed"_a, "passes"_a = 2);

    module.def(
        "divergence",
        [](const Array3 &faces) {
            const StaggeredIn u = view(faces);
            return filled(u.box.cells, [&](Out cells, Workers &workers) { divergence(u, cells, workers); });
        },
        "faces"_a);

    module.def(
        "relative_divergence",
        [](const Array3 &faces) {
            const StaggeredIn u = view(faces);
            return released([&](Workers &workers) { return relative_divergence(u, workers); });
        },
        "faces"_a);

    module.def(
        "gradient",
        [](const Array &cells) {
            const In a = view(cells);
            Array3 result = new_arrays({a.n, a.n, a.n});
            const Out3 g = out(result);
            released([&](Workers &workers) { gradient(a, g, workers); });
            return result;
        },
        "cells"_a);

    module.def(
        "advect_cells",
        [](const Array &field, const Array3 &displacement, bool maccormack, bool extend) {
            const In a = view(field);
            const StaggeredIn u = view(displacement, Box{a.n, {}});
            return filled(a.n, [&](Out moved, Workers &workers) {
                if (maccormack)
                    advect_cells_maccormack(a, u, moved, workers);
                else
                    advect_cells(a, u, extend, moved, workers);
            });
        },
        "field"_a, "displacement"_a, "maccormack"_a, "extend"_a = false);

    module.def(
        "advect_faces",
        [](const Array3 &field, const Array3 &displacement, bool maccormack) {
            const StaggeredIn a = view(field), u = view(displacement, a.box);
            return filled(a.box, [&](const StaggeredOut &moved, Workers &workers) {
                advect_faces(a, u, maccormack, moved, workers);
            });
        },
        "field"_a, "displacement"_a, "maccormack"_a);
}

} // namespace smokelift
