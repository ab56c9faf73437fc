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
Span voxels_in(const Blocks &blocks, int axis, int block, int count) {
    const int first = block * blocks.size - blocks.offset[axis];
    return {std::max(first, 0), std::min(first + blocks.size, count)};
}

std::size_t row_of(const Blocks &blocks, int x, int y) {
    return (std::size_t(x) * blocks.n[1] + y) * blocks.n[2];
}

// Distance of a voxel's center from that of its block, over the mean square of those of all voxels, in
// blocks: the slope of the straight line that fits a block's values best is the mean of the values times
// this.
float lever_of(const Blocks &blocks, int axis, int voxel) {
    const auto size = float(blocks.size);
    const int place = (voxel + blocks.offset[axis]) % blocks.size;
    return blocks.size > 1 ? 12 * size / (size * size - 1) * (float(place) + 0.5f - 0.5f * size) : 0.0f;
}

// Of voxels along z: their blocks and levers.
struct AlongZ {
    std::vector<int> block;
    std::vector<float> lever;

    AlongZ(const Blocks &blocks, int count) : block(count), lever(count) {
        for (int z = 0; z < count; ++z) {
            block[z] = block_of(blocks, 2, z);
            lever[z] = lever_of(blocks, 2, z);
        }
    }
};

// A plane of voxels across x takes and gives whole rows along z: rows of voxels in a loop that vectorises,
// and of the few rows of blocks each place along z by itself.

// Adds plane x of the voxels to plane `block_x` of means; `sums` of the rows in a block, by place along z.
SMOKELIFT_CLONES
void average_plane(const Voxels &medium, const Spans &spans, const Blocks &blocks, const AlongZ &along_z,
                   int block_x, int x, float *means) {
    const int length = medium.n[2], channels = medium.width - 1;
    const std::size_t count = blocks.count();
    const float voxel_weight = 1.0f / float(blocks.size * blocks.size * blocks.size);
    const float along_x = lever_of(blocks, 0, x);
    std::vector<float> memory((3 + 2 * std::size_t(channels)) * length);
    float *const __restrict kappa = memory.data(), *const __restrict radiance = kappa + length;
    float *const sums = radiance + length;
    for (int block_y = 0; block_y < blocks.n[1]; ++block_y) {
        const auto [first, end] = voxels_in(blocks, 1, block_y, medium.n[1]);
        Span filled{0, 0};
        std::fill_n(sums, (1 + 2 * channels) * length, 0.0f);
        for (int y = first; y < end; ++y) {
            const auto &span = spans.along_z[std::size_t(x) * medium.n[1] + y];
            if (span[0] >= span[1])
                continue;
            filled = joined(filled, span);
            const float along_y = lever_of(blocks, 1, y);
            const float *const voxel = medium.at(x, y, 0);
            load_row(voxel + span[0] * medium.width, medium.width, span[1] - span[0], kappa + span[0]);
            float *const __restrict extinction = sums;
            for (int z = span[0]; z < span[1]; ++z)
                extinction[z] += kappa[z];
            for (int channel = 0; channel < channels; ++channel) {
                load_row(voxel + span[0] * medium.width + 1 + channel, medium.width, span[1] - span[0],
                         radiance + span[0]);
                float *const __restrict emission = sums + (1 + 2 * channel) * length;
                float *const __restrict lifted = emission + length;
                for (int z = span[0]; z < span[1]; ++z) {
                    const float value = kappa[z] * radiance[z];
                    emission[z] += value;
                    lifted[z] += value * along_y;
                }
            }
        }
        float *const row = means + row_of(blocks, block_x, block_y);
        for (int z = filled[0]; z < filled[1]; ++z) {
            float *out = row + along_z.block[z];
            out[0] += voxel_weight * sums[z];
            for (int channel = 0; channel < channels; ++channel) {
                const float emission = voxel_weight * sums[(1 + 2 * channel) * length + z];
                float *const fields = out + (1 + channel * Blocks::FIELDS) * count;
                fields[0] += emission;
                fields[count] += emission * along_x;
                fields[2 * count] += voxel_weight * sums[(2 + 2 * channel) * length + z];
                fields[3 * count] += emission * along_z.lever[z];
            }
        }
    }
}

