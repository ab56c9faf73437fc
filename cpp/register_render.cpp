#include "blocks.h"
#include "camera.h"
#include "diffuse_light.h"
#include "lighting.h"
#include "pixel_rays.h"
#include "python.h"

#include <optional>
#include <variant>

namespace smokelift {
namespace {

using Floats = py::array_t<float, py::array::c_style>;
using SupportMarks = py::array_t<unsigned char, py::array::c_style | py::array::forcecast>;
using Integers = py::array_t<int, py::array::c_style | py::array::forcecast>;

// Where there can be smoke, and the ranges of rows around that.
struct Support {
    SupportMarks marked;
    Spans spans;

    explicit Support(const SupportMarks &marks) : marked(marks) {
        require_fit(marks.ndim() == 3);
        spans = spans_around(marks.data(), shape());
    }
    Shape shape() const { return {int(marked.shape(0)), int(marked.shape(1)), int(marked.shape(2))}; }
};

Voxels voxels_of(Floats &a, const Support &support) {
    const Shape n = support.shape();
    require_fit(a.ndim() == 4 && a.shape(0) == n[0] + 2 && a.shape(1) == n[1] + 2 && a.shape(2) == n[2] + 2);
    const int width = static_cast<int>(a.shape(3));
    require_fit(width == 1 || width == 2 || width == 4);
    return {a.mutable_data(), n, width};
}

// The rays with the arrays that they point to.
struct OwnedRays {
    Floats lines, length;
    Integers planes;
    Rays rays;

