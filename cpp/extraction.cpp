// The model of a cell is
//
//     I = B + a (J - B) + n,    J_c = source_c g(u_0) exp(BASIS[c][0] u_1 + BASIS[c][1] u_2),
//
// with a = 1 - T the opacity, u_0 the brightness of the smoke's source radiance J and u_1, u_2 its chroma.
// The logistic g(u) = 2 / (1 + exp(-2 u)) is exp(u) near 0, and 2 at most: shadows make smoke as dark as they
// like, but no light makes it much brighter than it usually is. Each of the four fields is a sum over the
// levels of a pyramid, whose coefficients are independent and normal.
//
// J is no linear function of its fields, so the cells' normal equations are those of Gauss and Newton about
// the last fields. They are solved for the coefficients by conjugate gradients, which a block of four
// coefficients preconditions. Outliers get the weights of a Student t distribution (iteratively reweighted
// least squares).
#include "extraction.h"

#include "compiler.h"
#include "vectors.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace smokelift {
namespace {

typedef float Four __attribute__((vector_size(16), aligned(4), may_alias));

constexpr float R2 = 1.22474487f, R6 = 0.70710678f;                // sqrt(3 / 2), sqrt(3 / 6) (by definition)
constexpr float BASIS[3][2] = {{R2, R6}, {0, -2 * R6}, {-R2, R6}}; // of chroma, orthogonal (by definition)
constexpr float MIN_OPACITY = 0.03f; // least 1 - T at which J is linearized: J can move where no smoke is yet
constexpr float BRIGHTEST = 2;       // largest g: so it is 1 at 0, as is its slope (by definition)
constexpr float MAX_FIELD = 3;       // bound of the fields of J, as of ln J, where they are linearized
constexpr float ENOUGH = 1e-3f;      // residual, over the first, where a solve ends
constexpr int WINDOW = 2;            // level, from 0, whose cells tell how certain T is: four fine cells wide
constexpr float SPREAD = 0.4f; // of the sum over a coefficient's cells, the energy of its bilinear weights

SMOKELIFT_INLINE Four load(const float *p) { return *reinterpret_cast<const Four *>(p); }
SMOKELIFT_INLINE void store(float *p, Four x) { *reinterpret_cast<Four *>(p) = x; }

typedef double FourDoubles __attribute__((vector_size(32)));

struct Level {
    int rows, columns;
    Values coefficients, residual, direction, product, preconditioned;
    Four precision; // of the prior
    Values system;  // the cells' 4 x 4 matrices, added up
    Values inverse; // of system and precision
    std::size_t cells() const { return std::size_t(rows) * columns; }
};

// Bilinear: a fine cell has 3/4 of the coarse cell that it lies in and 1/4 of the next one on its side;
// beyond the edge that is the same one. A `line` of coarse cells has one more at each end.
struct Mix {
    int near, next;
};
Mix mix(int fine, int coarse_count) {
    const int near = fine / 2;
    return {near, std::clamp(near + (fine % 2 ? 1 : -1), 0, coarse_count - 1)};
}

// sum = fine + coarse, interpolated.
SMOKELIFT_CLONES
void add_expanded(const float *coarse, int coarse_rows, int coarse_columns, const float *fine, int rows,
                  int columns, float *line, float *sum) {
    float *const inside = line + 4;
    for (int row = 0; row < rows; ++row) {
        const auto [near, next] = mix(row, coarse_rows);
        const float *const a = coarse + std::size_t(near) * coarse_columns * 4;
        const float *const b = coarse + std::size_t(next) * coarse_columns * 4;
        for (int n = 0; n < 4 * coarse_columns; ++n)
            inside[n] = 0.75f * a[n] + 0.25f * b[n];
        store(line, load(inside));
        store(inside + 4 * coarse_columns, load(inside + 4 * coarse_columns - 4));
        const float *const in = fine + std::size_t(row) * columns * 4;
        float *const out = sum + std::size_t(row) * columns * 4;
        for (int n = 0; n < columns / 2; ++n) {
            const float *const at = inside + 4 * n;
            const Four most = 0.75f * load(at);
            store(out + 8 * n, load(in + 8 * n) + most + 0.25f * load(at - 4));
            store(out + 8 * n + 4, load(in + 8 * n + 4) + most + 0.25f * load(at + 4));
        }
        if (columns % 2) {
            const float *const at = inside + 4 * (coarse_columns - 1);
            const int last = 4 * (columns - 1);
            store(out + last, load(in + last) + 0.75f * load(at) + 0.25f * load(at - 4));
        }
    }
}

// coarse = the adjoint of add_expanded, of fine.
SMOKELIFT_CLONES
void collect(const float *fine, int rows, int columns, float *coarse, int coarse_rows, int coarse_columns,
             float *line) {
    float *const inside = line + 4;
    std::fill_n(coarse, std::size_t(coarse_rows) * coarse_columns * 4, 0.0f);
    for (int row = 0; row < rows; ++row) {
        const float *const in = fine + std::size_t(row) * columns * 4;
        std::fill_n(line, 8, 0.0f);
        for (int n = 0; n < columns / 2; ++n) {
            const Four one = load(in + 8 * n), other = load(in + 8 * n + 4);
            float *const at = inside + 4 * n;
            store(at - 4, load(at - 4) + 0.25f * one);
            store(at, load(at) + 0.75f * (one + other));
            store(at + 4, 0.25f * other);
        }
        if (columns % 2) {
            const Four last = load(in + 4 * (columns - 1));
            float *const at = inside + 4 * (coarse_columns - 1);
            store(at - 4, load(at - 4) + 0.25f * last);
            store(at, load(at) + 0.75f * last);
            store(at + 4, Four{});
        }
        store(inside, load(inside) + load(line));
        float *const end = inside + 4 * (coarse_columns - 1);
        store(end, load(end) + load(end + 4));
        const auto [near, next] = mix(row, coarse_rows);
        float *const a = coarse + std::size_t(near) * coarse_columns * 4;
        float *const b = coarse + std::size_t(next) * coarse_columns * 4;
        for (int n = 0; n < 4 * coarse_columns; ++n)
            a[n] += 0.75f * inside[n];
        for (int n = 0; n < 4 * coarse_columns; ++n)
            b[n] += 0.25f * inside[n];
    }
}

SMOKELIFT_INLINE Four times(const float *matrix, Four x) {
    return load(matrix) * x[0] + load(matrix + 4) * x[1] + load(matrix + 8) * x[2] + load(matrix + 12) * x[3];
}

// The inverse of a symmetric positive definite matrix of four rows, by blocks of two.
void invert(const float *matrix, float *inverse) {
    const auto m = [matrix](int row, int column) { return double(matrix[4 * row + column]); };
    const double first = 1 / (m(0, 0) * m(1, 1) - m(0, 1) * m(0, 1));
    const double a = first * m(1, 1), b = -first * m(0, 1), c = first * m(0, 0); // of the upper left block
    // that times the upper right block, then the inverse of what it leaves of the lower right one
    const double p = a * m(0, 2) + b * m(1, 2), q = a * m(0, 3) + b * m(1, 3);
    const double r = b * m(0, 2) + c * m(1, 2), s = b * m(0, 3) + c * m(1, 3);
    const double d = m(2, 2) - m(0, 2) * p - m(1, 2) * r, e = m(2, 3) - m(0, 2) * q - m(1, 2) * s,
                 f = m(3, 3) - m(0, 3) * q - m(1, 3) * s;
    const double second = 1 / (d * f - e * e);
    const double x = second * f, y = -second * e, z = second * d;
    const double t = p * x + q * y, u = p * y + q * z, v = r * x + s * y, w = r * y + s * z;
    const double upper[4][4] = {{a + t * p + u * q, b + t * r + u * s, -t, -u},
                                {0, c + v * r + w * s, -v, -w},
                                {0, 0, x, y},
                                {0, 0, 0, z}};
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column)
            inverse[4 * row + column] = float(upper[std::min(row, column)][std::max(row, column)]);
}

