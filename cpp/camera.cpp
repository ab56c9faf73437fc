// A sample stands for a step of length d with constant extinction kappa and in-scattered radiance J:
//
//     a_s = 1 - exp(-kappa_s d),   L = sum_s tau_s a_s J_s,   tau_s+1 = tau_s (1 - a_s).
//
// The adjoint runs from back to front with R, the radiance that arrives from behind a sample (not yet
// attenuated), so that nothing is ever divided by a vanishing transmittance:
//
//     dL/dkappa_s = d tau_s+1 (J_s - R_s+1),   dL/dJ_s = tau_s a_s,   R_s = a_s J_s + (1 - a_s) R_s+1
//
// Times the derivative of the loss by L and summed over the channels, J_s is `inscattered` and R_s is
// `behind`, which starts as the derivative by the transmittance of the whole ray.
//
// Neighboring rays go together, plane by plane: their samples lie in the same cache lines, and everything
// after the look-up is vector arithmetic. On the way back samples are first turned into derivatives, ray by
// ray, and then added to the voxels plane by plane: each plane belongs to one task, so nothing is atomic.
#include "camera.h"

#include "exponential.h"

#include <algorithm>
#include <array>
#include <type_traits>

namespace smokelift {
namespace {

constexpr int LANES = Rays::LANES, CHANNELS = 4;        // extinction and colors (by definition)
constexpr int RUNS_PER_TASK = 64, PLANES_PER_TASK = 16; // runs and planes at a time for a thread
constexpr int TILE_ROWS = 16;                           // rows of pixels whose runs follow each other
constexpr int AHEAD = 3; // planes before a look-up that its voxels are asked for

template <int N> struct Floats {
    typedef float type __attribute__((vector_size(4 * N), aligned(4), may_alias));
};
template <> struct Floats<1> {
    using type = float;
};

// The values of a cell of four voxels, W floats each, mixed. Vectors: what one voxel holds, or two neighbors
// at once.
template <int W, bool Adjacent>
SMOKELIFT_INLINE void look_up(const float *at, Stride along_b, Stride along_c, float f, float g, float *out) {
    using One = typename Floats<W>::type;
    One near, far; // at c and c + 1
    if constexpr (Adjacent && W == 2) {
        using Two = typename Floats<4>::type;
        const Two low = *reinterpret_cast<const Two *>(at),
                  high = *reinterpret_cast<const Two *>(at + along_b);
        const Two mixed = low + f * (high - low);
        near = One{mixed[0], mixed[1]};
        far = One{mixed[2], mixed[3]};
    } else {
        const auto voxel = [&](Stride offset) { return *reinterpret_cast<const One *>(at + offset); };
        near = voxel(0) + f * (voxel(along_b) - voxel(0));
        far = voxel(along_c) + f * (voxel(along_b + along_c) - voxel(along_c));
    }
    *reinterpret_cast<One *>(out) = near + g * (far - near);
}

template <int W, bool Adjacent>
SMOKELIFT_INLINE void add_to(float *at, Stride along_b, Stride along_c, float f, float g,
                             const float *value) {
    if constexpr (Adjacent && W == 2) {
        using Two = typename Floats<4>::type;
        const Two all = {(1 - g) * value[0], (1 - g) * value[1], g * value[0], g * value[1]};
        *reinterpret_cast<Two *>(at) += (1 - f) * all;
        *reinterpret_cast<Two *>(at + along_b) += f * all;
    } else {
        using One = typename Floats<W>::type;
        const One all = *reinterpret_cast<const One *>(value);
        const auto voxel = [&](Stride offset) -> One & { return *reinterpret_cast<One *>(at + offset); };
        voxel(0) += (1 - f) * (1 - g) * all;
        voxel(along_c) += (1 - f) * g * all;
        voxel(along_b) += f * (1 - g) * all;
        voxel(along_b + along_c) += f * g * all;
    }
}

// The rays of a run side by side.
struct Lanes {
    int count;
    int axis;
    float b0[LANES], b1[LANES], c0[LANES], c1[LANES], length[LANES];
    int first[LANES], last[LANES];
    Stride along_k, along_b, along_c;

