// The sweep of a parallel light, and its adjoint.
//
// The grid is sheared so that every light ray is a column: column p meets plane k of the light's dominant
// axis at lateral position p + slope k. The fraction of slope k is the same for a whole plane, so going from
// voxels to columns (S) and back (its transpose) are bilinear with constant weights, and between them lies a
// running sum along the columns (K, midpoint rule): optical depth = S^T K S kappa x step. The transpose of
// the running sum is that of the light that travels the other way, so the adjoint is the sweep of the
// reversed light.
//
// Columns do not depend on each other, so a task takes some neighboring rows of them through all planes and
// keeps its running sums in the cache; the row between two tasks is computed by both.
#include "lighting.h"

#include "exponential.h"
#include "phase.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace smokelift {
namespace {

constexpr int ROWS_PER_TASK = 12; // rows of columns of voxels: their sums stay in the cache

struct Columns {
    const ParallelLight &light;
    const Spans &spans;
    int planes, count_b, count_c;  // of the grid: along the axis, along the two others
    int first_p, end_p;            // rows of columns that meet the grid
    int first_q, count_q;          // columns in a row
    std::vector<Span> filled_rows; // of voxels, by plane: first and end of those with a span

    Columns(const ParallelLight &l, const Spans &s) : light(l), spans(s) {
        planes = s.n[l.axis];
        count_b = s.n[LATERAL[l.axis][0]];
        count_c = s.n[LATERAL[l.axis][1]];
        const auto [low_b, high_b] = std::minmax({shift(0, 0), shift(0, planes - 1)});
        const auto [low_c, high_c] = std::minmax({shift(1, 0), shift(1, planes - 1)});
        first_p = -1 - high_b;
        end_p = count_b - low_b;
        first_q = -1 - high_c;
        count_q = count_c - low_c - first_q;
        filled_rows.assign(planes, {count_b, 0});
        for (int k = 0; k < planes; ++k) {
            for (int i = 0; i < count_b; ++i) {
                const auto &span = spans.row(light.axis, k, i);
                if (span[0] < span[1])
                    filled_rows[k] = {std::min(filled_rows[k][0], i), i + 1};
            }
        }
    }
    int shift(int lateral, int k) const {
        return static_cast<int>(std::floor(light.slope[lateral] * (light.first + k)));
    }
    float fraction(int lateral, int k) const {
        const double at = light.slope[lateral] * (light.first + k);
        return static_cast<float>(at - std::floor(at));
    }
    int tasks() const { return (end_p - 1 - first_p + ROWS_PER_TASK - 1) / ROWS_PER_TASK; }
};

// One task's rows of columns on their way through the planes of voxels, with the sum so far in every column.
// A plane is sampled in two steps: rows of voxels are slid along themselves to where the columns are, then
// mixed across.
class Rows {
public:
    SMOKELIFT_INLINE Rows(const Columns &columns, const Voxels &field, int task)
        : columns_(columns), field_(field), axis_(columns.light.axis),
          begin_(columns.first_p + task * ROWS_PER_TASK),
          rows_(std::min(columns.end_p - begin_, ROWS_PER_TASK + 1)), pitch_(columns.count_q),
          width_(columns.count_c + 2),
          memory_(std::size_t(2 * rows_ + 1) * pitch_ + std::size_t(rows_ + 3) * width_),
          sums_(memory_.data()), values_(sums_ + std::size_t(rows_) * pitch_),
          mixed_(values_ + std::size_t(rows_) * pitch_), slid_(mixed_ + pitch_),
          line_(slid_ + std::size_t(rows_ + 1) * width_), depth_(line_ + width_), slid_range_(rows_ + 1),
          filled_(rows_), stride_(field.stride(LATERAL[axis_][1])) {}

    // Goes on to plane k. False if none of the voxels beside these columns is in a span.
    SMOKELIFT_INLINE bool enter(int k) {
        k_ = k;
        shift_b_ = columns_.shift(0, k);
        shift_c_ = columns_.shift(1, k);
        fraction_b_ = columns_.fraction(0, k);
        fraction_c_ = columns_.fraction(1, k);
        first_row_ = std::max(0, columns_.filled_rows[k][0] - begin_ - shift_b_);
        end_row_ = std::min(rows_ + 1, columns_.filled_rows[k][1] - begin_ - shift_b_);
        first_column_ = std::max(0, first_row_ - 1);
        end_column_ = std::min(rows_, end_row_);
        return first_row_ < end_row_;
    }

    // The field where the columns meet the plane.
    SMOKELIFT_INLINE void sample() {
        slide_voxels();
        mix_slid();
        for (int r = first_row_; r < end_row_; ++r) {
            float *const row = slid_ + std::size_t(r) * width_;
            std::fill(row + slid_range_[r][0], row + slid_range_[r][1], 0.0f);
            slid_range_[r] = {0, 0};
        }
    }