constexpr int UPPER[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}; // of a symmetric matrix (by definition)

// The inverse of a symmetric positive definite matrix of three rows, by cofactors.
void invert(const float (&upper)[6], float (&inverse)[3][3]) {
    const double a = upper[0], b = upper[1], c = upper[2], d = upper[3], e = upper[4], f = upper[5];
    const double first = d * f - e * e, second = c * e - b * f, third = b * e - c * d;
    const double scale = 1 / (a * first + b * second + c * third);
    const double values[6] = {first, second, third, a * f - c * c, b * c - a * e, a * d - b * b};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            inverse[i][j] = float(scale * values[UPPER[i][j]]);
}

class Pyramid {
public:
    Pyramid(const ExtractionProblem &problem);
    void run(int rounds, int iterations);
    void write(float *fields, float *deviation, float *weight) const;

private:
    void expand(Values Level::*of);     // into fields_
    void collect_up(Values Level::*of); // from the finest level's values
    void linearize(bool robust);
    void precondition();
    double apply(Values Level::*of, Values Level::*result);
    double step(float size);
    void solve(int iterations);

    const ExtractionProblem &problem_;
    std::vector<Level> levels_;
    Values fields_, right_, line_, weight_;
};

Pyramid::Pyramid(const ExtractionProblem &problem) : problem_(problem) {
    int rows = problem.rows, columns = problem.columns;
    const int count = pyramid_levels(rows, columns);
    for (int n = 0; n < count; ++n) {
        Level level{rows, columns, {}, {}, {}, {}, {}, {}, {}, {}};
        const std::size_t values = 4 * level.cells();
        for (Values Level::*each : {&Level::coefficients, &Level::residual, &Level::direction,
                                    &Level::product, &Level::preconditioned}) {
            level.*each = Values(values);
            std::fill_n((level.*each).data(), values, 0.0f);
        }
        level.system = Values(4 * values);
        level.inverse = Values(4 * values);
        const auto &deviation = problem.deviations[n];
        for (int k = 0; k < 4; ++k)
            level.precision[k] = 1 / (deviation[k] * deviation[k]);
        levels_.push_back(std::move(level));
        rows = (rows + 1) / 2;
        columns = (columns + 1) / 2;
    }
    // the likeliest opacity is that of neither clear air nor solid smoke, so that both are found
    for (std::size_t cell = 0; cell < levels_.back().cells(); ++cell)
        levels_.back().coefficients[4 * cell] = 0.2f;
    fields_ = Values(4 * levels_[0].cells());
    right_ = Values(4 * levels_[0].cells());
    line_ = Values(4 * (std::size_t(problem.columns) + 2));
    weight_ = Values(levels_[0].cells());
    std::fill_n(weight_.data(), levels_[0].cells(), 1.0f);
}

