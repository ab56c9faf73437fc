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

constexpr float TOLERANCE = 1e-4f; // of the mean radiance, relative
constexpr int MOST_ITERATIONS = 100;

bool is_axial(const Direction &d) { return std::abs(d[0]) + std::abs(d[1]) + std::abs(d[2]) == 1; }
float weight(const Direction &d) { return is_axial(d) ? 1.0f / 15 : 3.0f / 40; }
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
    : n_(n), albedo_(albedo), scattering_(extinction, extinction + volume(n)) {
    for (float &value : scattering_)
        value *= albedo;
    axial_.length = edge;
    diagonal_.length = edge * std::sqrt(3.0f);
    for (Crossing *crossing : {&axial_, &diagonal_})
        cross(extinction, volume(n), *crossing);
}

SMOKELIFT_CLONES
void BlockTransport::cross(const float *extinction, std::size_t count, Crossing &c) {
    for (auto *values : {&c.passed, &c.escaped, &c.own, &c.of_escaped, &c.of_own})
        values->resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        const float t = c.length * extinction[i], safe = std::max(t, 0.5f);
        const Attenuation through = attenuation(t);
        const float escaped = through.opacity / safe, own = (1 - escaped) / safe;
        const float of_escaped = (through.transmittance - escaped) / safe;
        const bool thin = t < 0.5f;
        c.passed[i] = through.transmittance;
        c.escaped[i] = thin ? series<1, false>(t) : escaped;
        c.own[i] = thin ? series<2, false>(t) : own;
        c.of_escaped[i] = thin ? -series<2, true>(t) : of_escaped;
        c.of_own[i] = thin ? -series<3, true>(t) : -(of_escaped + own) / safe;
    }
}

const BlockTransport::Crossing &BlockTransport::crossing(const Direction &direction) const {
    return is_axial(direction) ? axial_ : diagonal_;
}

// Follows all beams of a direction. visit(first, count, in, out) gets neighbouring blocks along z with the
// radiance that enters each, and says what leaves.
template <class Visit>
SMOKELIFT_INLINE void BlockTransport::sweep(const Direction &d, const Visit &visit) const {
    const auto [nx, ny, nz] = n_;
    const auto place = [](int step, int along, int count) { return along > 0 ? step : count - 1 - step; };
    if (d[0]) { // planes across x, with a border that nothing leaves
        const int pitch = nz + 2;
        std::vector<float> arriving(std::size_t(ny + 2) * pitch, 0.0f), leaving(arriving);
        for (int step = 0; step < nx; ++step) {
            const int x = place(step, d[0], nx);
            for (int y = 0; y < ny; ++y)
                visit((std::size_t(x) * ny + y) * nz, nz, &arriving[(y + 1 - d[1]) * pitch + 1 - d[2]],
                      &leaving[(y + 1) * pitch + 1]);
            arriving.swap(leaving);
        }
        return;
    }
    const int rows = d[1] ? nx : nx * ny, steps = d[1] ? ny : nz, width = d[1] ? nz : 1;
    std::vector<float> arriving(width), leaving(width);
    for (int row = 0; row < rows; ++row) {
        std::fill(arriving.begin(), arriving.end(), 0.0f);
        for (int step = 0; step < steps; ++step) {
            const int k = place(step, d[1] + d[2], steps);
            visit((std::size_t(row) * steps + k) * width, width, arriving.data(), leaving.data());
            arriving.swap(leaving);
        }
    }
}

SMOKELIFT_CLONES
void BlockTransport::add_mean(const Direction &direction, const float *emission, float *mean) const {
    const Crossing &c = crossing(direction);
    const float share = weight(direction), length = c.length;
    sweep(direction, [&](std::size_t first, int count, const float *__restrict in,
                         float *__restrict out) SMOKELIFT_INLINE_LAMBDA {
        const float *__restrict passed = &c.passed[first], *__restrict escaped = &c.escaped[first];
        const float *__restrict own = &c.own[first], *__restrict emitted = emission + first;
        float *__restrict to = mean + first;
        for (int i = 0; i < count; ++i) {
            const float source = length * emitted[i];
            to[i] += share * (escaped[i] * in[i] + own[i] * source);
            out[i] = passed[i] * in[i] + escaped[i] * source;
        }
    });
}

// With M the radiance of l weights that comes from the other end, and L that of l emission:
//     d(weights^T G emission) / dkappa = -T L M + P' (l emission M + l weights L) + B' l weights l emission.
SMOKELIFT_CLONES
void BlockTransport::add_gradient(const Direction &direction, const float *emission, const float *weights,
                                  float *arriving, float *result) const {
    const Crossing &c = crossing(direction);
    const float share = weight(direction), length = c.length;
    sweep(direction, [&](std::size_t first, int count, const float *__restrict in,
                         float *__restrict out) SMOKELIFT_INLINE_LAMBDA {
        const float *__restrict passed = &c.passed[first], *__restrict escaped = &c.escaped[first];
        const float *__restrict emitted = emission + first;
        float *__restrict to = arriving + first;
        for (int i = 0; i < count; ++i) {
            to[i] = in[i];
            out[i] = passed[i] * in[i] + escaped[i] * length * emitted[i];
        }
    });
    sweep(opposite(direction), [&](std::size_t first, int count, const float *__restrict in,
                                   float *__restrict out) SMOKELIFT_INLINE_LAMBDA {
        const float *__restrict passed = &c.passed[first], *__restrict escaped = &c.escaped[first];
        const float *__restrict of_escaped = &c.of_escaped[first], *__restrict of_own = &c.of_own[first];
        const float *__restrict emitted = emission + first, *__restrict weighs = weights + first;
        const float *__restrict from = arriving + first;
        float *__restrict to = result + first;
        for (int i = 0; i < count; ++i) {
            const float source = length * emitted[i], back = length * weighs[i];
            to[i] += share * (of_escaped[i] * (source * in[i] + back * from[i]) + of_own[i] * back * source -
                              passed[i] * from[i] * in[i]);
            out[i] = passed[i] * in[i] + escaped[i] * back;
        }
    });
}

// result = the sum of what work(direction, sum) adds up for both directions of each line, whatever the number
// of threads.
template <class Work>
void BlockTransport::add_by_lines(float *result, Workers &workers, const Work &work) const {
    const std::size_t count = volume(n_);
    std::vector<float> sums(std::size(LINES) * count, 0.0f);
    workers.run(std::size(LINES), [&](int line) {
        work(LINES[line], sums.data() + line * count);
        work(opposite(LINES[line]), sums.data() + line * count);
    });
    for (std::size_t line = 0; line < std::size(LINES); ++line)
        for (std::size_t i = 0; i < count; ++i)
            result[i] += sums[line * count + i];
}

void BlockTransport::mean_radiance(const float *emission, float *mean, Workers &workers) const {
    std::fill_n(mean, volume(n_), 0.0f);
    add_by_lines(mean, workers,
                 [&](const Direction &direction, float *sum) { add_mean(direction, emission, sum); });
}

void BlockTransport::add_extinction_gradient(const float *emission, const float *weights, float *result,
                                             Workers &workers) const {
    add_by_lines(result, workers, [&](const Direction &direction, float *sum) {
        std::vector<float> arriving(volume(n_));
        add_gradient(direction, emission, weights, arriving.data(), sum);
    });
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
