#include "lattice.h"

#include <cmath>

namespace smokelift {
namespace {

// The nodes beside a place in a lattice that repeats, and how much the upper one counts: without creases.
struct Between {
    int low, high;
    float weight;
};

SMOKELIFT_INLINE Between between(float place, int count) {
    const float length = float(count), inside = place - length * std::floor(place / length);
    const int node = int(inside), low = node < count ? node : 0; // rounding may reach the end
    const float part = inside - float(node);
    return {low, low + 1 < count ? low + 1 : 0, part * part * (3.0f - 2.0f * part)};
}

// Values along a row of voxels: the first lies at `start`, the others `scale` apart along z.
SMOKELIFT_CLONES
void read_row(In lattice, const std::array<float, 3> &start, float scale, const float *__restrict along_x,
              const float *__restrict along_y, const float *__restrict along_z, float stretch, int count,
              float *__restrict values) {
    const int nx = lattice.n[0], ny = lattice.n[1], nz = lattice.n[2];
    const float *const __restrict nodes = lattice.data;
    const auto [first_x, first_y, first_z] = start;
    for (int n = 0; n < count; ++n) {
        const Between x = between(first_x + stretch * along_x[n], nx),
                      y = between(first_y + stretch * along_y[n], ny),
                      z = between(first_z + float(n) * scale + stretch * along_z[n], nz);
        const auto row = [&](int i, int j) SMOKELIFT_INLINE_LAMBDA {
            const int first = (i * ny + j) * nz;
            return nodes[first + z.low] + z.weight * (nodes[first + z.high] - nodes[first + z.low]);
        };
        const float low = row(x.low, y.low), low_high = row(x.low, y.high);
        const float high = row(x.high, y.low), high_high = row(x.high, y.high);
        const float near = low + y.weight * (low_high - low), far = high + y.weight * (high_high - high);
        values[n] = near + x.weight * (far - near);
    }
}

} // namespace

void read_lattice(In lattice, const LatticePlaces &places, const MarkedVoxels &voxels, float *values,
                  Workers &workers) {
    const float *const motion = places.motion;
    const std::size_t all = voxels.count();
    workers.run(voxels.shape()[0], [&](int x) {
        voxels.in_plane(x, [&](int y, int z, int count, std::size_t at) {
            std::array<float, 3> start = places.shift;
            const int index[3] = {x, y, z};
            for (int axis = 0; axis < 3; ++axis)
                start[axis] += float(index[axis]) * places.scale;
            read_row(lattice, start, places.scale, motion + at, motion + all + at, motion + 2 * all + at,
                     places.stretch, count, values + at);
        });
    });
}

} // namespace smokelift
