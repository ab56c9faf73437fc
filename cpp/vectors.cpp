#include "vectors.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

namespace smokelift {

SMOKELIFT_CLONES
double dot(const float *__restrict a, const float *__restrict b, std::size_t n) {
    // Sixteen running sums keep the vector units busy; a fixed number keeps the result the same everywhere.
    constexpr int running = 16;
    float sums[running] = {};
    std::size_t i = 0;
    for (; i + running <= n; i += running)
        for (int l = 0; l < running; ++l)
            sums[l] += a[i + l] * b[i + l];
    double total = 0;
    for (; i < n; ++i)
        total += double(a[i]) * b[i];
    for (float value : sums)
        total += value;
    return total;
}

SMOKELIFT_CLONES
void axpy(float factor, const float *__restrict x, float *__restrict y, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        y[i] += factor * x[i];
}

SMOKELIFT_CLONES
void xpay(const float *__restrict x, float factor, float *__restrict y, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        y[i] = x[i] + factor * y[i];
}

SMOKELIFT_CLONES
void scale(float factor, const float *x, float *y, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        y[i] = factor * x[i];
}

// Numbers of one sign are in the order of their bits, and compilers turn the largest of integers into vector
// code.
SMOKELIFT_CLONES
float largest_size(const float *x, std::size_t n) {
    std::int32_t most = 0;
    for (std::size_t i = 0; i < n; ++i) {
        std::int32_t bits;
        std::memcpy(&bits, x + i, 4);
        most = std::max(most, bits & 0x7fffffff);
    }
    float largest;
    std::memcpy(&largest, &most, 4);
    return largest;
}

void find_filled(In a, Span *spans, Workers &workers) {
    workers.run(a.n[0], [&](int i) {
        for (int j = 0; j < a.n[1]; ++j) {
            const float *const row = a.row(i, j), *first = row, *end = row + a.n[2];
            while (first < end && *first == 0)
                ++first;
            while (end > first && end[-1] == 0)
                --end;
            spans[std::size_t(i) * a.n[1] + j] = {int(first - row), int(end - row)};
        }
    });
}

void axpy(float factor, const StaggeredIn &x, const StaggeredOut &y, Workers &workers) {
    for (int c = 0; c < 3; ++c)
        workers.run(x[c].n[0],
                    [&](int i) { axpy(factor, x[c].row(i, 0), y[c].row(i, 0), x[c].slab_size()); });
}

void copy(const StaggeredIn &x, const StaggeredOut &y, Workers &workers) {
    for (int c = 0; c < 3; ++c)
        workers.run(x[c].n[0], [&](int i) { std::copy_n(x[c].row(i, 0), x[c].slab_size(), y[c].row(i, 0)); });
}

float largest_size(const StaggeredIn &x, Workers &workers) {
    float largest = 0;
    for (const In &component : x.faces) {
        std::vector<float> slabs(std::size_t(component.n[0]));
        workers.run(component.n[0],
                    [&](int i) { slabs[i] = largest_size(component.row(i, 0), component.slab_size()); });
        largest = std::max(largest, *std::max_element(slabs.begin(), slabs.end()));
    }
    return largest;
}

} // namespace smokelift
