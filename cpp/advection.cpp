#include "advection.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace smokelift {
namespace {

using Point = std::array<float, 3>;

// The eight values around a point given in the index space of the array, clamped to the array, and their
// weights.
struct Corners {
    const float *base;
    std::size_t step[3];
    float t[3];

    SMOKELIFT_INLINE Corners(const In &a, const Point &x) : base(a.data) {
        const std::size_t stride[3] = {a.slab_size(), std::size_t(a.n[2]), 1};
        for (int c = 0; c < 3; ++c) {
            // in this order of the arguments NaN becomes 0
            const float clamped = std::min(std::max(0.0f, x[c]), float(a.n[c] - 1));
            const int i = int(clamped);
            t[c] = clamped - float(i);
            base += i * stride[c];
            step[c] = i + 1 < a.n[c] ? stride[c] : 0;
        }
    }

    SMOKELIFT_INLINE float value() const {
        const float *b = base + step[0];
        const auto [y, z] = std::array<std::size_t, 2>{step[1], step[2]};
        const auto mix = [](float a, float c, float w) { return a + w * (c - a); };
        const float near = mix(mix(base[0], base[z], t[2]), mix(base[y], base[y + z], t[2]), t[1]);
        const float far = mix(mix(b[0], b[z], t[2]), mix(b[y], b[y + z], t[2]), t[1]);
        return mix(near, far, t[0]);
    }