void Pyramid::expand(Values Level::*of) {
    // each level is added to what the coarser ones are together; `product` of the coarser ones is free here
    const Level &top = levels_.back();
    const float *coarse = (top.*of).data();
    for (std::size_t n = levels_.size() - 1; n-- > 0;) {
        Level &level = levels_[n];
        float *const sum = n == 0 ? fields_.data() : level.product.data();
        add_expanded(coarse, levels_[n + 1].rows, levels_[n + 1].columns, (level.*of).data(), level.rows,
                     level.columns, line_.data(), sum);
        coarse = sum;
    }
    if (levels_.size() == 1)
        std::copy_n(coarse, 4 * top.cells(), fields_.data());
}

void Pyramid::collect_up(Values Level::*of) {
    for (std::size_t n = 1; n < levels_.size(); ++n) {
        const Level &fine = levels_[n - 1];
        Level &level = levels_[n];
        collect((fine.*of).data(), fine.rows, fine.columns, (level.*of).data(), level.rows, level.columns,
                line_.data());
    }
}

void Pyramid::linearize(bool robust) {
    expand(&Level::coefficients);
    const std::size_t cells = levels_[0].cells();
    for (std::size_t cell = 0; cell < cells; ++cell) {
        const Moments &m = problem_.moments[cell];
        float *const x = fields_.data() + 4 * cell;
        const float clear = 1 - std::clamp(x[0], 0.0f, 1.0f), opacity = std::max(1 - clear, MIN_OPACITY);
        float u[3];
        for (int k = 0; k < 3; ++k)
            u[k] = std::clamp(x[k + 1], -MAX_FIELD, MAX_FIELD);
        const float brightness = BRIGHTEST / (1 + std::exp(-2 * u[0]));
        // of the model I = B + f' x: how x changes it for each channel, but for B itself, which varies within
        // a cell
        float source[3], slope[3][3], known[3];
        for (int c = 0; c < 3; ++c) {
            source[c] = problem_.source[c] * brightness * std::exp(BASIS[c][0] * u[1] + BASIS[c][1] * u[2]);
            slope[c][0] = opacity * source[c] * (BRIGHTEST - brightness);
            for (int k = 0; k < 2; ++k)
                slope[c][k + 1] = opacity * source[c] * BASIS[c][k];
            known[c] = m.change[c]; // what is to be explained, with what the slopes make of u itself
            for (int k = 0; k < 3; ++k)
                known[c] += slope[c][k] * u[k];
        }
        // the inverse covariance of the mean of a cell
        float covariance[6], w[3][3];
        for (int k = 0; k < 6; ++k)
            covariance[k] = clear * clear * m.unknown * problem_.errors[k];
        for (int c = 0; c < 3; ++c)
            covariance[UPPER[c][c]] += m.noise[c] / problem_.pixels;
        invert(covariance, w);
        // sums over the cell of w B, B' w B, w D and B' w D
        float wb[3] = {}, wd[3] = {}, bwb = 0, bwd = 0;
        for (int c = 0; c < 3; ++c)
            for (int d = 0; d < 3; ++d) {
                wb[c] += w[c][d] * m.plate[d];
                wd[c] += w[c][d] * m.change[d];
                bwb += w[c][d] * m.plates[UPPER[c][d]];
                bwd += w[c][d] * m.products[3 * d + c];
            }
        float matrix[4][4] = {}, right[4] = {};
        matrix[0][0] = bwb;
        right[0] = -bwd;
        for (int c = 0; c < 3; ++c) {
            float contrast = -wb[c], explained = 0; // w (J - B), and w times what is to be explained
            for (int d = 0; d < 3; ++d) {
                contrast += w[c][d] * source[d];
                explained += w[c][d] * known[d];
            }
            matrix[0][0] += source[c] * (contrast - wb[c]);
            right[0] += source[c] * wd[c] + contrast * (known[c] - m.change[c]);
            for (int k = 0; k < 3; ++k) {
                matrix[0][k + 1] += contrast * slope[c][k];
                right[k + 1] += slope[c][k] * explained;
                for (int j = 0; j < 3; ++j)
                    for (int d = 0; d < 3; ++d)
                        matrix[j + 1][k + 1] += slope[c][j] * w[c][d] * slope[d][k];
            }
        }
        if (robust && problem_.outlier_freedom > 0) {
            float left[3], chi = 0;
            for (int c = 0; c < 3; ++c)
                left[c] = m.change[c] - x[0] * (source[c] - m.plate[c]);
            for (int c = 0; c < 3; ++c)
                for (int d = 0; d < 3; ++d)
                    chi += left[c] * w[c][d] * left[d] / problem_.pixels;
            weight_[cell] = std::min((problem_.outlier_freedom + 3) / (problem_.outlier_freedom + chi), 1.0f);
        }
        for (int k = 1; k < 4; ++k)
            matrix[k][0] = matrix[0][k];
        float *const system = levels_[0].system.data() + 16 * cell;
        for (int k = 0; k < 4; ++k) {
            for (int j = 0; j < 4; ++j)
                system[4 * k + j] = weight_[cell] * matrix[k][j];
            right_[4 * cell + k] = weight_[cell] * right[k];
        }
    }
}

