#include "blur.h"
#include "data_term.h"
#include "increment.h"
#include "momentum.h"
#include "operators.h"
#include "primal_dual.h"
#include "projected_cg.h"
#include "prolongation.h"
#include "python.h"
#include "vectors.h"

#include <optional>

namespace smokelift {
namespace {

using SmokeMarks = py::array_t<bool, py::array::c_style>;

Mask marked(const SmokeMarks &marks, const Shape &n) {
    require_fit(marks.ndim() == 3 && marks.shape(0) == n[0] && marks.shape(1) == n[1] &&
                marks.shape(2) == n[2]);
    return {reinterpret_cast<const unsigned char *>(marks.data()), n};
}

void register_data_term(py::module_ &module) {
    using namespace py::literals;

    module.def(
        "blur",
        [](const Array &cells, double width, double truncate) {
            const In a = view(cells);
            return filled(a.n,
                          [&](Out result, Workers &workers) { blur(a, width, truncate, result, workers); });
        },
        "cells"_a, "width"_a, "truncate"_a);

    module.def(
        "linearise",
        [](const Array &before, const Array &after, const Array3 &u, float threshold) {
            const In second = view(after), first = view(before, second.n);
            const Shape n = second.n;
            const StaggeredIn motion = view(u, Box{n, {}});
            Array3 direction = new_arrays({n, n, n});
            Array offset = new_array(n), residual = new_array(n), carried = new_array(n),
                  density = new_array(n);
            SmokeMarks smoke(std::vector<py::ssize_t>{n[0], n[1], n[2]});
            const Linearisation result{
                out(direction), out(offset),  out(residual),
                out(carried),   out(density), {reinterpret_cast<unsigned char *>(smoke.mutable_data()), n}};
            const double scale = released([&](Workers &workers) {
                return linearise(first, second, motion, threshold, result, workers);
            });
            return py::make_tuple(direction, offset, residual, carried, density, smoke, scale);
        },
        "before"_a, "after"_a, "u"_a, "threshold"_a);

    module.def(
        "residual_sums",
        [](const Array3 &direction, const Array &offset, const Array &weight, const SmokeMarks &smoke,
           const Array3 &u) {
            const In r = view(offset), w = view(weight, r.n);
            const In3 g = view(direction, r.n);
            const StaggeredIn motion = view(u, Box{r.n, {}});
            const Mask inside = marked(smoke, r.n);
            return released(
                [&](Workers &workers) { return residual_sums(g, r, w, inside, motion, workers); });
        },
        "direction"_a, "offset"_a, "weight"_a, "smoke"_a, "u"_a);

    module.def(
        "directional_derivative",
        [](const Array3 &direction, const Array3 &u) {
            const StaggeredIn motion = view(u);
            const In3 g = view(direction, motion.box.cells);
            return filled(g[0].n, [&](Out along, Workers &workers) {
                workers.run(along.n[0], [&](int i) { directional_slab(motion, g, slab(along, i), i); });
            });
        },
        "direction"_a, "u"_a);

    module.def(
        "weighted_products",
        [](const std::vector<Array> &columns, const Array &weight) {
            const In w = view(weight);
            std::vector<In> views;
            for (const Array &column : columns)
                views.push_back(view(column, w.n));
            const auto products =
                released([&](Workers &workers) { return weighted_products(views, w, workers); });
            py::array_t<double> result({columns.size(), columns.size()});
            std::copy(products.begin(), products.end(), result.mutable_data());
            return result;
        },
        "columns"_a, "weight"_a);
}

void register_motion(py::module_ &module) {
    using namespace py::literals;

    module.def(
        "add_momentum",
        [](const Array &density, const MomentumSource &source, float trust,
           const std::optional<Array3> &prediction, const Box::Closed &closed) {
            const In a = view(density);
            const Box box{a.n, closed};
            const StaggeredIn predicted = prediction ? view(*prediction, box) : StaggeredIn{};
            if (source.empty() || (trust != 0 && !prediction))
                throw std::invalid_argument("expected a momentum source, and a prediction to trust in.");
            return filled(box, [&](const StaggeredOut &u, Workers &workers) {
                add_momentum(a, source, trust, predicted, u, workers);
            });
        },
        "density"_a, "source"_a, "trust"_a, "prediction"_a, "closed"_a);

    module.def(
        "prolong",
        [](const Array3 &u) {
            const StaggeredIn coarse = view(u);
            const auto [x, y, z] = coarse.box.cells;
            return filled(Box{{2 * x, 2 * y, 2 * z}, {}}, [&](const StaggeredOut &fine, Workers &workers) {
                prolong(coarse, fine, workers);
            });
        },
        "u"_a);

    module.def(
        "clamp_increment",
        [](const Array3 &solution, const Array3 &u, float largest, const Box::Closed &closed) {
            const StaggeredIn found = view(solution, closed), from = view(u, found.box);
            if (released([&](Workers &workers) { return largest_difference(found, from, workers); }) <=
                largest)
                return solution;
            return filled(found.box, [&](const StaggeredOut &clamped, Workers &workers) {
                copy(found, clamped, workers);
                clamp_increment(from, largest, clamped, workers);
            });
        },
        "solution"_a, "u"_a, "largest"_a, "closed"_a);
}

// The problem with the arrays that it refers to. The right-hand side is made when it is first asked for; from
// then on nothing else is needed of offset and centre.
class Problem {
public:
    Problem(const Array3 &direction, const Array &offset, const Array &weight, const Array &irrotational,
            const Array3 &centre, const Regularisation &regularisation, const Box &box)
        : direction_(direction), centre_(centre), offset_(offset), weight_(weight),
          irrotational_(irrotational), linear_(box, view(direction, box.cells), view(weight, box.cells),
                                               view(irrotational, box.cells), regularisation) {
        view(centre, box);
    }