    SMOKELIFT_INLINE Lanes(const Voxels &voxels, const Rays &rays, const Run &run)
        : count(run.count), axis(run.axis), along_k(voxels.stride(run.axis)),
          along_b(voxels.stride(LATERAL[run.axis][0])), along_c(voxels.stride(LATERAL[run.axis][1])) {
        const std::size_t pixel = std::size_t(run.row) * rays.columns + run.column;
        for (int lane = 0; lane < LANES; ++lane) {
            // lanes beyond the last repeat it, without samples
            const std::size_t at = pixel + std::min(lane, count - 1);
            b0[lane] = rays.lines[4 * at] + 1; // positions count from the border
            b1[lane] = rays.lines[4 * at + 1];
            c0[lane] = rays.lines[4 * at + 2] + 1;
            c1[lane] = rays.lines[4 * at + 3];
            length[lane] = rays.length[at];
            first[lane] = lane < count ? rays.planes[4 * at + 2] : 0;
            last[lane] = lane < count ? rays.planes[4 * at + 3] : -1;
        }
    }
    bool crosses(int lane, int k) const { return first[lane] <= k && k <= last[lane]; }
};

// Where the lanes cross plane k: cells as offsets into the plane, and the place within the cell.
struct Footprint {
    Stride cell[LANES];
    float f[LANES], g[LANES];

