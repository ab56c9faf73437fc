#include "advection.h"
#include "operators.h"
#include "projection.h"
#include "python.h"
#include "vectors.h"

namespace smokelift {

void register_transport(py::module_ &module) {
    module.def(
        "solve_poisson", unlocked([](Workers &workers, In f, const Box::Closed &closed) {
            Field p(f.n);
            std::copy_n(f.data, volume(f.n), p.data().data());
            Poisson({f.n, closed}).solve(p, workers);
            return p;
        }),
        "f"_a, "closed"_a,
        R"(Solve -laplace p = f at cell centers, with p = 0 on open sides and no flux through closed ones.

        With all sides closed the mean of f is removed first, and p is known up to a constant.)");

    module.def("project",
               unlocked([](Workers &workers, StaggeredIn faces, const Box::Closed &closed, int passes) {
                   faces.box.closed = closed;
                   StaggeredField result(faces.box);
                   const StaggeredOut u = result.out();
                   copy(faces, u, workers);
                   Projection projection(u.box);
                   for (int pass = 0; pass < passes; ++pass)
                       projection.apply(u, workers);
                   return std::pair(std::move(result), relative_divergence(read(u), workers));
               }),
               "faces"_a, "closed"_a, "passes"_a = 2,
               R"(The nearest velocity without divergence, and max |div u| / max |u| of that.

        Nearest in the sum of squares over faces, those on open sides counted half. A second pass removes what rounding
        leaves.)");

    module.def("divergence", unlocked([](Workers &workers, const StaggeredIn &faces) {
                   Field cells(faces.box.cells);
                   divergence(faces, cells, workers);
                   return cells;
               }),
               "faces"_a, "Net outflow of every cell.");

    module.def("advect_cells",
               unlocked([](Workers &workers, In field, const StaggeredIn &displacement, bool maccormack,
                           bool extend) {
                   require_fit(displacement.box.cells == field.n);
                   Field moved(field.n);
                   advect_cells(field, displacement, extend, maccormack, moved, workers);
                   return moved;
               }),
               "field"_a, "displacement"_a, "maccormack"_a, "extend"_a = false,
               R"(Values at x - displacement(x), interpolated linearly.

        What comes from outside the box is zero, or with ``extend`` the nearest value inside. The correction (Selle et al.
        2008) is limited to the values around the point of origin.)");

    module.def("advect_faces",
               unlocked([](Workers &workers, const StaggeredIn &field, const StaggeredIn &displacement,
                           bool maccormack) {
                   require_fit(displacement.box.cells == field.box.cells);
                   StaggeredField moved(field.box);
                   advect_faces(field, displacement, maccormack, moved.out(), workers);
                   return moved;
               }),
               "field"_a, "displacement"_a, "maccormack"_a,
               "The same for a velocity, each component at its own faces; beyond the box it continues as on "
               "its side.");
}

} // namespace smokelift