void Pyramid::precondition() {
    for (std::size_t n = 1; n < levels_.size(); ++n) {
        const Level &fine = levels_[n - 1];
        Level &level = levels_[n];
        std::fill_n(level.system.data(), 16 * level.cells(), 0.0f);
        for (int row = 0; row < fine.rows; ++row)
            for (int column = 0; column < fine.columns; ++column) {
                const float *const from =
                    fine.system.data() + 16 * (std::size_t(row) * fine.columns + column);
                float *const to =
                    level.system.data() + 16 * (std::size_t(row / 2) * level.columns + column / 2);
                for (int k = 0; k < 16; ++k)
                    to[k] += from[k];
            }
    }
    for (std::size_t n = 0; n < levels_.size(); ++n) {
        Level &level = levels_[n];
        const float scale = n == 0 ? 1.0f : 4 * SPREAD;
        for (std::size_t cell = 0; cell < level.cells(); ++cell) {
            float matrix[16];
            for (int k = 0; k < 16; ++k)
                matrix[k] = scale * level.system[16 * cell + k];
            for (int k = 0; k < 4; ++k)
                matrix[5 * k] += level.precision[k];
            invert(matrix, level.inverse.data() + 16 * cell);
        }
    }
}

// y = matrix x, cell by cell.
SMOKELIFT_CLONES
void apply_system(const float *matrix, const float *x, float *y, std::size_t cells) {
    for (std::size_t cell = 0; cell < cells; ++cell)
        store(y + 4 * cell, times(matrix + 16 * cell, load(x + 4 * cell)));
}

