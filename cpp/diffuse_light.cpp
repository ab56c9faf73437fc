// Light goes from block to block along 14 directions of the lattice: the 6 axes and the 8 diagonals of space,
// with the weights of Lebedev's rule, which is exact for polynomials of degree 5 (Lebedev 1976, USSR Comput.
// Math. Math. Phys. 16, 10). A beam meets blocks whole, so nothing is interpolated and no energy is lost.
//
// For a path of length l with the emission e, the beam L_in that enters a block becomes
//     L_out = T L_in + P l e,    mean along the path = P L_in + B l e.
// G is symmetric, since what is true of one direction is so of its opposite. So I - G scattering is
// self-adjoint in the product weighted by the scattering, positive where smoke creates no light, and
// conjugate gradients solve for all orders of scattering at once.
#include "diffuse_light.h"

#include "exponential.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace smokelift {
namespace {

using Direction = std::array<int, 3>;

constexpr Direction LINES[7] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1},  {1, 1, 1},
                                {1, 1, -1}, {1, -1, 1}, {1, -1, -1}};
constexpr int AXES = 3; // the lines before the diagonals

constexpr float TOLERANCE = 3e-4f; // of the mean radiance, relative
constexpr int MOST_ITERATIONS = 100;

int class_of(const Direction &d) { return std::abs(d[0]) + std::abs(d[1]) + std::abs(d[2]) == 1 ? 0 : 1; }
Direction opposite(const Direction &d) { return {-d[0], -d[1], -d[2]}; }

// sum over n of (-t)^n / (n + shift)!, or of (-t)^n (n + 1) / (n + shift)!; to rounding for t below 1/2.
template <int Shift, bool Slope> SMOKELIFT_INLINE float series(float t) {
    constexpr int TERMS = 8;
    float factorial = 1;
    for (int n = 2; n < TERMS + Shift; ++n)
        factorial *= float(n);
    float sum = 0, term = 1 / factorial;
    for (int n = TERMS - 1; n >= 0; --n) {
        sum = (Slope ? float(n + 1) : 1.0f) * term - t * sum;
        term *= float(n + Shift);
    }
    return sum;
}

double weighted(const std::vector<float> &weights, const std::vector<float> &a, const std::vector<float> &b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        sum += double(weights[i]) * a[i] * b[i];
    return sum;
}

} // namespace

BlockTransport::BlockTransport(const float *extinction, float albedo, const Shape &n, float edge)
    : n_(n), albedo_(albedo), scattering_(extinction, extinction + volume(n)), own_(volume(n), 0.0f),
      of_own_(volume(n), 0.0f) {
    for (float &value : scattering_)
        value *= albedo;
    classes_[0].length = edge;
    classes_[0].weight = 1.0f / 15;
    classes_[1].length = edge * std::sqrt(3.0f);
    classes_[1].weight = 3.0f / 40;
    cross(extinction, 6, classes_[0], own_, of_own_);
    cross(extinction, 8, classes_[1], own_, of_own_);
}

// Of a block's emission e, the part B l e with B = (1 - P) / t is its own mean along a beam.
SMOKELIFT_CLONES
void BlockTransport::cross(const float *extinction, int directions, Crossing &c, std::vector<float> &own,
                           std::vector<float> &of_own) {
    const float share = float(directions) * c.weight * c.length;
    for (auto *values : {&c.passed, &c.escaped, &c.of_escaped})
        values->resize(own.size());
    for (std::size_t i = 0; i < own.size(); ++i) {
        const float t = c.length * extinction[i], safe = std::max(t, 0.5f);
        const Attenuation through = attenuation(t);
        const float escaped = through.opacity / safe, left = (1 - escaped) / safe;
        const float of_escaped = (through.transmittance - escaped) / safe,
                    of_left = -(of_escaped + left) / safe;
        const bool thin = t < 0.5f;
        c.passed[i] = through.transmittance;
        c.escaped[i] = thin ? series<1, false>(t) : escaped;
        c.of_escaped[i] = thin ? -series<2, true>(t) : of_escaped;
        own[i] += share * (thin ? series<2, false>(t) : left);
        of_own[i] += share * c.length * (thin ? -series<3, true>(t) : of_left);
    }
}

