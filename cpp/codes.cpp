#include "codes.h"

#include "compiler.h"

#include <algorithm>
#include <array>
#include <vector>

namespace smokelift {
namespace {

using Table = std::array<float, 256>;

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

// `Fixed` channels are those that there are, or 0 where that is not known before.
template <int Fixed>
void sum_columns_of(const float *__restrict values, const Extent &picture, const LineWeights &weights,
                    float *__restrict sums) {
    const int channels = Fixed ? Fixed : picture.channels;
    const std::ptrdiff_t width = std::ptrdiff_t(picture.columns) * channels;
    for (int line = 0; line < picture.lines; ++line, values += width) {
        for (int column = 0; column < weights.count; ++column, sums += channels) {
            std::fill_n(sums, channels, 0.0f);
            for (int n = weights.first[column]; n < weights.first[column + 1]; ++n) {
                const float *__restrict added = values + std::ptrdiff_t(weights.lines[n]) * channels;
                for (int c = 0; c < channels; ++c)
                    sums[c] += weights.weights[n] * added[c];
            }
        }
    }
}

SMOKELIFT_CLONES
void add_weighted_line(const unsigned char *__restrict codes, const float *__restrict table,
                       const float *__restrict weights, int width, float *__restrict sums) {
    for (int x = 0; x < width; ++x)
        sums[x] += table[codes[x]] * weights[x];
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

void sum_columns(const float *values, const Extent &picture, const LineWeights &weights, float *sums) {
    const auto sum = picture.channels == 3   ? sum_columns_of<3>
                     : picture.channels == 1 ? sum_columns_of<1>
                                             : sum_columns_of<0>;
    sum(values, picture, weights, sums);
}

void add_weighted(const CodedLines &picture, const float *table, const PartWeights &weights, float *sums) {
    std::vector<float> across(picture.width);
    for (int row = 0; row < weights.rows; ++row) {
        const float *weight = weights.weights + std::ptrdiff_t(row) * weights.columns * 3;
        for (int column = 0; column < weights.columns; ++column, weight += 3)
            for (int x = weights.first_column[column]; x < weights.first_column[column + 1]; ++x)
                std::copy_n(weight, 3, &across[3 * std::size_t(x)]);
        for (int line = weights.first_line[row]; line < weights.first_line[row + 1]; ++line)
            add_weighted_line(picture.codes + line * picture.stride, table, across.data(), picture.width,
                              sums + std::ptrdiff_t(line) * picture.width);
    }
}

} // namespace smokelift