    // visit(k, i, first, end, depth) for the rows of voxels between these columns: sums up to their centers,
    // that is with half of the plane's own value.
    template <class Visit> SMOKELIFT_INLINE void visit_voxels(const Visit &visit) const {
        const float f = fraction_b_, g = fraction_c_;
        float *const __restrict mixed = mixed_, *const __restrict depth = depth_;
        for (int r = first_column_; r < std::min(rows_ - 1, end_row_ - 1); ++r) {
            const int i = voxel_row(r + 1); // between columns r and r + 1
            const auto &span = columns_.spans.row(axis_, k_, i);
            const int first = span[0], count = span[1] - span[0];
            if (count <= 0)
                continue;
            const int q = first - shift_c_ - 1 - columns_.first_q;
            const float *__restrict s0 = sums_ + std::size_t(r) * pitch_ + q, *__restrict s1 = s0 + pitch_;
            const float *__restrict v0 = values_ + std::size_t(r) * pitch_ + q, *__restrict v1 = v0 + pitch_;
            for (int c = 0; c <= count; ++c)
                mixed[c] = f * (s0[c] + 0.5f * v0[c]) + (1 - f) * (s1[c] + 0.5f * v1[c]);
            for (int c = 0; c < count; ++c)
                depth[c] = g * mixed[c] + (1 - g) * mixed[c + 1];
            visit(k_, i, first, span[1], depth_);
        }
    }

    // Adds the plane to the sums.
    SMOKELIFT_INLINE void leave() {
        for (int r = first_column_; r < end_column_; ++r) {
            float *__restrict sum = sums_ + std::size_t(r) * pitch_;
            float *__restrict value = values_ + std::size_t(r) * pitch_;
            for (int q = filled_[r][0]; q < filled_[r][1]; ++q) {
                sum[q] += value[q];
                value[q] = 0;
            }
        }
    }

private:
    // The row of voxels before row r of columns.
    SMOKELIFT_INLINE int voxel_row(int r) const { return begin_ + r + shift_b_; }

    // slid[1 + c] is between voxels c and c + 1.
    SMOKELIFT_INLINE void slide_voxels() {
        const float g = fraction_c_;
        for (int r = first_row_; r < end_row_; ++r) {
            const int i = voxel_row(r);
            const auto &span = columns_.spans.row(axis_, k_, i);
            const int count = span[1] - span[0];
            if (count <= 0)
                continue;
            load_row(field_.at(axis_, k_, i, span[0]), stride_, count, line_ + 1);
            line_[0] = line_[count + 1] = 0;
            const float *const line = line_;
            float *__restrict out = slid_ + std::size_t(r) * width_ + span[0];
            for (int c = 0; c <= count; ++c)
                out[c] = line[c] + g * (line[c + 1] - line[c]);
            slid_range_[r] = {span[0], span[1] + 1};
        }
    }

    SMOKELIFT_INLINE void mix_slid() {
        const float f = fraction_b_;
        const int to_q = -1 - shift_c_ - columns_.first_q; // number of the column at slid[0]
        for (int r = first_column_; r < end_column_; ++r) {
            const auto [first, end] = joined(slid_range_[r], slid_range_[r + 1]);
            const float *__restrict near = slid_ + std::size_t(r) * width_, *__restrict far = near + width_;
            float *__restrict value = values_ + std::size_t(r) * pitch_ + to_q;
            for (int c = first; c < end; ++c)
                value[c] = near[c] + f * (far[c] - near[c]);
            filled_[r] = {first + to_q, end + to_q};
        }
    }

    const Columns &columns_;
    const Voxels &field_;
    const int axis_, begin_, rows_; // first row of columns, and how many
    const int pitch_, width_;       // columns in a row, and voxels with their border
    std::vector<float> memory_;
    float *const sums_, *const values_; // of the planes before, of this one: (rows, pitch)
    float *const mixed_;                // a row of columns
    float *const slid_;                 // (rows + 1, width)
    float *const line_, *const depth_;  // rows of voxels
    // where rows of `slid` and of `values` are not zero
    std::vector<Span> slid_range_, filled_;
    const Stride stride_;

