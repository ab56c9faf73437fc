#include "blur.h"
#include "least_squares.h"
#include "projection.h"
#include "python.h"
#include "vectors.h"

template <> struct pybind11::detail::type_caster<smokelift::Figures> {
    static constexpr auto name = const_name("Figures");

    static handle cast(const smokelift::Figures &f, return_value_policy, handle) {
        using namespace pybind11::literals;
        return dict("iterations"_a = f.iterations, "products"_a = f.products, "projections"_a = f.projections,
                    "residual"_a = f.residual)
            .release();
    }
};

namespace smokelift {
namespace {

using Components = std::array<Floats, 3>;

// A quadratic function with the arrays that it refers to.
class Problem {
public:
    Problem(const Components &direction, In offset, const Floats &weight, const Floats &irrotational,
            const StaggeredIn &center, const Regularization &regularization, const Box::Closed &closed)
        : direction_(direction), weight_(weight), irrotational_(irrotational), box_{offset.n, closed},
          linear_(box_,
                  {view(direction[0], offset.n), view(direction[1], offset.n), view(direction[2], offset.n)},
                  view(weight, offset.n), view(irrotational, offset.n), regularization) {
        const StaggeredIn around = in_box(center, box_);
        const py::gil_scoped_release release;
        b = linear_.right_hand_side(offset, around, *BorrowedWorkers());
    }

    const LeastSquares &linear() const { return linear_; }
    const Box &box() const { return box_; }

    StaggeredField b; // the right-hand side

private:
    Components direction_;
    Floats weight_, irrotational_;
    Box box_;
    LeastSquares linear_;
};

} // namespace

void register_velocity(py::module_ &module) {
    module.def(
        "blur", unlocked([](Workers &workers, In cells, double width, double truncate) {
            Field result(cells.n);
            blur(cells, width, truncate, result, workers);
            return result;
        }),
        "cells"_a, "width"_a, "truncate"_a,
        "A Gaussian of a standard deviation in cells, cut off at ``truncate`` of them; ends are mirrored.");

    module.def("prolong", unlocked([](Workers &workers, const StaggeredIn &u) {
                   const auto [x, y, z] = u.box.cells;
                   StaggeredField fine(Box{{2 * x, 2 * y, 2 * z}, {}});
                   prolong(u, fine.out(), workers);
                   return fine;
               }),
               "u"_a,
               "A velocity in the cells of a grid that is twice as fine, each with the divergence of its "
               "coarse one.");

    py::class_<Problem>(module, "LeastSquares",
                        R"(A quadratic function of face velocities, E(u) = u.Au - 2 b.u + constant.

        E sums weight (offset + direction . u)^2 + irrotational |curl u|^2 over the cells, and of v = u - center the terms
        first_order |grad v|^2 + second_order |grad curl v|^2 + kinetic |v|^2.)")
        .def(py::init([](const Components &direction, In offset, const Floats &weight,
                         const Floats &irrotational, const StaggeredIn &center, float first_order,
                         float second_order, float kinetic, const Box::Closed &closed) {
                 const Regularization regularization{first_order, second_order, kinetic};
                 return std::make_unique<Problem>(direction, offset, weight, irrotational, center,
                                                  regularization, closed);
             }),
             py::kw_only(), "direction"_a, "offset"_a, "weight"_a, "irrotational"_a, "center"_a,
             "first_order"_a, "second_order"_a, "kinetic"_a, "closed"_a)
        .def("apply", unlocked([](Workers &workers, const Problem &problem, const StaggeredIn &u) {
                 StaggeredField product(problem.box());
                 problem.linear().apply(in_box(u, problem.box()), product.out(), workers);
                 return product;
             }),
             "u"_a, "A u.")
        .def("right_hand_side", unlocked([](Workers &workers, const Problem &problem) {
                 StaggeredField result(problem.box());
                 copy(problem.b.in(), result.out(), workers);
                 return result;
             }),
             "b.")
        .def("diagonal", unlocked([](Workers &workers, const Problem &problem) {
                 StaggeredField result(problem.box());
                 problem.linear().find_diagonal(result.out(), workers);
                 return result;
             }),
             "The diagonal of A as it is away from the sides, without what irrotational adds.")
        .def("projected_cg",
             unlocked([](Workers &workers, Problem &problem, const StaggeredIn &start, double tolerance,
                         int limit) {
                 StaggeredField result(problem.box());
                 const StaggeredOut u = result.out();
                 copy(in_box(start, problem.box()), u, workers);
                 Figures figures = projected_cg(problem.linear(), problem.b, tolerance, limit, u, workers);
                 // Rounding in the course of the iterations leaves a little divergence.
                 Projection(problem.box()).apply(u, workers);
                 ++figures.projections;
                 return std::pair(std::move(result), figures);
             }),
             "start"_a, py::kw_only(), "tolerance"_a, "limit"_a,
             R"(Minimize over velocities without divergence by preconditioned conjugate gradients among them.

        Parameters
        ----------
        start
            Without divergence.
        tolerance
            Stops at this fraction of the preconditioned gradient at rest.
        limit
            Iterations at most.)");
}

} // namespace smokelift
