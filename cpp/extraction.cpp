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

#include <algorithm>
#include <cmath>
#include <cstring>

namespace smokelift {
namespace {

typedef float Four __attribute__((vector_size(16), aligned(4), may_alias));

constexpr float R2 = 1.22474487f, R6 = 0.70710678f; // sqrt(3 / 2), sqrt(3 / 6)
constexpr float BASIS[3][2] = {{R2, R6}, {0, -2 * R6}, {-R2, R6}};
constexpr float MIN_OPACITY = 0.03f; // at which J is linearised, so that J can move where no smoke is yet
constexpr float BRIGHTEST = 2;       // largest g
constexpr float MAX_FIELD = 3;       // bound of the fields of J where they are linearised
constexpr float ENOUGH = 1e-3f;      // residual, as a share of the first, where a solve ends
constexpr int WINDOW = 2;            // level whose cells tell how certain T is: four cells wide
constexpr float SPREAD = 0.4f; // of the sum over a coefficient's cells, the energy of its bilinear weights

Four load(const float *p) { return *reinterpret_cast<const Four *>(p); }
void store(float *p, Four x) { *reinterpret_cast<Four *>(p) = x; }

struct Level {
    int rows, columns;
    Values coefficients, residual, direction, product, preconditioned;
    Values precision; // of the prior, for each coefficient
    Values system;    // the cells' 4 x 4 matrices, added up
    Values inverse;   // of system and precision
    std::size_t cells() const { return std::size_t(rows) * columns; }
};

// Bilinear: a fine cell has 3/4 of the coarse cell that it lies in and 1/4 of the next one on its side.
struct Mix {
    int near, next;
};
Mix mix(int fine, int coarse_count) {
    const int near = fine / 2;
    return {near, std::clamp(near + (fine % 2 ? 1 : -1), 0, coarse_count - 1)};
}

// fine += coarse, interpolated.
SMOKELIFT_CLONES
void add_expanded(const float *coarse, int coarse_rows, int coarse_columns, float *fine, int rows,
                  int columns, float *line) {
    for (int row = 0; row < rows; ++row) {
        const auto [near, next] = mix(row, coarse_rows);
        const float *const a = coarse + std::size_t(near) * coarse_columns * 4;
        const float *const b = coarse + std::size_t(next) * coarse_columns * 4;
        for (int n = 0; n < 4 * coarse_columns; ++n)
            line[n] = 0.75f * a[n] + 0.25f * b[n];
        float *const out = fine + std::size_t(row) * columns * 4;
        for (int column = 0; column < columns; ++column) {
            const auto [left, right] = mix(column, coarse_columns);
            store(out + 4 * column,
                  load(out + 4 * column) + 0.75f * load(line + 4 * left) + 0.25f * load(line + 4 * right));
        }
    }
}

// coarse = the adjoint of add_expanded, of fine.
SMOKELIFT_CLONES
void collect(const float *fine, int rows, int columns, float *coarse, int coarse_rows, int coarse_columns,
             float *line) {
    std::fill_n(coarse, std::size_t(coarse_rows) * coarse_columns * 4, 0.0f);
    for (int row = 0; row < rows; ++row) {
        std::fill_n(line, 4 * coarse_columns, 0.0f);
        const float *const in = fine + std::size_t(row) * columns * 4;
        for (int column = 0; column < columns; ++column) {
            const auto [left, right] = mix(column, coarse_columns);
            const Four value = load(in + 4 * column);
            store(line + 4 * left, load(line + 4 * left) + 0.75f * value);
            store(line + 4 * right, load(line + 4 * right) + 0.25f * value);
        }
        const auto [near, next] = mix(row, coarse_rows);
        float *const a = coarse + std::size_t(near) * coarse_columns * 4;
        float *const b = coarse + std::size_t(next) * coarse_columns * 4;
        for (int n = 0; n < 4 * coarse_columns; ++n)
            a[n] += 0.75f * line[n];
        for (int n = 0; n < 4 * coarse_columns; ++n)
            b[n] += 0.25f * line[n];
    }
}

SMOKELIFT_INLINE Four times(const float *matrix, Four x) {
    return load(matrix) * x[0] + load(matrix + 4) * x[1] + load(matrix + 8) * x[2] + load(matrix + 12) * x[3];
}

// The inverse of a symmetric positive definite matrix of four rows, by elimination.
void invert(const float *matrix, float *inverse) {
    double m[4][8] = {};
    for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 4; ++j)
            m[i][j] = matrix[4 * i + j];
        m[i][4 + i] = 1;
    }
    for (int i = 0; i < 4; ++i) {
        const double scale = 1 / m[i][i];
        for (int j = 0; j < 8; ++j)
            m[i][j] *= scale;
        for (int k = 0; k < 4; ++k) {
            if (k == i)
                continue;
            const double factor = m[k][i];
            for (int j = 0; j < 8; ++j)
                m[k][j] -= factor * m[i][j];
        }
    }
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            inverse[4 * i + j] = float(m[i][4 + j]);
}