// Adds to the derivatives by the extinction and by J, `channel` floats behind it, those by their product, the
// emission.
SMOKELIFT_INLINE void add_products(const Span &span, const float *__restrict voxel,
                                   const float *__restrict emission_gradient, float along_y, int length,
                                   int width, int channel, float *__restrict out) {
    const float *const __restrict lifted_gradient = emission_gradient + length;
    for (int z = span[0]; z < span[1]; ++z) {
        const float value = emission_gradient[z] + along_y * lifted_gradient[z];
        out[z * width] += value * voxel[z * width + channel];
        out[z * width + channel] += value * voxel[z * width];
    }
}

SMOKELIFT_CLONES
void average_adjoint_plane(const Voxels &medium, const Spans &spans, const Blocks &blocks,
                           const AlongZ &along_z, const float *means_gradient, const Voxels &gradient,
                           int x) {
    const int width = medium.width, length = medium.n[2];
    const std::size_t count = blocks.count();
    const float voxel_weight = 1.0f / float(blocks.size * blocks.size * blocks.size);
    const float along_x = lever_of(blocks, 0, x);
    std::vector<float> memory((2 * std::size_t(width) - 1) * length);
    for (int block_y = 0; block_y < blocks.n[1]; ++block_y) {
        const auto [first, end] = voxels_in(blocks, 1, block_y, medium.n[1]);
        Span filled{0, 0};
        for (int y = first; y < end; ++y)
            filled = joined(filled, spans.along_z[std::size_t(x) * medium.n[1] + y]);
        const float *const row = means_gradient + row_of(blocks, block_of(blocks, 0, x), block_y);
        for (int z = filled[0]; z < filled[1]; ++z) {
            const float *const in = row + along_z.block[z];
            memory[z] = voxel_weight * in[0];
            for (int channel = 0; channel < width - 1; ++channel) {
                const float *const fields = in + (1 + channel * Blocks::FIELDS) * count;
                float *const out = memory.data() + (1 + 2 * channel) * length + z;
                out[0] = voxel_weight *
                         (fields[0] + along_x * fields[count] + along_z.lever[z] * fields[3 * count]);
                out[length] = voxel_weight * fields[2 * count];
            }
        }
        for (int y = first; y < end; ++y) {
            const auto &span = spans.along_z[std::size_t(x) * medium.n[1] + y];
            const float along_y = lever_of(blocks, 1, y);
            const float *const voxel = medium.at(x, y, 0);
            float *const out = gradient.at(x, y, 0);
            for (int z = span[0]; z < span[1]; ++z)
                out[z * width] += memory[z];
            for (int channel = 0; channel < width - 1; ++channel) {
                const float *const emission_gradient = memory.data() + (1 + 2 * channel) * length;
                if (width == 2) // neighbors in memory
                    add_products(span, voxel, emission_gradient, along_y, length, 2, 1, out);
                else
                    add_products(span, voxel, emission_gradient, along_y, length, width, channel + 1, out);
            }
        }
    }
}

// A channel on the rows of voxels through the centers of blocks in a plane across x: for each row of blocks
// the values, and their slope along y.
SMOKELIFT_CLONES
void expand(const float *fields, const Blocks &blocks, const Between &across_x,
            const std::vector<Between> &along_z, float *rows) {
    const std::size_t count = blocks.count(), length = along_z.size();
    const float near = 1 - across_x.fraction, far = across_x.fraction, bent = near * far;
    const std::size_t next = std::size_t(blocks.n[1]) * blocks.n[2];
    std::vector<float> line(3 * std::size_t(blocks.n[2]));
    float *const __restrict mean = line.data(), *const __restrict slope_y = mean + blocks.n[2];
    float *const __restrict slope_z = slope_y + blocks.n[2];
    for (int y = 0; y < blocks.n[1]; ++y) {
        const float *const __restrict in = fields + row_of(blocks, across_x.block, y);
        for (int z = 0; z < blocks.n[2]; ++z) {
            mean[z] = near * in[z] + far * in[next + z] + bent * (in[count + z] - in[count + next + z]);
            slope_y[z] = near * in[2 * count + z] + far * in[2 * count + next + z];
            slope_z[z] = near * in[3 * count + z] + far * in[3 * count + next + z];
        }
        float *const __restrict out = rows + 2 * y * length;
        for (std::size_t z = 0; z < length; ++z) {
            const auto [b, f] = along_z[z];
            out[z] = mean[b] + f * (mean[b + 1] - mean[b] + (1 - f) * (slope_z[b] - slope_z[b + 1]));
            out[length + z] = slope_y[b] + f * (slope_y[b + 1] - slope_y[b]);
        }
    }
}

