// Light goes from block to block along 14 directions of the lattice: the 6 axes and the 8 diagonals of space,
// with the weights of Lebedev's rule, which is exact for polynomials of degree 5 (Lebedev 1976, USSR Comput.
// Math. Math. Phys. 16, 10). A beam meets blocks whole, so nothing is interpolated and no energy is lost.
//
// Emission and radiance are linear across a block: in thick smoke light changes within a block, and a mean
// alone would spread it too deep. On a path of length l through the block's centre, at u from -1/2 to 1/2,
// with the emission e + r u, the beam L_in that enters a block becomes
//     L_out = T L_in + l (P e + Q r),    mean along the path     = P L_in + l (B e - Q/t r),
//                                        mean of u along the path = -Q L_in + l (Q/t e + C r).
// An axis's beams keep their slopes across too, each carried as a mean is; a diagonal's path leads from
// corner to corner, so that u tells all three slopes.
//
// In the product <a, b> = a_mean b_mean + (a_x b_x + a_y b_y + a_z b_z) / 12, the mean over a block, G is
// symmetric, since what is true of one direction is so of its opposite. So I - G scattering is self-adjoint
// in that product weighted by the scattering, and conjugate gradients solve for all orders of scattering at
// once.
#include "diffuse_light.h"

#include "exponential.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <utility>

namespace smokelift {
namespace {

using Direction = std::array<int, 3>;

constexpr Direction LINES[7] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1},  {1, 1, 1},
                                {1, 1, -1}, {1, -1, 1}, {1, -1, -1}};
constexpr int AXES = 3; // the lines before the diagonals

constexpr float SPREAD = 1.0f / 12; // mean of u^2
constexpr float TOLERANCE = 5e-4f;  // of the mean radiance, relative
constexpr int MOST_ITERATIONS = 100;

Direction opposite(const Direction &d) { return {-d[0], -d[1], -d[2]}; }

// Series in t, to rounding for t below THIN.
constexpr float THIN = 1;
constexpr int TERMS = 11;
struct Series {
    float terms[TERMS];

    constexpr float operator()(float t) const {
        float sum = 0;
        for (int n = TERMS - 1; n >= 0; --n)
            sum = terms[n] + t * sum;
        return sum;
    }
    constexpr Series slope() const {
        Series result{};
        for (int n = 1; n < TERMS; ++n)
            result.terms[n - 1] = float(n) * terms[n];
        return result;
    }
};
// The sum of (-t)^n f(n) / (n + shift)!.
template <class Factor> constexpr Series series(int shift, Factor factor) {
    Series result{};
    double factorial = 1;
    for (int n = 2; n <= shift; ++n)
        factorial *= n;
    for (int n = 0; n < TERMS; ++n) {
        result.terms[n] = static_cast<float>((n % 2 ? -1 : 1) * factor(n) / factorial);
        factorial *= n + shift + 1;
    }
    return result;
}
constexpr Series ESCAPED = series(1, [](int) { return 1.0; });                  // P
constexpr Series LEFT = series(2, [](int) { return 1.0; });                     // B
constexpr Series SLANTED = series(2, [](int n) { return -0.5 * n; });           // Q
constexpr Series TILTED = series(4, [](int n) { return -0.25 * n * (n + 3); }); // C
constexpr Series OF_ESCAPED = ESCAPED.slope(), OF_LEFT = LEFT.slope(), OF_SLANTED = SLANTED.slope(),
                 OF_TILTED = TILTED.slope();

} // namespace

BlockTransport::BlockTransport(const float *extinction, const Shape &n, float edge) : n_(n) {
    for (auto *values : {&own_, &of_own_})
        for (auto &part : *values)
            part.assign(volume(n), 0.0f);
    classes_[0].length = edge;
    classes_[0].weight = 1.0f / 15;
    classes_[1].length = edge * std::sqrt(3.0f);
    classes_[1].weight = 3.0f / 40;
    cross(extinction, classes_[0], 2, 4, own_, of_own_);
    cross(extinction, classes_[1], 8, 0, own_, of_own_);
}