    // of the plane: the whole part of its shift and the rest; rows of voxels that are not empty, counted like
    // the rows of columns before them; the rows of columns beside those
    int k_ = 0, shift_b_ = 0, shift_c_ = 0;
    float fraction_b_ = 0, fraction_c_ = 0;
    int first_row_ = 0, end_row_ = 0, first_column_ = 0, end_column_ = 0;
};

// Takes task number `task` of the columns through the field (its first float of each voxel). visit(k, i,
// first, end, depth) gets the sums along the light's way, in units of (value of the field) x planes, for a
// row of voxels.
template <class Visit>
SMOKELIFT_INLINE void sweep(const Columns &columns, const Voxels &field, int task, const Visit &visit) {
    Rows rows(columns, field, task);
    for (int step = 0; step < columns.planes; ++step) {
        if (!rows.enter(columns.light.travel > 0 ? step : columns.planes - 1 - step))
            continue;
        rows.sample();
        rows.visit_voxels(visit);
        rows.leave();
    }
}

SMOKELIFT_CLONES
void shade_columns(const Columns &columns, const Voxels &medium, const Phase &phase, bool add, int task) {
    const ParallelLight &light = columns.light;
    const Stride stride = medium.stride(LATERAL[light.axis][1]);
    std::vector<float> memory(columns.count_c);
    float *const __restrict lit = memory.data();
    sweep(columns, medium, task,
          [&](int k, int i, int first, int end, const float *__restrict depth) SMOKELIFT_INLINE_LAMBDA {
              phase_row(phase, light, light.axis, k, i, first, end, lit);
              for (int c = 0; c < end - first; ++c)
                  lit[c] *= attenuation(light.step * depth[c]).transmittance;
              write_inscatter(medium, medium.at(light.axis, k, i, first), stride, light.energy.data(), lit,
                              end - first, add);
          });
}

// scratch = derivative of the loss by the optical depth to the light: -E p V dJ.
SMOKELIFT_CLONES
void depth_gradient(const Columns &columns, const Voxels &medium, const Voxels &gradient,
                    const Voxels &scratch, const Phase &phase, int task) {
    const ParallelLight &light = columns.light;
    const int c_axis = LATERAL[light.axis][1];
    const Stride stride = gradient.stride(c_axis), scratch_stride = scratch.stride(c_axis);
    std::vector<float> memory(2 * columns.count_c);
    float *const __restrict lit = memory.data(), *const __restrict inscatter_gradient = lit + columns.count_c;
    sweep(columns, medium, task,
          [&](int k, int i, int first, int end, const float *__restrict depth) SMOKELIFT_INLINE_LAMBDA {
              phase_row(phase, light, light.axis, k, i, first, end, lit);
              const float *in = gradient.at(light.axis, k, i, first) + 1;
              std::fill_n(inscatter_gradient, end - first, 0.0f);
              for (int channel = 0; channel < gradient.width - 1; ++channel)
                  for (int c = 0; c < end - first; ++c)
                      inscatter_gradient[c] -= light.energy[channel] * in[c * stride + channel];
              for (int c = 0; c < end - first; ++c)
                  lit[c] *= inscatter_gradient[c] * attenuation(light.step * depth[c]).transmittance;
              float *out = scratch.at(light.axis, k, i, first);
              for (int c = 0; c < end - first; ++c)
                  out[c * scratch_stride] = lit[c];
          });
}

// The same where one light has made all of J: -J dJ, in place of dJ.
SMOKELIFT_CLONES
void depth_gradient_of_all(const Voxels &medium, const Voxels &gradient, const Spans &spans, int x) {
    for (int y = 0; y < medium.n[1]; ++y) {
        const auto &span = spans.along_z[std::size_t(x) * medium.n[1] + y];
        const float *inscatter = medium.at(x, y, 0);
        float *inscatter_gradient = gradient.at(x, y, 0);
        for (int z = span[0]; z < span[1]; ++z) {
            float sum = 0;
            for (int channel = 1; channel < medium.width; ++channel)
                sum -= inscatter[z * medium.width + channel] * inscatter_gradient[z * medium.width + channel];
            inscatter_gradient[z * medium.width + 1] = sum;
        }
    }
}

SMOKELIFT_CLONES
void add_columns(const Columns &columns, const Voxels &scratch, const Voxels &gradient, int task) {
    const ParallelLight &light = columns.light;
    const Stride stride = gradient.stride(LATERAL[light.axis][1]);
    sweep(columns, scratch, task,
          [&](int k, int i, int first, int end, const float *__restrict depth) SMOKELIFT_INLINE_LAMBDA {
              float *out = gradient.at(light.axis, k, i, first);
              for (int c = 0; c < end - first; ++c)
                  out[c * stride] += light.step * depth[c];
          });
}

} // namespace

void shade(const Voxels &medium, const Spans &spans, const Phase &phase, const ParallelLight &light, bool add,
           Workers &workers) {
    const Columns columns(light, spans);
    workers.run(columns.tasks(), [&](int task) { shade_columns(columns, medium, phase, add, task); });
}

void shade_adjoint(const Voxels &medium, const Voxels &gradient, const Voxels &scratch, const Spans &spans,
                   const Phase &phase, const ParallelLight &light, Workers &workers) {
    if (!scratch.data) {
        workers.run(medium.n[0], [&](int x) { depth_gradient_of_all(medium, gradient, spans, x); });
    } else {
        const Columns columns(light, spans);
        workers.run(columns.tasks(),
                    [&](int task) { depth_gradient(columns, medium, gradient, scratch, phase, task); });
    }
    ParallelLight reversed = light;
    reversed.travel = -light.travel;
    const Columns back(reversed, spans);
    const Voxels field = scratch.data ? scratch : Voxels{gradient.data + 1, gradient.n, gradient.width};
    workers.run(back.tasks(), [&](int task) { add_columns(back, field, gradient, task); });
}

} // namespace smokelift
