#include "increment.h"

#include "projection.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace smokelift {
namespace {

SMOKELIFT_CLONES
float difference_row(const float *__restrict a, const float *__restrict b, std::size_t n) {
    float largest = 0;
    for (std::size_t k = 0; k < n; ++k)
        largest = std::max(largest, std::abs(a[k] - b[k]));
    return largest;
}

SMOKELIFT_CLONES
void clamp_row(const float *__restrict u, float limit, float *__restrict out, std::size_t n) {
    for (std::size_t k = 0; k < n; ++k)
        out[k] = u[k] + std::min(std::max(out[k] - u[k], -limit), limit);
}

} // namespace

float largest_difference(const StaggeredIn &a, const StaggeredIn &b, Workers &workers) {
    std::vector<float> largest(a[0].n[0]);
    workers.run(a[0].n[0], [&](int i) {
        for (int c = 0; c < 3; ++c)
            if (i < a[c].n[0])
                largest[i] =
                    std::max(largest[i], difference_row(a[c].row(i, 0), b[c].row(i, 0), a[c].slab_size()));
    });
    return *std::max_element(largest.begin(), largest.end());
}

void clamp_increment(const StaggeredIn &u, float largest, const StaggeredOut &solution, Workers &workers) {
    for (int c = 0; c < 3; ++c)
        workers.run(u[c].n[0], [&](int i) {
            clamp_row(u[c].row(i, 0), largest, solution[c].row(i, 0), u[c].slab_size());
        });
    Projection(solution.box).apply(solution, workers);
}

} // namespace smokelift
