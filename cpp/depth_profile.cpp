#include "depth_profile.h"

#include <cmath>

namespace smokelift {

void find_profile(const DepthProfile &profile, Mask voxels, const std::vector<std::size_t> &first,
                  const SeenAt &seen_at, float *shapes, float *widths, Workers &workers) {
    const auto read = [&](const double *picture, float *values) {
        read_bilinearly(picture, profile.rows, profile.columns, seen_at.rows, seen_at.columns, first.back(),
                        values, workers);
    };
    read(profile.middle, shapes), read(profile.width, widths);
    const auto &[x, y, z] = profile.places;
    const auto &d = profile.depth;
    workers.run(voxels.n[0], [&](int i) {
        std::size_t at = first[i];
        if (at == first[i + 1])
            return;
        for (int j = 0; j < voxels.n[1]; ++j) {
            const unsigned char *const row = voxels.row(i, j);
            const double start = x[i] * d[0] + y[j] * d[1];
            for (int k = first_marked(row, voxels.n[2]); k < voxels.n[2]; ++k) {
                if (!row[k])
                    continue;
                const float distance = std::abs(float(start + z[k] * d[2]) - shapes[at]);
                shapes[at] = std::exp(-std::pow(distance / widths[at], float(profile.flatness)));
                ++at;
            }
        }
    });
}

} // namespace smokelift
