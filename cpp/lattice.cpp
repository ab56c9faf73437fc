#include "lattice.h"

#include <cmath>

namespace smokelift {
namespace {

constexpr std::size_t READS_PER_TASK = 1 << 16;

// The nodes beside a place in a lattice that repeats, and how near the upper one is.
struct Between {
    int low, high;
    float weight;
};

SMOKELIFT_INLINE Between between(float place, int count) {
    const float length = float(count), inside = place - length * std::floor(place / length);
    const int node = int(inside), low = node < count ? node : 0; // rounding may reach the end
    return {low, low + 1 < count ? low + 1 : 0, inside - float(node)};
}

SMOKELIFT_CLONES
void read_range(In lattice, const float *__restrict places, std::size_t count, std::size_t begin,
                std::size_t end, float *__restrict values) {
    const int nx = lattice.n[0], ny = lattice.n[1], nz = lattice.n[2];
    const float *const __restrict nodes = lattice.data;
    const float *const along_x = places, *const along_y = places + count, *const along_z = along_y + count;
    for (std::size_t n = begin; n < end; ++n) {
        const Between x = between(along_x[n], nx), y = between(along_y[n], ny), z = between(along_z[n], nz);
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

void read_lattice(In lattice, const float *places, std::size_t count, float *values, Workers &workers) {
    workers.run_ranges(count, READS_PER_TASK, [&](std::size_t begin, std::size_t end) {
        read_range(lattice, places, count, begin, end, values);
    });
}

} // namespace smokelift