// A slope is `along` so many directions of the class, and `across` others. Of a block's emission e the part
// B l e is its own mean along a beam, and of the rise r the part C l r / SPREAD is its own.
SMOKELIFT_CLONES
void BlockTransport::cross(const float *extinction, Crossing &c, float along, float across,
                           std::array<std::vector<float>, 2> &own,
                           std::array<std::vector<float>, 2> &of_own) {
    const std::size_t count = own[0].size();
    const float share = c.weight * c.length, all = share * (along + across);
    for (auto *values : {&c.passed, &c.escaped, &c.slanted, &c.of_escaped, &c.of_slanted})
        values->resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        const float t = c.length * extinction[i], safe = std::max(t, THIN), inverse = 1 / safe;
        const bool thin = t < THIN;
        const float series_at = std::min(t, THIN);
        const Attenuation through = attenuation(t);
        float escaped = through.opacity * inverse, left = (1 - escaped) * inverse;
        float of_escaped = (through.transmittance - escaped) * inverse,
              of_left = -(of_escaped + left) * inverse;
        float slanted = left - 0.5f * escaped, of_slanted = of_left - 0.5f * of_escaped;
        const float factor = (0.5f + inverse) * inverse;
        float tilted = SPREAD * inverse - factor * slanted;
        float of_tilted =
            (-SPREAD + (0.5f + 2 * inverse) * slanted) * inverse * inverse - factor * of_slanted;
        escaped = thin ? ESCAPED(series_at) : escaped;
        left = thin ? LEFT(series_at) : left;
        slanted = thin ? SLANTED(series_at) : slanted;
        tilted = thin ? TILTED(series_at) : tilted;
        of_escaped = thin ? OF_ESCAPED(series_at) : of_escaped;
        of_left = thin ? OF_LEFT(series_at) : of_left;
        of_slanted = thin ? OF_SLANTED(series_at) : of_slanted;
        of_tilted = thin ? OF_TILTED(series_at) : of_tilted;
        c.passed[i] = through.transmittance;
        c.escaped[i] = escaped;
        c.slanted[i] = slanted;
        c.of_escaped[i] = of_escaped;
        c.of_slanted[i] = of_slanted;
        own[0][i] += all * left;
        of_own[0][i] += all * c.length * of_left;
        own[1][i] += share * (along / SPREAD * tilted + across * left);
        of_own[1][i] += share * c.length * (along / SPREAD * of_tilted + across * of_left);
    }
}

// Follows all beams of a direction. visit(first, count, arriving) gets neighbouring blocks with the radiance
// that enters each.
template <class Visit>
SMOKELIFT_INLINE void BlockTransport::follow(const Direction &d, const float *all_passed,
                                             const float *all_sources, const Visit &visit) const {
    const auto [nx, ny, nz] = n_;
    const auto place = [](int step, int along, int count) { return along > 0 ? step : count - 1 - step; };
    const auto cross_row = [&, nz = nz](std::size_t first, const float *__restrict in, float *__restrict out)
                               SMOKELIFT_INLINE_LAMBDA {
                                   visit(first, nz, in);
                                   const float *__restrict passed = all_passed + first;
                                   const float *__restrict source = all_sources + first;
                                   for (int i = 0; i < nz; ++i)
                                       out[i] = passed[i] * in[i] + source[i];
                               };
    if (d[0] && !d[1]) { // whole planes across x
        const int plane = ny * nz;
        std::vector<float> arriving(plane, 0.0f), leaving(plane);
        for (int step = 0; step < nx; ++step) {
            const std::size_t first = std::size_t(place(step, d[0], nx)) * plane;
            visit(first, plane, arriving.data());
            const float *__restrict in = arriving.data();
            const float *__restrict passed = all_passed + first;
            const float *__restrict source = all_sources + first;
            float *__restrict out = leaving.data();
            for (int i = 0; i < plane; ++i)
                out[i] = passed[i] * in[i] + source[i];
            arriving.swap(leaving);
        }
    } else if (d[0]) { // planes across x, with a border that nothing leaves
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
        constexpr std::size_t ROWS = 8; // side by side, since a beam waits for itself
        const std::size_t rows = volume(n_) / nz;
        std::vector<float> arriving(ROWS * nz);
        for (std::size_t row = 0; row < rows; row += ROWS) {
            const std::size_t first = row * nz, number = std::min(ROWS, rows - row);
            float beams[ROWS] = {};
            for (int step = 0; step < nz; ++step) {
                const int z = place(step, d[2], nz);
                for (std::size_t r = 0; r < number; ++r) {
                    const std::size_t at = r * nz + z;
                    arriving[at] = beams[r];
                    beams[r] = all_passed[first + at] * beams[r] + all_sources[first + at];
                }
            }
            visit(first, static_cast<int>(number) * nz, arriving.data());
        }
    }
}