SMOKELIFT_CLONES
void expand_adjoint(const float *rows, const Blocks &blocks, const std::vector<Between> &along_z,
                    float *part) {
    const std::size_t length = along_z.size(), plane = std::size_t(blocks.n[1]) * blocks.n[2];
    for (int y = 0; y < blocks.n[1]; ++y) {
        const float *const in = rows + 2 * y * length;
        float *const mean = part + std::size_t(y) * blocks.n[2];
        float *const slope_y = mean + plane, *const slope_z = slope_y + plane;
        for (std::size_t z = 0; z < length; ++z) {
            const auto [b, f] = along_z[z];
            const float near = (1 - f) * in[z], bent = f * near;
            mean[b] += near;
            mean[b + 1] += f * in[z];
            slope_y[b] += (1 - f) * in[length + z];
            slope_y[b + 1] += f * in[length + z];
            slope_z[b] += bent;
            slope_z[b + 1] -= bent;
        }
    }
}

// What a row of voxels takes of the two rows of blocks beside it, of their values and of their slopes. At the
// fraction t from one center to the next it is (1 - t) (near + t near_slope) + t (far - (1 - t) far_slope).
struct Mix {
    float near, near_slope, far, far_slope;

    Mix(float fraction, float factor)
        : near(factor * (1 - fraction)), near_slope(near * fraction), far(factor * fraction),
          far_slope(-far * (1 - fraction)) {}
};

SMOKELIFT_CLONES
void add_rows(const float *rows, float factor, const Blocks &blocks, const Voxels &medium, const Spans &spans,
              int x, int channel) {
    const std::size_t length = medium.n[2];
    std::vector<float> memory(length);
    float *const __restrict mixed = memory.data();
    for (int y = 0; y < medium.n[1]; ++y) {
        const auto &span = spans.along_z[std::size_t(x) * medium.n[1] + y];
        const Between across_y = between(blocks, 1, y);
        const Mix mix(across_y.fraction, factor);
        const float *const __restrict near = rows + 2 * across_y.block * length;
        const float *const __restrict far = near + 2 * length;
        for (int z = span[0]; z < span[1]; ++z)
            mixed[z] = mix.near * near[z] + mix.near_slope * near[length + z] + mix.far * far[z] +
                       mix.far_slope * far[length + z];
        float *const __restrict out = medium.at(x, y, 0) + channel;
        for (int z = span[0]; z < span[1]; ++z)
            out[z * medium.width] += mixed[z];
    }
}

SMOKELIFT_CLONES
void gather_rows(const Voxels &gradient, const Spans &spans, const Blocks &blocks, int x, int channel,
                 float *rows) {
    const std::size_t length = gradient.n[2];
    std::vector<float> memory(length);
    float *const __restrict value = memory.data();
    for (int y = 0; y < gradient.n[1]; ++y) {
        const auto &span = spans.along_z[std::size_t(x) * gradient.n[1] + y];
        const Between across_y = between(blocks, 1, y);
        const Mix mix(across_y.fraction, 1);
        load_row(gradient.at(x, y, span[0]) + channel, gradient.width, span[1] - span[0], value + span[0]);
        float *const __restrict near = rows + 2 * across_y.block * length;
        float *const __restrict near_slope = near + length, *const __restrict far = near_slope + length;
        float *const __restrict far_slope = far + length;
        for (int z = span[0]; z < span[1]; ++z) {
            near[z] += mix.near * value[z];
            near_slope[z] += mix.near_slope * value[z];
            far[z] += mix.far * value[z];
            far_slope[z] += mix.far_slope * value[z];
        }
    }
}

} // namespace

