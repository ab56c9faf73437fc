#include "least_squares.h"

#include "spectral.h"
#include "vectors.h"

#include <algorithm>
#include <cmath>

namespace smokelift {

namespace {

// Steps that may pass without a new least gradient. In single precision the gradient stops falling somewhere,
// and steps beyond that lead away from the minimum; far from there it may rise for a while all the same.
constexpr double NEAR_ROUNDING = 1e-8; // Square of the gradient, over that of the fluid at rest.
constexpr int PATIENCE_FAR = 20, PATIENCE_NEAR = 1;

int patience(double least, double reference) {
    return least > NEAR_ROUNDING * reference ? PATIENCE_FAR : PATIENCE_NEAR;
}

} // namespace

Figures projected_cg(const LeastSquares &problem, StaggeredField &b, double tolerance, int limit,
                     const StaggeredOut &u, Workers &workers) {
    Figures figures;
    // Constant coefficients that resemble the problem's.
    const auto symbol = problem.symbol(workers);
    Spectral spectral(problem.box(), symbol[0], symbol[1], symbol[2]);
    StaggeredField search(problem.box());
    const StaggeredOut residual = b.out(),
                       product = spectral.room(); // a product is not needed when modes are made
    for (Field &component : search.components)
        std::fill(component.data().begin(), component.data().end(), 0.0f);
    const auto project_residual = [&] {
        ++figures.projections;
        return spectral.precondition(read(residual), workers);
    };

    const double reference = project_residual();
    problem.apply(read(u), product, workers);
    ++figures.products;
    axpy(-1, read(product), residual, workers);
    double squared = project_residual();

    // The square of the projected gradient; the limit is relative to what the images ask of a fluid at rest.
    const double goal = tolerance * tolerance * reference;
    double best = squared, before = 0;
    for (int stalled = 0;
         squared > goal && stalled < patience(best, reference) && figures.iterations < limit;) {
        spectral.descend(before > 0 ? float(squared / before) : 0, search.out(), workers);
        const double curvature = problem.apply(search.in(), product, workers);
        const float step = float(squared / curvature);
        axpy(step, search.in(), u, workers);
        axpy(-step, read(product), residual, workers);
        before = squared;
        squared = project_residual();
        stalled = squared < best ? 0 : stalled + 1;
        best = std::min(best, squared);
        ++figures.products;
        ++figures.iterations;
    }
    figures.residual = reference > 0 ? std::sqrt(std::max(squared, 0.0) / reference) : 0;
    problem.apply(read(u), product, workers);
    axpy(1, read(product), residual, workers);
    return figures;
}

} // namespace smokelift
