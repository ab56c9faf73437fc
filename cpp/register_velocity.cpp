#include "arrays.h"
#include "blur.h"
#include "linearisation.h"
#include "motion.h"
#include "operators.h"
#include "primal_dual.h"
#include "projected_cg.h"

#include <optional>

namespace smokelift {
namespace {

py::dict as_dict(const Figures &f) {
    using namespace py::literals;
    return py::dict("iterations"_a = f.iterations, "products"_a = f.products, "projections"_a = f.projections,
                    "residual"_a = f.residual);
}

// The problem with what it looks at. The right-hand side is made when it is first asked for; from then on
// nothing else is needed of offset and centre.
class Problem {
public:
    Problem(const Array3 &direction, const Array &offset, const Array &weight, const Array &irrotational,
            const Array3 &centre, const Regularisation &regularisation, const Closed &closed)
        : direction_(direction), centre_(centre), offset_(offset), weight_(weight),
          irrotational_(irrotational), linear_(cells(direction, view(offset)), view(weight, shape_of(offset)),
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

using Mask = py::array_t<bool, py::array::c_style>;

const unsigned char *marked(const Mask &mask, const Shape &n) {
    if (mask.ndim() != 3 || mask.shape(0) != n[0] || mask.shape(1) != n[1] || mask.shape(2) != n[2])
        throw std::invalid_argument("the arrays do not have shapes that belong together.");
    return reinterpret_cast<const unsigned char *>(mask.data());
}

// Arrays are made while the lock is held; only the work itself runs without it.
template <class Work> auto released(int threads, const Work &work) {
    py::gil_scoped_release release;
    Workers workers(threads);
    return work(workers);
}

void register_estimate(py::module_ &module) {
    using namespace py::literals;

    module.def(
        "blur",
        [](const Array &cells, double width, double truncate, int threads) {
            const In a = view(cells);
            Array result = new_array(a.n);
            const Out blurred = out(result);
            released(threads, [&](Workers &workers) { blur(a, width, truncate, blurred, workers); });
            return result;
        },
        "cells"_a, "width"_a, "truncate"_a, "threads"_a = 0);

    module.def(
        "linearise",
        [](const Array &before, const Array &after, const Array3 &u, float threshold, int threads) {
            const In second = view(after), first = view(before, second.n);
            const In3 motion = view(u, face_shapes(second.n));
            Array3 direction = new_arrays({second.n, second.n, second.n});
            Array offset = new_array(second.n), residual = new_array(second.n), carried = new_array(second.n),
                  density = new_array(second.n);
            Mask smoke(std::vector<py::ssize_t>{second.n[0], second.n[1], second.n[2]});
            const Linearisation result{
                out(direction), out(offset),  out(residual),
                out(carried),   out(density), reinterpret_cast<unsigned char *>(smoke.mutable_data())};
            const double scale = released(threads, [&](Workers &workers) {
                return linearise(first, second, motion, threshold, result, workers);
            });
            return py::make_tuple(direction, offset, residual, carried, density, smoke, scale);
        },
        "before"_a, "after"_a, "u"_a, "threshold"_a, "threads"_a = 0);

    module.def(
        "evidence",
        [](const Array3 &direction, const Array &offset, const Array &weight, const Mask &smoke,
           const Array3 &u, int threads) {
            const In r = view(offset), w = view(weight, r.n);
            const In3 g = view(direction, {r.n, r.n, r.n}), motion = view(u, face_shapes(r.n));
            const unsigned char *inside = marked(smoke, r.n);
            return released(threads,
                            [&](Workers &workers) { return evidence(g, r, w, inside, motion, workers); });
        },
        "direction"_a, "offset"_a, "weight"_a, "smoke"_a, "u"_a, "threads"_a = 0);

    module.def(
        "directional",
        [](const Array3 &direction, const Array3 &u, int threads) {
            const In3 motion = faces_view(u), g = view(direction, {cells_of(u), cells_of(u), cells_of(u)});
            Array result = new_array(g[0].n);
            const Out along = out(result);
            released(threads, [&](Workers &workers) {
                workers.run(along.n[0], [&](int i) { directional_slab(motion, g, slab(along, i), i); });
            });
            return result;
        },
        "direction"_a, "u"_a, "threads"_a = 0);

    module.def(
        "weighted_products",
        [](const std::vector<Array> &columns, const Array &weight, int threads) {
            const In w = view(weight);
            std::vector<In> views;
            for (const Array &column : columns)
                views.push_back(view(column, w.n));
            const auto products =
                released(threads, [&](Workers &workers) { return weighted_products(views, w, workers); });
            py::array_t<double> result({columns.size(), columns.size()});
            std::copy(products.begin(), products.end(), result.mutable_data());
            return result;
        },
        "columns"_a, "weight"_a, "threads"_a = 0);

    module.def(
        "pushed",
        [](const Array &density, const Push &push, float trust, const std::optional<Array3> &prediction,
           const Closed &closed, int threads) {
            const In a = view(density);
            const In3 predicted = prediction ? view(*prediction, face_shapes(a.n)) : In3{};
            if (push.empty() || (trust != 0 && !prediction))
                throw std::invalid_argument("expected a push, and a prediction to trust in.");
            Array3 result = new_arrays(face_shapes(a.n));
            const Out3 u = out(result);
            released(threads,
                     [&](Workers &workers) { pushed(a, push, trust, predicted, closed, u, workers); });
            return result;
        },
        "density"_a, "push"_a, "trust"_a, "prediction"_a, "closed"_a, "threads"_a = 0);

    module.def(
        "refine",
        [](const Array3 &u, const Shape &shape, const Closed &closed, int threads) {
            const In3 coarse = faces_view(u);
            Array3 result = new_arrays(face_shapes(shape));
            const Out3 fine = out(result);
            released(threads, [&](Workers &workers) { refine(coarse, closed, fine, workers); });
            return result;
        },
        "u"_a, "shape"_a, "closed"_a, "threads"_a = 0);

    module.def(
        "within_reach",
        [](const Array3 &solution, const Array3 &u, float reach, const Closed &closed, int threads) {
            const In3 found = faces_view(solution), from = view(u, face_shapes(cells_of(solution)));
            if (released(threads,
                         [&](Workers &workers) { return largest_difference(found, from, workers); }) <= reach)
                return solution;
            Array3 result = new_arrays(face_shapes(cells_of(solution)));
            const Out3 held = out(result);
            released(threads, [&](Workers &workers) {
                copy(found, held, workers);
                hold_back(from, reach, closed, held, workers);
            });
            return result;
        },
        "solution"_a, "u"_a, "reach"_a, "closed"_a, "threads"_a = 0);
}

} // namespace

void register_velocity(py::module_ &module) {
    using namespace py::literals;

    register_estimate(module);

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
                return solved(problem, start, threads,
                              [&](Field3 &b, Projection &, const Out3 &u, Workers &workers) {
                                  return projected_cg(problem.linear(), b, tolerance, limit, u, workers);
                              });
            },
            "start"_a, py::kw_only(), "tolerance"_a, "limit"_a, "threads"_a = 0)
        .def(
            "primal_dual",
            [](Problem &problem, const Array3 &start, double sigma, double tau, double theta, double absolute,
               double relative, int limit, double inner_tolerance, int inner_limit, int threads) {
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
