// Light goes from block to block along 14 directions of the lattice: the 6 axes and the 8 diagonals of space,
// with the weights of Lebedev's rule, which is exact for polynomials of degree 5 (Lebedev 1976, USSR Comput.
// Math. Math. Phys. 16, 10). A beam meets blocks whole, so nothing is interpolated and no energy is lost.
//
// Emission and radiance are linear across a block: in thick smoke light changes within a block, and a mean
// alone would spread it too deep. On a path of length l through the block's center, at u from -1/2 to 1/2,
// with the emission e + r u, the beam L_in that enters a block becomes
//     L_out = T L_in + l (P e + Q r),    mean along the path     = P L_in + l (B e - Q/t r),
//                                        mean of u along the path = -Q L_in + l (Q/t e + C r).
// An axis's beams keep their slopes across too, each carried as a mean is; a diagonal's path leads from
// corner to corner, so that u tells all three slopes.
//
// In the product <a, b> = a_mean b_mean + (a_x b_x + a_y b_y + a_z b_z) / 12, the mean over a block, G is
// symmetric, since what is true of one direction is so of its opposite.
#include "block_transport.h"

#include "exponential.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

namespace smokelift {
namespace {

constexpr float SPREAD = BlockTransport::SPREAD;

// The diagonals (1, y, z) of four lines (by definition); the other four directions are their opposites.
constexpr int DIAGONALS = 4;
constexpr int DIAGONAL_Y[DIAGONALS] = {1, 1, -1, -1}, DIAGONAL_Z[DIAGONALS] = {1, -1, 1, -1};

// What an axis's beams carry (by definition): the mean with the slope along, and the two slopes across.
constexpr int CARRIED = 3;

constexpr int AXES = 3, WAYS = 2;  // x, y, z; forth (1) and back (-1) (by definition)
constexpr int DIAGONAL_FIELDS = 3; // sums of what arrives, and by sign along y, along z (by definition)

// Series in t, the optical depth of a path, to rounding for t below THIN.
constexpr float THIN = 1;
constexpr int TERMS = 11; // the next ones are below 1 / 12! (by definition)
struct Series {
    float terms[TERMS];

