#include "refinement.h"

#include "projection.h"

#include <algorithm>
#include <vector>

namespace smokelift {
namespace {

// Where the elements of a finer line lie between those of a coarse one.
struct Line {
    Line(int coarse, int fine, double shift) : low(fine), high(fine), weight(fine) {
        for (int i = 0; i < fine; ++i) {
            const double position = std::clamp(i / 2.0 + shift, 0.0, double(coarse - 1));
            low[i] = std::min(int(position), std::max(coarse - 2, 0));
            high[i] = std::min(low[i] + 1, coarse - 1);
            weight[i] = float(position - low[i]);
        }
    }

    std::vector<int> low, high;
    std::vector<float> weight;
};

SMOKELIFT_CLONES
void mix_rows(const float *__restrict a, const float *__restrict b, const float *__restrict c,
              const float *__restrict d, float x, float y, float *__restrict out, int n) {
    for (int k = 0; k < n; ++k)
        out[k] = (1 - y) * ((1 - x) * a[k] + x * b[k]) + y * ((1 - x) * c[k] + x * d[k]);
}

} // namespace

void refine(const StaggeredIn &coarse, const StaggeredOut &result, Workers &workers) {
    for (int c = 0; c < 3; ++c) {
        const In from = coarse[c];
        const Out to = result[c];
        const Line x(from.n[0], to.n[0], c == 0 ? 0 : -0.25), y(from.n[1], to.n[1], c == 1 ? 0 : -0.25),
            z(from.n[2], to.n[2], c == 2 ? 0 : -0.25);
        workers.run(to.n[0], [&](int i) {
            thread_local std::vector<float> row;
            row.resize(from.n[2]);
            for (int j = 0; j < to.n[1]; ++j) {
                mix_rows(from.row(x.low[i], y.low[j]), from.row(x.high[i], y.low[j]),
                         from.row(x.low[i], y.high[j]), from.row(x.high[i], y.high[j]), x.weight[i],
                         y.weight[j], row.data(), from.n[2]);
                float *out = to.row(i, j);
                for (int k = 0; k < to.n[2]; ++k)
                    out[k] = 2 * (row[z.low[k]] * (1 - z.weight[k]) + row[z.high[k]] * z.weight[k]);
            }
        });
    }
    Projection(result.box).apply(result, workers);
}

} // namespace smokelift
