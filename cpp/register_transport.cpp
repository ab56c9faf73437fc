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
            Array p = new_array(shape_of(f));
            std::copy_n(f.data(), f.size(), p.mutable_data());
            const Out solution = out(p);
            released([&](Workers &workers) { Poisson({solution.n, closed}).solve(solution, workers); });
            return p;
        },
        "f"_a, "closed"_a);

    module.def(
        "project",
        [](const Array3 &faces, const Box::Closed &closed, int passes) {
            const StaggeredIn from = view(faces, closed);
            Array3 result = new_arrays(from.box.faces());
            const StaggeredOut u = out(result, from.box);
            const double residual = released([&](Workers &workers) {
                copy(from, u, workers);
                Projection projection(u.box);
                for (int pass = 0; pass < passes; ++pass)
                    projection.apply(u, workers);
                return relative_divergence(read(u), workers);
            });
            return std::pair(result, residual);
        },
        "faces"_a, "closed"_a, "passes"_a = 2);

    module.def(
        "divergence",
        [](const Array3 &faces) {
            const StaggeredIn u = view(faces);
            Array result = new_array(u.box.cells);
            const Out cells = out(result);
            released([&](Workers &workers) { divergence(u, cells, workers); });
            return result;
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
            Array result = new_array(a.n);
            const Out moved = out(result);
            released([&](Workers &workers) {
                if (maccormack)
                    advect_cells_maccormack(a, u, moved, workers);
                else
                    advect_cells(a, u, extend, moved, workers);
            });
            return result;
        },
        "field"_a, "displacement"_a, "maccormack"_a, "extend"_a = false);

    module.def(
        "advect_faces",
        [](const Array3 &field, const Array3 &displacement, bool maccormack) {
            const StaggeredIn a = view(field), u = view(displacement, a.box);
            Array3 result = new_arrays(a.box.faces());
            const StaggeredOut moved = out(result, a.box);
            released([&](Workers &workers) { advect_faces(a, u, maccormack, moved, workers); });
            return result;
        },
        "field"_a, "displacement"_a, "maccormack"_a);
}

} // namespace smokelift
