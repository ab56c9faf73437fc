#include "blocks.h"

#include <algorithm>
#include <vector>

namespace smokelift {
namespace {

// Between which two blocks a voxel lies, and how far from the first to the second.
struct Between {
    int block;
    float fraction;
};

Between between(const Blocks &blocks, int axis, int voxel) {
    const float at = (float(voxel + blocks.offset[axis]) + 0.5f) / float(blocks.size) - 0.5f;
    const int block = static_cast<int>(at);
    return {block, at - float(block)};
}

std::vector<Between> all_between(const Blocks &blocks, int axis, int count) {
    std::vector<Between> result(count);
    for (int voxel = 0; voxel < count; ++voxel)
        result[voxel] = between(blocks, axis, voxel);
    return result;
}

int block_of(const Blocks &blocks, int axis, int voxel) {
    return (voxel + blocks.offset[axis]) / blocks.size;
}

// The voxels in plane `block` of blocks, first and end.
std::array<int, 2> voxels_in(const Blocks &blocks, int axis, int block, int count) {
    const int first = block * blocks.size - blocks.offset[axis];
    return {std::max(first, 0), std::min(first + blocks.size, count)};
}

std::size_t row_of(const Blocks &blocks, int x, int y) {
    return (std::size_t(x) * blocks.n[1] + y) * blocks.n[2];
}

// Calls visit(first, end, block) for the voxels of each block in a range of a row.
template <class Visit>
SMOKELIFT_INLINE void along_row(const Blocks &blocks, const std::array<int, 2> &span, const Visit &visit) {
    int z = span[0], block = block_of(blocks, 2, z);
    while (z < span[1]) {
        const int end = std::min(span[1], (block + 1) * blocks.size - blocks.offset[2]);
        visit(z, end, block);
        z = end;
        ++block;
    }
}

// A row of values between four rows of blocks; `x` and `y` are the distances from their centres, in blocks.
struct Mixed {
    std::size_t rows[4];
    float weights[4], x[4], y[4];

