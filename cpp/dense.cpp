#include "dense.h"

#include "grid.h"

#include <algorithm>
#include <cmath>

namespace smokelift {
namespace {

using Stride = std::ptrdiff_t; // negative: rows from the last backwards

// A vector of the compiler's own: left to itself GCC does not keep the sums in registers (20 times slower).
template <int W> struct Lanes {
    typedef float type __attribute__((vector_size(4 * W), aligned(4), may_alias));
};

// R rows by W columns of c stay in registers while k runs.
template <int R, int W>
SMOKELIFT_INLINE void tile(int k, const float *__restrict a, Stride lda, const float *__restrict b,
                           Stride ldb, float *__restrict c, Stride ldc) {
    using Vector = typename Lanes<W>::type;
    Vector sum[R] = {};
    for (int p = 0; p < k; ++p) {
        const Vector values = *reinterpret_cast<const Vector *>(b + p * ldb);
#pragma GCC unroll 8
        for (int r = 0; r < R; ++r)
            sum[r] += a[r * lda + p] * values;
    }
#pragma GCC unroll 8
    for (int r = 0; r < R; ++r)
        *reinterpret_cast<Vector *>(c + r * ldc) = sum[r];
}

template <int W>
SMOKELIFT_INLINE void stripe(int m, int k, const float *a, Stride lda, const float *b, Stride ldb, float *c,
                             Stride ldc) {
    int i = 0;
    for (; i + 8 <= m; i += 8)
        tile<8, W>(k, a + i * lda, lda, b, ldb, c + i * ldc, ldc);
    for (; i + 4 <= m; i += 4)
        tile<4, W>(k, a + i * lda, lda, b, ldb, c + i * ldc, ldc);
    for (; i < m; ++i)
        tile<1, W>(k, a + i * lda, lda, b, ldb, c + i * ldc, ldc);
}

} // namespace

SMOKELIFT_CLONES
void multiply(int m, int n, int k, const float *a, int lda, const float *b, int ldb, float *c, int ldc) {
    int j = 0;
    for (; j + 16 <= n; j += 16)
        stripe<16>(m, k, a, lda, b + j, ldb, c + j, ldc);
    for (; j + 4 <= n; j += 4)
        stripe<4>(m, k, a, lda, b + j, ldb, c + j, ldc);
    for (; j < n; ++j)
        stripe<1>(m, k, a, lda, b + j, ldb, c + j, ldc);
}

namespace {

// Splits rows into symmetric and antisymmetric parts: sums into `e`, differences into `o`.
SMOKELIFT_CLONES
void fold_rows(const float *__restrict x, int count, int length, float *__restrict e, float *__restrict o) {
    const int odd = length / 2, half = length - odd;
    for (int r = 0; r < count; ++r, x += length, e += half, o += odd) {
        for (int i = 0; i < odd; ++i) {
            e[i] = x[i] + x[length - 1 - i];
            o[i] = x[i] - x[length - 1 - i];
        }
        if (half > odd)
            e[odd] = x[odd];
    }
}

SMOKELIFT_CLONES
void unfold_rows(const float *__restrict e, const float *__restrict o, int count, int length,
                 float *__restrict x) {
    const int odd = length / 2, half = length - odd;
    for (int r = 0; r < count; ++r, x += length, e += half, o += odd) {
        for (int i = 0; i < odd; ++i)
            x[i] = e[i] + o[i];
        for (int i = 0; i < odd; ++i)
            x[length - 1 - i] = e[i] - o[i];
        if (half > odd)
            x[odd] = e[odd];
    }
}

// In place: row i becomes the sum and row length-1-i the difference of the two (and back, up to a factor of
// two).
SMOKELIFT_CLONES
void fold_columns(float *x, int count, int length) {
    for (int i = 0; i < length / 2; ++i) {
        float *__restrict low = x + std::size_t(i) * count;
        float *__restrict high = x + std::size_t(length - 1 - i) * count;
        for (int w = 0; w < count; ++w) {
            const float sum = low[w] + high[w], difference = low[w] - high[w];
            low[w] = sum;
            high[w] = difference;
        }
    }
}

} // namespace

Basis::Basis(int length, int first, const std::vector<double> &vectors)
    : length_(length), modes_(int(vectors.size()) / length), folded_(first > 0) {
    // Some modes may be zero everywhere; the others tell which symmetry comes first.
    double asymmetry = 0;
    for (int m = 0; m < first; ++m)
        for (int i = 0; i < length; ++i)
            asymmetry +=
                std::abs(vectors[std::size_t(m) * length + i] - vectors[std::size_t(m + 1) * length - 1 - i]);
    const bool even_first = asymmetry < 1e-6;
    even_.count = !folded_ ? modes_ : even_first ? first : modes_ - first;
    even_.start = folded_ && !even_first ? first : 0;
    even_.points = folded_ ? length - length / 2 : length;
    odd_.count = modes_ - even_.count;
    odd_.start = even_first ? first : 0;
    odd_.points = length - even_.points;
    for (Block *block : {&even_, &odd_}) {
        block->analysis.resize(std::size_t(block->count) * block->points);
        block->synthesis.resize(block->analysis.size());
        for (int m = 0; m < block->count; ++m)
            for (int i = 0; i < block->points; ++i) {
                const float value = float(vectors[std::size_t(block->start + m) * length + i]);
                block->analysis[std::size_t(m) * block->points + i] = value;
                block->synthesis[std::size_t(i) * block->count + m] = value;
            }
    }
}

void Basis::rows_to_modes(const float *points, int count, float *modes, std::vector<float> &scratch) const {
    scratch.resize(std::size_t(count) * length_);
    float *e = scratch.data(), *o = e + std::size_t(count) * even_.points;
    if (folded_)
        fold_rows(points, count, length_, e, o);
    else
        std::copy_n(points, scratch.size(), e);
    multiply(count, even_.count, even_.points, e, even_.points, even_.synthesis.data(), even_.count,
             modes + even_.start, modes_);
    multiply(count, odd_.count, odd_.points, o, odd_.points, odd_.synthesis.data(), odd_.count,
             modes + odd_.start, modes_);
}

void Basis::rows_from_modes(const float *modes, int count, float *points, std::vector<float> &scratch) const {
    scratch.resize(std::size_t(count) * length_);
    float *e = scratch.data(), *o = e + std::size_t(count) * even_.points;
    multiply(count, even_.points, even_.count, modes + even_.start, modes_, even_.analysis.data(),
             even_.points, e, even_.points);
    multiply(count, odd_.points, odd_.count, modes + odd_.start, modes_, odd_.analysis.data(), odd_.points, o,
             odd_.points);
    if (folded_)
        unfold_rows(e, o, count, length_, points);
    else
        std::copy_n(e, scratch.size(), points);
}

void Basis::columns_to_modes(const float *points, int stride, int count, float *modes, int modes_stride,
                             std::vector<float> &scratch) const {
    scratch.resize(std::size_t(count) * length_);
    float *x = scratch.data();
    for (int i = 0; i < length_; ++i)
        std::copy_n(points + std::size_t(i) * stride, count, x + std::size_t(i) * count);
    if (folded_)
        fold_columns(x, count, length_);
    // The differences lie from the last row backwards.
    multiply(even_.count, count, even_.points, even_.analysis.data(), even_.points, x, count,
             modes + std::size_t(even_.start) * modes_stride, modes_stride);
    multiply(odd_.count, count, odd_.points, odd_.analysis.data(), odd_.points,
             x + std::size_t(length_ - 1) * count, -count, modes + std::size_t(odd_.start) * modes_stride,
             modes_stride);
}

void Basis::columns_from_modes(const float *modes, int modes_stride, int count, float *points, int stride,
                               std::vector<float> &scratch) const {
    scratch.resize(std::size_t(count) * length_);
    float *x = scratch.data();
    multiply(even_.points, count, even_.count, even_.synthesis.data(), even_.count,
             modes + std::size_t(even_.start) * modes_stride, modes_stride, x, count);
    multiply(odd_.points, count, odd_.count, odd_.synthesis.data(), odd_.count,
             modes + std::size_t(odd_.start) * modes_stride, modes_stride,
             x + std::size_t(length_ - 1) * count, -count);
    if (folded_)
        fold_columns(x, count, length_);
    for (int i = 0; i < length_; ++i)
        std::copy_n(x + std::size_t(i) * count, count, points + std::size_t(i) * stride);
}

} // namespace smokelift
