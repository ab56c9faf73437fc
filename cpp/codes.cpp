#include "codes.h"

#include "compiler.h"

#include <algorithm>
#include <array>

namespace smokelift {
namespace {

using Table = std::array<float, 256>;

// The products are rounded in memory: added to at once, a compiler may leave them unrounded.
SMOKELIFT_INLINE void multiply(const float *table, float weight, Table &product) {
    for (std::size_t code = 0; code < product.size(); ++code)
        product[code] = weight * table[code];
}

SMOKELIFT_CLONES
void add_line(const unsigned char *__restrict codes, const float *__restrict values, int width,
              float *__restrict sums) {
    for (int x = 0; x < width; ++x)
        sums[x] += values[codes[x]];
}

} // namespace

void sum_lines(const CodedLines &picture, const float *table, const LineWeights &weights, float *sums) {
    Table product;
    for (int line = 0; line < weights.count; ++line, sums += picture.width) {
        std::fill_n(sums, picture.width, 0.0f);
        const int begin = weights.first[line];
        for (int n = begin; n < weights.first[line + 1]; ++n) {
            if (n == begin || weights.weights[n] != weights.weights[n - 1])
                multiply(table, weights.weights[n], product);
            add_line(picture.codes + weights.lines[n] * picture.stride, product.data(), picture.width, sums);
        }
    }
}

} // namespace smokelift