const BlockTransport::Crossing &BlockTransport::crossing(int line) const {
    return classes_[line < AXES ? 0 : 1];
}

// What leaves blocks along the line, and against it: of the mean and of the rise of an emission.
SMOKELIFT_CLONES
void BlockTransport::sources_along(int line, const float *emission, float *along, float *against) const {
    const std::size_t count = volume(n_);
    const Crossing &c = crossing(line);
    const float l = c.length, x = l * float(LINES[line][0]), y = l * float(LINES[line][1]),
                z = l * float(LINES[line][2]);
    for (std::size_t i = 0; i < count; ++i) {
        const float rise =
            x * emission[count + i] + y * emission[2 * count + i] + z * emission[3 * count + i];
        const float mean = l * c.escaped[i] * emission[i], slanted = c.slanted[i] * rise;
        along[i] = mean + slanted;
        against[i] = mean - slanted;
    }
}

// The same of a slope across the line, which is that way and this the same.
SMOKELIFT_CLONES
void BlockTransport::sources_across(int line, const float *slope, float *both) const {
    const Crossing &c = crossing(line);
    for (std::size_t i = 0; i < volume(n_); ++i)
        both[i] = c.length * c.escaped[i] * slope[i];
}

// Sum and difference of what arrives along the line and against it.
SMOKELIFT_CLONES
void BlockTransport::arriving(int line, const float *along, const float *against, float *sum,
                              float *difference) const {
    const float *const passed = crossing(line).passed.data();
    follow(LINES[line], passed, along,
           [&](std::size_t first, int count, const float *__restrict in) SMOKELIFT_INLINE_LAMBDA {
               std::copy_n(in, count, sum + first);
               std::copy_n(in, count, difference + first);
           });
    follow(opposite(LINES[line]), passed, against,
           [&](std::size_t first, int count, const float *__restrict in) SMOKELIFT_INLINE_LAMBDA {
               float *__restrict to_sum = sum + first, *__restrict to_difference = difference + first;
               for (int i = 0; i < count; ++i) {
                   to_sum[i] += in[i];
                   to_difference[i] -= in[i];
               }
           });
}

// The sum alone, of what leaves both ways alike.
SMOKELIFT_CLONES
void BlockTransport::arriving(int line, const float *both, float *sum) const {
    const float *const passed = crossing(line).passed.data();
    follow(LINES[line], passed, both,
           [&](std::size_t first, int count, const float *__restrict in)
               SMOKELIFT_INLINE_LAMBDA { std::copy_n(in, count, sum + first); });
    follow(opposite(LINES[line]), passed, both,
           [&](std::size_t first, int count, const float *__restrict in) SMOKELIFT_INLINE_LAMBDA {
               float *__restrict to = sum + first;
               for (int i = 0; i < count; ++i)
                   to[i] += in[i];
           });
}