    constexpr float operator()(float t) const {
        float sum = 0;
        for (int n = TERMS - 1; n >= 0; --n)
            sum = terms[n] + t * sum;
        return sum;
    }
    constexpr Series derivative() const {
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
constexpr Series KEPT = series(2, [](int) { return 1.0; });                     // B
constexpr Series SLANTED = series(2, [](int n) { return -0.5 * n; });           // Q
constexpr Series TILTED = series(4, [](int n) { return -0.25 * n * (n + 3); }); // C
constexpr Series ESCAPED_DERIVATIVE = ESCAPED.derivative(), KEPT_DERIVATIVE = KEPT.derivative(),
                 SLANTED_DERIVATIVE = SLANTED.derivative(), TILTED_DERIVATIVE = TILTED.derivative();

// P, B, Q and C of the formulas above, or their derivatives by t.
struct Coefficients {
    float escaped, kept, slanted, tilted;
};

// Of a path of optical depth t >= THIN, `inverse` = 1 / t.

SMOKELIFT_INLINE Coefficients thick_coefficients(const Attenuation &through, float inverse) {
    const float escaped = through.opacity * inverse, kept = (1 - escaped) * inverse;
    const float slanted = kept - 0.5f * escaped;
    return {escaped, kept, slanted, SPREAD * inverse - (0.5f + inverse) * inverse * slanted};
}

SMOKELIFT_INLINE Coefficients thick_derivatives(const Attenuation &through, float inverse) {
    const Coefficients of = thick_coefficients(through, inverse);
    const float escaped = (through.transmittance - of.escaped) * inverse,
                kept = -(escaped + of.kept) * inverse;
    const float slanted = kept - 0.5f * escaped;
    const float tilted = (-SPREAD + (0.5f + 2 * inverse) * of.slanted) * inverse * inverse -
                         (0.5f + inverse) * inverse * slanted;
    return {escaped, kept, slanted, tilted};
}

SMOKELIFT_INLINE Coefficients coefficients(float t, const Attenuation &through) {
    const bool thin = t < THIN;
    const float low = std::min(t, THIN);
    const Coefficients thick = thick_coefficients(through, 1 / std::max(t, THIN));
    return {thin ? ESCAPED(low) : thick.escaped, thin ? KEPT(low) : thick.kept,
            thin ? SLANTED(low) : thick.slanted, thin ? TILTED(low) : thick.tilted};
}

SMOKELIFT_INLINE Coefficients coefficient_derivatives(float t) {
    const bool thin = t < THIN;
    const float low = std::min(t, THIN);
    const Coefficients thick = thick_derivatives(attenuation(t), 1 / std::max(t, THIN));
    return {thin ? ESCAPED_DERIVATIVE(low) : thick.escaped, thin ? KEPT_DERIVATIVE(low) : thick.kept,
            thin ? SLANTED_DERIVATIVE(low) : thick.slanted, thin ? TILTED_DERIVATIVE(low) : thick.tilted};
}

// Neighboring blocks. Rows are short, and compilers leave short loops and the rest of long ones scalar.
constexpr int LANES = Lattice::LANES;
typedef float Lanes __attribute__((vector_size(4 * LANES), aligned(4), may_alias));

SMOKELIFT_INLINE const Lanes &at(const float *first) { return *reinterpret_cast<const Lanes *>(first); }
SMOKELIFT_INLINE Lanes &at(float *first) { return *reinterpret_cast<Lanes *>(first); }

// visit(i) for lanes that begin at i. The last ones overlap those before: to visit blocks twice must change
// nothing.
template <class Visit> SMOKELIFT_INLINE void by_lanes(int count, const Visit &visit) {
    for (int i = 0; i + LANES < count; i += LANES)
        visit(i);
    visit(count - LANES);
}

std::unique_ptr<float[]> uninitialized(std::size_t size) { return std::unique_ptr<float[]>(new float[size]); }

// What arrives along a line of the lattice, both ways: L of the emission, M of the weights taken for one. The
// optical depth t of a block changes <weights, G emission>, by the beam that crosses it there and the one
// that comes back, by
//     -T (L M) + P' l (e M + w L) + Q' l (r M - s L),
// with the emission e and the weight w of the block, and their rises r and s along the beam.
struct Beams {
    const float *forth, *back;                 // L
    const float *weighed_forth, *weighed_back; // M

    SMOKELIFT_INLINE float by_passed(std::size_t i) const {
        return forth[i] * weighed_back[i] + back[i] * weighed_forth[i];
    }
    SMOKELIFT_INLINE float by_escaped(std::size_t i, float emitted, float weight) const {
        return weight * (forth[i] + back[i]) + emitted * (weighed_forth[i] + weighed_back[i]);
    }
    SMOKELIFT_INLINE float by_slanted(std::size_t i, float rise, float weight_rise) const {
        return rise * (weighed_forth[i] - weighed_back[i]) + weight_rise * (forth[i] - back[i]);
    }
};

// Memory for what arrives along several lines of one lattice: fields of L forth, L back, M forth, M back.
class Arriving {
public:
    Arriving(int lines, std::size_t count)
        : size_(lines * count), count_(count), memory_(uninitialized(4 * size_)) {}

    float *of_emission(int way) { return part(way > 0 ? 0 : 1); }
    float *of_weights(int way) { return part(way > 0 ? 2 : 3); }
    Beams beams(int line) const {
        const std::size_t at = line * count_;
        return {part(0) + at, part(1) + at, part(2) + at, part(3) + at};
    }

private:
    float *part(int number) const { return memory_.get() + number * size_; }

    std::size_t size_, count_;
    std::unique_ptr<float[]> memory_;
};

} // namespace

BlockTransport::BlockTransport(std::vector<float> extinction, const Lattice &lattice, float edge)
    : lattice_(lattice), extinction_(std::move(extinction)) {
    classes_[0] = {edge, 1.0f / 15, 2, 4, {}, {}, {}};
    classes_[1] = {edge * std::sqrt(3.0f), 3.0f / 40, 8, 0, {}, {}, {}};
    for (Fields &part : own_)
        part.assign(lattice_.count(), 0.0f);
    for (Crossing &crossing : classes_) {
        set_up(crossing);
        for (Fields *values : {&crossing.passed, &crossing.escaped, &crossing.slanted})
            clear_border(*values);
    }
    for (Fields &part : own_)
        clear_border(part);
}

void BlockTransport::clear_border(Fields &values) const {
    const auto [nx, ny, nz] = lattice_.n;
    for (int x = 0; x < nx; ++x) {
        for (int y = 0; y <= ny; ++y) {
            float *const row = values.data() + lattice_.row(x, y);
            std::fill(row + (y < ny ? nz : 0), row + lattice_.pitch(), 0.0f);
        }
    }
}

// Of a block's emission e the part B l e is its own mean along a beam, and of the rise r the part
// C l r / SPREAD is its own.
SMOKELIFT_CLONES
void BlockTransport::set_up(Crossing &c) {
    const float scale = c.weight * c.length, all = scale * (c.along + c.across);
    const std::size_t count = lattice_.count();
    for (Fields *values : {&c.passed, &c.escaped, &c.slanted})
        values->resize(count);
    const float *const __restrict extinction = extinction_.data();
    float *const __restrict passed = c.passed.data(), *const __restrict escaped = c.escaped.data();
    float *const __restrict slanted = c.slanted.data();
    float *const __restrict own = own_[0].data(), *const __restrict own_slope = own_[1].data();
    const float along = scale * c.along / SPREAD, across = scale * c.across;
    for (std::size_t i = 0; i < count; ++i) {
        const float t = c.length * extinction[i];
        const Attenuation through = attenuation(t);
        const Coefficients of = coefficients(t, through);
        passed[i] = through.transmittance;
        escaped[i] = of.escaped;
        slanted[i] = of.slanted;
        own[i] += all * of.kept;
        own_slope[i] += along * of.tilted + across * of.kept;
    }
}

SMOKELIFT_CLONES
void BlockTransport::differentiate(const Crossing &c, DepthDerivatives &derivatives,
                                   Own &own_derivative) const {
    const float scale = c.weight * c.length * c.length, all = scale * (c.along + c.across);
    const std::size_t count = lattice_.count();
    derivatives.escaped.resize(count);
    derivatives.slanted.resize(count);
    const float *const __restrict extinction = extinction_.data();
    float *const __restrict escaped = derivatives.escaped.data(), *const __restrict slanted =
                                                                      derivatives.slanted.data();
    float *const __restrict own = own_derivative[0].data(), *const __restrict own_slope =
                                                                own_derivative[1].data();
    const float along = scale * c.along / SPREAD, across = scale * c.across;
    for (std::size_t i = 0; i < count; ++i) {
        const Coefficients of = coefficient_derivatives(c.length * extinction[i]);
        escaped[i] = of.escaped;
        slanted[i] = of.slanted;
        own[i] += all * of.kept;
        own_slope[i] += along * of.tilted + across * of.kept;
    }
}

// Follows the beams of the axis x or y, one way. visit(first, count, arriving) gets neighboring blocks with
// what enters them of all that is carried.
template <class Visit>
SMOKELIFT_INLINE void BlockTransport::follow_rows(int axis, int way, const float *emission,
                                                  const Visit &visit) const {
    const Crossing &crossing = classes_[0];
    const std::size_t all = lattice_.count();
    const int lines = axis ? lattice_.n[0] : 1, steps = axis ? lattice_.n[1] + 1 : lattice_.n[0];
    const int run = axis ? lattice_.pitch() : lattice_.plane();
    const float length = crossing.length, rising = float(way) * length;
    Fields memory(std::size_t(2 * CARRIED) * run);
    float *arriving = memory.data(), *leaving = arriving + CARRIED * run;
    for (int line = 0; line < lines; ++line) {
        std::fill_n(arriving, CARRIED * run, 0.0f);
        for (int step = 0; step < steps; ++step) {
            const std::size_t first = (std::size_t(line) * steps + (way > 0 ? step : steps - 1 - step)) * run;
            visit(first, run, arriving);
            const Crossing::Row block = crossing.from(first);
            const float *const mean = emission + first, *const rise = mean + (1 + axis) * all;
            const float *const across[2] = {mean + (1 + LATERAL[axis][0]) * all,
                                            mean + (1 + LATERAL[axis][1]) * all};
            by_lanes(run, [&](int i) SMOKELIFT_INLINE_LAMBDA {
                const Lanes through = at(block.passed + i), emitted = length * at(block.escaped + i);
                at(leaving + i) = through * at(arriving + i) +
                                  (emitted * at(mean + i) + rising * at(block.slanted + i) * at(rise + i));
                for (int side = 0; side < 2; ++side)
                    at(leaving + (1 + side) * run + i) =
                        through * at(arriving + (1 + side) * run + i) + emitted * at(across[side] + i);
            });
            std::swap(arriving, leaving);
        }
    }
}

// The same along rows of memory: some rows side by side, since a beam waits for itself.
template <class Visit>
SMOKELIFT_INLINE void BlockTransport::follow_along_z(int way, const float *emission,
                                                     const Visit &visit) const {
    constexpr int ROWS = Lattice::ROWS;
    const Crossing &crossing = classes_[0];
    const std::size_t all = lattice_.count();
    const int pitch = lattice_.pitch(), run = ROWS * pitch;
    const int rows = static_cast<int>(all / pitch);
    const float length = crossing.length, rising = float(way) * length;
    Fields memory(std::size_t(2 * CARRIED) * run);
    float *const sources = memory.data(), *const arriving = sources + CARRIED * run;
    for (int row = 0; row < rows; row += ROWS) {
        const std::size_t first = std::size_t(std::min(row, rows - ROWS)) * pitch;
        const Crossing::Row block = crossing.from(first);
        const float *const mean = emission + first, *const x = mean + all, *const y = x + all;
        const float *const rise = y + all;
        by_lanes(run, [&](int i) SMOKELIFT_INLINE_LAMBDA {
            const Lanes emitted = length * at(block.escaped + i);
            at(sources + i) = emitted * at(mean + i) + rising * at(block.slanted + i) * at(rise + i);
            at(sources + run + i) = emitted * at(x + i);
            at(sources + 2 * run + i) = emitted * at(y + i);
        });
        float beams[CARRIED][ROWS] = {};
        for (int step = 0; step < pitch; ++step) {
            const int z = way > 0 ? step : pitch - 1 - step;
            for (int r = 0; r < ROWS; ++r) {
                for (int part = 0; part < CARRIED; ++part) {
                    const int place = part * run + r * pitch + z;
                    arriving[place] = beams[part][r];
                    beams[part][r] = block.passed[r * pitch + z] * beams[part][r] + sources[place];
                }
            }
        }
        visit(first, run, arriving);
    }
}

template <class Visit>
SMOKELIFT_INLINE void BlockTransport::follow_axis(int axis, int way, const float *emission,
                                                  const Visit &visit) const {
    if (axis == 2)
        follow_along_z(way, emission, visit);
    else
        follow_rows(axis, way, emission, visit);
}

// Follows the beams of the four diagonals, or of their opposites. visit(first, count, arriving) gets planes
// across x with what enters their blocks along each.
template <class Visit>
SMOKELIFT_INLINE void BlockTransport::follow_diagonals(int way, const float *emission,
                                                       const Visit &visit) const {
    const Crossing &crossing = classes_[1];
    const std::size_t all = lattice_.count();
    const int steps = lattice_.n[0], plane = lattice_.plane(), pitch = lattice_.pitch();
    const int margin = pitch + 1, size = plane + 2 * margin; // what comes from outside the lattice is 0
    const float length = crossing.length, rising = float(way) * length;
    Fields memory(std::size_t(2 * DIAGONALS) * size, 0.0f);
    float *beams = memory.data() + margin, *leaving = beams + DIAGONALS * size;
    for (int step = 0; step < steps; ++step) {
        const std::size_t first = std::size_t(way > 0 ? step : steps - 1 - step) * plane;
        const float *arriving[DIAGONALS];
        for (int line = 0; line < DIAGONALS; ++line)
            arriving[line] = beams + line * size - way * (DIAGONAL_Y[line] * pitch + DIAGONAL_Z[line]);
        visit(first, plane, arriving);
        const Crossing::Row block = crossing.from(first);
        const float *const mean = emission + first, *const x = mean + all, *const y = x + all;
        const float *const z = y + all;
        by_lanes(plane, [&](int i) SMOKELIFT_INLINE_LAMBDA {
            const Lanes through = at(block.passed + i),
                        emitted = length * at(block.escaped + i) * at(mean + i);
            const Lanes slope = rising * at(block.slanted + i);
            for (int line = 0; line < DIAGONALS; ++line) {
                const Lanes rise =
                    at(x + i) + float(DIAGONAL_Y[line]) * at(y + i) + float(DIAGONAL_Z[line]) * at(z + i);
                at(leaving + line * size + i) = through * at(arriving[line] + i) + (emitted + slope * rise);
            }
        });
        std::swap(beams, leaving);
    }
}

// What both ways of an axis make of the mean radiance, in its four fields.
SMOKELIFT_CLONES
void BlockTransport::through_axis(int axis, const float *emission, float *mean) const {
    const Crossing &crossing = classes_[0];
    const std::size_t all = lattice_.count();
    const auto memory = uninitialized(CARRIED * all);
    float *const arrived = memory.get();
    arriving_along_axis(axis, 1, emission, arrived);
    const float weight = crossing.weight, of_slope = -weight / SPREAD;
    follow_axis(
        axis, -1, emission, [&](std::size_t first, int count, const float *back) SMOKELIFT_INLINE_LAMBDA {
            const float *const forth = arrived + first;
            const Crossing::Row block = crossing.from(first);
            float *const of_mean = mean + first, *const along = of_mean + (1 + axis) * all;
            float *const across[2] = {of_mean + (1 + LATERAL[axis][0]) * all,
                                      of_mean + (1 + LATERAL[axis][1]) * all};
            by_lanes(count, [&](int i) SMOKELIFT_INLINE_LAMBDA {
                const Lanes factor = weight * at(block.escaped + i);
                at(of_mean + i) = factor * (at(forth + i) + at(back + i));
                at(along + i) = of_slope * at(block.slanted + i) * (at(forth + i) - at(back + i));
                for (int side = 0; side < 2; ++side)
                    at(across[side] + i) =
                        factor * (at(forth + (1 + side) * all + i) + at(back + (1 + side) * count + i));
            });
        });
}

// Of what arrives along four diagonals: the sum, and the sums with their signs along y and z.
SMOKELIFT_CLONES
void BlockTransport::through_diagonals(int way, const float *emission, float *sums) const {
    const std::size_t all = lattice_.count();
    follow_diagonals(way, emission,
                     [&](std::size_t first, int count, const float *const *arriving) SMOKELIFT_INLINE_LAMBDA {
                         float *const sum = sums + first, *const y = sum + all, *const z = y + all;
                         by_lanes(count, [&](int i) SMOKELIFT_INLINE_LAMBDA {
                             const Lanes near = at(arriving[0] + i) + at(arriving[1] + i);
                             const Lanes far = at(arriving[2] + i) + at(arriving[3] + i);
                             at(sum + i) = near + far;
                             at(y + i) = near - far;
                             at(z + i) = (at(arriving[0] + i) - at(arriving[1] + i)) +
                                         (at(arriving[2] + i) - at(arriving[3] + i));
                         });
                     });
}

// The mean radiance from the parts that mean_radiance() has made.
SMOKELIFT_CLONES
void BlockTransport::gather(const float *emission, const float *parts, float *mean) const {
    const Crossing &c = classes_[1];
    const std::size_t all = lattice_.count();
    const float weight = c.weight, of_slope = -c.weight / SPREAD;
    const float *const diagonals = parts + AXES * FIELDS * all;
    for (int field = 0; field < FIELDS; ++field) {
        const float *const __restrict x = parts + field * all, *const __restrict y = x + FIELDS * all;
        const float *const __restrict z = y + FIELDS * all, *const __restrict own = own_[field > 0].data();
        const float *const __restrict emitted = emission + field * all;
        // all diagonals lie along x, so that their sum forth is also that with the sign along x
        const float *const __restrict forth = diagonals + std::max(field - 1, 0) * all;
        const float *const __restrict back = forth + DIAGONAL_FIELDS * all;
        const float *const __restrict coefficient = field ? c.slanted.data() : c.escaped.data();
        float *const __restrict out = mean + field * all;
        const float factor = field ? of_slope : weight, sign = field ? -1.0f : 1.0f;
        for (std::size_t i = 0; i < all; ++i)
            out[i] = own[i] * emitted[i] + ((x[i] + y[i]) + z[i]) +
                     factor * coefficient[i] * (forth[i] + sign * back[i]);
    }
}

void BlockTransport::mean_radiance(const float *emission, float *mean, Workers &workers) const {
    const std::size_t all = lattice_.count();
    const auto memory = uninitialized((AXES * FIELDS + WAYS * DIAGONAL_FIELDS) * all);
    float *const parts = memory.get(), *const diagonals = parts + AXES * FIELDS * all;
    workers.run(AXES + WAYS, [&](int task) {
        if (task < WAYS)
            through_diagonals(task ? -1 : 1, emission, diagonals + task * DIAGONAL_FIELDS * all);
        else
            through_axis(task - WAYS, emission, parts + (task - WAYS) * FIELDS * all);
    });
    gather(emission, parts, mean);
}

// What arrives along an axis, one way, of all that is carried: a field each.
SMOKELIFT_CLONES
void BlockTransport::arriving_along_axis(int axis, int way, const float *emission, float *fields) const {
    const std::size_t all = lattice_.count();
    follow_axis(axis, way, emission,
                [&](std::size_t first, int count, const float *arriving) SMOKELIFT_INLINE_LAMBDA {
                    for (int part = 0; part < CARRIED; ++part)
                        std::copy_n(arriving + part * count, count, fields + part * all + first);
                });
}

// The same along four diagonals.
SMOKELIFT_CLONES
void BlockTransport::arriving_along_diagonals(int way, const float *emission, float *fields) const {
    const std::size_t all = lattice_.count();
    follow_diagonals(way, emission,
                     [&](std::size_t first, int count, const float *const *arriving) SMOKELIFT_INLINE_LAMBDA {
                         for (int line = 0; line < DIAGONALS; ++line)
                             std::copy_n(arriving[line], count, fields + line * all + first);
                     });
}

SMOKELIFT_CLONES
void BlockTransport::axis_gradient(int axis, const DepthDerivatives &derivatives, const float *emission,
                                   const float *weights, float *result) const {
    const Crossing &c = classes_[0];
    const std::size_t all = lattice_.count();
    Arriving arriving(CARRIED, all);
    for (const int way : {1, -1}) {
        arriving_along_axis(axis, way, emission, arriving.of_emission(way));
        arriving_along_axis(axis, way, weights, arriving.of_weights(way));
    }
    const float *const passed = c.passed.data();
    const float *const escaped = derivatives.escaped.data(), *const slanted = derivatives.slanted.data();
    for (int part = 0; part < CARRIED; ++part) {
        const Beams beams = arriving.beams(part);
        const int field = part ? 1 + LATERAL[axis][part - 1] : 0;
        const float *const emitted = emission + field * all, *const weight = weights + field * all;
        const float factor = c.weight * (part ? SPREAD : 1.0f);
        for (std::size_t i = 0; i < all; ++i) {
            const float by_passed = beams.by_passed(i);
            const float by_escaped = beams.by_escaped(i, emitted[i], weight[i]);
            const float value = factor * (c.length * escaped[i] * by_escaped - passed[i] * by_passed);
            result[i] = part ? result[i] + value : value;
        }
    }
    const Beams beams = arriving.beams(0);
    const float *const rise = emission + (1 + axis) * all, *const weight_rise = weights + (1 + axis) * all;
    for (std::size_t i = 0; i < all; ++i)
        result[i] -= c.weight * c.length * slanted[i] * beams.by_slanted(i, rise[i], weight_rise[i]);
}

SMOKELIFT_CLONES
void BlockTransport::diagonal_gradient(const DepthDerivatives &derivatives, const float *emission,
                                       const float *weights, float *result) const {
    const Crossing &c = classes_[1];
    const std::size_t all = lattice_.count();
    Arriving arriving(DIAGONALS, all);
    for (const int way : {1, -1}) {
        arriving_along_diagonals(way, emission, arriving.of_emission(way));
        arriving_along_diagonals(way, weights, arriving.of_weights(way));
    }
    const float *const passed = c.passed.data();
    const float *const escaped = derivatives.escaped.data(), *const slanted = derivatives.slanted.data();
    const float *const e = emission, *const w = weights;
    for (int line = 0; line < DIAGONALS; ++line) {
        const Beams beams = arriving.beams(line);
        const auto y = float(DIAGONAL_Y[line]), z = float(DIAGONAL_Z[line]);
        for (std::size_t i = 0; i < all; ++i) {
            const float rise = e[all + i] + y * e[2 * all + i] + z * e[3 * all + i];
            const float weight_rise = w[all + i] + y * w[2 * all + i] + z * w[3 * all + i];
            const float by_passed = beams.by_passed(i), by_escaped = beams.by_escaped(i, e[i], w[i]);
            const float by_slanted = beams.by_slanted(i, rise, weight_rise);
            const float value = c.weight * (c.length * (escaped[i] * by_escaped - slanted[i] * by_slanted) -
                                            passed[i] * by_passed);
            result[i] = line ? result[i] + value : value;
        }
    }
}

void BlockTransport::add_extinction_gradient(const float *emission, const float *weights, float *result,
                                             Workers &workers) const {
    const std::size_t all = lattice_.count();
    DepthDerivatives derivatives[2];
    Own own_derivative = {Fields(all), Fields(all)};
    for (int number = 0; number < 2; ++number)
        differentiate(classes_[number], derivatives[number], own_derivative);
    const auto memory = uninitialized((AXES + 1) * all);
    float *const parts = memory.get();
    workers.run(AXES + 1, [&](int task) {
        if (task == AXES)
            diagonal_gradient(derivatives[1], emission, weights, parts + task * all);
        else
            axis_gradient(task, derivatives[0], emission, weights, parts + task * all);
    });
    for (std::size_t i = 0; i < all; ++i) {
        float slope_products = 0;
        for (int field = 1; field < FIELDS; ++field)
            slope_products += weights[field * all + i] * emission[field * all + i];
        result[i] +=
            own_derivative[0][i] * weights[i] * emission[i] + SPREAD * own_derivative[1][i] * slope_products;
        for (int part = 0; part <= AXES; ++part)
            result[i] += parts[part * all + i];
    }
}

} // namespace smokelift