// sum += x y
SMOKELIFT_INLINE void add_products(Four x, Four y, FourDoubles &sum) {
    sum += __builtin_convertvector(x, FourDoubles) * __builtin_convertvector(y, FourDoubles);
}
SMOKELIFT_INLINE double total(const FourDoubles &sum) { return (sum[0] + sum[1]) + (sum[2] + sum[3]); }

// y += precision x; their scalar product.
SMOKELIFT_CLONES
double add_prior(Four precision, const float *x, float *y, std::size_t cells) {
    FourDoubles sum = {};
    for (std::size_t cell = 0; cell < cells; ++cell) {
        const Four at = load(x + 4 * cell), result = load(y + 4 * cell) + precision * at;
        store(y + 4 * cell, result);
        add_products(at, result, sum);
    }
    return total(sum);
}

// A step along the direction; the scalar product of the residual there and the preconditioned one.
SMOKELIFT_CLONES
double step_along(float step, const Level &level, float *coefficients, float *residual,
                  float *preconditioned) {
    const float *const direction = level.direction.data(), *const product = level.product.data();
    const float *const inverse = level.inverse.data();
    const std::size_t cells = level.cells();
    FourDoubles sum = {};
    for (std::size_t cell = 0; cell < cells; ++cell) {
        const std::size_t at = 4 * cell;
        store(coefficients + at, load(coefficients + at) + step * load(direction + at));
        const Four left = load(residual + at) - step * load(product + at);
        const Four conditioned = times(inverse + 4 * at, left);
        store(residual + at, left);
        store(preconditioned + at, conditioned);
        add_products(left, conditioned, sum);
    }
    return total(sum);
}

