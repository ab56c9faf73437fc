#include "blur.h"

#include <algorithm>
#include <cstddef>

namespace smokelift {
namespace {

// Two lines of values that have one weight.
struct Pair {
    const float *before, *after;
    double weight;
};

template <int Width>
SMOKELIFT_INLINE void sum_some(const float *middle, double weight, const std::vector<Pair> &pairs,
                               std::size_t from, float *result) {
    double sum[Width];
    for (int x = 0; x < Width; ++x)
        sum[x] = middle[from + x] * weight;
    for (const Pair &pair : pairs)
        for (int x = 0; x < Width; ++x)
            sum[x] += (double(pair.before[from + x]) + pair.after[from + x]) * pair.weight;
    for (int x = 0; x < Width; ++x)
        result[from + x] = float(sum[x]);
}

SMOKELIFT_CLONES
void sum_line(const float *middle, double weight, const std::vector<Pair> &pairs, std::size_t width,
              float *result) {
    constexpr int together = 8; // sums, in two or three registers
    std::size_t x = 0;
    for (; x + together <= width; x += together)
        sum_some<together>(middle, weight, pairs, x, result);
    if (width >= together && x < width) // some of the last ones once more
        sum_some<together>(middle, weight, pairs, width - together, result);
    else
        for (; x < width; ++x)
            sum_some<1>(middle, weight, pairs, x, result);
}

} // namespace

void blur_picture(const float *picture, const Extent &extent, const std::vector<double> &weights,
                  float *result) {
    const auto [lines, columns, channels] = extent;
    const int radius = int(weights.size()) - 1;
    const std::size_t width = std::size_t(columns) * channels, beyond = std::size_t(radius) * channels;
    std::vector<float> down(width + 2 * beyond);
    float *const inner = down.data() + beyond;
    std::vector<Pair> above(radius), beside(radius);
    for (int n = 0; n < radius; ++n) { // the farthest first
        const int away = radius - n;
        above[n].weight = beside[n].weight = weights[away];
        beside[n].before = inner - std::ptrdiff_t(away) * channels;
        beside[n].after = inner + std::ptrdiff_t(away) * channels;
    }
    for (int line = 0; line < lines; ++line, result += width) {
        for (int n = 0; n < radius; ++n) {
            above[n].before = picture + mirrored(line - radius + n, lines) * width;
            above[n].after = picture + mirrored(line + radius - n, lines) * width;
        }
        sum_line(picture + line * width, weights[0], above, width, inner);
        for (int n = 1; n <= radius; ++n) {
            std::copy_n(inner + std::size_t(mirrored(-n, columns)) * channels, channels,
                        inner - std::ptrdiff_t(n) * channels);
            const int last = columns - 1 + n;
            std::copy_n(inner + std::size_t(mirrored(last, columns)) * channels, channels,
                        inner + std::size_t(last) * channels);
        }
        sum_line(inner, weights[0], beside, width, result);
    }
}

} // namespace smokelift