BlockTransport::Sources BlockTransport::sources(const float *emission) const {
    Sources result;
    for (std::size_t number = 0; number < classes_.size(); ++number) {
        const Crossing &c = classes_[number];
        result[number].resize(own_.size());
        for (std::size_t i = 0; i < own_.size(); ++i)
            result[number][i] = c.escaped[i] * c.length * emission[i];
    }
    return result;
}

// Follows all beams of a direction. visit(first, count, arriving) gets neighbouring blocks along z with the
// radiance that enters each.
template <class Visit>
SMOKELIFT_INLINE void BlockTransport::follow(const Direction &d, const Sources &sources,
                                             const Visit &visit) const {
    const auto [nx, ny, nz] = n_;
    const float *const all_passed = classes_[class_of(d)].passed.data();
    const float *const all_sources = sources[class_of(d)].data();
    const auto place = [](int step, int along, int count) { return along > 0 ? step : count - 1 - step; };
    const auto cross_row = [&, nz = nz](std::size_t first, const float *__restrict in, float *__restrict out)
                               SMOKELIFT_INLINE_LAMBDA {
                                   visit(first, nz, in);
                                   const float *__restrict passed = all_passed + first;
                                   const float *__restrict source = all_sources + first;
                                   for (int i = 0; i < nz; ++i)
                                       out[i] = passed[i] * in[i] + source[i];
                               };
    if (d[0]) { // planes across x, with a border that nothing leaves
        const int pitch = nz + 2;
        std::vector<float> arriving(std::size_t(ny + 2) * pitch, 0.0f), leaving(arriving);
        for (int step = 0; step < nx; ++step) {
            const int x = place(step, d[0], nx);
            for (int y = 0; y < ny; ++y)
                cross_row((std::size_t(x) * ny + y) * nz, &arriving[(y + 1 - d[1]) * pitch + 1 - d[2]],
                          &leaving[(y + 1) * pitch + 1]);
            arriving.swap(leaving);
        }
    } else if (d[1]) {
        std::vector<float> arriving(nz), leaving(nz);
        for (int x = 0; x < nx; ++x) {
            std::fill(arriving.begin(), arriving.end(), 0.0f);
            for (int step = 0; step < ny; ++step) {
                cross_row((std::size_t(x) * ny + place(step, d[1], ny)) * nz, arriving.data(),
                          leaving.data());
                arriving.swap(leaving);
            }
        }
    } else {
        std::vector<float> arriving(nz);
        for (std::size_t first = 0; first < own_.size(); first += nz) {
            float beam = 0;
            for (int step = 0; step < nz; ++step) {
                const int z = place(step, d[2], nz);
                arriving[z] = beam;
                beam = all_passed[first + z] * beam + all_sources[first + z];
            }
            visit(first, nz, arriving.data());
        }
    }
}

SMOKELIFT_CLONES
void BlockTransport::add_arriving(const Direction &direction, const Sources &sources, float *sum) const {
    follow(direction, sources,
           [&](std::size_t first, int count, const float *__restrict in) SMOKELIFT_INLINE_LAMBDA {
               float *__restrict to = sum + first;
               for (int i = 0; i < count; ++i)
                   to[i] += in[i];
           });
}

// products += what arrives of the one along the direction x what arrives of the other against it.
SMOKELIFT_CLONES
void BlockTransport::add_products(const Direction &direction, const Sources &forwards,
                                  const Sources &backwards, float *kept, float *products) const {
    follow(direction, forwards,
           [&](std::size_t first, int count, const float *__restrict in)
               SMOKELIFT_INLINE_LAMBDA { std::copy_n(in, count, kept + first); });
    follow(opposite(direction), backwards,
           [&](std::size_t first, int count, const float *__restrict in) SMOKELIFT_INLINE_LAMBDA {
               const float *__restrict from = kept + first;
               float *__restrict to = products + first;
               for (int i = 0; i < count; ++i)
                   to[i] += from[i] * in[i];
           });
}

template <class Work>
BlockTransport::Sources BlockTransport::sum_by_class(Workers &workers, const Work &work) const {
    const std::size_t count = own_.size();
    std::vector<float> sums(std::size(LINES) * count, 0.0f);
    workers.run(std::size(LINES), [&](int line) {
        work(LINES[line], sums.data() + line * count);
        work(opposite(LINES[line]), sums.data() + line * count);
    });
    Sources result{std::vector<float>(count, 0.0f), std::vector<float>(count, 0.0f)};
    for (std::size_t line = 0; line < std::size(LINES); ++line)
        for (std::size_t i = 0; i < count; ++i)
            result[line < AXES ? 0 : 1][i] += sums[line * count + i];
    return result;
}