// With L what arrives of l emission along a direction, M what arrives of l weights against it, and r and s
// their rises along it:
//     -T L M + P' (l emission M + l weights L) + Q' (l r M - l s L),
// and in sums and differences of both ways:  L M + (both reversed) = (sums - differences) / 2.
SMOKELIFT_CLONES
void BlockTransport::add_line_gradient(int line, const float *emission, const float *weights,
                                       float *result) const {
    const std::size_t count = volume(n_);
    const Crossing &c = crossing(line);
    const float l = c.length, x = float(LINES[line][0]), y = float(LINES[line][1]), z = float(LINES[line][2]);
    std::vector<float> memory(6 * count);
    float *const along = memory.data(), *const against = along + count;
    float *const emitted = against + count, *const emitted_more = emitted + count;
    float *const weighed = emitted_more + count, *const weighed_more = weighed + count;
    sources_along(line, emission, along, against);
    arriving(line, along, against, emitted, emitted_more);
    sources_along(line, weights, along, against);
    arriving(line, along, against, weighed, weighed_more);
    for (std::size_t i = 0; i < count; ++i) {
        const float rise =
            x * emission[count + i] + y * emission[2 * count + i] + z * emission[3 * count + i];
        const float of_rise =
            x * weights[count + i] + y * weights[2 * count + i] + z * weights[3 * count + i];
        const float products = 0.5f * (emitted[i] * weighed[i] - emitted_more[i] * weighed_more[i]);
        const float of_escaped = weights[i] * emitted[i] + emission[i] * weighed[i];
        const float of_slanted = rise * weighed_more[i] + of_rise * emitted_more[i];
        result[i] += c.weight * (l * (c.of_escaped[i] * of_escaped - c.of_slanted[i] * of_slanted) -
                                 c.passed[i] * products);
    }
    for (int axis = 0; line < AXES && axis < 3; ++axis) {
        if (axis == line)
            continue;
        const float *const slope = emission + (axis + 1) * count;
        const float *const of_slope = weights + (axis + 1) * count;
        sources_across(line, slope, along);
        arriving(line, along, along, emitted, emitted_more);
        sources_across(line, of_slope, along);
        arriving(line, along, along, weighed, weighed_more);
        for (std::size_t i = 0; i < count; ++i) {
            const float products = 0.5f * (emitted[i] * weighed[i] - emitted_more[i] * weighed_more[i]);
            const float of_escaped = of_slope[i] * emitted[i] + slope[i] * weighed[i];
            result[i] += SPREAD * c.weight * (l * c.of_escaped[i] * of_escaped - c.passed[i] * products);
        }
    }
}

// Of a line: the sum of what arrives, the difference, and across an axis the sums of the two slopes.
SMOKELIFT_CLONES
void BlockTransport::gather(const float *emission, const float *sums, float *mean) const {
    const std::size_t count = volume(n_);
    const auto of = [&](int line, int part) { return sums + (line * FIELDS + part) * count; };
    const float weights[2] = {classes_[0].weight, classes_[1].weight};
    const float *const passing[2] = {classes_[0].escaped.data(), classes_[1].escaped.data()};
    const float *const slanted[2] = {classes_[0].slanted.data(), classes_[1].slanted.data()};
    const float *const x = of(0, 0), *const y = of(1, 0), *const z = of(2, 0);
    const float *const a = of(3, 0), *const b = of(4, 0), *const c = of(5, 0), *const d = of(6, 0);
    for (std::size_t i = 0; i < count; ++i)
        mean[i] = own_[0][i] * emission[i] + weights[0] * passing[0][i] * (x[i] + y[i] + z[i]) +
                  weights[1] * passing[1][i] * (a[i] + b[i] + c[i] + d[i]);
    for (int axis = 0; axis < 3; ++axis) {
        const float *const slope = emission + (axis + 1) * count;
        float *const out = mean + (axis + 1) * count;
        const int others[2] = {axis == 0 ? 1 : 0, axis == 2 ? 1 : 2};
        // the two slopes across an axis are in the order of x, y, z
        const float *const one = of(others[0], axis < 3 - others[0] - axis ? 2 : 3);
        const float *const two = of(others[1], axis < 3 - others[1] - axis ? 2 : 3);
        const float *const rise = of(axis, 1);
        const float *rises[4];
        float signs[4];
        for (int diagonal = 0; diagonal < 4; ++diagonal) {
            rises[diagonal] = of(AXES + diagonal, 1);
            signs[diagonal] = float(LINES[AXES + diagonal][axis]);
        }
        for (std::size_t i = 0; i < count; ++i) {
            const float along_diagonals = signs[0] * rises[0][i] + signs[1] * rises[1][i] +
                                          signs[2] * rises[2][i] + signs[3] * rises[3][i];
            out[i] = own_[1][i] * slope[i] + weights[0] * passing[0][i] * (one[i] + two[i]) -
                     (weights[0] * slanted[0][i] * rise[i] + weights[1] * slanted[1][i] * along_diagonals) /
                         SPREAD;
        }
    }
}

