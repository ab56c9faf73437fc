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
constexpr float TOLERANCE = 5e-4f;  // residual of the mean radiance, over that of the first order
constexpr int MAX_ITERATIONS = 100; // of conjugate gradients

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

DiffuseLight::DiffuseLight(const float *extinction, float albedo, const Shape &n, float edge)
    : lattice_{n}, albedo_(albedo), scattering_(with_border(extinction, 1, lattice_)),
      transport_(scattering_, lattice_, edge) {
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

// The mean radiance of all orders, from that of the first.
Fields DiffuseLight::all_orders(Fields residual, Workers &workers) const {
    const std::size_t size = residual.size();
    Fields phi(size, 0.0f), search = residual, moved(size), scattered(size);
    double square = product(residual, residual);
    const double enough = TOLERANCE * TOLERANCE * square;
    for (int iteration = 0; iteration < MAX_ITERATIONS && square > enough; ++iteration) {
        multiply(scattering_, search, scattered);
        transport_.mean_radiance(scattered.data(), moved.data(), workers);
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

// Emission and what is scattered.
Fields DiffuseLight::with_scattered(const Fields &phi, Fields emission) const {
    Fields scattered(phi.size());
    multiply(scattering_, phi, scattered);
    axpy(1, scattered.data(), emission.data(), emission.size());
    return emission;
}

void DiffuseLight::solve(const float *emission, float *phi, Workers &workers) const {
    Fields emitted = with_border(emission, FIELDS, lattice_), mean(emitted.size());
    transport_.mean_radiance(emitted.data(), mean.data(), workers);
    const Fields source = with_scattered(all_orders(mean, workers), std::move(emitted));
    transport_.mean_radiance(source.data(), mean.data(), workers);
    without_border(mean, FIELDS, lattice_, phi);
}

// G is its own adjoint in the product <,>, so with  q: phi_gradient = <q, phi>  and  mu = G (q + scattering
// mu):
//     d(phi_gradient^T phi) = <mu, d emission + phi d scattering> + <q + scattering mu, dG (emission +
//     scattering phi)>.
void DiffuseLight::solve_adjoint(const float *emission, const float *phi, const float *phi_gradient,
                                 float *emission_gradient, float *extinction_gradient,
                                 Workers &workers) const {
    const std::size_t count = volume(lattice_.n), size = FIELDS * lattice_.count();
    Fields asked = with_border(phi_gradient, FIELDS, lattice_), mu(size);
    for (std::size_t i = lattice_.count(); i < size; ++i)
        asked[i] /= SPREAD;
    transport_.mean_radiance(asked.data(), mu.data(), workers); // asked where there is no smoke, too
    const Fields weights = with_scattered(all_orders(mu, workers), std::move(asked));
    transport_.mean_radiance(weights.data(), mu.data(), workers);
    const Fields source =
        with_scattered(with_border(phi, FIELDS, lattice_), with_border(emission, FIELDS, lattice_));
    Fields kappa_gradient(lattice_.count(), 0.0f), result(count);
    transport_.add_extinction_gradient(source.data(), weights.data(), kappa_gradient.data(), workers);
    without_border(kappa_gradient, 1, lattice_, result.data());
    without_border(mu, FIELDS, lattice_, emission_gradient);
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
