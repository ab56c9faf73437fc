#include "ranks.h"

#include "compiler.h"

#include <algorithm>
#include <utility>

namespace smokelift {
namespace {

using Pairs = std::vector<std::pair<int, int>>;

// Places whose lines are ordered at a time: dozens of lines fit the cache.
constexpr std::size_t together = 64;

// The lines to compare, one pair after the other, so that lines are in order: Batcher's merge exchange
// (Knuth, The Art of Computer Programming 3, algorithm 5.2.2M).
Pairs merge_exchange(int lines) {
    Pairs pairs;
    int top = 1;
    while (2 * top < lines)
        top *= 2;
    for (int p = top; p > 0; p /= 2) {
        int r = 0, d = p;
        for (int q = top;; q /= 2) {
            for (int i = 0; i + d < lines; ++i)
                if ((i & p) == r)
                    pairs.emplace_back(i, i + d);
            if (q == p)
                break;
            d = q - p;
            r = p;
        }
    }
    return pairs;
}

SMOKELIFT_CLONES
void exchange(float *__restrict one, float *__restrict other) {
    for (std::size_t x = 0; x < together; ++x) {
        const float a = one[x], b = other[x];
        one[x] = b < a ? b : a;
        other[x] = b < a ? a : b;
    }
}

} // namespace

void at_ranks(const float *values, int lines, std::size_t width, const std::vector<int> &ranks,
              float *result) {
    const Pairs pairs = merge_exchange(lines);
    std::vector<float> ordered(lines * together);
    for (std::size_t start = 0; start < width; start += together) {
        const std::size_t count = std::min(together, width - start);
        for (int line = 0; line < lines; ++line)
            std::copy_n(values + line * width + start, count, &ordered[line * together]);
        for (const auto &[one, other] : pairs)
            exchange(&ordered[one * together], &ordered[other * together]);
        for (std::size_t n = 0; n < ranks.size(); ++n)
            std::copy_n(&ordered[ranks[n] * together], count, result + n * width + start);
    }
}

} // namespace smokelift