void BlockTransport::mean_radiance(const float *emission, float *mean, Workers &workers) const {
    const std::size_t count = volume(n_);
    const std::unique_ptr<float[]> memory(new float[std::size(LINES) * FIELDS * count]); // not cleared
    float *const sums = memory.get();
    workers.run(std::size(LINES), [&](int line) {
        std::vector<float> along(count), against(count);
        float *const out = sums + line * FIELDS * count;
        sources_along(line, emission, along.data(), against.data());
        arriving(line, along.data(), against.data(), out, out + count);
        int part = 2;
        for (int axis = 0; line < AXES && axis < 3; ++axis) {
            if (axis == line)
                continue;
            sources_across(line, emission + (axis + 1) * count, along.data());
            arriving(line, along.data(), out + part++ * count);
        }
    });
    gather(emission, sums, mean);
}

void BlockTransport::add_extinction_gradient(const float *emission, const float *weights, float *result,
                                             Workers &workers) const {
    const std::size_t count = volume(n_);
    std::vector<float> sums(std::size(LINES) * count, 0.0f);
    workers.run(std::size(LINES),
                [&](int line) { add_line_gradient(line, emission, weights, sums.data() + line * count); });
    for (std::size_t i = 0; i < count; ++i) {
        float slopes = 0;
        for (int field = 1; field < FIELDS; ++field)
            slopes += weights[field * count + i] * emission[field * count + i];
        result[i] += of_own_[0][i] * weights[i] * emission[i] + SPREAD * of_own_[1][i] * slopes;
        for (std::size_t line = 0; line < std::size(LINES); ++line)
            result[i] += sums[line * count + i];
    }
}

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
            visit((std::size_t(x + i) * n_[1] + y + j) * n_[2] + z,
                  (std::size_t(i) * part_.n[1] + j) * part_.n[2]);
}

std::vector<float> DiffuseLight::cut(const float *values, int fields) const {
    const std::size_t all = volume(n_), count = volume(part_.n);
    std::vector<float> result(fields * count);
    over_part([&](std::size_t at, std::size_t in_part) {
        for (int field = 0; field < fields; ++field)
            std::copy_n(values + field * all + at, part_.n[2], result.data() + field * count + in_part);
    });
    return result;
}

DiffuseLight::DiffuseLight(const float *extinction, float albedo, const Shape &n, float edge)
    : n_(n), part_(around_smoke(extinction, n)), albedo_(albedo), scattering_(cut(extinction, 1)),
      everywhere_(extinction, n, edge), smoke_(scattering_.data(), part_.n, edge) {
    for (float &value : scattering_) // the extinction so far
        value *= albedo;
}

