// The sweep of a point light, and its adjoint.
//
// A voxel belongs to the face of the cube around the light through which it is seen: to the axis along which
// it is farthest from the light. For each face the columns of the parallel sweep become rays from the light
// with slopes p / D, q / D, where D is the distance of the domain's farthest plane: there they are one voxel
// apart, nearer to the light they are closer together. Columns sample the planes (S), a running sum goes
// along them (K, midpoint rule), and voxels interpolate between columns (T): optical depth = T K S kappa. The
// adjoint is S' K' T', with each plane written by one task only.
#include "lighting.h"

#include "exponential.h"
#include "phase.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

namespace smokelift {
namespace {

constexpr int ROWS_PER_TASK = 8; // rows of columns of voxels

// A face with the light it belongs to, over a grid.
struct Cone : PointLight::Face {
    std::array<double, 3> light;
    int count_b, count_c, first_p, count_p, first_q, count_q; // of voxels, and of columns

    Cone(const PointLight::Face &face, const PointLight &of, const Shape &n)
        : Face(face), light(of.position), count_b(n[LATERAL[axis][0]]), count_c(n[LATERAL[axis][1]]),
          first_p(columns_b[0]), count_p(columns_b[1]), first_q(columns_c[0]), count_q(columns_c[1]) {}

    int plane(int number) const { return first + travel * number; }
    double distance(int number) const { return travel * (plane(number) - light[axis]); }
    double light_b() const { return light[LATERAL[axis][0]]; }
    double light_c() const { return light[LATERAL[axis][1]]; }
    std::size_t size() const { return std::size_t(planes) * count_p * count_q; }
    std::size_t offset(int number, int p) const {
        return (std::size_t(number) * count_p + (p - first_p)) * count_q;
    }
    // Length of column (p, q) between two planes, in voxels.
    float length(int p, int q) const {
        return static_cast<float>(std::sqrt(1 + (double(p) * p + double(q) * q) / (far * far)));
    }
    bool owns(int lateral, int index, double distance) const {
        const double across = std::abs(index - light[lateral]);
        return axis < lateral ? across <= distance : across < distance;
    }
    // The voxels of a lateral axis that belong to this face, first and end.
    Span owned(int lateral, int count, double distance) const {
        int first = index_within(std::floor(light[lateral] - distance), 0, count);
        int end = index_within(std::ceil(light[lateral] + distance) + 1, 0, count);
        while (first < end && !owns(lateral, first, distance))
            ++first;
        while (first < end && !owns(lateral, end - 1, distance))
            --end;
        return {first, end};
    }
};

bool row_is_empty(const Spans &spans, const Cone &cone, int k, int i) {
    for (int row = i; row <= i + 1; ++row) {
        if (row >= 0 && row < cone.count_b) {
            const auto &span = spans.row(cone.axis, k, row);
            if (span[0] < span[1])
                return false;
        }
    }
    return true;
}

// The columns of row p that meet plane k where its footprint can hold smoke: visit(q, j, g) with the position
// j + g.
template <class Visit>
SMOKELIFT_INLINE void along_row(const Cone &cone, double distance, const Visit &visit) {
    const double scale = distance / cone.far, light = cone.light_c();
    const int low = cone.first_q, end = low + cone.count_q;
    const int first = index_within(std::ceil((-1 - light) / scale), low, end);
    const int last = index_within(std::floor((cone.count_c - light) / scale), low - 1, end - 1);
    for (int q = first; q <= last; ++q) {
        const double c = light + q * scale;
        if (c >= -1 && c < cone.count_c) {
            const int j = static_cast<int>(std::floor(c));
            visit(q, j, static_cast<float>(c - j));
        }
    }
}

// columns = K S kappa for some rows of columns: optical depths.
SMOKELIFT_CLONES
void accumulate(const Cone &cone, const Voxels &medium, const Spans &spans, float voxel_size, int task,
                float *columns) {
    const int end = std::min(cone.count_p, (task + 1) * ROWS_PER_TASK);
    const Stride along_b = medium.stride(LATERAL[cone.axis][0]),
                 along_c = medium.stride(LATERAL[cone.axis][1]);
    std::vector<float> sums(cone.count_q);
    for (int p = cone.first_p + task * ROWS_PER_TASK; p < cone.first_p + end; ++p) {
        std::fill(sums.begin(), sums.end(), 0.0f);
        for (int number = 0; number < cone.planes; ++number) {
            const int k = cone.plane(number);
            float *const out = columns + cone.offset(number, p);
            std::copy(sums.begin(), sums.end(), out);
            const double distance = cone.distance(number), b = cone.light_b() + p * distance / cone.far;
            if (!(b >= -1 && b < cone.count_b))
                continue;
            const int i = static_cast<int>(std::floor(b));
            if (row_is_empty(spans, cone, k, i))
                continue;
            const float f = static_cast<float>(b - i);
            const float *const row = medium.at(cone.axis, k, i, 0);
            along_row(cone, distance, [&](int q, int j, float g) SMOKELIFT_INLINE_LAMBDA {
                const float *at = row + j * along_c;
                const float value = (1 - f) * ((1 - g) * at[0] + g * at[along_c]) +
                                    f * ((1 - g) * at[along_b] + g * at[along_b + along_c]);
                const float step = voxel_size * cone.length(p, q) * value;
                out[q - cone.first_q] += 0.5f * step;
                sums[q - cone.first_q] += step;
            });
        }
    }
}

// The voxels of a plane that this face owns, row by row: visit(k, i, first, end, p, f, column) where `column`
// points to the columns of row p.
template <class Visit>
SMOKELIFT_INLINE void owned_rows(const Cone &cone, const Spans &spans, int number, float *columns,
                                 const Visit &visit) {
    const int k = cone.plane(number), b = LATERAL[cone.axis][0], c = LATERAL[cone.axis][1];
    const double distance = cone.distance(number), scale = cone.far / distance;
    const auto rows = cone.owned(b, cone.count_b, distance), inside = cone.owned(c, cone.count_c, distance);
    for (int i = rows[0]; i < rows[1]; ++i) {
        const auto &span = spans.row(cone.axis, k, i);
        const int first = std::max(span[0], inside[0]), end = std::min(span[1], inside[1]);
        if (first >= end)
            continue;
        const double at = (i - cone.light_b()) * scale;
        const int p = static_cast<int>(std::floor(at));
        visit(k, i, first, end, static_cast<float>(at - p), columns + cone.offset(number, p));
    }
}

// Optical depth of the voxels of a row, from the columns around them.
SMOKELIFT_INLINE void depth_row(const Cone &cone, int number, int first, int end, float f, const float *near,
                                float *__restrict depth) {
    const double scale = cone.far / cone.distance(number);
    const float *const far = near + cone.count_q;
    for (int c = first; c < end; ++c) {
        const double at = (c - cone.light_c()) * scale - cone.first_q;
        const int q = static_cast<int>(at); // not negative
        const float g = static_cast<float>(at - q);
        depth[c - first] =
            (1 - f) * ((1 - g) * near[q] + g * near[q + 1]) + f * ((1 - g) * far[q] + g * far[q + 1]);
    }
}

SMOKELIFT_CLONES
void shade_plane(const Cone &cone, const Voxels &medium, const Spans &spans, const Phase &phase,
                 const PointLight &light, bool add, int number, float *columns) {
    const Stride stride = medium.stride(LATERAL[cone.axis][1]);
    std::vector<float> memory(2 * cone.count_c);
    float *const __restrict lit = memory.data(), *const __restrict depth = lit + cone.count_c;
    owned_rows(cone, spans, number, columns,
               [&](int k, int i, int first, int end, float f, const float *near) SMOKELIFT_INLINE_LAMBDA {
                   phase_row(phase, light, cone.axis, k, i, first, end, lit);
                   depth_row(cone, number, first, end, f, near, depth);
                   for (int c = 0; c < end - first; ++c)
                       lit[c] *= attenuation(depth[c]).transmittance;
                   write_inscatter(medium, medium.at(cone.axis, k, i, first), stride, light.energy.data(),
                                   lit, end - first, add);
               });
}

// back = T' (derivative by the optical depth at the voxels).
SMOKELIFT_CLONES
void gather_plane(const Cone &cone, const Voxels &gradient, const Spans &spans, const Phase &phase,
                  const PointLight &light, int number, float *columns, float *back) {
    const Stride stride = gradient.stride(LATERAL[cone.axis][1]);
    std::vector<float> memory(2 * cone.count_c);
    float *const __restrict depth_gradient = memory.data(), *const __restrict depth =
                                                                depth_gradient + cone.count_c;
    const double scale = cone.far / cone.distance(number);
    std::fill_n(back + cone.offset(number, cone.first_p), std::size_t(cone.count_p) * cone.count_q, 0.0f);
    owned_rows(cone, spans, number, columns,
               [&](int k, int i, int first, int end, float f, const float *near) SMOKELIFT_INLINE_LAMBDA {
                   phase_row(phase, light, cone.axis, k, i, first, end, depth_gradient);
                   depth_row(cone, number, first, end, f, near, depth);
                   const float *in = gradient.at(cone.axis, k, i, first) + 1;
                   float *const to_near = back + (near - columns), *const to_far = to_near + cone.count_q;
                   for (int c = 0; c < end - first; ++c) {
                       float inscatter_gradient = 0;
                       for (int channel = 0; channel < gradient.width - 1; ++channel)
                           inscatter_gradient -= light.energy[channel] * in[c * stride + channel];
                       const float value =
                           depth_gradient[c] * inscatter_gradient * attenuation(depth[c]).transmittance;
                       const double at = (first + c - cone.light_c()) * scale - cone.first_q;
                       const int q = static_cast<int>(at);
                       const float g = static_cast<float>(at - q);
                       to_near[q] += (1 - f) * (1 - g) * value;
                       to_near[q + 1] += (1 - f) * g * value;
                       to_far[q] += f * (1 - g) * value;
                       to_far[q + 1] += f * g * value;
                   }
               });
}

// back = K' back, in place.
SMOKELIFT_CLONES
void sum_back(const Cone &cone, float voxel_size, int task, float *back) {
    const int end = std::min(cone.count_p, (task + 1) * ROWS_PER_TASK);
    std::vector<float> sums(cone.count_q), lengths(cone.count_q);
    for (int p = cone.first_p + task * ROWS_PER_TASK; p < cone.first_p + end; ++p) {
        std::fill(sums.begin(), sums.end(), 0.0f);
        for (int q = 0; q < cone.count_q; ++q)
            lengths[q] = voxel_size * cone.length(p, cone.first_q + q);
        for (int number = cone.planes - 1; number >= 0; --number) {
            float *__restrict row = back + cone.offset(number, p);
            for (int q = 0; q < cone.count_q; ++q) {
                const float value = row[q];
                row[q] = lengths[q] * (sums[q] + 0.5f * value);
                sums[q] += value;
            }
        }
    }
}

// gradient += S' back.
SMOKELIFT_CLONES
void scatter_plane(const Cone &cone, const Voxels &gradient, const Spans &spans, int number,
                   const float *back) {
    const Stride along_b = gradient.stride(LATERAL[cone.axis][0]),
                 along_c = gradient.stride(LATERAL[cone.axis][1]);
    const int k = cone.plane(number);
    const double distance = cone.distance(number);
    for (int p = cone.first_p; p < cone.first_p + cone.count_p; ++p) {
        const double b = cone.light_b() + p * distance / cone.far;
        if (!(b >= -1 && b < cone.count_b))
            continue;
        const int i = static_cast<int>(std::floor(b));
        if (row_is_empty(spans, cone, k, i))
            continue;
        const float f = static_cast<float>(b - i);
        float *const row = gradient.at(cone.axis, k, i, 0);
        const float *const values = back + cone.offset(number, p);
        along_row(cone, distance, [&](int q, int j, float g) SMOKELIFT_INLINE_LAMBDA {
            float *at = row + j * along_c;
            const float value = values[q - cone.first_q];
            at[0] += (1 - f) * (1 - g) * value;
            at[along_c] += (1 - f) * g * value;
            at[along_b] += f * (1 - g) * value;
            at[along_b + along_c] += f * g * value;
        });
    }
}

int row_tasks(const Cone &cone) { return (cone.count_p + ROWS_PER_TASK - 1) / ROWS_PER_TASK; }

} // namespace

void shade(const Voxels &medium, const Spans &spans, const Phase &phase, const PointLight &light, bool add,
           Workers &workers) {
    for (const PointLight::Face &face : light.faces) {
        const Cone cone(face, light, medium.n);
        const std::unique_ptr<float[]> columns(new float[cone.size()]);
        workers.run(row_tasks(cone), [&](int task) {
            accumulate(cone, medium, spans, light.voxel_size, task, columns.get());
        });
        workers.run(cone.planes, [&](int number) {
            shade_plane(cone, medium, spans, phase, light, add, number, columns.get());
        });
    }
}

void shade_adjoint(const Voxels &medium, const Voxels &gradient, const Spans &spans, const Phase &phase,
                   const PointLight &light, Workers &workers) {
    for (const PointLight::Face &face : light.faces) {
        const Cone cone(face, light, medium.n);
        const std::unique_ptr<float[]> columns(new float[cone.size()]), back(new float[cone.size()]);
        workers.run(row_tasks(cone), [&](int task) {
            accumulate(cone, medium, spans, light.voxel_size, task, columns.get());
        });
        workers.run(cone.planes, [&](int number) {
            gather_plane(cone, gradient, spans, phase, light, number, columns.get(), back.get());
        });
        workers.run(row_tasks(cone), [&](int task) { sum_back(cone, light.voxel_size, task, back.get()); });
        workers.run(cone.planes,
                    [&](int number) { scatter_plane(cone, gradient, spans, number, back.get()); });
    }
}

} // namespace smokelift