constexpr int UPPER[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}; // of the upper triangle of a symmetric matrix

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
    void linearise(bool robust);
    void precondition();
    void apply(Values Level::*of, Values Level::*result);
    void solve(int iterations);
    double scalar(Values Level::*a, Values Level::*b) const;
    void add(float factor, Values Level::*from, Values Level::*to);

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
                                    &Level::product, &Level::preconditioned, &Level::precision}) {
            level.*each = Values(values);
            std::fill_n((level.*each).data(), values, 0.0f);
        }
        level.system = Values(4 * values);
        level.inverse = Values(4 * values);
        const auto &deviation = problem.deviations[n];
        for (std::size_t at = 0; at < values; ++at)
            level.precision[at] = 1 / (deviation[at % 4] * deviation[at % 4]);
        levels_.push_back(std::move(level));
        rows = (rows + 1) / 2;
        columns = (columns + 1) / 2;
    }
    // the likeliest opacity is that of neither clear air nor solid smoke, so that both are found
    for (std::size_t cell = 0; cell < levels_.back().cells(); ++cell)
        levels_.back().coefficients[4 * cell] = 0.2f;
    fields_ = Values(4 * levels_[0].cells());
    right_ = Values(4 * levels_[0].cells());
    line_ = Values(4 * std::size_t(problem.columns));
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
        std::copy_n((level.*of).data(), 4 * level.cells(), sum);
        add_expanded(coarse, levels_[n + 1].rows, levels_[n + 1].columns, sum, level.rows, level.columns,
                     line_.data());
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

void Pyramid::linearise(bool robust) {
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
                matrix[5 * k] += level.precision[4 * cell + k];
            invert(matrix, level.inverse.data() + 16 * cell);
        }
    }
}

// result = (prior + collect system expand) of
SMOKELIFT_CLONES
static void apply_system(const float *system, const float *x, float *y, std::size_t cells) {
    for (std::size_t cell = 0; cell < cells; ++cell)
        store(y + 4 * cell, times(system + 16 * cell, load(x + 4 * cell)));
}

void Pyramid::apply(Values Level::*of, Values Level::*result) {
    expand(of);
    apply_system(levels_[0].system.data(), fields_.data(), (levels_[0].*result).data(), levels_[0].cells());
    collect_up(result);
    for (Level &level : levels_) {
        const float *const precision = level.precision.data(), *const x = (level.*of).data();
        float *const y = (level.*result).data();
        for (std::size_t at = 0; at < 4 * level.cells(); ++at)
            y[at] += precision[at] * x[at];
    }
}

double Pyramid::scalar(Values Level::*a, Values Level::*b) const {
    double sum = 0;
    for (const Level &level : levels_) {
        const float *const x = (level.*a).data(), *const y = (level.*b).data();
        double part[4] = {};
        for (std::size_t at = 0; at < 4 * level.cells(); at += 4)
            for (int k = 0; k < 4; ++k)
                part[k] += double(x[at + k]) * y[at + k];
        sum += (part[0] + part[1]) + (part[2] + part[3]);
    }
    return sum;
}

void Pyramid::add(float factor, Values Level::*from, Values Level::*to) {
    for (Level &level : levels_) {
        const float *const x = (level.*from).data();
        float *const y = (level.*to).data();
        for (std::size_t at = 0; at < 4 * level.cells(); ++at)
            y[at] += factor * x[at];
    }
}

void Pyramid::solve(int iterations) {
    const auto condition = [&] {
        for (Level &level : levels_)
            apply_system(level.inverse.data(), level.residual.data(), level.preconditioned.data(),
                         level.cells());
    };
    apply(&Level::coefficients, &Level::residual);
    std::copy_n(right_.data(), 4 * levels_[0].cells(), levels_[0].preconditioned.data());
    collect_up(&Level::preconditioned);
    for (Level &level : levels_)
        for (std::size_t at = 0; at < 4 * level.cells(); ++at)
            level.residual[at] = level.preconditioned[at] - level.residual[at];
    condition();
    for (Level &level : levels_)
        std::copy_n(level.preconditioned.data(), 4 * level.cells(), level.direction.data());
    double now = scalar(&Level::residual, &Level::preconditioned);
    const double first = now;
    for (int n = 0; n < iterations && now > double(ENOUGH) * ENOUGH * first; ++n) {
        apply(&Level::direction, &Level::product);
        const double curvature = scalar(&Level::direction, &Level::product);
        if (!(curvature > 0))
            break;
        const float step = float(now / curvature);
        add(step, &Level::direction, &Level::coefficients);
        add(-step, &Level::product, &Level::residual);
        condition();
        const double next = scalar(&Level::residual, &Level::preconditioned);
        const float factor = float(next / now);
        for (Level &level : levels_)
            for (std::size_t at = 0; at < 4 * level.cells(); ++at)
                level.direction[at] = level.preconditioned[at] + factor * level.direction[at];
        now = next;
    }
}

void Pyramid::run(int rounds, int iterations) {
    for (int round = 0; round < rounds; ++round) {
        // what does not fit yet is no outlier
        linearise(2 * round >= rounds);
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
        variance[at] = inverse[0];
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