    SMOKELIFT_INLINE float limit(float v) const {
        float low = base[0], high = base[0];
        for (int c = 1; c < 8; ++c) {
            const float corner = base[(c & 1) * step[2] + (c >> 1 & 1) * step[1] + (c >> 2) * step[0]];
            low = std::min(low, corner);
            high = std::max(high, corner);
        }
        return std::min(std::max(v, low), high);
    }
};

SMOKELIFT_INLINE bool outside(const Shape &n, const Point &x) {
    // Half a cell beyond the outermost centres is the side of the box.
    bool result = false;
    for (int c = 0; c < 3; ++c)
        result = result || x[c] < -0.5f || x[c] > float(n[c]) - 0.5f;
    return result;
}

SMOKELIFT_INLINE Point minus(int i, int j, int k, const Point &u) {
    return {float(i) - u[0], float(j) - u[1], float(k) - u[2]};
}

SMOKELIFT_INLINE Point plus(int i, int j, int k, const Point &u) {
    return {float(i) + u[0], float(j) + u[1], float(k) + u[2]};
}

SMOKELIFT_INLINE Point centre_velocity(const StaggeredIn &u, int i, int j, int k) {
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

// Calls at(i, j, k, index) for every element.
template <class At> void everywhere(const Shape &n, Workers &workers, const At &at) {
    workers.run(n[0], [&](int i) {
        std::size_t index = std::size_t(i) * n[1] * n[2];
        for (int j = 0; j < n[1]; ++j)
            for (int k = 0; k < n[2]; ++k)
                at(i, j, k, index++);
    });
}

// For every row (i, j) the range outside which all values within `reach` are zero.
std::vector<Span> spans_within(In a, int reach, Workers &workers) {
    const auto [nx, ny, nz] = a.n;
    std::vector<Span> own(std::size_t(nx) * ny, Span{0, 0}), along_y = own, result = own;
    workers.run(nx, [&, ny = ny, nz = nz](int i) {
        for (int j = 0; j < ny; ++j) {
            const auto [first, end] = nonzero(a.row(i, j), nz);
            if (first < end)
                own[std::size_t(i) * ny + j] = {std::max(first - reach, 0), std::min(end + reach, nz)};
        }
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
    float farthest = 0;
    for (int c = 0; c < 3; ++c) {
        const In u = displacement[c];
        std::vector<float> slabs(std::size_t(u.n[0]));
        workers.run(u.n[0], [&](int i) {
            const float *const values = u.row(i, 0);
            float most = 0;
            for (std::size_t at = 0; at < u.slab_size(); ++at)
                most = std::max(most, std::abs(values[at]));
            slabs[i] = most;
        });
        farthest = std::max(farthest, *std::max_element(slabs.begin(), slabs.end()));
    }
    const float longest =
        float(*std::max_element(displacement.box.cells.begin(), displacement.box.cells.end()));
    return int(std::ceil(std::min(farthest, longest))) + 1;
}

// Calls at(i, j, k, index) for the elements in the spans of the rows (i, j), and clears the others of an
// array.
template <class At>
void within_spans(const std::vector<Span> &spans, const Out &cleared, Workers &workers, const At &at) {
    const auto [nx, ny, nz] = cleared.n;
    workers.run(nx, [&, ny = ny, nz = nz](int i) {
        for (int j = 0; j < ny; ++j) {
            const auto [first, end] = spans[std::size_t(i) * ny + j];
            float *const row = cleared.row(i, j);
            const std::size_t start = std::size_t(row - cleared.data);
            std::fill(row, row + first, 0.0f);
            for (int k = first; k < end; ++k)
                at(i, j, k, start + k);
            std::fill(row + std::max(first, end), row + nz, 0.0f);
        }
    });
}

// Transport of one array by `velocity(i, j, k)`; values outside the box are those of its side, or zero as
// outside the spans, where those are given.
template <class Velocity>
void maccormack(In a, const Velocity &velocity, const std::vector<Span> *spans, Out result,
                Workers &workers) {
    Field forward(a.n);
    const In hat = forward;
    const auto gone = [&](const Point &x) { return spans && outside(a.n, x); };
    const auto over = [&](const Out &filled, const auto &at) {
        if (spans)
            within_spans(*spans, filled, workers, at);
        else
            everywhere(a.n, workers, at);
    };
    over(forward, [&](int i, int j, int k, std::size_t index) {
        const Point from = minus(i, j, k, velocity(i, j, k));
        forward.data()[index] = gone(from) ? 0 : Corners(a, from).value();
    });
    over(result, [&](int i, int j, int k, std::size_t index) {
        const Point u = velocity(i, j, k), from = minus(i, j, k, u), to = plus(i, j, k, u);
        // Without the value after transport there is nothing to estimate the error from.
        const bool correct = !gone(from) && !outside(a.n, to);
        const float error = correct ? 0.5f * (a.data[index] - Corners(hat, to).value()) : 0;
        result.data[index] = correct ? Corners(a, from).limit(hat.data[index] + error) : hat.data[index];
    });
}

} // namespace

void advect_cells(In field, const StaggeredIn &displacement, bool extend, Out result, Workers &workers) {
    everywhere(field.n, workers, [&](int i, int j, int k, std::size_t index) {
        const Point from = minus(i, j, k, centre_velocity(displacement, i, j, k));
        result.data[index] = !extend && outside(field.n, from) ? 0 : Corners(field, from).value();
    });
}

void advect_cells_maccormack(In field, const StaggeredIn &displacement, Out result, Workers &workers) {
    const auto velocity = [&](int i, int j, int k) { return centre_velocity(displacement, i, j, k); };
    const std::vector<Span> spans = spans_within(field, reach_of(displacement, workers), workers);
    maccormack(field, velocity, &spans, result, workers);
}

void advect_faces(const StaggeredIn &field, const StaggeredIn &displacement, bool limited,
                  const StaggeredOut &result, Workers &workers) {
    for (int c = 0; c < 3; ++c) {
        const auto velocity = [&](int i, int j, int k) { return face_velocity(displacement, c, i, j, k); };
        if (limited) {
            maccormack(field[c], velocity, nullptr, result[c], workers);
            continue;
        }
        everywhere(field[c].n, workers, [&](int i, int j, int k, std::size_t index) {
            result[c].data[index] = Corners(field[c], minus(i, j, k, velocity(i, j, k))).value();
        });
    }
}

} // namespace smokelift
