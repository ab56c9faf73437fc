#include "pictures.h"

#include "exponential.h"

#include <algorithm>
#include <cmath>

namespace smokelift {
namespace {

constexpr std::size_t READS_PER_TASK = 1 << 16; // points of a picture
constexpr int TOGETHER = 256;                   // voxels along z that are computed together
constexpr int RUN = 32;                         // voxels along z that are projected together
constexpr double MIN_DEPTH = 1e-12;             // m; a voxel in the plane of the eye is in no picture

// Homogeneous pixel coordinates along a row of voxels.
struct PixelRow {
    std::array<double, 3> start{}, along{}, end{};

    SMOKELIFT_INLINE PixelRow(const PictureMap &map, int i, int j) {
        for (int c = 0; c < 3; ++c) {
            const auto &m = map.to_pixel[c];
            start[c] = std::fma(map.centers[1][j], m[1], map.centers[0][i] * m[0]);
            along[c] = m[2];
            end[c] = m[3];
        }
    }
    SMOKELIFT_INLINE double at(int c, double z) const { return (start[c] + z * along[c]) + end[c]; }
};

struct Place {
    float row, column;
    bool visible;
};

SMOKELIFT_INLINE Place place_of(const PixelRow &line, double z, int rows, int columns) {
    const double depth = line.at(2, z);
    const double safe = std::abs(depth) < MIN_DEPTH ? MIN_DEPTH : depth;
    const double column = line.at(0, z) / safe - 0.5, row = line.at(1, z) / safe - 0.5;
    const bool inside =
        (column > -0.5) & (column < columns - 0.5) & (row > -0.5) & (row < rows - 0.5) & (depth > 0);
    return {float(row), float(column), inside};
}

SMOKELIFT_INLINE Place place_of(const PictureMap &map, const PixelRow &line, int k) {
    return place_of(line, map.centers[2][k], map.rows, map.columns);
}

SMOKELIFT_INLINE int pixel(float place, int count) {
    return static_cast<int>(std::clamp(std::nearbyint(place), 0.0f, float(count - 1)));
}

// The places of neighbors along z from z on, of which the first is number `at` of the marked voxels.
SMOKELIFT_CLONES
void places_of_row(const PictureMap &map, const PixelRow &line, int z, int count, std::size_t at,
                   const Places &places) {
    for (int k = z; k < z + count; ++k, ++at) {
        const Place found = place_of(map, line, k);
        places.rows[at] = found.row;
        places.columns[at] = found.column;
        places.visible[at] = found.visible;
    }
}

// How many pixels above and left of each corner of a pixel are marked.
class MarkedPixels {
public:
    MarkedPixels(const PictureMap &map, const unsigned char *picture)
        : width_(map.columns + 1), sums_(std::size_t(map.rows + 1) * width_) {
        for (int row = 0; row < map.rows; ++row) {
            int *const above = sums_.data() + std::size_t(row) * width_, *const sums = above + width_;
            for (int column = 0, inside = 0; column < map.columns; ++column) {
                inside += picture[std::size_t(row) * map.columns + column];
                sums[column + 1] = above[column + 1] + inside;
            }
        }
    }