    SMOKELIFT_INLINE Footprint(const Lanes &lanes, int k) {
        for (int lane = 0; lane < LANES; ++lane) {
            const float b = lanes.b0[lane] + lanes.b1[lane] * float(k);
            const float c = lanes.c0[lane] + lanes.c1[lane] * float(k);
            const int i = static_cast<int>(b), j = static_cast<int>(c); // positive where there is a sample
            f[lane] = b - float(i);
            g[lane] = c - float(j);
            cell[lane] = i * lanes.along_b + j * lanes.along_c;
        }
    }
};

template <int W, bool Adjacent>
SMOKELIFT_INLINE bool sample_plane(const Voxels &medium, const Lanes &lanes, int k, float (*sample)[LANES]) {
    const float *const plane = medium.data + (k + 1) * lanes.along_k;
    const Footprint at(lanes, k);
    float found[LANES][W];
    for (int lane = 0; lane < LANES; ++lane) {
        if (lanes.crosses(lane, k))
            look_up<W, Adjacent>(plane + at.cell[lane], lanes.along_b, lanes.along_c, at.f[lane], at.g[lane],
                                 found[lane]);
        else
            for (int w = 0; w < W; ++w)
                found[lane][w] = 0;
    }
    bool any = false;
    for (int lane = 0; lane < LANES; ++lane) {
        for (int w = 0; w < W; ++w)
            sample[w][lane] = found[lane][w];
        any |= found[lane][0] > 0;
    }
    return any;
}

// Asks for the voxels that the lanes will look up in a plane some steps ahead.
SMOKELIFT_INLINE void prefetch_plane(const Voxels &voxels, const Lanes &lanes, int k) {
#if defined(__GNUC__)
    const float *const plane = voxels.data + (k + 1) * lanes.along_k;
    const Footprint at(lanes, k);
    for (int lane = 0; lane < LANES; ++lane) {
        if (lanes.crosses(lane, k)) {
            __builtin_prefetch(plane + at.cell[lane]);
            __builtin_prefetch(plane + at.cell[lane] + lanes.along_b);
        }
    }
#endif
}

template <int W>
SMOKELIFT_INLINE bool sample_lanes(const Voxels &medium, const Lanes &lanes, int k, float (*sample)[LANES]) {
    return lanes.axis == 2 ? sample_plane<W, false>(medium, lanes, k, sample)
                           : sample_plane<W, true>(medium, lanes, k, sample);
}

template <int W>
SMOKELIFT_INLINE void march_run(const Voxels &medium, const Rays &rays, const Run &run, float *scattered,
                                float *depth, const Record &record) {
    const Lanes lanes(medium, rays, run);
    float tau[LANES], radiance[W][LANES] = {}, total[LANES] = {}, sample[W][LANES];
    std::fill_n(tau, LANES, 1.0f);
    for (int step = 0; step <= run.last - run.first; ++step) {
        const int k = run.travel > 0 ? run.first + step : run.last - step;
        prefetch_plane(medium, lanes, k + AHEAD * run.travel);
        const bool any = sample_lanes<W>(medium, lanes, k, sample);
        if (record.data)
            std::copy_n(sample[0], W * LANES, record.at(run, k, W));
        if (!any)
            continue;
        for (int lane = 0; lane < LANES; ++lane) {
            const float x = sample[0][lane] * lanes.length[lane];
            const Attenuation crossed = attenuation(x);
            for (int w = 1; w < W; ++w)
                radiance[w][lane] += tau[lane] * crossed.opacity * sample[w][lane];
            tau[lane] *= crossed.transmittance;
            total[lane] += x;
        }
    }
    const std::size_t pixel = std::size_t(run.row) * rays.columns + run.column;
    for (int lane = 0; lane < run.count; ++lane) {
        depth[pixel + lane] = total[lane];
        for (int w = 1; w < W; ++w)
            scattered[(pixel + lane) * (W - 1) + w - 1] = radiance[w][lane];
    }
}

template <int W>
SMOKELIFT_INLINE void adjoint_sweep(const Rays &rays, const Run &run, const float *depth,
                                    const float *scattered_gradient, const float *transmittance_gradient,
                                    const Record &record) {
    const std::size_t pixel = std::size_t(run.row) * rays.columns + run.column;
    float radiance_gradient[W][LANES] = {}, behind[LANES] = {}, before[LANES] = {}, length[LANES] = {};
    int first[LANES], last[LANES];
    std::fill_n(first, LANES, 0);
    std::fill_n(last, LANES, -1);
    for (int lane = 0; lane < run.count; ++lane) {
        const std::size_t at = pixel + lane;
        for (int w = 1; w < W; ++w)
            radiance_gradient[w][lane] = scattered_gradient[at * (W - 1) + w - 1];
        behind[lane] = transmittance_gradient[at];
        before[lane] = depth[at]; // optical depth from the camera to the back of the sample
        length[lane] = rays.length[at];
        first[lane] = rays.planes[4 * at + 2];
        last[lane] = rays.planes[4 * at + 3];
    }
    for (int step = 0; step <= run.last - run.first; ++step) {
        const int k = run.travel > 0 ? run.last - step : run.first + step;
        float sample[W][LANES];
        float *const recorded = record.at(run, k, W);
        std::copy_n(recorded, W * LANES, sample[0]);
        for (int lane = 0; lane < LANES; ++lane) {
            const float x = sample[0][lane] * length[lane];
            const Attenuation crossed = attenuation(x);
            before[lane] = std::max(before[lane] - x, 0.0f);
            const float tau = attenuation(before[lane]).transmittance;
            float inscattered = 0;
            for (int w = 1; w < W; ++w)
                inscattered += radiance_gradient[w][lane] * sample[w][lane];
            const bool crosses = first[lane] <= k && k <= last[lane];
            const float extinction_gradient =
                length[lane] * tau * crossed.transmittance * (inscattered - behind[lane]);
            sample[0][lane] = crosses ? extinction_gradient : 0.0f;
            for (int w = 1; w < W; ++w)
                sample[w][lane] = tau * crossed.opacity * radiance_gradient[w][lane];
            behind[lane] = crossed.opacity * inscattered + crossed.transmittance * behind[lane];
        }
        std::copy_n(sample[0], W * LANES, recorded);
    }
}

template <int W, bool Adjacent>
SMOKELIFT_INLINE void scatter_planes(const Rays &rays, const Run &run, const Record &record,
                                     const Voxels &gradient, int first, int end) {
    const Lanes lanes(gradient, rays, run);
    for (int k = std::max(first, run.first); k < std::min(end, run.last + 1); ++k) {
        float *const plane = gradient.data + (k + 1) * lanes.along_k;
        prefetch_plane(gradient, lanes, k + AHEAD);
        const Footprint at(lanes, k);
        float derivative[LANES][W];
        const float *const in = record.at(run, k, W);
        for (int w = 0; w < W; ++w)
            for (int lane = 0; lane < LANES; ++lane)
                derivative[lane][w] = in[w * LANES + lane];
        for (int lane = 0; lane < run.count; ++lane)
            if (lanes.crosses(lane, k))
                add_to<W, Adjacent>(plane + at.cell[lane], lanes.along_b, lanes.along_c, at.f[lane],
                                    at.g[lane], derivative[lane]);
    }
}

// work(width) with the width as a constant.
template <class Work> SMOKELIFT_INLINE void by_width(int width, const Work &work) {
    if (width == 1)
        work(std::integral_constant<int, 1>());
    else if (width == 2)
        work(std::integral_constant<int, 2>());
    else
        work(std::integral_constant<int, CHANNELS>());
}

SMOKELIFT_CLONES
void march_runs(const Voxels &medium, const Rays &rays, std::size_t first, std::size_t end, float *scattered,
                float *depth, const Record &record) {
    by_width(medium.width, [&](auto width) SMOKELIFT_INLINE_LAMBDA {
        for (std::size_t r = first; r < end; ++r)
            march_run<width>(medium, rays, rays.runs[r], scattered, depth, record);
    });
}

SMOKELIFT_CLONES
void adjoint_sweeps(const Rays &rays, int width, std::size_t first, std::size_t end, const float *depth,
                    const float *scattered_gradient, const float *transmittance_gradient,
                    const Record &record) {
    by_width(width, [&](auto width) SMOKELIFT_INLINE_LAMBDA {
        for (std::size_t r = first; r < end; ++r)
            adjoint_sweep<width>(rays, rays.runs[r], depth, scattered_gradient, transmittance_gradient,
                                 record);
    });
}

SMOKELIFT_CLONES
void scatter_runs(const Rays &rays, int axis, int first, int end, const Record &record,
                  const Voxels &gradient) {
    by_width(gradient.width, [&](auto width) SMOKELIFT_INLINE_LAMBDA {
        for (const Run &run : rays.runs)
            if (run.axis == axis && axis == 2)
                scatter_planes<width, false>(rays, run, record, gradient, first, end);
            else if (run.axis == axis)
                scatter_planes<width, true>(rays, run, record, gradient, first, end);
    });
}

SMOKELIFT_CLONES
void clip_run(const Voxels &medium, Rays &rays, const Run &run) {
    const Lanes lanes(medium, rays, run);
    // from both ends, as far as the first samples that hold anything: what lies between them does not matter
    const auto find = [&](int k, int step, int (&found)[LANES]) SMOKELIFT_INLINE_LAMBDA {
        float sample[1][LANES];
        std::fill_n(found, LANES, -1);
        for (int left = run.count; run.first <= k && k <= run.last && left > 0; k += step)
            if (sample_lanes<1>(medium, lanes, k, sample))
                for (int lane = 0; lane < run.count; ++lane)
                    if (found[lane] < 0 && sample[0][lane] > 0) {
                        found[lane] = k;
                        --left;
                    }
    };
    int first[LANES], last[LANES];
    find(run.first, 1, first);
    find(run.last, -1, last);
    const std::size_t pixel = std::size_t(run.row) * rays.columns + run.column;
    for (int lane = 0; lane < run.count; ++lane) {
        rays.planes[4 * (pixel + lane) + 2] = std::max(first[lane], 0);
        rays.planes[4 * (pixel + lane) + 3] = last[lane];
    }
}

} // namespace

void Rays::find_runs() {
    runs.clear();
    for (int row = 0; row < rows; ++row) {
        Run run{};
        const auto close = [&] {
            if (run.count)
                runs.push_back(run);
            run.count = 0;
        };
        for (int column = 0; column < columns; ++column) {
            const int *ray = planes + 4 * (std::size_t(row) * columns + column);
            if (ray[3] < ray[2]) {
                close();
                continue;
            }
            if (run.count == LANES || (run.count && (run.axis != ray[0] || run.travel != ray[1])))
                close();
            if (!run.count)
                run = {row, column, 0, ray[0], ray[1], ray[2], ray[3]};
            ++run.count;
            run.first = std::min(run.first, ray[2]);
            run.last = std::max(run.last, ray[3]);
        }
        close();
    }
    // Tile by tile: rays of neighboring rows look up the same cache lines.
    std::sort(runs.begin(), runs.end(), [](const Run &a, const Run &b) {
        const auto place = [](const Run &r) {
            return std::array<int, 4>{r.row / TILE_ROWS, r.column / LANES, r.row, r.column};
        };
        return place(a) < place(b);
    });
    std::size_t before = 0;
    for (Run &run : runs) {
        run.before = before;
        before += run.planes();
    }
}

void clip(const Voxels &medium, Rays &rays, Workers &workers) {
    workers.run_ranges(rays.runs.size(), RUNS_PER_TASK, [&](std::size_t first, std::size_t end) {
        for (std::size_t r = first; r < end; ++r)
            clip_run(medium, rays, rays.runs[r]);
    });
    rays.find_runs();
}

void march(const Voxels &medium, const Rays &rays, float *scattered, float *depth, const Record &record,
           Workers &workers) {
    std::fill_n(depth, rays.pixels(), 0.0f);
    std::fill_n(scattered, rays.pixels() * (medium.width - 1), 0.0f);
    workers.run_ranges(rays.runs.size(), RUNS_PER_TASK, [&](std::size_t first, std::size_t end) {
        march_runs(medium, rays, first, end, scattered, depth, record);
    });
}

void march_adjoint(const Rays &rays, const float *depth, const float *scattered_gradient,
                   const float *transmittance_gradient, const Record &record, const Voxels &gradient,
                   Workers &workers) {
    workers.run_ranges(rays.runs.size(), RUNS_PER_TASK, [&](std::size_t first, std::size_t end) {
        adjoint_sweeps(rays, gradient.width, first, end, depth, scattered_gradient, transmittance_gradient,
                       record);
    });
    for (int axis = 0; axis < 3; ++axis) {
        if (std::none_of(rays.runs.begin(), rays.runs.end(), [&](const Run &r) { return r.axis == axis; }))
            continue;
        workers.run_ranges(gradient.n[axis], PLANES_PER_TASK, [&](std::size_t first, std::size_t end) {
            scatter_runs(rays, axis, int(first), int(end), record, gradient);
        });
    }
}

} // namespace smokelift