    const LeastSquares &linear() const { return linear_; }

    StaggeredField &right_hand_side() {
        if (!known_) {
            const In offset = view(offset_);
            const StaggeredIn centre = view(centre_, linear_.box());
            released([&](Workers &workers) { b_ = linear_.right_hand_side(offset, centre, workers); });
            known_ = true;
            offset_ = Array();
            centre_ = Array3();
        }
        return b_;
    }

    // Runs solve(b, projection, u, workers) on a copy of `start`.
    template <class Solve> std::pair<Array3, py::dict> solved(const Array3 &start, const Solve &solve) {
        const StaggeredIn from = view(start, linear_.box());
        StaggeredField &b = right_hand_side();
        Figures f;
        Array3 result = filled(linear_.box(), [&](const StaggeredOut &u, Workers &workers) {
            copy(from, u, workers);
            Projection projection(u.box);
            f = solve(b, projection, u, workers);
            // Rounding in the course of the iterations leaves a little divergence.
            projection.apply(u, workers);
            ++f.projections;
        });
        using namespace py::literals;
        return {result, py::dict("iterations"_a = f.iterations, "products"_a = f.products,
                                 "projections"_a = f.projections, "residual"_a = f.residual)};
    }

private:
    Array3 direction_, centre_;
    Array offset_, weight_, irrotational_;
    LeastSquares linear_;
    bool known_ = false;
    StaggeredField b_;
};

} // namespace

void register_velocity(py::module_ &module) {
    using namespace py::literals;

    register_data_term(module);
    register_motion(module);

    py::class_<Problem>(module, "LeastSquares")
        .def(py::init([](const Array3 &direction, const Array &offset, const Array &weight,
                         const Array &irrotational, const Array3 &centre, float first_order,
                         float second_order, float kinetic, const Box::Closed &closed) {
                 return std::make_unique<Problem>(direction, offset, weight, irrotational, centre,
                                                  Regularisation{first_order, second_order, kinetic},
                                                  Box{shape_of(offset), closed});
             }),
             py::kw_only(), "direction"_a, "offset"_a, "weight"_a, "irrotational"_a, "centre"_a,
             "first_order"_a, "second_order"_a, "kinetic"_a, "closed"_a)
        .def(
            "apply",
            [](const Problem &problem, const Array3 &u) {
                const StaggeredIn in = view(u, problem.linear().box());
                return filled(in.box, [&](const StaggeredOut &product, Workers &workers) {
                    problem.linear().apply(in, product, workers);
                });
            },
            "u"_a)
        .def("right_hand_side",
             [](Problem &problem) {
                 const StaggeredIn b = problem.right_hand_side().in();
                 return filled(
                     b.box, [&](const StaggeredOut &result, Workers &workers) { copy(b, result, workers); });
             })
        .def(
            "projected_cg",
            [](Problem &problem, const Array3 &start, double tolerance, int limit) {
                return problem.solved(
                    start, [&](StaggeredField &b, Projection &, const StaggeredOut &u, Workers &workers) {
                        return projected_cg(problem.linear(), b, tolerance, limit, u, workers);
                    });
            },
            "start"_a, py::kw_only(), "tolerance"_a, "limit"_a)
        .def(
            "primal_dual",
            [](Problem &problem, const Array3 &start, double sigma, double tau, double theta, double absolute,
               double relative, int limit, double inner_tolerance, int inner_limit) {
                const PrimalDual settings{sigma,    tau,   theta,           absolute,
                                          relative, limit, inner_tolerance, inner_limit};
                return problem.solved(start, [&](const StaggeredField &b, Projection &projection,
                                                 const StaggeredOut &u, Workers &workers) {
                    return primal_dual(problem.linear(), b, projection, settings, u, workers);
                });
            },
            "start"_a, py::kw_only(), "sigma"_a, "tau"_a, "theta"_a, "absolute"_a, "relative"_a, "limit"_a,
            "inner_tolerance"_a, "inner_limit"_a);
}

} // namespace smokelift
