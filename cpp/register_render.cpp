#include "arrays.h"
#include "camera.h"
#include "lighting.h"

#include <cstdint>
#include <memory>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace smokelift {
namespace {

using Floats = py::array_t<float, py::array::c_style>;
using Marks = py::array_t<unsigned char, py::array::c_style | py::array::forcecast>;
using Integers = py::array_t<int, py::array::c_style | py::array::forcecast>;

void require(bool fits) {
    if (!fits)
        throw std::invalid_argument("the arrays do not have shapes that belong together.");
}

// Where there can be smoke, and the ranges of rows around that.
struct Support {
    Marks marked;
    Spans spans;

    explicit Support(const Marks &marks) : marked(marks) {
        require(marks.ndim() == 3);
        spans = spans_around(marks.data(), shape());
    }
    Shape shape() const { return {int(marked.shape(0)), int(marked.shape(1)), int(marked.shape(2))}; }
};

Voxels voxels_of(Floats &a, const Support &support) {
    const Shape n = support.shape();
    require(a.ndim() == 4 && a.shape(0) == n[0] + 2 && a.shape(1) == n[1] + 2 && a.shape(2) == n[2] + 2);
    const int width = static_cast<int>(a.shape(3));
    require(width == 1 || width == 2 || width == 4);
    return {a.mutable_data(), n, width};
}

// The rays with the arrays that they point to.
struct OwnedRays {
    Floats lines, length;
    Integers planes;
    Rays rays;