// The mean radiance of all orders in the part, from that of the first.
std::vector<float> DiffuseLight::all_orders(std::vector<float> residual, Workers &workers) const {
    const std::size_t count = scattering_.size(), size = FIELDS * count;
    // <a, b>, weighted by the scattering
    const auto product = [&](const std::vector<float> &a, const std::vector<float> &b) {
        double sum = 0;
        for (std::size_t i = 0; i < count; ++i) {
            float slopes = 0;
            for (int field = 1; field < FIELDS; ++field)
                slopes += a[field * count + i] * b[field * count + i];
            sum += double(scattering_[i]) * (a[i] * b[i] + SPREAD * slopes);
        }
        return sum;
    };
    std::vector<float> phi(size, 0.0f), search = residual, moved(size), scattered(size);
    double square = product(residual, residual);
    const double enough = TOLERANCE * TOLERANCE * square;
    for (int iteration = 0; iteration < MOST_ITERATIONS && square > enough; ++iteration) {
        for (int field = 0; field < FIELDS; ++field)
            for (std::size_t i = 0; i < count; ++i)
                scattered[field * count + i] = scattering_[i] * search[field * count + i];
        smoke_.mean_radiance(scattered.data(), moved.data(), workers);
        for (std::size_t i = 0; i < size; ++i)
            moved[i] = search[i] - moved[i];
        const auto step = static_cast<float>(square / product(search, moved));
        for (std::size_t i = 0; i < size; ++i) {
            phi[i] += step * search[i];
            residual[i] -= step * moved[i];
        }
        const double before = std::exchange(square, product(residual, residual));
        const auto factor = static_cast<float>(square / before);
        for (std::size_t i = 0; i < size; ++i)
            search[i] = residual[i] + factor * search[i];
    }
    return phi;
}

// source = emission + scattering x in_smoke,  phi = G source,  everywhere.
void DiffuseLight::scatter(const std::vector<float> &in_smoke, const float *emission, float *phi,
                           std::vector<float> &source, Workers &workers) const {
    const std::size_t all = volume(n_), count = scattering_.size();
    source.assign(emission, emission + FIELDS * all);
    over_part([&](std::size_t at, std::size_t in_part) {
        for (int field = 0; field < FIELDS; ++field)
            for (int i = 0; i < part_.n[2]; ++i)
                source[field * all + at + i] +=
                    scattering_[in_part + i] * in_smoke[field * count + in_part + i];
    });
    everywhere_.mean_radiance(source.data(), phi, workers);
}

void DiffuseLight::solve(const float *emission, float *phi, Workers &workers) const {
    std::vector<float> first(FIELDS * scattering_.size()), source;
    smoke_.mean_radiance(cut(emission, FIELDS).data(), first.data(), workers);
    scatter(all_orders(std::move(first), workers), emission, phi, source, workers);
}

// G is its own adjoint in the product <,>, so with  q: of_phi = <q, phi>  and  mu = G (q + scattering mu):
//     d(of_phi^T phi) = <mu, d emission + phi d scattering> + <q + scattering mu, dG (emission + scattering
//     phi)>.
void DiffuseLight::solve_adjoint(const float *emission, const float *phi, const float *of_phi,
                                 float *of_emission, float *of_extinction, Workers &workers) const {
    const std::size_t count = volume(n_), size = FIELDS * count;
    std::vector<float> asked(of_phi, of_phi + size), source(emission, emission + size), weights;
    for (std::size_t i = count; i < size; ++i)
        asked[i] /= SPREAD;
    everywhere_.mean_radiance(asked.data(), of_emission, workers); // asked where there is no smoke, too
    scatter(all_orders(cut(of_emission, FIELDS), workers), asked.data(), of_emission, weights, workers);
    over_part([&](std::size_t at, std::size_t in_part) {
        for (int field = 0; field < FIELDS; ++field)
            for (int i = 0; i < part_.n[2]; ++i)
                source[field * count + at + i] += scattering_[in_part + i] * phi[field * count + at + i];
    });
    for (int field = 0; field < FIELDS; ++field) {
        const float share = field ? SPREAD : 1.0f;
        for (std::size_t i = 0; i < count; ++i) {
            of_emission[field * count + i] *= share;
            of_extinction[i] += albedo_ * phi[field * count + i] * of_emission[field * count + i];
        }
    }
    everywhere_.add_extinction_gradient(source.data(), weights.data(), of_extinction, workers);
}

} // namespace smokelift
