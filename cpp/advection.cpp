#include "advection.h"

#include "vectors.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace smokelift {
namespace {

using Point = std::array<float, 3>;

SMOKELIFT_INLINE Point center_velocity(const StaggeredIn &u, int i, int j, int k) {
    const float *z = u[2].row(i, j) + k;
    return {0.5f * (u[0].row(i, j)[k] + u[0].row(i + 1, j)[k]),
            0.5f * (u[1].row(i, j)[k] + u[1].row(i, j + 1)[k]), 0.5f * (z[0] + z[1])};
}

// The velocity where component c lives; the others are the mean of the four faces around.
SMOKELIFT_INLINE Point face_velocity(const StaggeredIn &u, int c, int i, int j, int k) {
    const int at[3] = {i, j, k};
    Point result;
    for (int d = 0; d < 3; ++d) {
        if (d == c) {
            result[d] = u[d].row(i, j)[k];
            continue;
        }
        float sum = 0;
        for (int side = 0; side < 2; ++side)
            for (int end = 0; end < 2; ++end) {
                Shape q{at[0], at[1], at[2]};
                q[c] = std::min(std::max(at[c] - 1 + side, 0), u[d].n[c] - 1);
                q[d] = at[d] + end;
                sum += u[d].row(q[0], q[1])[q[2]];
            }
        result[d] = 0.25f * sum;
    }
    return result;
}

// The eight values around a point, as places relative to a row of the array, and how near the upper ones are.
struct Corners {
    int low, x, y, z;
    float f, g, h;
};

// Of a point (index space), clamped to the array, beside row (i, j).
SMOKELIFT_INLINE Corners corners(const Shape &n, int i, int j, float x, float y, float z) {
    // in this order of the arguments NaN becomes 0
    x = std::min(std::max(0.0f, x), float(n[0] - 1));
    y = std::min(std::max(0.0f, y), float(n[1] - 1));
    z = std::min(std::max(0.0f, z), float(n[2] - 1));
    const int a = int(x), b = int(y), c = int(z), slab = n[1] * n[2];
    return {(a - i) * slab + (b - j) * n[2] + c,
            a + 1 < n[0] ? slab : 0,
            b + 1 < n[1] ? n[2] : 0,
            c + 1 < n[2] ? 1 : 0,
            x - float(a),
            y - float(b),
            z - float(c)};
}

SMOKELIFT_INLINE float mixed(const float *row, const Corners &at) {
    const auto mix = [](float a, float b, float fraction)
                         SMOKELIFT_INLINE_LAMBDA { return a + fraction * (b - a); };
    const auto along_z = [&](int first)
                             SMOKELIFT_INLINE_LAMBDA { return mix(row[first], row[first + at.z], at.h); };
    const int high = at.low + at.x;
    const float near = mix(along_z(at.low), along_z(at.low + at.y), at.g);
    const float far = mix(along_z(high), along_z(high + at.y), at.g);
    return mix(near, far, at.f);
}

// A value no lower and no higher than all of the corners.
SMOKELIFT_INLINE float limited(const float *row, const Corners &at, float value) {
    float low = row[at.low], high = low;
    for (int corner = 1; corner < 8; ++corner) {
        const float other =
            row[at.low + (corner & 1) * at.z + (corner >> 1 & 1) * at.y + (corner >> 2) * at.x];
        low = std::min(low, other);
        high = std::max(high, other);
    }
    return std::min(std::max(value, low), high);
}

// 0 beyond the sides of the box, half a cell from the outermost centers; else 1. A condition in its place
// would keep loops from vector code.
SMOKELIFT_INLINE float inside(const Shape &n, float x, float y, float z) {
    return float((x >= -0.5f) & (x <= float(n[0]) - 0.5f) & (y >= -0.5f) & (y <= float(n[1]) - 0.5f) &
                 (z >= -0.5f) & (z <= float(n[2]) - 0.5f));
}

// The way, in cells, that each element of a row goes in a step.
struct Way {
    explicit Way(int n) : x(n), y(n), z(n) {}
    std::vector<float> x, y, z;
};

// A row after a step: what was where the step began, or 0 if it comes from outside and nothing is there.
SMOKELIFT_CLONES
void carry_row(const In &from, const Way &way, bool extend, int i, int j, Span span,
               float *__restrict result) {
    const Shape n = from.n;
    const float *const __restrict row = from.row(i, j);
    const float *const x = way.x.data(), *const y = way.y.data(), *const z = way.z.data();
    const int end = span[1];
    for (int k = span[0]; k < end; ++k) {
        const float a = float(i) - x[k], b = float(j) - y[k], c = float(k) - z[k];
        const float kept = std::max(float(extend), inside(n, a, b, c));
        result[k] = kept * mixed(row, corners(n, i, j, a, b, c));
    }
}

// The row that carry_row made (in `once`), corrected by what a step back makes of it, within the values that
// it came from. What leaves the box, or came from outside, has no error that could be estimated.
SMOKELIFT_CLONES
void correct_row(const In &from, const In &once, const Way &way, bool extend, int i, int j, Span span,
                 float *__restrict result) {
    const Shape n = from.n;
    const float *const __restrict row = from.row(i, j);
    const float *const __restrict carried = once.row(i, j);
    const float *const x = way.x.data(), *const y = way.y.data(), *const z = way.z.data();
    const int end = span[1];
    for (int k = span[0]; k < end; ++k) {
        const float a = float(i) - x[k], b = float(j) - y[k], c = float(k) - z[k];
        const float to_a = float(i) + x[k], to_b = float(j) + y[k], to_c = float(k) + z[k];
        const float known = inside(n, to_a, to_b, to_c) * std::max(float(extend), inside(n, a, b, c));
        const float error = 0.5f * (row[k] - mixed(carried, corners(n, i, j, to_a, to_b, to_c)));
        const float better = limited(row, corners(n, i, j, a, b, c), carried[k] + error);
        result[k] = carried[k] + known * (better - carried[k]);
    }
}

// For every row (i, j) the range outside which all values within `reach` are zero.
std::vector<Span> spans_within(In a, int reach, Workers &workers) {
    const auto [nx, ny, nz] = a.n;
    std::vector<Span> own(std::size_t(nx) * ny, Span{0, 0}), along_y = own, result = own;
    find_filled(a, own.data(), workers);
    for (Span &span : own)
        if (span[0] < span[1])
            span = {std::max(span[0] - reach, 0), std::min(span[1] + reach, nz)};
    workers.run(nx, [&, ny = ny](int i) {
        for (int j = 0; j < ny; ++j)
            for (int other = std::max(j - reach, 0); other < std::min(j + reach + 1, ny); ++other)
                along_y[std::size_t(i) * ny + j] =
                    joined(along_y[std::size_t(i) * ny + j], own[std::size_t(i) * ny + other]);
    });
    workers.run(nx, [&, nx = nx, ny = ny](int i) {
        for (int other = std::max(i - reach, 0); other < std::min(i + reach + 1, nx); ++other)
            for (int j = 0; j < ny; ++j)
                result[std::size_t(i) * ny + j] =
                    joined(result[std::size_t(i) * ny + j], along_y[std::size_t(other) * ny + j]);
    });
    return result;
}

// Voxels around one that its value after a step can come from.
int reach_of(const StaggeredIn &displacement, Workers &workers) {
    const float longest =
        float(*std::max_element(displacement.box.cells.begin(), displacement.box.cells.end()));
    return int(std::ceil(std::min(longest, largest_size(displacement, workers)))) +
           1; // NaN counts as the longest
}

// Calls at(i, j, span, way) for every row, with the part of it where there can be something and the ways
// there; clears the rest of it in an array.
template <class Velocity, class At>
void each_row(const std::vector<Span> &spans, const Velocity &velocity, const Out &cleared, Workers &workers,
              const At &at) {
    const auto [nx, ny, nz] = cleared.n;
    workers.run(nx, [&, ny = ny, nz = nz](int i) {
        Way way(nz);
        for (int j = 0; j < ny; ++j) {
            const Span &span = spans[std::size_t(i) * ny + j];
            for (int k = span[0]; k < span[1]; ++k) {
                const Point u = velocity(i, j, k);
                way.x[k] = u[0], way.y[k] = u[1], way.z[k] = u[2];
            }
            float *const row = cleared.row(i, j);
            std::fill(row, row + span[0], 0.0f);
            at(i, j, span, way);
            std::fill(row + std::max(span[0], span[1]), row + nz, 0.0f);
        }
    });
}

// Transport of one array by `velocity(i, j, k)`, corrected (MacCormack) or not, within the spans.
template <class Velocity>
void advect(In a, const Velocity &velocity, const std::vector<Span> &spans, bool extend, bool corrected,
            Out result, Workers &workers) {
    Field forward(corrected ? a.n : Shape{});
    const Out once = corrected ? forward.out() : result;
    each_row(spans, velocity, once, workers, [&](int i, int j, const Span &span, const Way &way) {
        carry_row(a, way, extend, i, j, span, once.row(i, j));
    });
    if (corrected)
        each_row(spans, velocity, result, workers, [&](int i, int j, const Span &span, const Way &way) {
            correct_row(a, once, way, extend, i, j, span, result.row(i, j));
        });
}

} // namespace

void advect_cells(In field, const StaggeredIn &displacement, bool extend, bool corrected, Out result,
                  Workers &workers) {
    const auto velocity = [&](int i, int j, int k) { return center_velocity(displacement, i, j, k); };
    const std::vector<Span> spans = spans_within(field, reach_of(displacement, workers), workers);
    advect(field, velocity, spans, extend, corrected, result, workers);
}

void advect_faces(const StaggeredIn &field, const StaggeredIn &displacement, bool corrected,
                  const StaggeredOut &result, Workers &workers) {
    for (int c = 0; c < 3; ++c) {
        const auto velocity = [&](int i, int j, int k) { return face_velocity(displacement, c, i, j, k); };
        const auto [nx, ny, nz] = field[c].n;
        const std::vector<Span> everywhere(std::size_t(nx) * ny, Span{0, nz});
        advect(field[c], velocity, everywhere, true, corrected, result[c], workers);
    }
}

} // namespace smokelift
