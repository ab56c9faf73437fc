#include "data_term.h"

#include "advection.h"
#include "operators.h"

#include <algorithm>
#include <cmath>

namespace smokelift {
namespace {

SMOKELIFT_CLONES
float larger(const float *__restrict a, const float *__restrict b, float *__restrict out, std::size_t n) {
    float largest = 0;
    for (std::size_t i = 0; i < n; ++i) {
        out[i] = std::max(a[i], b[i]);
        largest = std::max(largest, out[i]);
    }
    return largest;
}

SMOKELIFT_CLONES
void mean(const float *__restrict a, const float *__restrict b, float *__restrict out, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        out[i] = 0.5f * (a[i] + b[i]);
}

SMOKELIFT_CLONES
void mark(const float *__restrict density, float least, unsigned char *__restrict smoke, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        smoke[i] = density[i] > least;
}

// value(0) + ... + value(n - 1) in eight running sums, which keep the vector units busy.
template <class Value> SMOKELIFT_INLINE double sum_of(std::size_t n, const Value &value) {
    constexpr int running = 8;
    double sums[running] = {};
    std::size_t i = 0;
    for (; i + running <= n; i += running)
        for (int l = 0; l < running; ++l)
            sums[l] += value(i + l);
    for (; i < n; ++i)
        sums[0] += value(i);
    double total = 0;
    for (double sum : sums)
        total += sum;
    return total;
}

SMOKELIFT_CLONES
double squares(const float *__restrict x, const float *__restrict y, const float *__restrict z,
               const unsigned char *__restrict smoke, std::size_t n) {
    return sum_of(n, [&](std::size_t i) SMOKELIFT_INLINE_LAMBDA {
        return smoke[i] ? x[i] * x[i] + y[i] * y[i] + z[i] * z[i] : 0.0f;
    });
}

SMOKELIFT_CLONES
void scale_by(float factor, float *__restrict out, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
        out[i] *= factor;
}

// residual = after - carried, carried /= scale, and offset = residual / scale - along.
SMOKELIFT_CLONES
void differences(const float *__restrict after, const float *__restrict along, float inverse,
                 float *__restrict carried, float *__restrict residual, float *__restrict offset,
                 std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) {
        residual[i] = after[i] - carried[i];
        offset[i] = inverse * residual[i] - along[i];
        carried[i] *= inverse;
    }
}

SMOKELIFT_CLONES
std::array<double, 3> residual_sums_row(const float *__restrict along, const float *__restrict offset,
                                        const float *__restrict weight, const unsigned char *__restrict smoke,
                                        std::size_t n) {
    constexpr int running = 8;
    double whole[running] = {}, rest[running] = {}, inside[running] = {};
    const auto add = [&](std::size_t i, int l) SMOKELIFT_INLINE_LAMBDA {
        const float left = offset[i] + along[i];
        whole[l] += weight[i] * offset[i] * offset[i];
        rest[l] += weight[i] * left * left;
        inside[l] += smoke[i] ? weight[i] : 0.0f;
    };
    std::size_t i = 0;
    for (; i + running <= n; i += running)
        for (int l = 0; l < running; ++l)
            add(i + l, l);
    for (; i < n; ++i)
        add(i, 0);
    std::array<double, 3> total{};
    for (int l = 0; l < running; ++l) {
        total[0] += whole[l];
        total[1] += rest[l];
        total[2] += inside[l];
    }
    return total;
}

SMOKELIFT_CLONES
double weighted_dot(const float *__restrict a, const float *__restrict b, const float *__restrict weight,
                    std::size_t n) {
    return sum_of(n, [&](std::size_t i) SMOKELIFT_INLINE_LAMBDA { return double(weight[i] * a[i]) * b[i]; });
}

// Sums of several quantities over slabs, added in order whatever the number of threads.
template <class Partial>
std::vector<double> sums(int slabs, std::size_t quantities, Workers &workers, const Partial &partial) {
    std::vector<double> partials(slabs * quantities), total(quantities);
    workers.run(slabs, [&](int i) { partial(i, partials.data() + i * quantities); });
    for (std::size_t k = 0; k < partials.size(); ++k)
        total[k % quantities] += partials[k];
    return total;
}

} // namespace

double linearise(In before, In after, const StaggeredIn &u, float threshold, const Linearisation &result,
                 Workers &workers) {
    const int nx = after.n[0];
    const std::size_t size = after.slab_size();
    const Out carried = result.carried, density = result.density;
    advect_cells(before, u, true, carried, workers);
    std::vector<float> largest(nx);
    workers.run(nx, [&](int i) {
        largest[i] = larger(carried.row(i, 0), after.row(i, 0), density.row(i, 0), size);
        mean(carried.row(i, 0), after.row(i, 0), result.offset.row(i, 0), size);
    });
    const float least = threshold * *std::max_element(largest.begin(), largest.end());
    gradient(result.offset, result.direction, workers);
    const Out3 g = result.direction;
    const auto total = sums(nx, 2, workers, [&](int i, double *partial) {
        unsigned char *smoke = result.smoke.row(i, 0);
        mark(density.row(i, 0), least, smoke, size);
        partial[0] = squares(g[0].row(i, 0), g[1].row(i, 0), g[2].row(i, 0), smoke, size);
        partial[1] = double(std::count(smoke, smoke + size, 1));
    });
    const double scale = total[1] > 0 ? std::sqrt(total[0] / total[1]) : 0;
    if (scale == 0)
        return 0;
    const float inverse = float(1 / scale);
    workers.run(nx, [&](int i) {
        thread_local std::vector<float> along;
        along.resize(size);
        for (const Out &component : g)
            scale_by(inverse, component.row(i, 0), size);
        directional_slab(u, read(g), {along.data(), {1, after.n[1], after.n[2]}}, i);
        differences(after.row(i, 0), along.data(), inverse, carried.row(i, 0), result.residual.row(i, 0),
                    result.offset.row(i, 0), size);
    });
    return scale;
}

std::array<double, 3> residual_sums(const In3 &direction, In offset, In weight, Mask smoke,
                                    const StaggeredIn &u, Workers &workers) {
    const std::size_t size = offset.slab_size();
    const auto total = sums(offset.n[0], 3, workers, [&](int i, double *partial) {
        thread_local std::vector<float> along;
        along.resize(size);
        directional_slab(u, direction, {along.data(), {1, offset.n[1], offset.n[2]}}, i);
        const auto row =
            residual_sums_row(along.data(), offset.row(i, 0), weight.row(i, 0), smoke.row(i, 0), size);
        std::copy(row.begin(), row.end(), partial);
    });
    return {total[0], total[1], total[2]};
}

std::vector<double> weighted_products(const std::vector<In> &columns, In weight, Workers &workers) {
    const std::size_t count = columns.size();
    auto total = sums(weight.n[0], count * count, workers, [&](int i, double *partial) {
        for (std::size_t a = 0; a < count; ++a)
            for (std::size_t b = a; b < count; ++b)
                partial[a * count + b] = weighted_dot(columns[a].row(i, 0), columns[b].row(i, 0),
                                                      weight.row(i, 0), weight.slab_size());
    });
    for (std::size_t a = 0; a < count; ++a)
        for (std::size_t b = 0; b < a; ++b)
            total[a * count + b] = total[b * count + a];
    return total;
}

} // namespace smokelift
