#include "halves.h"

#include "vectors.h"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

namespace smokelift {
namespace {

// near x weight + far x (1 - weight)
SMOKELIFT_CLONES
void mix(const float *__restrict near, const float *__restrict far, float weight, float *__restrict out,
         int n) {
    const float rest = 1 - weight;
    for (int k = 0; k < n; ++k)
        out[k] = weight * near[k] + rest * far[k];
}

SMOKELIFT_CLONES
void mix_along(const float *__restrict row, float *__restrict out, int n) {
    out[0] = 0.75f * row[0] + 0.25f * row[0];
    for (int k = 1; k < n; ++k) {
        out[2 * k - 1] = 0.75f * row[k - 1] + 0.25f * row[k];
        out[2 * k] = 0.75f * row[k] + 0.25f * row[k - 1];
    }
    out[2 * n - 1] = 0.75f * row[n - 1] + 0.25f * row[n - 1];
}

SMOKELIFT_CLONES
void scale_row(const float *__restrict fine, const bool *__restrict marked, const float *__restrict before,
               const float *__restrict after, float least, float *__restrict result, int n) {
    for (int k = 0; k < n; ++k)
        if (marked[k])
            result[k] = fine[k] * (after[k] / std::max(before[k], least));
}

bool any(const bool *row, int n) { return std::memchr(row, 1, std::size_t(n)) != nullptr; }

// The coarse voxel beside that of a fine one on the side where the fine one lies; itself at the end.
int beside(int fine, int count) { return std::clamp(fine / 2 + (fine % 2 ? 1 : -1), 0, count - 1); }

// A plane across x of the fine grid, linear between the middles of a coarse one.
class FinePlane {
public:
    FinePlane(const Part<const float> &coarse, int x)
        : rows_(coarse.n[1]), length_(2 * coarse.n[2]), row_(2 * length_) {
        const int planes[2] = {x / 2, beside(x, coarse.n[0])};
        for (int p = 0; p < 2; ++p) {
            planes_[p].resize(std::size_t(rows_) * length_);
            for (int j = 0; j < rows_; ++j)
                mix_along(coarse.row(planes[p], j), planes_[p].data() + std::size_t(j) * length_,
                          coarse.n[2]);
        }
        result_.resize(length_);
    }

    // A row of it; valid until the next is asked for.
    const float *row(int y) {
        const std::size_t near = std::size_t(y / 2) * length_, far = std::size_t(beside(y, rows_)) * length_;
        for (int p = 0; p < 2; ++p)
            mix(planes_[p].data() + near, planes_[p].data() + far, 0.75f, row_.data() + p * length_, length_);
        mix(row_.data(), row_.data() + length_, 0.75f, result_.data(), length_);
        return result_.data();
    }

private:
    int rows_, length_;
    std::vector<float> planes_[2], row_, result_;
};

} // namespace

void means_of_two(const Part<const float> &fine, const std::optional<Part<const bool>> &marked,
                  const Out &coarse, Workers &workers) {
    const Shape &n = fine.n;
    workers.run(coarse.n[0], [&](int i) {
        std::vector<float> rows(3 * n[2]);
        const std::vector<float> nothing(n[2]);
        const auto row_at = [&](int x, int y) {
            return !marked || any(marked->row(x, y), n[2]) ? fine.row(x, y) : nothing.data();
        };
        for (int j = 0; j < coarse.n[1]; ++j) {
            float *const both = rows.data(), *const row = both + 2 * n[2];
            const int along_y = std::min(2, n[1] - 2 * j);
            for (int y = 0; y < along_y; ++y) {
                const float *low = row_at(2 * i, 2 * j + y);
                if (2 * i + 1 < n[0])
                    mix(low, row_at(2 * i + 1, 2 * j + y), 0.5f, both + y * n[2], n[2]);
                else
                    scale(0.5f, low, both + y * n[2], n[2]);
            }
            if (along_y == 2)
                mix(both, both + n[2], 0.5f, row, n[2]);
            else
                scale(0.5f, both, row, n[2]);
            float *out = coarse.row(i, j);
            for (int k = 0; k < n[2] / 2; ++k)
                out[k] = 0.5f * row[2 * k] + 0.5f * row[2 * k + 1];
            if (n[2] % 2)
                out[n[2] / 2] = 0.5f * row[n[2] - 1];
        }
    });
}

void prolong_values(const Part<const float> &coarse, const MarkedVoxels &marked, float *values,
                    Workers &workers) {
    workers.run(marked.shape()[0], [&](int x) {
        std::optional<FinePlane> plane; // made for the first of its voxels
        int row_y = -1;
        const float *row = nullptr;
        marked.in_plane(x, [&](int y, int z, int count, std::size_t at) {
            if (!plane)
                plane.emplace(coarse, x);
            if (y != std::exchange(row_y, y))
                row = plane->row(y);
            std::copy_n(row + z, count, values + at);
        });
    });
}

void scale_alike(const Part<const float> &fine, const Part<const bool> &marked,
                 const Part<const float> &before, const Part<const float> &after, float least,
                 const Part<float> &result, Workers &workers) {
    const Shape &n = fine.n;
    workers.run(n[0], [&](int x) {
        FinePlane was(before, x), is(after, x);
        for (int y = 0; y < n[1]; ++y)
            if (const bool *mark = marked.row(x, y); any(mark, n[2]))
                scale_row(fine.row(x, y), mark, was.row(y), is.row(y), least, result.row(x, y), n[2]);
    });
}

} // namespace smokelift
