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

// The problem with what it looks at. The right-hand side is made when it is first asked for; from then on nothing
// else is needed of offset and centre.
class Problem {
public:
    Problem(const Array3 &direction, const Array &offset, const Array &weight, const Array &irrotational,
            const Array3 &centre, const Regularisation &regularisation, const Closed &closed)
        : direction_(direction), centre_(centre), offset_(offset), weight_(weight), irrotational_(irrotational),
          linear_(cells(direction, view(offset)), view(weight, shape_of(offset)),
                  view(irrotational, shape_of(offset)), regularisation, closed) {
        view(centre, linear_.shapes());
    }

    const LeastSquares &linear() const { return linear_; }

    Field3 &right_hand_side(int threads) {
        if (!known_) {
            const In offset = view(offset_);
            const In3 centre = view(centre_, linear_.shapes());
            {
                py::gil_scoped_release release;
                Workers workers(threads);
                b_ = linear_.right_hand_side(offset, centre, workers);
            }
            known_ = true;
            offset_ = Array();
            centre_ = Array3();
        }
        return b_;
    }

private:
    static In3 cells(const Array3 &arrays, In like) { return view(arrays, {like.n, like.n, like.n}); }

    Array3 direction_, centre_;
    Array offset_, weight_, irrotational_;
    LeastSquares linear_;
    bool known_ = false;
    Field3 b_;
};

// Runs solve(b, projection, u, workers) on a copy of `start`.
template <class Solve>
std::pair<Array3, py::dict> solved(Problem &problem, const Array3 &start, int threads, const Solve &solve) {
    const LeastSquares &linear = problem.linear();
    const In3 from = view(start, linear.shapes());
    Field3 &b = problem.right_hand_side(threads);
    Array3 result = new_arrays(linear.shapes());
    const Out3 u = out(result);
    Figures figures;
    {
        py::gil_scoped_release release;
        Workers workers(threads);
        copy(from, u, workers);
        Projection projection(linear.shape(), linear.closed());
        figures = solve(b, projection, u, workers);
        // Rounding in the course of the iterations leaves a little divergence.
        projection.apply(u, workers);
        ++figures.projections;
    }
    return {result, as_dict(figures)};
}

} // namespace

void register_velocity(py::module_ &module) {
    using namespace py::literals;

    py::class_<Problem>(module, "LeastSquares")
        .def(py::init([](const Array3 &direction, const Array &offset, const Array &weight,
                         const Array &irrotational, const Array3 &centre, float first_order,
                         float second_order, float kinetic, const Closed &closed) {
                 return std::make_unique<Problem>(direction, offset, weight, irrotational, centre,
                                                  Regularisation{first_order, second_order, kinetic}, closed);
             }),
             py::kw_only(), "direction"_a, "offset"_a, "weight"_a, "irrotational"_a, "centre"_a,
             "first_order"_a, "second_order"_a, "kinetic"_a, "closed"_a)
        .def(
            "apply",
            [](const Problem &problem, const Array3 &u, int threads) {
                const LeastSquares &linear = problem.linear();
                const In3 in = view(u, linear.shapes());
                Array3 result = new_arrays(linear.shapes());
                const Out3 product = out(result);
                {
                    py::gil_scoped_release release;
                    Workers workers(threads);
                    linear.apply(in, product, workers);
                }
                return result;
            },
            "u"_a, "threads"_a = 0)
        .def(
            "right_hand_side",
            [](Problem &problem, int threads) { return copy_of(problem.right_hand_side(threads).in()); },
            "threads"_a = 0)
        .def(
            "projected_cg",
            [](Problem &problem, const Array3 &start, double tolerance, int limit, int threads) {
                return solved(problem, start, threads, [&](Field3 &b, Projection &, const Out3 &u, Workers &workers) {
                    return projected_cg(problem.linear(), b, tolerance, limit, u, workers);
                });
            },
            "start"_a, py::kw_only(), "tolerance"_a, "limit"_a, "threads"_a = 0)
        .def(
            "primal_dual",
            [](Problem &problem, const Array3 &start, double sigma, double tau, double theta,
               double absolute, double relative, int limit, double inner_tolerance, int inner_limit,
               int threads) {
                const PrimalDual settings{sigma,    tau,   theta,           absolute,
                                          relative, limit, inner_tolerance, inner_limit};
                return solved(problem, start, threads,
                              [&](const Field3 &b, Projection &projection, const Out3 &u, Workers &workers) {
                                  return primal_dual(problem.linear(), b, projection, settings, u, workers);
                              });
            },
            "start"_a, py::kw_only(), "sigma"_a, "tau"_a, "theta"_a, "absolute"_a, "relative"_a, "limit"_a,
            "inner_tolerance"_a, "inner_limit"_a, "threads"_a = 0);
}

} // namespace smokelift