// result = (prior + collect system expand) of; their scalar product.
double Pyramid::apply(Values Level::*of, Values Level::*result) {
    expand(of);
    apply_system(levels_[0].system.data(), fields_.data(), (levels_[0].*result).data(), levels_[0].cells());
    collect_up(result);
    double sum = 0;
    for (Level &level : levels_)
        sum += add_prior(level.precision, (level.*of).data(), (level.*result).data(), level.cells());
    return sum;
}

// A step of conjugate gradients; the scalar product of the residual and the preconditioned one after it.
double Pyramid::step(float size) {
    double sum = 0;
    for (Level &level : levels_)
        sum += step_along(size, level, level.coefficients.data(), level.residual.data(),
                          level.preconditioned.data());
    return sum;
}

void Pyramid::solve(int iterations) {
    apply(&Level::coefficients, &Level::product);
    std::copy_n(right_.data(), 4 * levels_[0].cells(), levels_[0].residual.data());
    collect_up(&Level::residual);
    for (Level &level : levels_) // a step of 1 along 0 takes the product off
        std::fill_n(level.direction.data(), 4 * level.cells(), 0.0f);
    double now = step(1);
    const double first = now;
    float factor = 0;
    for (int n = 0; n < iterations && now > double(ENOUGH) * ENOUGH * first; ++n) {
        for (Level &level : levels_)
            xpay(level.preconditioned.data(), factor, level.direction.data(), 4 * level.cells());
        const double curvature = apply(&Level::direction, &Level::product);
        if (!(curvature > 0))
            break;
        const double next = step(float(now / curvature));
        factor = float(next / now);
        now = next;
    }
}

void Pyramid::run(int rounds, int iterations) {
    for (int round = 0; round < rounds; ++round) {
        // what does not fit yet is no outlier
        linearize(2 * round >= rounds);
        precondition();
        solve(iterations);
    }
    expand(&Level::coefficients);
}

void Pyramid::write(float *fields, float *deviation, float *weight) const {
    const std::size_t cells = levels_[0].cells();
    for (std::size_t cell = 0; cell < cells; ++cell) {
        const float *const x = fields_.data() + 4 * cell;
        fields[4 * cell] = std::clamp(x[0], 0.0f, 1.0f);
        for (int k = 1; k < 4; ++k)
            fields[4 * cell + k] = std::clamp(x[k], -MAX_FIELD, MAX_FIELD);
        weight[cell] = weight_[cell];
    }
    // what a window tells of T by itself, where opacity and J are even in it and may be anything, and the
    // errors of its pixels are not independent
    const int index = std::min(WINDOW, int(levels_.size()) - 1);
    const Level &window = levels_[index];
    Values variance(window.cells());
    for (std::size_t at = 0; at < window.cells(); ++at) {
        float matrix[16], inverse[16];
        for (int k = 0; k < 16; ++k)
            matrix[k] = window.system[16 * at + k] / (problem_.pixels * float(1 << 2 * index));
        for (int k = 0; k < 4; ++k)
            matrix[5 * k] += 1 / (problem_.deviations.back()[k] * problem_.deviations.back()[k]);
        invert(matrix, inverse);
        variance[at] = std::max(inverse[0], 0.0f); // rounding may make it negative
    }
    for (std::size_t cell = 0; cell < cells; ++cell) {
        const std::size_t row = (cell / problem_.columns) >> index,
                          column = (cell % problem_.columns) >> index;
        deviation[cell] = std::sqrt(variance[row * window.columns + column]);
    }
}

} // namespace

int pyramid_levels(int rows, int columns) {
    int levels = 1;
    for (; columns > 2 || rows > 2; ++levels) {
        rows = (rows + 1) / 2;
        columns = (columns + 1) / 2;
    }
    return levels;
}

void extract(const ExtractionProblem &problem, int rounds, int iterations, float *fields, float *deviation,
             float *weight) {
    Pyramid pyramid(problem);
    pyramid.run(rounds, iterations);
    pyramid.write(fields, deviation, weight);
}

} // namespace smokelift