    OwnedRays(const Floats &l, const Floats &d, const Integers &p) : lines(l), length(d), planes(p.size()) {
        require_fit(l.ndim() == 3 && l.shape(2) == 4 && p.ndim() == 3 && p.shape(2) == 4 && d.ndim() == 2);
        require_fit(d.shape(0) == l.shape(0) && d.shape(1) == l.shape(1) && p.shape(0) == l.shape(0) &&
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
        require_fit(std::size_t(a.size()) == rays.pixels() * channels);
    }
    Record record(std::optional<Floats> &a, int width) const {
        if (!a)
            return {};
        require_fit(std::size_t(a->size()) == rays.planes_of_runs() * width * Rays::LANES);
        return {a->mutable_data()};
    }
};

// The box of an array that a support stands for.
template <class T, class Data>
Strided<T> box_of(const py::array_t<float> &a, Data data, const Support &support,
                  const std::array<int, 3> &corner) {
    require_fit(a.ndim() == 3);
    std::array<Stride, 3> stride{};
    for (int axis = 0; axis < 3; ++axis) {
        require_fit(corner[axis] >= 0 && corner[axis] + support.shape()[axis] <= a.shape(axis));
        stride[axis] = a.strides(axis) / Stride(sizeof(float));
        data += corner[axis] * stride[axis];
    }
    return {data, stride};
}

// An array over blocks, [field][x][y][z].
using OverBlocks = py::array_t<float, py::array::c_style>;

// A new one that work(values, workers) fills.
template <class Work> auto over_blocks(int fields, const Shape &n, const Work &work) {
    return made({fields, n[0], n[1], n[2]}, work);
}

Shape blocks_shape(const OverBlocks &a, int fields) {
    require_fit(a.ndim() == 4 && a.shape(0) == fields);
    return {int(a.shape(1)), int(a.shape(2)), int(a.shape(3))};
}

// How many channels there are in means of extinction and emission.
int channels_of(const OverBlocks &means) {
    require_fit(means.ndim() == 4 && means.shape(0) > 1 && (means.shape(0) - 1) % Blocks::FIELDS == 0);
    return static_cast<int>(means.shape(0) - 1) / Blocks::FIELDS;
}

// Blocks that reach around all voxels of a support.
void require_around(const Blocks &blocks, const Support &support) {
    for (int axis = 0; axis < 3; ++axis)
        require_fit(blocks.size > 0 && 2 * blocks.offset[axis] + 1 >= blocks.size &&
                    2 * (blocks.offset[axis] + support.shape()[axis]) - 1 <
                        (2 * blocks.n[axis] - 1) * blocks.size);
}

using Light = std::variant<ParallelLight, PointLight>;

// Zeros that get memory where they are touched.
Array zeros(const std::vector<py::ssize_t> &shape) {
    std::size_t size = 1;
    for (const py::ssize_t n : shape)
        size *= std::size_t(n);
    Values values(size);
    if (!LazyPages<float>::starts_as_zero(size))
        std::fill(values.begin(), values.end(), 0.0f);
    return array_of(std::move(values), shape);
}

void register_voxels(py::module_ &module) {
    using namespace py::literals;

    module.def("zeros", &zeros, "shape"_a);

    py::class_<Support>(module, "Support").def(py::init<const SupportMarks &>(), "marked"_a);

    module.def(
        "pack",
        [](const py::array_t<float> &density, const std::array<int, 3> &corner, const Support &support,
           float extinction, Floats medium) {
            const auto box = box_of<const float>(density, density.data(), support, corner);
            const Voxels voxels = voxels_of(medium, support);
            released([&](Workers &workers) {
                pack(box, support.marked.data(), extinction, support.spans, voxels, workers);
            });
        },
        "density"_a.noconvert(), "corner"_a, "support"_a, "extinction"_a, "medium"_a.noconvert());

    module.def(
        "unpack",
        [](Floats gradient, const Support &support, float extinction, py::array_t<float> result,
           const std::array<int, 3> &corner) {
            const Voxels voxels = voxels_of(gradient, support);
            const auto box = box_of<float>(result, result.mutable_data(), support, corner);
            released(
                [&](Workers &workers) { unpack(voxels, support.marked.data(), extinction, box, workers); });
        },
        "gradient"_a.noconvert(), "support"_a, "extinction"_a, "result"_a.noconvert(), "corner"_a);
}

void register_lights(py::module_ &module) {
    using namespace py::literals;

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

    module.def(
        "shade",
        [](Floats medium, const Support &support, const Phase &phase, const std::vector<Light> &lights) {
            const Voxels voxels = voxels_of(medium, support);
            released([&](Workers &workers) {
                bool add = false;
                for (const Light &light : lights) {
                    std::visit([&](const auto &l) { shade(voxels, support.spans, phase, l, add, workers); },
                               light);
                    add = true;
                }
                extend_into_border(voxels);
            });
        },
        "medium"_a.noconvert(), "support"_a, "phase"_a, "lights"_a);

    module.def(
        "shade_adjoint",
        [](Floats medium, Floats gradient, std::optional<Floats> scratch, const Support &support,
           const Phase &phase, const std::vector<Light> &lights) {
            const Voxels voxels = voxels_of(medium, support), gradients = voxels_of(gradient, support);
            const Voxels space = scratch ? voxels_of(*scratch, support) : Voxels{};
            require_fit(gradients.width == voxels.width && (scratch || lights.size() == 1) &&
                        space.width == 1);
            released([&](Workers &workers) {
                fold_border(gradients);
                for (const Light &light : lights) {
                    if (const auto *point = std::get_if<PointLight>(&light))
                        shade_adjoint(voxels, gradients, support.spans, phase, *point, workers);
                    else
                        shade_adjoint(voxels, gradients, space, support.spans, phase,
                                      std::get<ParallelLight>(light), workers);
                }
            });
        },
        "medium"_a.noconvert(), "gradient"_a.noconvert(), "scratch"_a.noconvert(), "support"_a, "phase"_a,
        "lights"_a);
}

void register_camera(py::module_ &module) {
    using namespace py::literals;

    py::class_<OwnedRays>(module, "Rays")
        .def(py::init<const Floats &, const Floats &, const Integers &>(), "lines"_a, "length"_a, "planes"_a)
        .def(
            "clip",
            [](OwnedRays &self, const Support &support, Floats medium) {
                const Voxels voxels = voxels_of(medium, support);
                released([&](Workers &workers) { clip(voxels, self.rays, workers); });
            },
            "support"_a, "medium"_a.noconvert())
        .def_property_readonly("samples",
                               [](const OwnedRays &self) {
                                   std::size_t count = 0;
                                   for (std::size_t ray = 0; ray < self.rays.pixels(); ++ray)
                                       count += std::max(0, self.rays.planes[4 * ray + 3] -
                                                                self.rays.planes[4 * ray + 2] + 1);
                                   return count;
                               })
        .def_property_readonly(
            "recorded", [](const OwnedRays &self) { return self.rays.planes_of_runs() * Rays::LANES; });

    using Places = std::vector<double>;
    module.def(
        "pixel_rays",
        [](const std::array<Vector, 3> &start, const std::array<Vector, 3> &direction, bool far,
           const Places &columns, const Places &rows, const Shape &n) {
            const py::ssize_t height = py::ssize_t(rows.size()), width = py::ssize_t(columns.size());
            Floats lines({height, width, py::ssize_t(4)}), length({height, width});
            Integers planes({height, width, py::ssize_t(4)});
            const Lens lens{{start[0], start[1], start[2]}, {direction[0], direction[1], direction[2]}, far};
            released([&, to = lines.mutable_data(), steps = length.mutable_data(),
                      at = planes.mutable_data()](Workers &workers) {
                pixel_rays(lens, columns, rows, n, to, steps, at, workers);
            });
            return py::make_tuple(lines, length, planes);
        },
        "start"_a, "direction"_a, "far"_a, "columns"_a, "rows"_a, "shape"_a);

    module.def(
        "march",
        [](Floats medium, const Support &support, const OwnedRays &rays, Floats scattered, Floats depth,
           std::optional<Floats> record) {
            const Voxels voxels = voxels_of(medium, support);
            rays.require_pixels(scattered, voxels.width - 1);
            rays.require_pixels(depth, 1);
            const Record samples = rays.record(record, voxels.width);
            released([&](Workers &workers) {
                march(voxels, rays.rays, scattered.mutable_data(), depth.mutable_data(), samples, workers);
            });
        },
        "medium"_a.noconvert(), "support"_a, "rays"_a, "scattered"_a.noconvert(), "depth"_a.noconvert(),
        "record"_a.noconvert());

    module.def(
        "march_adjoint",
        [](const OwnedRays &rays, const Floats &depth, const Floats &scattered_gradient,
           const Floats &transmittance_gradient, std::optional<Floats> record, Floats gradient,
           const Support &support) {
            const Voxels voxels = voxels_of(gradient, support);
            rays.require_pixels(scattered_gradient, voxels.width - 1);
            rays.require_pixels(transmittance_gradient, 1);
            rays.require_pixels(depth, 1);
            const Record samples = rays.record(record, voxels.width);
            require_fit(samples.data);
            released([&](Workers &workers) {
                clear(voxels, workers);
                march_adjoint(rays.rays, depth.data(), scattered_gradient.data(),
                              transmittance_gradient.data(), samples, voxels, workers);
            });
        },
        "rays"_a, "depth"_a.noconvert(), "scattered_gradient"_a.noconvert(),
        "transmittance_gradient"_a.noconvert(), "record"_a.noconvert(), "gradient"_a.noconvert(),
        "support"_a);
}

void register_blocks(py::module_ &module) {
    using namespace py::literals;

    py::class_<Blocks>(module, "Blocks")
        .def(py::init([](const std::array<int, 3> &shape, int size, const std::array<int, 3> &offset) {
                 return Blocks{shape, size, offset};
             }),
             py::kw_only(), "shape"_a, "size"_a, "offset"_a);

    module.def(
        "average",
        [](Floats medium, const Support &support, const Blocks &blocks) {
            const Voxels voxels = voxels_of(medium, support);
            require_around(blocks, support);
            const int fields = 1 + (voxels.width - 1) * Blocks::FIELDS;
            return over_blocks(fields, blocks.n, [&](float *means, Workers &workers) {
                average(voxels, support.spans, blocks, means, workers);
            });
        },
        "medium"_a.noconvert(), "support"_a, "blocks"_a);

    module.def(
        "average_adjoint",
        [](Floats medium, const Support &support, const Blocks &blocks, const OverBlocks &means_gradient,
           Floats gradient) {
            const Voxels voxels = voxels_of(medium, support), gradients = voxels_of(gradient, support);
            require_around(blocks, support);
            require_fit(gradients.width == voxels.width &&
                        blocks_shape(means_gradient, 1 + (voxels.width - 1) * Blocks::FIELDS) == blocks.n);
            released([&](Workers &workers) {
                average_adjoint(voxels, support.spans, blocks, means_gradient.data(), gradients, workers);
            });
        },
        "medium"_a.noconvert(), "support"_a, "blocks"_a, "means_gradient"_a.noconvert(),
        "gradient"_a.noconvert());

    module.def(
        "add_interpolated",
        [](const OverBlocks &values, float factor, const Blocks &blocks, Floats medium,
           const Support &support) {
            const Voxels voxels = voxels_of(medium, support);
            require_around(blocks, support);
            require_fit(blocks_shape(values, (voxels.width - 1) * Blocks::FIELDS) == blocks.n);
            released([&](Workers &workers) {
                add_interpolated(values.data(), factor, blocks, voxels, support.spans, workers);
                extend_into_border(voxels);
            });
        },
        "values"_a.noconvert(), "factor"_a, "blocks"_a, "medium"_a.noconvert(), "support"_a);

    module.def(
        "interpolate_adjoint",
        [](Floats gradient, const Support &support, float factor, const Blocks &blocks) {
            const Voxels gradients = voxels_of(gradient, support);
            require_around(blocks, support);
            const int fields = (gradients.width - 1) * Blocks::FIELDS;
            return over_blocks(fields, blocks.n, [&](float *values_gradient, Workers &workers) {
                fold_border(gradients);
                interpolate_adjoint(gradients, support.spans, factor, blocks, values_gradient, workers);
            });
        },
        "gradient"_a.noconvert(), "support"_a, "factor"_a, "blocks"_a);
}

void register_diffuse_light(py::module_ &module) {
    using namespace py::literals;

    module.def(
        "diffuse",
        [](const OverBlocks &means, float albedo, float edge) {
            const int channels = channels_of(means), fields = channels * Blocks::FIELDS;
            const Shape n = blocks_shape(means, 1 + fields);
            return over_blocks(fields, n, [&](float *phi, Workers &workers) {
                const std::size_t count = volume(n);
                const DiffuseLight light(means.data(), albedo, n, edge);
                for (int channel = 0; channel < channels; ++channel)
                    light.solve(means.data() + (1 + channel * Blocks::FIELDS) * count,
                                phi + channel * Blocks::FIELDS * count, workers);
            });
        },
        "means"_a.noconvert(), "albedo"_a, "edge"_a);

    module.def(
        "diffuse_adjoint",
        [](const OverBlocks &means, const OverBlocks &radiance, const OverBlocks &radiance_gradient,
           float albedo, float edge) {
            const int channels = channels_of(means), fields = channels * Blocks::FIELDS;
            const Shape n = blocks_shape(means, 1 + fields);
            require_fit(blocks_shape(radiance, fields) == n && blocks_shape(radiance_gradient, fields) == n);
            return over_blocks(1 + fields, n, [&](float *result, Workers &workers) {
                const std::size_t count = volume(n);
                const DiffuseLight light(means.data(), albedo, n, edge);
                std::fill_n(result, count, 0.0f);
                for (int channel = 0; channel < channels; ++channel) {
                    const std::size_t at = channel * Blocks::FIELDS * count;
                    light.solve_adjoint(means.data() + count + at, radiance.data() + at,
                                        radiance_gradient.data() + at, result + count + at, result, workers);
                }
            });
        },
        "means"_a.noconvert(), "radiance"_a.noconvert(), "radiance_gradient"_a.noconvert(), "albedo"_a,
        "edge"_a);
}

} // namespace

void register_render(py::module_ &module) {
    register_voxels(module);
    register_lights(module);
    register_camera(module);
    register_blocks(module);
    register_diffuse_light(module);
}

} // namespace smokelift