    Mixed(const Blocks &blocks, const Between &x, const Between &y) {
        for (int i = 0; i < 4; ++i) {
            rows[i] = row_of(blocks, x.block + i / 2, y.block + i % 2);
            weights[i] = (i / 2 ? x.fraction : 1 - x.fraction) * (i % 2 ? y.fraction : 1 - y.fraction);
            this->x[i] = x.fraction - float(i / 2);
            this->y[i] = y.fraction - float(i % 2);
        }
    }
};

// Distance of a voxel's centre from that of its block, over the mean square of those of all voxels, in
// blocks: a slope is the mean of the values times this.
float lever(const Blocks &blocks, int axis, int voxel) {
    const auto size = float(blocks.size);
    const int place = (voxel + blocks.offset[axis]) % blocks.size;
    return blocks.size > 1 ? 12 * size / (size * size - 1) * (float(place) + 0.5f - 0.5f * size) : 0.0f;
}

std::vector<float> levers(const Blocks &blocks, int axis, int count) {
    std::vector<float> result(count);
    for (int voxel = 0; voxel < count; ++voxel)
        result[voxel] = lever(blocks, axis, voxel);
    return result;
}

} // namespace

void average(const Voxels &medium, const Spans &spans, const Blocks &blocks, float *means, Workers &workers) {
    const int width = medium.width;
    const std::size_t count = blocks.count();
    const float share = 1.0f / float(blocks.size * blocks.size * blocks.size);
    const std::vector<float> along_y = levers(blocks, 1, medium.n[1]),
                             along_z = levers(blocks, 2, medium.n[2]);
    std::fill_n(means, (1 + (width - 1) * Blocks::FIELDS) * count, 0.0f);
    workers.run(blocks.n[0], [&](int block_x) {
        const auto [first, end] = voxels_in(blocks, 0, block_x, medium.n[0]);
        for (int x = first; x < end; ++x) {
            const float along_x = lever(blocks, 0, x);
            for (int y = 0; y < medium.n[1]; ++y) {
                const auto &span = spans.along_z[std::size_t(x) * medium.n[1] + y];
                const float *in = medium.at(x, y, 0);
                float *const out = means + row_of(blocks, block_x, block_of(blocks, 1, y));
                along_row(blocks, span, [&](int z, int last, int block) SMOKELIFT_INLINE_LAMBDA {
                    float extinction = 0;
                    for (int i = z; i < last; ++i)
                        extinction += in[i * width];
                    out[block] += share * extinction;
                    for (int channel = 1; channel < width; ++channel) {
                        float emission = 0, rise = 0;
                        for (int i = z; i < last; ++i) {
                            const float value = share * in[i * width] * in[i * width + channel];
                            emission += value;
                            rise += value * along_z[i];
                        }
                        float *const fields = out + (1 + (channel - 1) * Blocks::FIELDS) * count + block;
                        fields[0] += emission;
                        fields[count] += emission * along_x;
                        fields[2 * count] += emission * along_y[y];
                        fields[3 * count] += rise;
                    }
                });
            }
        }
    });
}

void average_adjoint(const Voxels &medium, const Spans &spans, const Blocks &blocks, const float *of_means,
                     const Voxels &gradient, Workers &workers) {
    const int width = medium.width;
    const std::size_t count = blocks.count();
    const float share = 1.0f / float(blocks.size * blocks.size * blocks.size);
    const std::vector<float> along_y = levers(blocks, 1, medium.n[1]),
                             along_z = levers(blocks, 2, medium.n[2]);
    workers.run(medium.n[0], [&](int x) {
        const float along_x = lever(blocks, 0, x);
        for (int y = 0; y < medium.n[1]; ++y) {
            const auto &span = spans.along_z[std::size_t(x) * medium.n[1] + y];
            const float *voxel = medium.at(x, y, 0);
            const float *const in = of_means + row_of(blocks, block_of(blocks, 0, x), block_of(blocks, 1, y));
            float *const out = gradient.at(x, y, 0);
            along_row(blocks, span, [&](int z, int last, int block) SMOKELIFT_INLINE_LAMBDA {
                const float of_extinction = share * in[block];
                for (int i = z; i < last; ++i)
                    out[i * width] += of_extinction;
                for (int channel = 1; channel < width; ++channel) {
                    const float *const fields = in + (1 + (channel - 1) * Blocks::FIELDS) * count + block;
                    const float mean =
                        share * (fields[0] + along_x * fields[count] + along_y[y] * fields[2 * count]);
                    const float slope = share * fields[3 * count];
                    for (int i = z; i < last; ++i) {
                        const float of_emission = mean + slope * along_z[i];
                        out[i * width] += of_emission * voxel[i * width + channel];
                        out[i * width + channel] += of_emission * voxel[i * width];
                    }
                }
            });
        }
    });
}

void add_interpolated(const float *values, float factor, const Blocks &blocks, const Voxels &medium,
                      const Spans &spans, Workers &workers) {
    const std::size_t count = blocks.count();
    const std::vector<Between> along_z = all_between(blocks, 2, medium.n[2]);
    workers.run(medium.n[0], [&](int x) {
        const Between across_x = between(blocks, 0, x);
        std::vector<float> line(blocks.n[2]), slope(blocks.n[2]);
        for (int y = 0; y < medium.n[1]; ++y) {
            const auto &span = spans.along_z[std::size_t(x) * medium.n[1] + y];
            if (span[0] >= span[1])
                continue;
            const Mixed mixed(blocks, across_x, between(blocks, 1, y));
            float *const out = medium.at(x, y, 0);
            for (int channel = 1; channel < medium.width; ++channel) {
                const float *const fields = values + (channel - 1) * Blocks::FIELDS * count;
                std::fill(line.begin(), line.end(), 0.0f);
                std::fill(slope.begin(), slope.end(), 0.0f);
                for (int i = 0; i < 4; ++i) {
                    const float *const from = fields + mixed.rows[i];
                    const float weight = factor * mixed.weights[i];
                    for (int z = 0; z < blocks.n[2]; ++z) {
                        line[z] += weight * (from[z] + mixed.x[i] * from[count + z] +
                                             mixed.y[i] * from[2 * count + z]);
                        slope[z] += weight * from[3 * count + z];
                    }
                }
                for (int z = span[0]; z < span[1]; ++z) {
                    const auto [block, f] = along_z[z];
                    out[z * medium.width + channel] +=
                        line[block] +
                        f * (line[block + 1] - line[block] + (1 - f) * (slope[block] - slope[block + 1]));
                }
            }
        }
    });
}

void interpolate_adjoint(const Voxels &gradient, const Spans &spans, float factor, const Blocks &blocks,
                         float *of_values, Workers &workers) {
    const int channels = gradient.width - 1;
    const std::vector<Between> along_z = all_between(blocks, 2, gradient.n[2]);
    const std::size_t plane = std::size_t(blocks.n[1]) * blocks.n[2], count = blocks.count();
    // of voxels along x, of blocks across: of the mean, of the slopes along y and z
    constexpr int PARTS = 3;
    std::vector<float> planes(channels * PARTS * plane * gradient.n[0], 0.0f);
    workers.run(gradient.n[0], [&](int x) {
        std::vector<float> line(blocks.n[2]), slope(blocks.n[2]);
        for (int y = 0; y < gradient.n[1]; ++y) {
            const auto &span = spans.along_z[std::size_t(x) * gradient.n[1] + y];
            if (span[0] >= span[1])
                continue;
            const Between across_y = between(blocks, 1, y);
            const float *const in = gradient.at(x, y, 0);
            for (int channel = 0; channel < channels; ++channel) {
                std::fill(line.begin(), line.end(), 0.0f);
                std::fill(slope.begin(), slope.end(), 0.0f);
                for (int z = span[0]; z < span[1]; ++z) {
                    const auto [block, f] = along_z[z];
                    const float value = in[z * gradient.width + 1 + channel];
                    const float near = (1 - f) * value, bent = f * near;
                    line[block] += near;
                    line[block + 1] += f * value;
                    slope[block] += bent;
                    slope[block + 1] -= bent;
                }
                float *const part = planes.data() + (std::size_t(x) * channels + channel) * PARTS * plane;
                for (int side = 0; side < 2; ++side) {
                    const float share = side ? across_y.fraction : 1 - across_y.fraction;
                    const float from_centre = share * (across_y.fraction - float(side));
                    float *const mean = part + (across_y.block + side) * blocks.n[2];
                    for (int z = 0; z < blocks.n[2]; ++z) {
                        mean[z] += share * line[z];
                        mean[plane + z] += from_centre * line[z];
                        mean[2 * plane + z] += share * slope[z];
                    }
                }
            }
        }
    });
    std::fill_n(of_values, channels * Blocks::FIELDS * count, 0.0f);
    for (int x = 0; x < gradient.n[0]; ++x) {
        const Between across_x = between(blocks, 0, x);
        for (int channel = 0; channel < channels; ++channel) {
            const float *const mean = planes.data() + (std::size_t(x) * channels + channel) * PARTS * plane;
            for (int side = 0; side < 2; ++side) {
                const float share = factor * (side ? across_x.fraction : 1 - across_x.fraction);
                const float from_centre = share * (across_x.fraction - float(side));
                float *const to =
                    of_values + channel * Blocks::FIELDS * count + (across_x.block + side) * plane;
                for (std::size_t i = 0; i < plane; ++i) {
                    to[i] += share * mean[i];
                    to[count + i] += from_centre * mean[i];
                    to[2 * count + i] += share * mean[plane + i];
                    to[3 * count + i] += share * mean[2 * plane + i];
                }
            }
        }
    }
}

} // namespace smokelift