    // Whether any may be within a pixel of the box around two places.
    bool near(const PictureMap &map, const Place &a, const Place &b) const {
        const auto [top, bottom] = std::minmax(a.row, b.row);
        const auto [left, right] = std::minmax(a.column, b.column);
        const int *const first = sums_.data() + std::size_t(index_within(top - 1, 0, map.rows)) * width_;
        const int *const last = sums_.data() + std::size_t(index_within(bottom + 3, 0, map.rows)) * width_;
        const int low = index_within(left - 1, 0, map.columns),
                  high = index_within(right + 3, 0, map.columns);
        return last[high] - last[low] - first[high] + first[low] > 0;
    }

private:
    int width_;
    std::vector<int> sums_;
};

SMOKELIFT_CLONES
void mark_run(const PictureMap &map, const unsigned char *picture, const PixelRow &line, int begin, int end,
              bool *shown) {
    for (int k = begin; k < end; ++k) {
        const Place found = place_of(map, line, k);
        const std::size_t at =
            std::size_t(pixel(found.row, map.rows)) * map.columns + pixel(found.column, map.columns);
        shown[k] = found.visible && picture[at];
    }
}

void mark_plane(const PictureMap &map, const unsigned char *picture, const MarkedPixels &marked, int i,
                bool *shown) {
    const Shape n = map.shape();
    for (int j = 0; j < n[1]; ++j, shown += n[2]) {
        const PixelRow line(map, i, j);
        for (int begin = 0; begin < n[2]; begin += RUN) {
            const int end = std::min(begin + RUN, n[2]);
            const double near = line.at(2, map.centers[2][begin]), far = line.at(2, map.centers[2][end - 1]);
            // before the camera, what lies between two voxels is seen between them
            if (near > MIN_DEPTH && far > MIN_DEPTH &&
                !marked.near(map, place_of(map, line, begin), place_of(map, line, end - 1)))
                std::fill(shown + begin, shown + end, false);
            else
                mark_run(map, picture, line, begin, end, shown);
        }
    }
}

// A picture read bilinearly; the nearest pixel's value outside.
SMOKELIFT_INLINE float read_at(const double *__restrict picture, int rows, int columns, float at_row,
                               float at_column) {
    const double row = std::clamp(double(at_row), 0.0, double(rows - 1));
    const double column = std::clamp(double(at_column), 0.0, double(columns - 1));
    const int i = static_cast<int>(row), j = static_cast<int>(column);
    const double f = row - i, g = column - j;
    const int upper = i * columns, lower = std::min(i + 1, rows - 1) * columns;
    const int next = std::min(j + 1, columns - 1);
    const double near = (picture[upper + j] * (1 - f)) * (1 - g);
    const double far = (picture[upper + next] * (1 - f)) * g;
    const double near_below = (picture[lower + j] * f) * (1 - g);
    const double far_below = (picture[lower + next] * f) * g;
    return float(((near + far) + near_below) + far_below);
}

SMOKELIFT_CLONES
void read_range(const double *__restrict picture, int rows, int columns, const float *__restrict at_rows,
                const float *__restrict at_columns, std::size_t begin, std::size_t end,
                float *__restrict values) {
    for (std::size_t n = begin; n < end; ++n)
        values[n] = read_at(picture, rows, columns, at_rows[n], at_columns[n]);
}

// The picture of a map read at voxels of a row, no more than TOGETHER; 0 where they are not in it.
SMOKELIFT_CLONES
void read_row(const double *picture, const PictureMap &map, const PixelRow &line, int first, int count,
              float *__restrict values) {
    const PixelRow own = line; // no array that is written may be it
    const int bottom = map.rows, right = map.columns;
    const double *const z = map.centers[2].data() + first;
    float rows[TOGETHER] = {}, columns[TOGETHER] = {}, shown[TOGETHER];
    for (int n = 0; n < count; ++n) {
        const Place found = place_of(own, z[n], bottom, right);
        rows[n] = found.row;
        columns[n] = found.column;
        shown[n] = found.visible ? 1.0f : 0.0f;
    }
    read_range(picture, map.rows, map.columns, rows, columns, 0, std::size_t(count), values);
    for (int n = 0; n < count; ++n)
        values[n] *= shown[n];
}

SMOKELIFT_CLONES
void scale_evenly(const float *__restrict steps, float fraction, const float *values, float *scaled,
                  int count) {
    for (int n = 0; n < count; ++n)
        scaled[n] = values[n] * exponential(fraction * steps[n]);
}

SMOKELIFT_CLONES
void scale_unevenly(const float *__restrict steps, const RayScale &scale, const float *__restrict plausible,
                    const float *values, float *scaled, int count) {
    const float fraction = scale.fraction, floor = scale.floor, max_gain = scale.max_gain;
    for (int n = 0; n < count; ++n) {
        const float step = steps[n], value = values[n];
        const float wanted = plausible[n] + floor, reached = value * exponential(step) + floor;
        const float gain = step < 0 ? reached / wanted : wanted / reached;
        scaled[n] = value * exponential(fraction * step * (gain < max_gain ? gain : max_gain));
    }
}

// exp(-(distance / width)^(halves / 2)) of the distance from a middle in depth, in the place of the middles.
SMOKELIFT_CLONES
void profile_row(double start, double along, const double *__restrict z, int halves,
                 const float *__restrict widths, float *__restrict shapes, int count) {
    float root[TOGETHER], power[TOGETHER];
    for (int n = 0; n < count; ++n) {
        root[n] = std::sqrt(std::abs(float(start + z[n] * along) - shapes[n]) / widths[n]);
        power[n] = 1;
    }
    for (int half = 0; half < halves; ++half)
        for (int n = 0; n < count; ++n)
            power[n] *= root[n];
    for (int n = 0; n < count; ++n)
        shapes[n] = attenuation(power[n]).transmittance;
}

} // namespace

void find_places(const PictureMap &map, const MarkedVoxels &voxels, const Places &places, Workers &workers) {
    workers.run(voxels.shape()[0], [&](int x) {
        voxels.in_plane(x, [&](int y, int z, int count, std::size_t at) {
            places_of_row(map, PixelRow(map, x, y), z, count, at, places);
        });
    });
}

void mark_shown(const PictureMap &map, const unsigned char *picture, bool *shown, Workers &workers) {
    const Shape n = map.shape();
    const MarkedPixels marked(map, picture);
    workers.run(n[0],
                [&](int i) { mark_plane(map, picture, marked, i, shown + std::size_t(i) * n[1] * n[2]); });
}

void scale_along_rays(const RayScale &scale, const PictureMap &map, const MarkedVoxels &voxels,
                      const float *values, float *scaled, Workers &workers) {
    workers.run(voxels.shape()[0], [&](int x) {
        float steps[TOGETHER];
        voxels.in_plane(x, [&](int y, int z, int length, std::size_t first) {
            const PixelRow line(map, x, y);
            for (int begin = 0; begin < length; begin += TOGETHER) {
                const int count = std::min(length - begin, TOGETHER);
                const std::size_t at = first + std::size_t(begin);
                read_row(scale.logarithm, map, line, z + begin, count, steps);
                if (scale.plausible)
                    scale_unevenly(steps, scale, scale.plausible + at, values + at, scaled + at, count);
                else
                    scale_evenly(steps, scale.fraction, values + at, scaled + at, count);
            }
        });
    });
}

void read_bilinearly(const double *picture, int rows, int columns, const float *at_rows,
                     const float *at_columns, std::size_t count, float *values, Workers &workers) {
    workers.run_ranges(count, READS_PER_TASK, [&](std::size_t begin, std::size_t end) {
        read_range(picture, rows, columns, at_rows, at_columns, begin, end, values);
    });
}

void find_profile(const DepthProfile &profile, const MarkedVoxels &voxels, const float *at_rows,
                  const float *at_columns, float *shapes, float *widths, Workers &workers) {
    const auto read = [&](const double *picture, float *values) {
        read_bilinearly(picture, profile.rows, profile.columns, at_rows, at_columns, voxels.count(), values,
                        workers);
    };
    read(profile.middle, shapes), read(profile.width, widths);
    const std::vector<double> &places_z = profile.places[2];
    const auto &d = profile.depth;
    workers.run(voxels.shape()[0], [&](int x) {
        voxels.in_plane(x, [&](int y, int z, int length, std::size_t first) {
            const double start = profile.places[0][x] * d[0] + profile.places[1][y] * d[1];
            for (int begin = 0; begin < length; begin += TOGETHER) {
                const std::size_t at = first + std::size_t(begin);
                profile_row(start, d[2], places_z.data() + z + begin, profile.halves, widths + at,
                            shapes + at, std::min(length - begin, TOGETHER));
            }
        });
    });
}

} // namespace smokelift
