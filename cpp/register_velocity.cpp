#include "arrays.h"
#include "operators.h"
#include "primal_dual.h"
#include "projected_cg.h"

namespace smokelift {
namespace {

py::dict as_dict(const Figures &f) {
    using namespace py::literals;
    return py::dict("iterations"_a = f.iterations, "products"_a = f.products, "projections"_a = f.projections,
                    "residual"_a = f.residual);
}

// Runs solve(problem, projection, u, workers) on a copy of `start`.
template <class Solve>
std::pair<Array3, py::dict> solved(LeastSquares &problem, const Array3 &start, int threads,
                                   const Solve &solve) {
    Array3 result = copy_of(view(start, problem.shapes()));
    const Out3 u = out(result);
    Figures figures;
    {
        py::gil_scoped_release release;
        Workers workers(threads);
        Projection projection(problem.shape(), problem.closed());
        figures = solve(projection, u, workers);
        // Rounding in the course of the iterations leaves a little divergence.
        projection.apply(u, workers);
        ++figures.projections;
    }
    return {result, as_dict(figures)};
}

} // namespace

void register_velocity(py::module_ &module) {
    using namespace py::literals;

    py::class_<LeastSquares>(module, "LeastSquares")
        .def(py::init([](const Array3 &direction, const Array &offset, const Array &weight,
                         const Array &irrotational, const Array3 &centre, float first_order,
                         float second_order, float kinetic, const Closed &closed) {
                 const Shape n = shape_of(offset);
                 return std::make_unique<LeastSquares>(
                     view(direction, {n, n, n}), view(offset, n), view(weight, n), view(irrotational, n),
                     view(centre, face_shapes(n)), Regularisation{first_order, second_order, kinetic},
                     closed);
             }),
             py::kw_only(), "direction"_a, "offset"_a, "weight"_a, "irrotational"_a, "centre"_a,
             "first_order"_a, "second_order"_a, "kinetic"_a, "closed"_a)
        .def(
            "apply",
            [](LeastSquares &problem, const Array3 &u, int threads) {
                const In3 in = view(u, problem.shapes());
                Array3 result = new_arrays(problem.shapes());
                const Out3 product = out(result);
                {
                    py::gil_scoped_release release;
                    Workers workers(threads);
                    problem.apply(in, product, workers);
                }
                return result;
            },
            "u"_a, "threads"_a = 0)
        .def(
            "right_hand_side",
            [](LeastSquares &problem, int threads) {
                Field3 b;
                {
                    py::gil_scoped_release release;
                    Workers workers(threads);
                    b = problem.right_hand_side(workers);
                }
                return copy_of(b.in());
            },
            "threads"_a = 0)
        .def(
            "projected_cg",
            [](LeastSquares &problem, const Array3 &start, double tolerance, int limit, int threads) {
                return solved(problem, start, threads, [&](Projection &, const Out3 &u, Workers &workers) {
                    return projected_cg(problem, tolerance, limit, u, workers);
                });
            },
            "start"_a, py::kw_only(), "tolerance"_a, "limit"_a, "threads"_a = 0)
        .def(
            "primal_dual",
            [](LeastSquares &problem, const Array3 &start, double sigma, double tau, double theta,
               double absolute, double relative, int limit, double inner_tolerance, int inner_limit,
               int threads) {
                const PrimalDual settings{sigma,    tau,   theta,           absolute,
                                          relative, limit, inner_tolerance, inner_limit};
                return solved(problem, start, threads,
                              [&](Projection &projection, const Out3 &u, Workers &workers) {
                                  return primal_dual(problem, projection, settings, u, workers);
                              });
            },
            "start"_a, py::kw_only(), "sigma"_a, "tau"_a, "theta"_a, "absolute"_a, "relative"_a, "limit"_a,
            "inner_tolerance"_a, "inner_limit"_a, "threads"_a = 0);
}

} // namespace smokelift
