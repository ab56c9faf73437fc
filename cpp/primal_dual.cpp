#include "solvers.h"

#include "vectors.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace smokelift {
namespace {

void require_convergent(const PrimalDual &s) {
    // The two parts are coupled by the identity, whose norm is one. Written so that NaN is refused as well.
    const bool steps = s.sigma > 0 && s.tau > 0 && s.sigma * s.tau <= 1;
    const bool relaxation = s.theta >= 0 && s.theta <= 1;
    if (steps && relaxation)
        return;
    std::ostringstream message;
    message << "primal-dual steps sigma = " << s.sigma << ", tau = " << s.tau << ", theta = " << s.theta
            << " do not converge: sigma and tau must be positive with sigma * tau <= 1, and theta in [0, 1].";
    throw std::invalid_argument(message.str());
}

SMOKELIFT_CLONES
void dual_step(float *__restrict x, const float *__restrict y, const float *__restrict prox, float sigma,
               std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        x[i] += sigma * (y[i] - prox[i]);
}

SMOKELIFT_CLONES
void divide(const float *__restrict a, const float *__restrict b, float *__restrict out, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        out[i] = a[i] / b[i];
}

// argmin f(v) + sigma/2 |v - xi|^2: (A + sigma/2 w) v = b + sigma/2 w xi, by conjugate gradients with the
// diagonal as preconditioner, warm-started from the last answer. w are the weights of the projection's inner
// product.
class Proximal {
public:
    Proximal(const LeastSquares &problem, const StaggeredField &b, const PrimalDual &settings,
             Workers &workers)
        : problem_(problem), b_(b), settings_(settings), workers_(workers),
          diagonal_(problem.diagonal(workers)), residual_(problem.box()), scaled_(problem.box()),
          search_(problem.box()), product_(problem.box()) {
        for (std::size_t i = 0; i < diagonal_.size(); ++i)
            diagonal_.data()[i] += float(settings.sigma / 2);
    }

    // Returns the number of products with A.
    int solve(const StaggeredField &xi, StaggeredField &v) {
        const std::size_t n = v.size();
        std::copy_n(xi.data(), n, residual_.data());
        weigh(residual_);
        xpay(b_.data(), float(settings_.sigma / 2), residual_.data(), n, workers_);
        apply(v);
        axpy(-1, product_.data(), residual_.data(), n, workers_);
        double squared = precondition();
        // Relative to the start and not to the right-hand side: a warm start that passed unchanged would look
        // like convergence of the outer iteration.
        const double goal = settings_.inner_tolerance * std::sqrt(squared);
        std::copy_n(scaled_.data(), n, search_.data());
        int products = 1;
        for (; std::sqrt(squared) > goal && products <= settings_.inner_limit; ++products) {
            apply(search_);
            const float step = float(squared / dot(search_.data(), product_.data(), n, workers_));
            axpy(step, search_.data(), v.data(), n, workers_);
            axpy(-step, product_.data(), residual_.data(), n, workers_);
            const double before = squared;
            squared = precondition();
            xpay(scaled_.data(), float(squared / before), search_.data(), n, workers_);
        }
        return products;
    }

private:
    void weigh(StaggeredField &field) const { scale_sides(field.out(), 0.5f, 1); }

    // product = (A + sigma/2 w) v
    void apply(const StaggeredField &v) {
        problem_.apply(v.in(), product_.out(), workers_);
        std::copy_n(v.data(), v.size(), scaled_.data());
        weigh(scaled_);
        axpy(float(settings_.sigma / 2), scaled_.data(), product_.data(), v.size(), workers_);
    }

    double precondition() {
        divide(residual_.data(), diagonal_.data(), scaled_.data(), residual_.size());
        return dot(residual_.data(), scaled_.data(), residual_.size(), workers_);
    }

    const LeastSquares &problem_;
    const StaggeredField &b_;
    const PrimalDual &settings_;
    Workers &workers_;
    StaggeredField diagonal_, residual_, scaled_, search_, product_;
};

} // namespace

Figures primal_dual(const LeastSquares &problem, const StaggeredField &b, Projection &projection,
                    const PrimalDual &s, const StaggeredOut &result, Workers &workers) {
    require_convergent(s);
    Figures figures;
    Proximal proximal(problem, b, s, workers);
    StaggeredField u(problem.box()), dual(problem.box()), xi(problem.box());
    const std::size_t n = u.size();
    std::fill_n(dual.data(), n, 0.0f);
    copy(read(result), u.out(), workers);
    StaggeredField relaxed = u, prox = u, before = u;

    for (bool converged = false; !converged && figures.iterations < s.limit; ++figures.iterations) {
        // X' = X + sigma Y - sigma prox_f(X / sigma + Y)
        std::copy_n(dual.data(), n, xi.data());
        xpay(relaxed.data(), float(1 / s.sigma), xi.data(), n, workers);
        figures.products += proximal.solve(xi, prox);
        dual_step(dual.data(), relaxed.data(), prox.data(), float(s.sigma), n);

        // u' = prox_g(u - tau X')
        std::copy_n(u.data(), n, before.data());
        axpy(float(-s.tau), dual.data(), u.data(), n, workers);
        projection.apply(u.out(), workers);
        ++figures.projections;

        // Y' = u' + theta (u' - u)
        axpy(-1, u.data(), before.data(), n, workers);
        std::copy_n(u.data(), n, relaxed.data());
        axpy(float(-s.theta), before.data(), relaxed.data(), n, workers);

        const double change = std::sqrt(dot(before.data(), before.data(), n, workers));
        const double norm = std::sqrt(dot(u.data(), u.data(), n, workers));
        converged = change <= std::sqrt(3.0) * s.absolute + s.relative * norm;
        figures.residual = norm > 0 ? change / norm : 0;
    }
    copy(u.in(), result, workers);
    return figures;
}

} // namespace smokelift