void average(const Voxels &medium, const Spans &spans, const Blocks &blocks, float *means, Workers &workers) {
    std::fill_n(means, (1 + (medium.width - 1) * Blocks::FIELDS) * blocks.count(), 0.0f);
    const AlongZ along_z(blocks, medium.n[2]);
    workers.run(blocks.n[0], [&](int block_x) {
        const auto [first, end] = voxels_in(blocks, 0, block_x, medium.n[0]);
        for (int x = first; x < end; ++x)
            average_plane(medium, spans, blocks, along_z, block_x, x, means);
    });
}

void average_adjoint(const Voxels &medium, const Spans &spans, const Blocks &blocks,
                     const float *means_gradient, const Voxels &gradient, Workers &workers) {
    const AlongZ along_z(blocks, medium.n[2]);
    workers.run(medium.n[0], [&](int x) {
        average_adjoint_plane(medium, spans, blocks, along_z, means_gradient, gradient, x);
    });
}

void add_interpolated(const float *values, float factor, const Blocks &blocks, const Voxels &medium,
                      const Spans &spans, Workers &workers) {
    const std::vector<Between> along_z = all_between(blocks, 2, medium.n[2]);
    workers.run(medium.n[0], [&](int x) {
        std::vector<float> rows(2 * std::size_t(blocks.n[1]) * medium.n[2]);
        for (int channel = 1; channel < medium.width; ++channel) {
            expand(values + (channel - 1) * Blocks::FIELDS * blocks.count(), blocks, between(blocks, 0, x),
                   along_z, rows.data());
            add_rows(rows.data(), factor, blocks, medium, spans, x, channel);
        }
    });
}

void interpolate_adjoint(const Voxels &gradient, const Spans &spans, float factor, const Blocks &blocks,
                         float *values_gradient, Workers &workers) {
    const int channels = gradient.width - 1;
    const std::vector<Between> along_z = all_between(blocks, 2, gradient.n[2]);
    const std::size_t plane = std::size_t(blocks.n[1]) * blocks.n[2], count = blocks.count();
    // of voxels along x, of blocks across: of the mean, of the slopes along y and z
    constexpr int PARTS = 3;
    std::vector<float> planes(channels * PARTS * plane * gradient.n[0], 0.0f);
    workers.run(gradient.n[0], [&](int x) {
        for (int channel = 0; channel < channels; ++channel) {
            std::vector<float> rows(2 * std::size_t(blocks.n[1]) * gradient.n[2], 0.0f);
            gather_rows(gradient, spans, blocks, x, channel + 1, rows.data());
            expand_adjoint(rows.data(), blocks, along_z,
                           planes.data() + (std::size_t(x) * channels + channel) * PARTS * plane);
        }
    });
    std::fill_n(values_gradient, channels * Blocks::FIELDS * count, 0.0f);
    for (int x = 0; x < gradient.n[0]; ++x) {
        const Between across_x = between(blocks, 0, x);
        for (int channel = 0; channel < channels; ++channel) {
            const float *const mean = planes.data() + (std::size_t(x) * channels + channel) * PARTS * plane;
            for (int side = 0; side < 2; ++side) {
                const float weight = factor * (side ? across_x.fraction : 1 - across_x.fraction);
                const float from_center = weight * (across_x.fraction - float(side));
                float *const to =
                    values_gradient + channel * Blocks::FIELDS * count + (across_x.block + side) * plane;
                for (std::size_t i = 0; i < plane; ++i) {
                    to[i] += weight * mean[i];
                    to[count + i] += from_center * mean[i];
                    to[2 * count + i] += weight * mean[plane + i];
                    to[3 * count + i] += weight * mean[2 * plane + i];
                }
            }
        }
    }
}

} // namespace smokelift