    OwnedRays(const Floats &l, const Floats &d, const Integers &p) : lines(l), length(d), planes(p.size()) {
        require(l.ndim() == 3 && l.shape(2) == 4 && p.ndim() == 3 && p.shape(2) == 4 && d.ndim() == 2);
        require(d.shape(0) == l.shape(0) && d.shape(1) == l.shape(1) && p.shape(0) == l.shape(0) &&
                p.shape(1) == l.shape(1));
        std::copy_n(p.data(), p.size(), planes.mutable_data()); // clip() writes them
        rays.lines = lines.data();
        rays.length = length.data();
        rays.planes = planes.mutable_data();
        rays.rows = static_cast<int>(d.shape(0));
        rays.columns = static_cast<int>(d.shape(1));
        rays.find_runs();
    }
    void require_pixels(const Floats &a, int channels) const {
        require(std::size_t(a.size()) == rays.pixels() * channels);
    }
    Record record(std::optional<Floats> &a, int width) const {
        if (!a)
            return {};
        require(a->ndim() == 4 && a->shape(0) == width && a->shape(2) == rays.rows &&
                a->shape(3) == rays.columns);
        return {a->mutable_data(), static_cast<int>(a->shape(1))};
    }
};

// First voxel of the box of an array that a support stands for.
const float *corner_of(const Floats &a, const Support &support, const std::array<int, 3> &corner) {
    require(a.ndim() == 3);
    for (int axis = 0; axis < 3; ++axis)
        require(corner[axis] >= 0 && corner[axis] + support.shape()[axis] <= a.shape(axis));
    return a.data(corner[0], corner[1], corner[2]);
}

// Zeros that get memory where they are touched, in large pages where the system has them: the rays' look-ups
// are spread over so many small ones that finding the pages would cost as much as the look-ups.
Floats large_zeros(const std::vector<py::ssize_t> &shape) {
    std::size_t bytes = sizeof(float);
    for (const py::ssize_t n : shape)
        bytes *= n;
#if defined(__linux__)
    constexpr std::size_t PAGE = std::size_t(1) << 21;
    if (bytes >= PAGE) {
        const std::size_t whole = bytes + PAGE; // room to begin at a large page's boundary
        void *memory = mmap(nullptr, whole, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (memory == MAP_FAILED)
            throw std::bad_alloc();
        madvise(memory, whole, MADV_HUGEPAGE);
        struct Mapping {
            void *memory;
            std::size_t size;
        };
        const py::capsule owner(new Mapping{memory, whole}, [](void *p) {
            const std::unique_ptr<Mapping> mapping(static_cast<Mapping *>(p));
            munmap(mapping->memory, mapping->size);
        });
        const std::uintptr_t first = (reinterpret_cast<std::uintptr_t>(memory) + PAGE - 1) / PAGE * PAGE;
        return Floats(shape, reinterpret_cast<const float *>(first), owner);
    }
#endif
    Floats result(shape);
    std::fill_n(result.mutable_data(), result.size(), 0.0f);
    return result;
}

template <class Work> void unlocked(int threads, const Work &work) {
    py::gil_scoped_release release;
    Workers workers(threads);
    work(workers);
}

} // namespace

void register_render(py::module_ &module) {
    using namespace py::literals;

    module.def("zeros", &large_zeros, "shape"_a);

    py::class_<Support>(module, "Support").def(py::init<const Marks &>(), "marked"_a);

    py::class_<Phase>(module, "Phase")
        .def(py::init([](const std::array<std::array<float, 4>, 3> &to_eye, float albedo, float anisotropy) {
                 return Phase{to_eye, albedo, anisotropy};
             }),
             py::kw_only(), "to_eye"_a, "albedo"_a, "anisotropy"_a);

    py::class_<ParallelLight>(module, "ParallelLight")
        .def(py::init([](const std::array<float, 3> &direction, const std::array<float, 3> &energy, int axis,
                         int travel, int first, const std::array<double, 2> &slope, float step) {
                 return ParallelLight{direction, energy, axis, travel, first, slope, step};
             }),
             py::kw_only(), "direction"_a, "energy"_a, "axis"_a, "travel"_a, "first"_a, "slope"_a, "step"_a);

    using Face = PointLight::Face;
    py::class_<Face>(module, "Face")
        .def(py::init([](int axis, int travel, int first, int planes, double far,
                         std::array<int, 2> columns_b, std::array<int, 2> columns_c) {
                 return Face{axis,         travel,       first,        planes,      far,
                             columns_b[0], columns_b[1], columns_c[0], columns_c[1]};
             }),
             py::kw_only(), "axis"_a, "travel"_a, "first"_a, "planes"_a, "far"_a, "columns_b"_a,
             "columns_c"_a);

    py::class_<PointLight>(module, "PointLight")
        .def(py::init([](const std::array<double, 3> &position, const std::array<float, 3> &energy,
                         float voxel_size, const std::vector<Face> &faces) {
                 return PointLight{position, energy, voxel_size, faces};
             }),
             py::kw_only(), "position"_a, "energy"_a, "voxel_size"_a, "faces"_a);

    py::class_<OwnedRays>(module, "Rays")
        .def(py::init<const Floats &, const Floats &, const Integers &>(), "lines"_a, "length"_a, "planes"_a)
        .def(
            "clip",
            [](OwnedRays &self, const Support &support, Floats medium, int threads) {
                const Voxels voxels = voxels_of(medium, support);
                unlocked(threads, [&](Workers &workers) { clip(voxels, self.rays, workers); });
            },
            "support"_a, "medium"_a.noconvert(), "threads"_a = 0)
        .def_property_readonly("samples", [](const OwnedRays &self) {
            std::size_t count = 0;
            for (std::size_t ray = 0; ray < self.rays.pixels(); ++ray)
                count += std::max(0, self.rays.planes[4 * ray + 3] - self.rays.planes[4 * ray + 2] + 1);
            return count;
        });

    module.def(
        "pack",
        [](const Floats &density, const std::array<int, 3> &corner, const Support &support, float extinction,
           Floats medium, int threads) {
            const float *first = corner_of(density, support, corner);
            const Voxels voxels = voxels_of(medium, support);
            const Stride y = density.shape(2), x = y * density.shape(1);
            unlocked(threads, [&](Workers &workers) {
                pack(first, x, y, support.marked.data(), extinction, support.spans, voxels, workers);
            });
        },
        "density"_a.noconvert(), "corner"_a, "support"_a, "extinction"_a, "medium"_a.noconvert(),
        "threads"_a = 0);

    module.def(
        "unpack",
        [](Floats gradient, const Support &support, float extinction, Floats result,
           const std::array<int, 3> &corner, int threads) {
            const Voxels voxels = voxels_of(gradient, support);
            corner_of(result, support, corner);
            float *first = result.mutable_data(corner[0], corner[1], corner[2]);
            const Stride y = result.shape(2), x = y * result.shape(1);
            unlocked(threads, [&](Workers &workers) {
                unpack(voxels, support.marked.data(), extinction, first, x, y, workers);
            });
        },
        "gradient"_a.noconvert(), "support"_a, "extinction"_a, "result"_a.noconvert(), "corner"_a,
        "threads"_a = 0);

    using Light = std::variant<ParallelLight, PointLight>;
    module.def(
        "shade",
        [](Floats medium, const Support &support, const Phase &phase, const std::vector<Light> &lights,
           int threads) {
            const Voxels voxels = voxels_of(medium, support);
            unlocked(threads, [&](Workers &workers) {
                bool add = false;
                for (const Light &light : lights) {
                    std::visit([&](const auto &l) { shade(voxels, support.spans, phase, l, add, workers); },
                               light);
                    add = true;
                }
                extend_into_border(voxels);
            });
        },
        "medium"_a.noconvert(), "support"_a, "phase"_a, "lights"_a, "threads"_a = 0);

    module.def(
        "shade_adjoint",
        [](Floats medium, Floats gradient, Floats scratch, const Support &support, const Phase &phase,
           const std::vector<Light> &lights, int threads) {
            const Voxels voxels = voxels_of(medium, support), slopes = voxels_of(gradient, support);
            const Voxels space = voxels_of(scratch, support);
            require(space.width == 1 && slopes.width == voxels.width);
            unlocked(threads, [&](Workers &workers) {
                fold_border(slopes);
                for (const Light &light : lights) {
                    if (const auto *point = std::get_if<PointLight>(&light))
                        shade_adjoint(voxels, slopes, support.spans, phase, *point, workers);
                    else
                        shade_adjoint(voxels, slopes, space, support.spans, phase,
                                      std::get<ParallelLight>(light), workers);
                }
            });
        },
        "medium"_a.noconvert(), "gradient"_a.noconvert(), "scratch"_a.noconvert(), "support"_a, "phase"_a,
        "lights"_a, "threads"_a = 0);

    module.def(
        "march",
        [](Floats medium, const Support &support, const OwnedRays &rays, Floats scattered, Floats depth,
           std::optional<Floats> record, int threads) {
            const Voxels voxels = voxels_of(medium, support);
            rays.require_pixels(scattered, voxels.width - 1);
            rays.require_pixels(depth, 1);
            const Record samples = rays.record(record, voxels.width);
            unlocked(threads, [&](Workers &workers) {
                march(voxels, rays.rays, scattered.mutable_data(), depth.mutable_data(), samples, workers);
            });
        },
        "medium"_a.noconvert(), "support"_a, "rays"_a, "scattered"_a.noconvert(), "depth"_a.noconvert(),
        "record"_a.noconvert(), "threads"_a = 0);

    module.def(
        "march_adjoint",
        [](const OwnedRays &rays, const Floats &depth, const Floats &of_scattered,
           const Floats &of_transmittance, std::optional<Floats> record, Floats gradient,
           const Support &support, int threads) {
            const Voxels voxels = voxels_of(gradient, support);
            rays.require_pixels(of_scattered, voxels.width - 1);
            rays.require_pixels(of_transmittance, 1);
            rays.require_pixels(depth, 1);
            const Record samples = rays.record(record, voxels.width);
            require(samples.data);
            unlocked(threads, [&](Workers &workers) {
                clear(voxels, workers);
                march_adjoint(rays.rays, depth.data(), of_scattered.data(), of_transmittance.data(), samples,
                              voxels, workers);
            });
        },
        "rays"_a, "depth"_a.noconvert(), "of_scattered"_a.noconvert(), "of_transmittance"_a.noconvert(),
        "record"_a.noconvert(), "gradient"_a.noconvert(), "support"_a, "threads"_a = 0);
}

} // namespace smokelift
