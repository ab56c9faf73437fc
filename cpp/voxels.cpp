#include "voxels.h"

#include <algorithm>
#include <utility>

namespace smokelift {
namespace {

// Ranges of a table of rows, each joined with its eight neighbors' and made one longer at both ends.
std::vector<Span> around(const std::vector<Span> &rows, int count_a, int count_b, int length) {
    std::vector<Span> result(rows.size());
    for (int a = 0; a < count_a; ++a) {
        for (int b = 0; b < count_b; ++b) {
            Span span{0, 0};
            for (int i = std::max(a - 1, 0); i <= std::min(a + 1, count_a - 1); ++i)
                for (int j = std::max(b - 1, 0); j <= std::min(b + 1, count_b - 1); ++j)
                    span = joined(span, rows[std::size_t(i) * count_b + j]);
            if (span[0] < span[1])
                span = {std::max(span[0] - 1, 0), std::min(span[1] + 1, length)};
            result[std::size_t(a) * count_b + b] = span;
        }
    }
    return result;
}

} // namespace

Spans spans_around(const unsigned char *marked, const Shape &n) {
    std::vector<Span> along_z(std::size_t(n[0]) * n[1], Span{0, 0}),
        along_y(std::size_t(n[0]) * n[2], Span{0, 0});
    for (int x = 0; x < n[0]; ++x) {
        for (int y = 0; y < n[1]; ++y) {
            const unsigned char *row = marked + (std::size_t(x) * n[1] + y) * n[2];
            Span &z_span = along_z[std::size_t(x) * n[1] + y];
            for (int z = 0; z < n[2]; ++z) {
                if (row[z]) {
                    z_span = joined(z_span, {z, z + 1});
                    Span &y_span = along_y[std::size_t(x) * n[2] + z];
                    y_span = joined(y_span, {y, y + 1});
                }
            }
        }
    }
    return {around(along_z, n[0], n[1], n[2]), around(along_y, n[0], n[2], n[1]), n};
}

void pack(const Part<const float> &density, const unsigned char *marked, float extinction, const Spans &spans,
          const Voxels &medium, Workers &workers) {
    const Shape &n = medium.n;
    workers.run(n[0], [&](int x) {
        for (int y = 0; y < n[1]; ++y) {
            const Span &span = spans.along_z[std::size_t(x) * n[1] + y];
            const float *in = density.row(x, y);
            const unsigned char *mark = marked + (std::size_t(x) * n[1] + y) * n[2];
            float *out = medium.at(x, y, 0);
            for (int z = span[0]; z < span[1]; ++z)
                out[z * medium.width] = mark[z] ? extinction * in[z * density.stride[2]] : 0;
        }
    });
}

void unpack(const Voxels &gradient, const unsigned char *marked, float extinction, const Part<float> &result,
            Workers &workers) {
    const Shape &n = gradient.n;
    workers.run(n[0], [&](int x) {
        for (int y = 0; y < n[1]; ++y) {
            const unsigned char *mark = marked + (std::size_t(x) * n[1] + y) * n[2];
            const float *in = gradient.at(x, y, 0);
            float *out = result.row(x, y);
            for (int z = 0; z < n[2]; ++z)
                if (mark[z])
                    out[z * result.stride[2]] = extinction * in[z * gradient.width];
        }
    });
}

void clear(const Voxels &voxels, Workers &workers) {
    const std::size_t slab = voxels.stride(0);
    workers.run(voxels.n[0] + 2, [&](int x) { std::fill_n(voxels.data + x * slab, slab, 0.0f); });
}

namespace {

// work(border, nearest) for the voxels of the border on both sides of an axis; indices along the axes before
// it stay inside the grid, those after it include the border.
template <class Work> void over_border(const Voxels &voxels, int axis, const Work &work) {
    const int a = LATERAL[axis][0], b = LATERAL[axis][1];
    const int low_a = a < axis ? 0 : -1, low_b = b < axis ? 0 : -1;
    for (int side = 0; side < 2; ++side) {
        const int nearest = side ? voxels.n[axis] - 1 : 0;
        const Stride outwards = side ? voxels.stride(axis) : -voxels.stride(axis);
        for (int i = low_a; i < voxels.n[a] - low_a; ++i) {
            for (int j = low_b; j < voxels.n[b] - low_b; ++j) {
                float *inner = voxels.at(axis, nearest, i, j);
                work(inner + outwards, inner);
            }
        }
    }
}

} // namespace

void extend_into_border(const Voxels &medium) {
    for (int axis = 2; axis >= 0; --axis)
        over_border(medium, axis, [&](float *border, const float *nearest) {
            std::copy(nearest + 1, nearest + medium.width, border + 1);
        });
}

void fold_border(const Voxels &gradient) {
    for (int axis = 0; axis < 3; ++axis)
        over_border(gradient, axis, [&](float *border, float *nearest) {
            for (int channel = 1; channel < gradient.width; ++channel)
                nearest[channel] += std::exchange(border[channel], 0.0f);
        });
}

} // namespace smokelift
