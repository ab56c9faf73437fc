#include "lattice.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace smokelift {
namespace {

constexpr std::size_t READS_PER_TASK = 1 << 16;

// The nodes beside a place, and what each counts.
struct Between {
    int low, high;
    double weight_low, weight_high;
};

SMOKELIFT_INLINE Between between(double place, int count) {
    // in single turns and halves of them, as SciPy's mode "grid-wrap"
    if (place < 0)
        place += count * (double(std::int64_t(-place / count)) + 1);
    else if (place > count - 1)
        place -= count * double(std::int64_t(place / count));
    const double low = std::floor(place), weight = 1 - (place - low);
    const int node = int(low) < count ? int(low) : 0;
    return {node, node + 1 < count ? node + 1 : 0, weight, 1 - weight};
}

SMOKELIFT_CLONES
void read_range(In lattice, const float *places, std::size_t count, std::size_t begin, std::size_t end,
                float *values) {
    const auto [nx, ny, nz] = lattice.n;
    for (std::size_t n = begin; n < end; ++n) {
        const Between x = between(places[n], nx), y = between(places[count + n], ny),
                      z = between(places[2 * count + n], nz);
        double sum = 0;
        for (int i = 0; i < 2; ++i) {
            for (int j = 0; j < 2; ++j) {
                const float *row = lattice.row(i ? x.high : x.low, j ? y.high : y.low);
                const double across = i ? x.weight_high : x.weight_low,
                             along = j ? y.weight_high : y.weight_low;
                sum += row[z.low] * across * along * z.weight_low;
                sum += row[z.high] * across * along * z.weight_high;
            }
        }
        values[n] = float(sum);
    }
}

} // namespace

void read_lattice(In lattice, const float *places, std::size_t count, float *values, Workers &workers) {
    workers.run_ranges(count, READS_PER_TASK, [&](std::size_t begin, std::size_t end) {
        read_range(lattice, places, count, begin, end, values);
    });
}

} // namespace smokelift
