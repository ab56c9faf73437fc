#include "marked_voxels.h"

#include "vectors.h"

#include <algorithm>

namespace smokelift {
namespace {

// Calls found(first, end) for the stretches of a row in which marked(z) holds.
template <class Marked, class Found>
void find_stretches(int begin, int end, const Marked &marked, const Found &found) {
    for (int z = begin; z < end;) {
        if (!marked(z)) {
            ++z;
            continue;
        }
        const int first = z;
        while (z < end && marked(z))
            ++z;
        found(first, z);
    }
}

// Means over the cubes of one lattice: cube number (coordinate + offset) / size along every axis.
class Cubes {
public:
    Cubes(const MarkedVoxels &voxels, int size, int offset) : voxels_(voxels), size_(size), offset_(offset) {
        for (int axis = 0; axis < 3; ++axis)
            n_[axis] = (voxels.shape()[axis] + offset) / size + 1;
        means_.resize(volume(n_));
    }

    // Every sum is formed in the voxels' order, by one task.
    void find(const float *values, double factor, Workers &workers) {
        workers.run(n_[0], [&](int i) {
            const std::size_t slab = std::size_t(n_[1]) * n_[2];
            std::vector<double> sums(slab);
            std::vector<int> counts(slab);
            const int end = std::min((i + 1) * size_ - offset_, voxels_.shape()[0]);
            for (int x = std::max(i * size_ - offset_, 0); x < end; ++x) {
                voxels_.in_plane(x, [&](int y, int z, int count, std::size_t at) {
                    const std::size_t row = std::size_t((y + offset_) / size_) * n_[2];
                    in_cubes(z, count, [&](int cube, int first, int end) {
                        double sum = sums[row + cube];
                        for (int k = first; k < end; ++k)
                            sum += values[at + k];
                        sums[row + cube] = sum;
                        counts[row + cube] += end - first;
                    });
                });
            }
            float *const means = means_.data() + i * slab;
            for (std::size_t cube = 0; cube < slab; ++cube)
                means[cube] = float(sums[cube] * factor / std::max(counts[cube], 1));
        });
    }

    // Adds the means of the voxels' cubes to a stretch.
    void add(int x, int y, int z, int count, float *values) const {
        const float *const row =
            means_.data() + (std::size_t((x + offset_) / size_) * n_[1] + (y + offset_) / size_) * n_[2];
        in_cubes(z, count, [&](int cube, int first, int end) {
            for (int k = first; k < end; ++k)
                values[k] += row[cube];
        });
    }

private:
    // part(cube, first, end) for the parts of a stretch in cubes of a row.
    template <class Part> void in_cubes(int z, int count, const Part &part) const {
        int cube = (z + offset_) / size_, end = (cube + 1) * size_ - offset_ - z; // one division a stretch
        for (int k = 0; k < count; k = end, end += size_)
            part(cube++, k, std::min(count, end));
    }

    const MarkedVoxels &voxels_;
    int size_, offset_;
    Shape n_{};
    Values means_;
};

} // namespace

MarkedVoxels::MarkedVoxels(Mask voxels, Workers &workers) : MarkedVoxels(voxels.n) {
    workers.run(n_[0], [&](int x) {
        for (int y = 0; y < n_[1]; ++y) {
            const unsigned char *const row = voxels.row(x, y);
            find_stretches(
                first_marked(row, n_[2]), n_[2], [&](int z) { return row[z] != 0; },
                [&](int begin, int end) { planes_[x].stretches.push_back({y, begin, end - begin}); });
        }
    });
    number();
}

MarkedVoxels MarkedVoxels::above_zero(const float *a, const float *b, Workers &workers) const {
    MarkedVoxels result(n_);
    workers.run(n_[0], [&](int x) {
        in_plane(x, [&](int y, int z, int count, std::size_t) {
            const std::size_t row = (std::size_t(x) * n_[1] + y) * n_[2];
            find_stretches(
                z, z + count, [&](int k) { return a[row + k] > 0 || b[row + k] > 0; },
                [&](int begin, int end) { result.planes_[x].stretches.push_back({y, begin, end - begin}); });
        });
    });
    result.number();
    return result;
}

void MarkedVoxels::number() {
    std::size_t first = 0;
    for (Plane &plane : planes_) {
        plane.first = first;
        for (const Stretch &stretch : plane.stretches)
            plane.count += std::size_t(stretch.count);
        first += plane.count;
    }
}

void MarkedVoxels::take(const float *volume, float *values, Workers &workers) const {
    workers.run(n_[0], [&](int x) {
        in_plane(x, [&](int y, int z, int count, std::size_t at) {
            std::copy_n(volume + (std::size_t(x) * n_[1] + y) * n_[2] + z, count, values + at);
        });
    });
}

void MarkedVoxels::put(const float *values, float factor, float *volume, Workers &workers) const {
    workers.run(n_[0], [&](int x) {
        in_plane(x, [&](int y, int z, int count, std::size_t at) {
            scale(factor, values + at, volume + (std::size_t(x) * n_[1] + y) * n_[2] + z, count);
        });
    });
}

void smooth_in_cubes(const MarkedVoxels &voxels, int size, double weight, const float *values,
                     float *smoothed, Workers &workers) {
    Cubes whole(voxels, size, 0), between(voxels, size, size / 2);
    const double lattice_weight = weight / (1 + weight) / 2;
    whole.find(values, lattice_weight, workers);
    between.find(values, lattice_weight, workers);
    const float own = float(1 + weight);
    workers.run(voxels.shape()[0], [&](int x) {
        voxels.in_plane(x, [&](int y, int z, int count, std::size_t at) {
            for (int k = 0; k < count; ++k)
                smoothed[at + k] = values[at + k] / own;
            whole.add(x, y, z, count, smoothed + at);
            between.add(x, y, z, count, smoothed + at);
        });
    });
}

} // namespace smokelift
