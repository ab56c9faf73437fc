// G is symmetric (block_transport.cpp), so I - G scattering is self-adjoint in the product of blocks weighted
// by the scattering, and conjugate gradients solve for all orders of scattering at once.
#include "diffuse_light.h"

#include "vectors.h"

#include <algorithm>
#include <utility>

namespace smokelift {
namespace {

using Fields = std::vector<float>;

constexpr float SPREAD = BlockTransport::SPREAD;
constexpr float TOLERANCE = 5e-4f; // of the mean radiance, relative
constexpr int MAX_ITERATIONS = 100;

// visit(lattice_row, row) for the first blocks of all rows, with and without a border.
template <class Visit> void over_rows(const Lattice &lattice, const Visit &visit) {
    std::size_t row = 0;
    for (int x = 0; x < lattice.n[0]; ++x)
        for (int y = 0; y < lattice.n[1]; ++y, row += lattice.n[2])
            visit(lattice.row(x, y), row);
}

Fields with_border(const float *values, int fields, const Lattice &lattice) {
    const std::size_t count = volume(lattice.n);
    Fields result(fields * lattice.count(), 0.0f);
    over_rows(lattice, [&](std::size_t to, std::size_t from) {
        for (int field = 0; field < fields; ++field)
            std::copy_n(values + field * count + from, lattice.n[2],
                        result.data() + field * lattice.count() + to);
    });
    return result;
}

void without_border(const Fields &values, int fields, const Lattice &lattice, float *result) {
    const std::size_t count = volume(lattice.n);
    over_rows(lattice, [&](std::size_t from, std::size_t to) {
        for (int field = 0; field < fields; ++field)
            std::copy_n(values.data() + field * lattice.count() + from, lattice.n[2],
                        result + field * count + to);
    });
}

// result[field] = a x b[field]
SMOKELIFT_CLONES
void multiply(const Fields &a, const Fields &b, Fields &result) {
    for (std::size_t at = 0; at < b.size(); at += a.size()) {
        const float *const __restrict factor = a.data(), *const __restrict in = b.data() + at;
        float *const __restrict out = result.data() + at;
        for (std::size_t i = 0; i < a.size(); ++i)
            out[i] = factor[i] * in[i];
    }
}

} // namespace

// The box around the blocks that scatter: no other takes part in the equation. One block where none does.
DiffuseLight::Part DiffuseLight::around_smoke(const float *extinction, const Shape &n) {
    Shape low = n, high{};
    const float *at = extinction;
    for (int x = 0; x < n[0]; ++x)
        for (int y = 0; y < n[1]; ++y)
            for (int z = 0; z < n[2]; ++z)
                if (*at++ > 0) {
                    const Shape here{x, y, z};
                    for (int axis = 0; axis < 3; ++axis) {
                        low[axis] = std::min(low[axis], here[axis]);
                        high[axis] = std::max(high[axis], here[axis] + 1);
                    }
                }
    if (high[0] == 0)
        return {Shape{0, 0, 0}, Shape{1, 1, 1}};
    return {low, Shape{high[0] - low[0], high[1] - low[1], high[2] - low[2]}};
}

// visit(at, in_part) for the first blocks of all rows of the part: the place among all, and in the part.
template <class Visit> void DiffuseLight::over_part(const Visit &visit) const {
    const auto [x, y, z] = part_.first;
    for (int i = 0; i < part_.n[0]; ++i)
        for (int j = 0; j < part_.n[1]; ++j)
            visit(all_.row(x + i, y + j) + z, in_part_.row(i, j));
}

Fields DiffuseLight::cut(const Fields &everywhere, int fields) const {
    Fields result(fields * in_part_.count(), 0.0f);
    over_part([&](std::size_t at, std::size_t in_part) {
        for (int field = 0; field < fields; ++field)
            std::copy_n(everywhere.data() + field * all_.count() + at, part_.n[2],
                        result.data() + field * in_part_.count() + in_part);
    });
    return result;
}

DiffuseLight::DiffuseLight(const float *extinction, float albedo, const Shape &n, float edge)
    : all_{n}, part_(around_smoke(extinction, n)), in_part_{part_.n}, albedo_(albedo),
      scattering_(cut(with_border(extinction, 1, all_), 1)),
      everywhere_(with_border(extinction, 1, all_), all_, edge), smoke_(scattering_, in_part_, edge) {
    for (float &value : scattering_) // the extinction so far
        value *= albedo;
}

// <a, b>, weighted by the scattering.
SMOKELIFT_CLONES
double DiffuseLight::product(const Fields &a, const Fields &b) const {
    // as many running sums as keep the vector units busy
    constexpr std::size_t RUNNING = 16;
    const std::size_t count = scattering_.size();
    const float *const __restrict scattering = scattering_.data();
    const float *const __restrict a_0 = a.data(), *const __restrict b_0 = b.data();
    const float *const __restrict a_x = a_0 + count, *const __restrict b_x = b_0 + count;
    const float *const __restrict a_y = a_x + count, *const __restrict b_y = b_x + count;
    const float *const __restrict a_z = a_y + count, *const __restrict b_z = b_y + count;
    const auto of = [&](std::size_t i) SMOKELIFT_INLINE_LAMBDA {
        return scattering[i] *
               (a_0[i] * b_0[i] + SPREAD * (a_x[i] * b_x[i] + a_y[i] * b_y[i] + a_z[i] * b_z[i]));
    };
    double sums[RUNNING] = {};
    std::size_t i = 0;
    for (; i + RUNNING <= count; i += RUNNING)
        for (std::size_t j = 0; j < RUNNING; ++j)
            sums[j] += double(of(i + j));
    double result = 0;
    for (; i < count; ++i)
        result += double(of(i));
    for (const double sum : sums)
        result += sum;
    return result;
}

// The mean radiance of all orders in the part, from that of the first.
Fields DiffuseLight::all_orders(Fields residual, Workers &workers) const {
    const std::size_t size = residual.size();
    Fields phi(size, 0.0f), search = residual, moved(size), scattered(size);
    double square = product(residual, residual);
    const double enough = TOLERANCE * TOLERANCE * square;
    for (int iteration = 0; iteration < MAX_ITERATIONS && square > enough; ++iteration) {
        multiply(scattering_, search, scattered);
        smoke_.mean_radiance(scattered.data(), moved.data(), workers);
        for (std::size_t i = 0; i < size; ++i)
            moved[i] = search[i] - moved[i];
        const auto step = static_cast<float>(square / product(search, moved));
        axpy(step, search.data(), phi.data(), size);
        axpy(-step, moved.data(), residual.data(), size);
        const double before = std::exchange(square, product(residual, residual));
        xpay(residual.data(), static_cast<float>(square / before), search.data(), size);
    }
    return phi;
}

// Emission everywhere and what the part scatters.
Fields DiffuseLight::with_scattered(const Fields &in_smoke, Fields emission) const {
    over_part([&](std::size_t at, std::size_t in_part) {
        for (int field = 0; field < FIELDS; ++field)
            for (int i = 0; i < part_.n[2]; ++i)
                emission[field * all_.count() + at + i] +=
                    scattering_[in_part + i] * in_smoke[field * in_part_.count() + in_part + i];
    });
    return emission;
}

void DiffuseLight::solve(const float *emission, float *phi, Workers &workers) const {
    Fields emitted = with_border(emission, FIELDS, all_), mean(emitted.size());
    Fields first(FIELDS * in_part_.count());
    smoke_.mean_radiance(cut(emitted, FIELDS).data(), first.data(), workers);
    const Fields source = with_scattered(all_orders(std::move(first), workers), std::move(emitted));
    everywhere_.mean_radiance(source.data(), mean.data(), workers);
    without_border(mean, FIELDS, all_, phi);
}

// G is its own adjoint in the product <,>, so with  q: phi_gradient = <q, phi>  and  mu = G (q + scattering
// mu):
//     d(phi_gradient^T phi) = <mu, d emission + phi d scattering> + <q + scattering mu, dG (emission +
//     scattering phi)>.
void DiffuseLight::solve_adjoint(const float *emission, const float *phi, const float *phi_gradient,
                                 float *emission_gradient, float *extinction_gradient,
                                 Workers &workers) const {
    const std::size_t count = volume(all_.n), size = FIELDS * all_.count();
    Fields asked = with_border(phi_gradient, FIELDS, all_), mu(size);
    for (std::size_t i = all_.count(); i < size; ++i)
        asked[i] /= SPREAD;
    everywhere_.mean_radiance(asked.data(), mu.data(), workers); // asked where there is no smoke, too
    const Fields weights = with_scattered(all_orders(cut(mu, FIELDS), workers), std::move(asked));
    everywhere_.mean_radiance(weights.data(), mu.data(), workers);
    const Fields source =
        with_scattered(cut(with_border(phi, FIELDS, all_), FIELDS), with_border(emission, FIELDS, all_));
    Fields kappa_gradient(all_.count(), 0.0f), result(count);
    everywhere_.add_extinction_gradient(source.data(), weights.data(), kappa_gradient.data(), workers);
    without_border(kappa_gradient, 1, all_, result.data());
    without_border(mu, FIELDS, all_, emission_gradient);
    for (int field = 0; field < FIELDS; ++field) {
        const float weight = field ? SPREAD : 1.0f;
        for (std::size_t i = 0; i < count; ++i) {
            emission_gradient[field * count + i] *= weight;
            result[i] += albedo_ * phi[field * count + i] * emission_gradient[field * count + i];
        }
    }
    axpy(1, result.data(), extinction_gradient, count);
}

} // namespace smokelift
