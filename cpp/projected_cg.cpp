#include "projected_cg.h"

#include "operators.h"
#include "spectral.h"

#include <algorithm>
#include <cmath>

namespace smokelift {

Figures projected_cg(LeastSquares &problem, double tolerance, int limit, const Out3 &u, Workers &workers) {
    Figures figures;
    Field3 residual = problem.right_hand_side(workers), gradient(problem.shapes()), search(problem.shapes()),
           product(problem.shapes());
    const std::size_t n = residual.size();
    // Constant coefficients that resemble the problem's.
    const auto symbol = problem.symbol();
    Spectral spectral(problem.shape(), problem.closed(), symbol[0], symbol[1], symbol[2]);
    const auto project_residual = [&] {
        spectral.apply(residual.in(), gradient.out(), workers);
        ++figures.projections;
        return dot(residual.data(), gradient.data(), n, workers);
    };

    const double reference = project_residual();
    problem.apply(read(u), product.out(), workers);
    ++figures.products;
    axpy(-1, product.data(), residual.data(), n, workers);
    double squared = project_residual();
    std::copy_n(gradient.data(), n, search.data());

    // The square of the projected gradient; the limit is relative to what the images ask of a fluid at rest.
    const double goal = tolerance * tolerance * reference;
    // In single precision the gradient stops falling somewhere; steps beyond that lead away from the minimum.
    // Far from there it may rise for a while all the same.
    const auto patience = [&](double least) { return least > 1e-8 * reference ? 20 : 1; };
    double best = squared;
    for (int stalled = 0; squared > goal && stalled < patience(best) && figures.iterations < limit;) {
        problem.apply(search.in(), product.out(), workers);
        const double curvature = dot(search.data(), product.data(), n, workers);
        const float step = float(squared / curvature);
        const In3 direction = search.in();
        for (int c = 0; c < 3; ++c)
            axpy(step, direction[c].data, u[c].data, volume(u[c].n), workers);
        axpy(-step, product.data(), residual.data(), n, workers);
        const double before = squared;
        squared = project_residual();
        stalled = squared < best ? 0 : stalled + 1;
        best = std::min(best, squared);
        xpay(gradient.data(), float(squared / before), search.data(), n, workers);
        ++figures.products;
        ++figures.iterations;
    }
    figures.residual = reference > 0 ? std::sqrt(std::max(squared, 0.0) / reference) : 0;
    return figures;
}

} // namespace smokelift
