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

// Calls visit(z, block) for the voxels of a range of a row.
template <class Visit>
SMOKELIFT_INLINE void along_row(const Blocks &blocks, const std::array<int, 2> &span, const Visit &visit) {
    int z = span[0], block = block_of(blocks, 2, z);
    while (z < span[1]) {
        const int end = std::min(span[1], (block + 1) * blocks.size - blocks.offset[2]);
        for (; z < end; ++z)
            visit(z, block);
        ++block;
    }
}

// A row of values between four rows of blocks.
struct Mixed {
    std::size_t rows[4];
    float weights[4];

    Mixed(const Blocks &blocks, const Between &x, const Between &y) {
        for (int i = 0; i < 4; ++i) {
            rows[i] = row_of(blocks, x.block + i / 2, y.block + i % 2);
            weights[i] = (i / 2 ? x.fraction : 1 - x.fraction) * (i % 2 ? y.fraction : 1 - y.fraction);
        }
    }
};

} // namespace

void average(const Voxels &medium, const Spans &spans, const Blocks &blocks, float *means, Workers &workers) {
    const int width = medium.width;
    const float share = 1.0f / float(blocks.size * blocks.size * blocks.size);
    std::fill_n(means, width * blocks.count(), 0.0f);
    workers.run(blocks.n[0], [&](int block_x) {
        const auto [first, end] = voxels_in(blocks, 0, block_x, medium.n[0]);
        for (int x = first; x < end; ++x) {
            for (int y = 0; y < medium.n[1]; ++y) {
                const auto &span = spans.along_z[std::size_t(x) * medium.n[1] + y];
                const float *in = medium.at(x, y, 0);
                float *const out = means + row_of(blocks, block_x, block_of(blocks, 1, y));
                along_row(blocks, span, [&](int z, int block) SMOKELIFT_INLINE_LAMBDA {
                    const float extinction = share * in[z * width];
                    out[block] += extinction;
                    for (int channel = 1; channel < width; ++channel)
                        out[channel * blocks.count() + block] += extinction * in[z * width + channel];
                });
            }
        }
    });
}

void average_adjoint(const Voxels &medium, const Spans &spans, const Blocks &blocks, const float *of_means,
                     const Voxels &gradient, Workers &workers) {
    const int width = medium.width;
    const float share = 1.0f / float(blocks.size * blocks.size * blocks.size);
    workers.run(medium.n[0], [&](int x) {
        for (int y = 0; y < medium.n[1]; ++y) {
            const auto &span = spans.along_z[std::size_t(x) * medium.n[1] + y];
            const float *voxel = medium.at(x, y, 0);
            const float *const in = of_means + row_of(blocks, block_of(blocks, 0, x), block_of(blocks, 1, y));
            float *const out = gradient.at(x, y, 0);
            along_row(blocks, span, [&](int z, int block) SMOKELIFT_INLINE_LAMBDA {
                float of_extinction = in[block];
                for (int channel = 1; channel < width; ++channel) {
                    const float of_emission = in[channel * blocks.count() + block];
                    of_extinction += of_emission * voxel[z * width + channel];
                    out[z * width + channel] += share * of_emission * voxel[z * width];
                }
                out[z * width] += share * of_extinction;
            });
        }
    });
}

void add_interpolated(const float *values, float factor, const Blocks &blocks, const Voxels &medium,
                      const Spans &spans, Workers &workers) {
    const std::vector<Between> along_z = all_between(blocks, 2, medium.n[2]);
    workers.run(medium.n[0], [&](int x) {
        const Between across_x = between(blocks, 0, x);
        std::vector<float> line(blocks.n[2]);
        for (int y = 0; y < medium.n[1]; ++y) {
            const auto &span = spans.along_z[std::size_t(x) * medium.n[1] + y];
            if (span[0] >= span[1])
                continue;
            const Mixed mixed(blocks, across_x, between(blocks, 1, y));
            float *const out = medium.at(x, y, 0);
            for (int channel = 1; channel < medium.width; ++channel) {
                const float *const of_channel = values + (channel - 1) * blocks.count();
                for (int z = 0; z < blocks.n[2]; ++z) {
                    line[z] = 0;
                    for (int i = 0; i < 4; ++i)
                        line[z] += factor * mixed.weights[i] * of_channel[mixed.rows[i] + z];
                }
                for (int z = span[0]; z < span[1]; ++z) {
                    const auto [block, fraction] = along_z[z];
                    out[z * medium.width + channel] +=
                        line[block] + fraction * (line[block + 1] - line[block]);
                }
            }
        }
    });
}

void interpolate_adjoint(const Voxels &gradient, const Spans &spans, float factor, const Blocks &blocks,
                         float *of_values, Workers &workers) {
    const int channels = gradient.width - 1;
    const std::vector<Between> along_z = all_between(blocks, 2, gradient.n[2]);
    const std::size_t plane = std::size_t(blocks.n[1]) * blocks.n[2];
    std::vector<float> planes(channels * plane * gradient.n[0], 0.0f); // of voxels along x, of blocks across
    workers.run(gradient.n[0], [&](int x) {
        for (int y = 0; y < gradient.n[1]; ++y) {
            const auto &span = spans.along_z[std::size_t(x) * gradient.n[1] + y];
            const Between across_y = between(blocks, 1, y);
            const float *const in = gradient.at(x, y, 0);
            for (int channel = 0; channel < channels; ++channel) {
                float *const near = planes.data() + (std::size_t(x) * channels + channel) * plane +
                                    across_y.block * blocks.n[2];
                float *const far = near + blocks.n[2];
                for (int z = span[0]; z < span[1]; ++z) {
                    const auto [block, fraction] = along_z[z];
                    const float value = in[z * gradient.width + 1 + channel];
                    const float to_far = across_y.fraction * value, to_near = value - to_far;
                    near[block] += (1 - fraction) * to_near;
                    near[block + 1] += fraction * to_near;
                    far[block] += (1 - fraction) * to_far;
                    far[block + 1] += fraction * to_far;
                }
            }
        }
    });
    std::fill_n(of_values, channels * blocks.count(), 0.0f);
    for (int x = 0; x < gradient.n[0]; ++x) {
        const Between across_x = between(blocks, 0, x);
        const float to_far = factor * across_x.fraction, to_near = factor - to_far;
        for (int channel = 0; channel < channels; ++channel) {
            const float *const in = planes.data() + (std::size_t(x) * channels + channel) * plane;
            float *const near = of_values + channel * blocks.count() + across_x.block * plane;
            float *const far = near + plane;
            for (std::size_t i = 0; i < plane; ++i) {
                near[i] += to_near * in[i];
                far[i] += to_far * in[i];
            }
        }
    }
}

} // namespace smokelift
