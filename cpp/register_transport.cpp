#include "advection.h"
#include "arrays.h"
#include "operators.h"
#include "projection.h"

namespace smokelift {

// Arrays are made while the lock is held; only the work itself runs without it.
template <class Work> auto released(int threads, const Work &work) {
    py::gil_scoped_release release;
    Workers workers(threads);
    return work(workers);
}

void register_transport(py::module_ &module) {
    using namespace py::literals;

    module.def(
        "solve_poisson",
        [](const Array &f, const Closed &closed, int threads) {
            Array p = new_array(shape_of(f));
            std::copy_n(f.data(), f.size(), p.mutable_data());
            const Out solution = out(p);
            released(threads,
                     [&](Workers &workers) { Poisson(solution.n, closed).solve(solution, workers); });
            return p;
        },
        "f"_a, "closed"_a, "threads"_a = 0);

    module.def(
        "project",
        [](const Array3 &faces, const Closed &closed, int passes, int threads) {
            Array3 result = copy_of(faces_view(faces));
            const Out3 u = out(result);
            const double residual = released(threads, [&](Workers &workers) {
                Projection projection(Shape{u[1].n[0], u[0].n[1], u[0].n[2]}, closed);
                for (int pass = 0; pass < passes; ++pass)
                    projection.apply(u, workers);
                return relative_divergence(read(u), workers);
            });
            return std::pair(result, residual);
        },
        "faces"_a, "closed"_a, "passes"_a = 2, "threads"_a = 0);

    module.def(
        "divergence",
        [](const Array3 &faces, int threads) {
            const In3 u = faces_view(faces);
            Array result = new_array(cells_of(faces));
            const Out cells = out(result);
            released(threads, [&](Workers &workers) { divergence(u, cells, workers); });
            return result;
        },
        "faces"_a, "threads"_a = 0);

    module.def(
        "gradient",
        [](const Array &cells, int threads) {
            const In a = view(cells);
            Array3 result = new_arrays({a.n, a.n, a.n});
            const Out3 g = out(result);
            released(threads, [&](Workers &workers) { gradient(a, g, workers); });
            return result;
        },
        "cells"_a, "threads"_a = 0);

    module.def(
        "advect_cells",
        [](const Array &field, const Array3 &displacement, bool maccormack, bool extend, int threads) {
            const In a = view(field);
            const In3 u = view(displacement, face_shapes(a.n));
            Array result = new_array(a.n);
            const Out moved = out(result);
            released(threads, [&](Workers &workers) {
                if (maccormack)
                    advect_cells_maccormack(a, u, moved, workers);
                else
                    advect_cells(a, u, extend, moved, workers);
            });
            return result;
        },
        "field"_a, "displacement"_a, "maccormack"_a, "extend"_a = false, "threads"_a = 0);

    module.def(
        "advect_faces",
        [](const Array3 &field, const Array3 &displacement, bool maccormack, int threads) {
            const In3 a = faces_view(field);
            const In3 u = view(displacement, face_shapes(cells_of(field)));
            Array3 result = new_arrays(face_shapes(cells_of(field)));
            const Out3 moved = out(result);
            released(threads, [&](Workers &workers) { advect_faces(a, u, maccormack, moved, workers); });
            return result;
        },
        "field"_a, "displacement"_a, "maccormack"_a, "threads"_a = 0);
}

} // namespace smokelift