void BlockTransport::mean_radiance(const float *emission, float *mean, Workers &workers) const {
    const Sources from = sources(emission);
    const Sources arriving = sum_by_class(
        workers, [&](const Direction &direction, float *sum) { add_arriving(direction, from, sum); });
    for (std::size_t i = 0; i < own_.size(); ++i) {
        mean[i] = own_[i] * emission[i];
        for (std::size_t number = 0; number < classes_.size(); ++number)
            mean[i] += classes_[number].weight * classes_[number].escaped[i] * arriving[number][i];
    }
}

// With M what arrives of l weights against each direction, and L of l emission along it:
//     d(weights^T G emission) / dkappa = -T L M + P' (l emission M + l weights L) + l^2 B' weights emission.
void BlockTransport::add_extinction_gradient(const float *emission, const float *weights, float *result,
                                             Workers &workers) const {
    const Sources of_emission = sources(emission), of_weights = sources(weights);
    const auto arriving = [&](const Sources &from) {
        return sum_by_class(
            workers, [&](const Direction &direction, float *sum) { add_arriving(direction, from, sum); });
    };
    const Sources emitted = arriving(of_emission), weighed = arriving(of_weights);
    const Sources products = sum_by_class(workers, [&](const Direction &direction, float *sum) {
        std::vector<float> kept(own_.size());
        add_products(direction, of_emission, of_weights, kept.data(), sum);
    });
    for (std::size_t i = 0; i < own_.size(); ++i) {
        result[i] += of_own_[i] * weights[i] * emission[i];
        for (std::size_t number = 0; number < classes_.size(); ++number) {
            const Crossing &c = classes_[number];
            result[i] +=
                c.weight * (c.of_escaped[i] * c.length *
                                (emission[i] * weighed[number][i] + weights[i] * emitted[number][i]) -
                            c.passed[i] * products[number][i]);
        }
    }
}

void BlockTransport::solve(const float *emission, float *phi, Workers &workers) const {
    const std::size_t count = volume(n_);
    std::vector<float> residual(count), search, product(count), scattered(count);
    mean_radiance(emission, residual.data(), workers);
    std::fill_n(phi, count, 0.0f);
    search = residual;
    double square = weighted(scattering_, residual, residual);
    const double enough = TOLERANCE * TOLERANCE * square;
    for (int iteration = 0; iteration < MOST_ITERATIONS && square > enough; ++iteration) {
        for (std::size_t i = 0; i < count; ++i)
            scattered[i] = scattering_[i] * search[i];
        mean_radiance(scattered.data(), product.data(), workers);
        for (std::size_t i = 0; i < count; ++i)
            product[i] = search[i] - product[i];
        const auto step = static_cast<float>(square / weighted(scattering_, search, product));
        for (std::size_t i = 0; i < count; ++i) {
            phi[i] += step * search[i];
            residual[i] -= step * product[i];
        }
        const double before = std::exchange(square, weighted(scattering_, residual, residual));
        const auto factor = static_cast<float>(square / before);
        for (std::size_t i = 0; i < count; ++i)
            search[i] = residual[i] + factor * search[i];
    }
    for (std::size_t i = 0; i < count; ++i) // what is left, scattered no more
        phi[i] += residual[i];
}

// G is its own adjoint, so with  mu = G (of_phi + scattering mu):
//     d(of_phi^T phi) = mu^T (d emission + phi d scattering) + (of_phi + scattering mu)^T dG (emission +
//     scattering phi).
void BlockTransport::solve_adjoint(const float *emission, const float *phi, const float *of_phi,
                                   float *of_emission, float *of_extinction, Workers &workers) const {
    const std::size_t count = volume(n_);
    solve(of_phi, of_emission, workers);
    std::vector<float> source(count), weights(count);
    for (std::size_t i = 0; i < count; ++i) {
        source[i] = emission[i] + scattering_[i] * phi[i];
        weights[i] = of_phi[i] + scattering_[i] * of_emission[i];
        of_extinction[i] += albedo_ * phi[i] * of_emission[i];
    }
    add_extinction_gradient(source.data(), weights.data(), of_extinction, workers);
}

} // namespace smokelift
