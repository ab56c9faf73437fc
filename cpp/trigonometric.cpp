#include "trigonometric.h"

#include "compiler.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace smokelift {
namespace {

using Stride = std::ptrdiff_t; // negative: rows from the last backwards

// A vector of the compiler's own: left to itself GCC does not keep the sums in registers (20 times slower).
template <int W> struct VectorOf {
    typedef float type __attribute__((vector_size(4 * W), aligned(4), may_alias));
};

// c = a b for R rows of a (R, k) and W columns of b (k, W); the rows of c stay in registers while k runs.
template <int R, int W>
SMOKELIFT_INLINE void tile(int k, const float *__restrict a, Stride lda, const float *__restrict b,
                           Stride ldb, float *__restrict c, Stride ldc) {
    using Vector = typename VectorOf<W>::type;
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

// The same for m rows.
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

constexpr int width = 16; // lines that are transformed at once, side by side
constexpr int dense = 32; // transforms up to this size are not split further

using Vector = VectorOf<width>::type;

int points_of(Transform transform, int n) {
    return transform == Transform::dct1 ? n + 1 : transform == Transform::dst1 ? n - 1 : n;
}

bool is_cosine(Transform transform) { return int(transform) % 2 == 0; }
bool on_centers(Transform transform) { return int(transform) / 2 % 2 == 1; }      // II and IV
bool has_half_modes(Transform transform) { return transform >= Transform::dct3; } // III and IV

// The first point with values: sines on faces are zero at the start.
int first_point(Transform transform) { return !is_cosine(transform) && !on_centers(transform); }

double value(Transform transform, int n, int mode, int point) {
    const double phase = (mode + (has_half_modes(transform) ? 0.5 : 0)) * std::acos(-1.0) / n *
                         (point + (on_centers(transform) ? 0.5 : first_point(transform)));
    return is_cosine(transform) ? std::cos(phase) : std::sin(phase);
}

std::vector<int> count_up(int count) {
    std::vector<int> result;
    for (int m = 0; m < count; ++m)
        result.push_back(m);
    return result;
}

} // namespace

LineTransform::LineTransform(Transform transform, int n, int first, int count) : modes_(count) {
    const bool faces = !on_centers(transform);
    length_ = n + faces;
    std::vector<int> modes;
    for (int m = first; m < first + count; ++m)
        modes.push_back(m);
    const int start = first_point(transform), points = points_of(transform, n);
    rows_ = split(transform, n, modes, start, 1);
    for (int i = 0; i < length_; ++i)
        if (i < start || i >= start + points)
            idle_.push_back(i);
    norms_.resize(count);
    for (int m = 0; m < count; ++m) {
        double norm = 0;
        for (int i = 0; i < points; ++i) {
            const double x = value(transform, n, modes[m], i);
            const bool half = faces && (start + i == 0 || start + i == n);
            norm += (half ? 0.5 : 1) * x * x;
        }
        // A mode that is zero on these points comes out as rounding error.
        norms_[rows_[m]] = norm > 1e-6 ? float(1 / std::sqrt(norm)) : 0;
    }
}

// Plans a transform of points start, start + stride, ...; says in which row each of its modes will be.
std::vector<int> LineTransform::split(Transform transform, int n, const std::vector<int> &modes, int start,
                                      int stride) {
    if (n <= dense || n % 2)
        return leave_dense(transform, n, modes, start, stride);
    return has_half_modes(transform) ? split_pairs(transform, n, start, stride)
                                     : split_parities(transform, n, modes, start, stride);
}

std::vector<int> LineTransform::leave_dense(Transform transform, int n, const std::vector<int> &modes,
                                            int start, int stride) {
    std::vector<int> rows(modes.size());
    Leaf leaf;
    leaf.start = start;
    leaf.stride = stride;
    leaf.points = points_of(transform, n);
    leaf.count = int(modes.size());
    leaf.first = leaves_.empty() ? 0 : leaves_.back().first + leaves_.back().count;
    leaf.analysis.resize(std::size_t(leaf.count) * leaf.points);
    leaf.synthesis.resize(leaf.analysis.size());
    for (int m = 0; m < leaf.count; ++m) {
        rows[m] = leaf.first + m;
        for (int i = 0; i < leaf.points; ++i) {
            const float x = float(value(transform, n, modes[m], i));
            leaf.analysis[std::size_t(m) * leaf.points + i] = x;
            leaf.synthesis[std::size_t(i) * leaf.count + m] = x;
        }
    }
    leaves_.push_back(std::move(leaf));
    return rows;
}

// Types I and II: modes of even and odd number are symmetric about the middle or antisymmetric.
std::vector<int> LineTransform::split_parities(Transform transform, int n, const std::vector<int> &modes,
                                               int start, int stride) {
    const auto row = [&](int i) { return start + i * stride; };
    const bool cosine = is_cosine(transform);
    std::vector<int> even, odd;
    for (int mode : modes)
        (mode % 2 ? odd : even).push_back(mode / 2);
    const int last = points_of(transform, n) - 1;
    for (int i = 0; i < last - i; ++i)
        before_.push_back({row(i), row(last - i), 1, 1, 1, -1});
    const int end = row(last);                             // the differences lie from there backwards
    const auto half_modes = Transform(int(transform) + 4); // of the same kind
    const auto even_rows = split(transform, n / 2, even, cosine ? start : end, cosine ? stride : -stride);
    const auto odd_rows = split(half_modes, n / 2, odd, cosine ? end : start, cosine ? -stride : stride);
    auto next_even = even_rows.begin(), next_odd = odd_rows.begin();
    std::vector<int> rows(modes.size());
    for (std::size_t m = 0; m < modes.size(); ++m)
        rows[m] = modes[m] % 2 ? *next_odd++ : *next_even++;
    return rows;
}

// Types III and IV, all n modes: m and n - 1 - m are the same on every second point, and opposite on the
// others (III), or sums and differences of neighbors turned by half the angle of m (IV).
std::vector<int> LineTransform::split_pairs(Transform transform, int n, int start, int stride) {
    const auto row = [&](int i) { return start + i * stride; };
    const bool cosine = is_cosine(transform), on_faces = !on_centers(transform);
    const int half = n / 2;
    std::vector<int> a, b;
    if (on_faces) {
        a = split(transform, half, count_up(half), row(cosine ? 0 : 1), 2 * stride);
        b = split(cosine ? Transform::dct4 : Transform::dst4, half, count_up(half), row(cosine ? 1 : 0),
                  2 * stride);
    } else {
        for (int i = 0; i < n; i += 2)
            before_.push_back({row(i), row(i + 1), 1, 1, 1, -1});
        a = split(transform, half, count_up(half), row(0), 2 * stride);
        b = split(cosine ? Transform::dst4 : Transform::dct4, half, count_up(half), row(1), 2 * stride);
    }
    std::vector<int> rows(n);
    for (int m = 0; m < half; ++m) {
        const double angle = (m + 0.5) * std::acos(-1.0) / n / 2;
        const float c = float(std::cos(angle)), s = float(std::sin(angle));
        if (on_faces)
            after_.push_back({a[m], b[m], 1, 1, cosine ? 1.0f : -1.0f, cosine ? -1.0f : 1.0f});
        else
            after_.push_back({a[m], b[m], c, cosine ? s : -s, cosine ? -s : s, c});
        rows[m] = a[m];
        rows[n - 1 - m] = b[m];
    }
    return rows;
}

namespace {

template <class Butterfly> SMOKELIFT_INLINE void apply(const Butterfly &t, float *x) {
    Vector &a = *reinterpret_cast<Vector *>(x + t.a * width),
           &b = *reinterpret_cast<Vector *>(x + t.b * width);
    const Vector first = t.aa * a + t.ab * b, second = t.ba * a + t.bb * b;
    a = first;
    b = second;
}

template <class Butterfly> SMOKELIFT_INLINE void apply_transposed(const Butterfly &t, float *x) {
    apply(Butterfly{t.a, t.b, t.aa, t.ba, t.ab, t.bb}, x);
}

} // namespace

SMOKELIFT_CLONES
void LineTransform::analyse(float *points, float *modes) const {
    for (const Butterfly &t : before_)
        apply(t, points);
    for (const Leaf &leaf : leaves_)
        stripe<width>(leaf.count, leaf.points, leaf.analysis.data(), leaf.points, points + leaf.start * width,
                      leaf.stride * width, modes + leaf.first * width, width);
    for (const Butterfly &t : after_)
        apply(t, modes);
    for (int m = 0; m < modes_; ++m)
        reinterpret_cast<Vector *>(modes)[m] *= norms_[m];
}

// The transpose.
SMOKELIFT_CLONES
void LineTransform::synthesize(float *modes, float *points) const {
    for (int m = 0; m < modes_; ++m)
        reinterpret_cast<Vector *>(modes)[m] *= norms_[m];
    for (auto t = after_.rbegin(); t != after_.rend(); ++t)
        apply_transposed(*t, modes);
    for (int i : idle_)
        std::fill_n(points + i * width, width, 0.0f);
    for (const Leaf &leaf : leaves_)
        stripe<width>(leaf.points, leaf.count, leaf.synthesis.data(), leaf.count, modes + leaf.first * width,
                      width, points + leaf.start * width, leaf.stride * width);
    for (auto t = before_.rbegin(); t != before_.rend(); ++t)
        apply_transposed(*t, points);
}

namespace {

// Exchanges the off-diagonal blocks of `step` rows and columns.
#define SMOKELIFT_EXCHANGE(step, low, high)                                                                  \
    for (int i = 0; i < width; ++i)                                                                          \
        if (!(i & step)) {                                                                                   \
            const Vector a = x[i], b = x[i + step];                                                          \
            x[i] = __builtin_shufflevector(a, b, low);                                                       \
            x[i + step] = __builtin_shufflevector(a, b, high);                                               \
        }
#define SMOKELIFT_LIST(...) __VA_ARGS__

SMOKELIFT_INLINE void transpose(Vector *x){
#pragma GCC unroll 16
    SMOKELIFT_EXCHANGE(8, SMOKELIFT_LIST(0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 22, 23),
                       SMOKELIFT_LIST(8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26, 27, 28, 29, 30, 31))
#pragma GCC unroll 16
        SMOKELIFT_EXCHANGE(4, SMOKELIFT_LIST(0, 1, 2, 3, 16, 17, 18, 19, 8, 9, 10, 11, 24, 25, 26, 27),
                           SMOKELIFT_LIST(4, 5, 6, 7, 20, 21, 22, 23, 12, 13, 14, 15, 28, 29, 30, 31))
#pragma GCC unroll 16
            SMOKELIFT_EXCHANGE(2, SMOKELIFT_LIST(0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29),
                               SMOKELIFT_LIST(2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31))
#pragma GCC unroll 16
                SMOKELIFT_EXCHANGE(1,
                                   SMOKELIFT_LIST(0, 16, 2, 18, 4, 20, 6, 22, 8, 24, 10, 26, 12, 28, 14, 30),
                                   SMOKELIFT_LIST(1, 17, 3, 19, 5, 21, 7, 23, 9, 25, 11, 27, 13, 29, 15, 31))}

SMOKELIFT_INLINE int at(const int *order, int i) {
    return width * (order ? order[i] : i);
}

// Some lines side by side: element i of each to row order[i] of x, or back.
SMOKELIFT_CLONES
void lines_in(const Lines<const float> &from, int length, int lines, const int *order, float *x) {
    int i = 0;
    for (; from.along == 1 && lines == width && i + width <= length; i += width) {
        Vector block[width];
        for (int l = 0; l < width; ++l)
            block[l] = *reinterpret_cast<const Vector *>(from.at(i, l));
        transpose(block);
        for (int k = 0; k < width; ++k)
            *reinterpret_cast<Vector *>(x + at(order, i + k)) = block[k];
    }
    for (; i < length; ++i)
        if (from.apart == 1 && lines == width)
            *reinterpret_cast<Vector *>(x + at(order, i)) = *reinterpret_cast<const Vector *>(from.at(i));
        else
            for (int l = 0; l < lines; ++l)
                x[at(order, i) + l] = *from.at(i, l);
}

SMOKELIFT_CLONES
void lines_out(const Lines<float> &to, int length, int lines, const int *order, const float *x) {
    int i = 0;
    for (; to.along == 1 && lines == width && i + width <= length; i += width) {
        Vector block[width];
        for (int k = 0; k < width; ++k)
            block[k] = *reinterpret_cast<const Vector *>(x + at(order, i + k));
        transpose(block);
        for (int l = 0; l < width; ++l)
            *reinterpret_cast<Vector *>(to.at(i, l)) = block[l];
    }
    for (; i < length; ++i)
        if (to.apart == 1 && lines == width)
            *reinterpret_cast<Vector *>(to.at(i)) = *reinterpret_cast<const Vector *>(x + at(order, i));
        else
            for (int l = 0; l < lines; ++l)
                *to.at(i, l) = x[at(order, i) + l];
}

} // namespace

void LineTransform::to_modes(const Lines<const float> &points, int count, const Lines<float> &modes,
                             std::vector<float> &scratch) const {
    scratch.resize(std::size_t(length_ + modes_) * width);
    float *const x = scratch.data(), *const y = x + length_ * width;
    for (int first = 0; first < count; first += width) {
        const int lines = std::min(width, count - first);
        lines_in(points.from(first), length_, lines, nullptr, x);
        analyse(x, y);
        lines_out(modes.from(first), modes_, lines, rows_.data(), y);
    }
}

void LineTransform::from_modes(const Lines<const float> &modes, int count, const Lines<float> &points,
                               std::vector<float> &scratch) const {
    scratch.resize(std::size_t(length_ + modes_) * width);
    float *const x = scratch.data(), *const y = x + length_ * width;
    for (int first = 0; first < count; first += width) {
        const int lines = std::min(width, count - first);
        lines_in(modes.from(first), modes_, lines, rows_.data(), y);
        synthesize(y, x);
        lines_out(points.from(first), length_, lines, nullptr, x);
    }
}

AxisModes::AxisModes(int n, bool closed_low, bool closed_high, int count) : n_(n), count_(count) {
    const bool symmetric = closed_low == closed_high;
    cells_ = symmetric ? (closed_low ? Transform::dct2 : Transform::dst2)
                       : (closed_low ? Transform::dct4 : Transform::dst4);
    faces_ = symmetric ? (closed_low ? Transform::dst1 : Transform::dct1)
                       : (closed_low ? Transform::dst3 : Transform::dct3);
    // Cells between open ends have no constant mode, so that n of them start with the next.
    first_ = symmetric && !closed_low && count == n;
    for (int k = first_; k < first_ + count; ++k) {
        const double angle = (k + (symmetric ? 0 : 0.5)) * std::acos(-1.0) / n;
        difference.push_back((closed_low ? 2 : -2) * std::sin(angle / 2));
    }
}

} // namespace smokelift
