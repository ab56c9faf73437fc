#include "blocks.h"
#include "camera.h"
#include "diffuse_light.h"
#include "lighting.h"
#include "python.h"

#include <optional>
#include <variant>

// Lights are those of plan.py, read by their attributes.
namespace pybind11::detail {

template <class T, class... Rest> void read(handle from, const char *name, T &value, Rest &&...rest) {
    value = from.attr(name).cast<T>();
    if constexpr (sizeof...(rest) > 0)
        read(from, rest...);
}

inline void read_energy(handle from, std::array<float, 3> &energy) {
    const auto channels = from.attr("energy").cast<std::vector<float>>();
    std::copy_n(channels.begin(), std::min(channels.size(), energy.size()), energy.begin());
}

template <> struct type_caster<smokelift::ParallelLight> {
    PYBIND11_TYPE_CASTER(smokelift::ParallelLight, const_name("ParallelSweep"));

    bool load(handle from, bool) {
        if (!hasattr(from, "slope"))
            return false;
        read_energy(from, value.energy);
        read(from, "direction", value.direction, "axis", value.axis, "travel", value.travel, "first",
             value.first, "slope", value.slope, "step", value.step);
        return true;
    }
};

template <> struct type_caster<smokelift::PointLight> {
    PYBIND11_TYPE_CASTER(smokelift::PointLight, const_name("PointSweep"));

    bool load(handle from, bool) {
        if (!hasattr(from, "faces"))
            return false;
        read_energy(from, value.energy);
        read(from, "position", value.position, "voxel_size", value.voxel_size);
        for (const handle side : from.attr("faces")) {
            smokelift::PointLight::Face &face = value.faces.emplace_back();
            read(side, "axis", face.axis, "travel", face.travel, "first", face.first, "planes", face.planes,
                 "far", face.far, "columns_b", face.columns_b, "columns_c", face.columns_c);
        }
        return true;
    }
};

} // namespace pybind11::detail

namespace smokelift {
namespace {

using Bytes = py::array_t<unsigned char, py::array::c_style | py::array::forcecast>;
using Light = std::variant<ParallelLight, PointLight>;
using VoxelArray = Write<4>;
using Fields = Made<float, 4>; // over blocks, [field][x][y][z]
using OverBlocks = Read<4>;    // the same, given

// Where there can be smoke, and the ranges of rows around that.
struct Support {
    Bytes marked;
    Shape n;
    Spans spans;

    explicit Support(const Bytes &marks) : marked(marks) {
        require_fit(marks.ndim() == 3);
        n = {int(marked.shape(0)), int(marked.shape(1)), int(marked.shape(2))};
        spans = spans_around(marks.data(), n);
    }
};

// The voxels of a support in an array with their border.
Voxels voxels_of(VoxelArray a, const Support &support) {
    const auto [x, y, z] = support.n;
    require_fit(a.n[0] == x + 2 && a.n[1] == y + 2 && a.n[2] == z + 2);
    const int width = int(a.n[3]);
    require_fit(width == 1 || width == 2 || width == 4);
    return {a.data, support.n, width};
}

// The rays with the arrays that they point to.
struct OwnedRays {
    Floats lines, length;
    std::vector<int> planes; // clip() writes them
    Rays rays;

    OwnedRays(const Floats &l, const Floats &d, Read<3, int> p)
        : lines(l), length(d), planes(p.data, p.data + p.size) {
        require_fit(l.ndim() == 3 && l.shape(2) == 4 && d.ndim() == 2 && p.n[2] == 4);
        for (int axis = 0; axis < 2; ++axis)
            require_fit(d.shape(axis) == l.shape(axis) && p.n[axis] == l.shape(axis));
        rays.lines = lines.data();
        rays.length = length.data();
        rays.planes = planes.data();
        rays.rows = int(d.shape(0));
        rays.columns = int(d.shape(1));
        rays.find_runs();
    }
    // Values of each channel that a record holds.
    std::size_t recorded() const { return rays.planes_of_runs() * Rays::LANES; }
    void require_pixels(std::size_t size, int channels) const {
        require_fit(size == rays.pixels() * channels);
    }
    Record record(std::optional<Write<>> a, int width) const {
        if (!a)
            return {};
        require_fit(a->size == recorded() * width);
        return {a->data};
    }
};

Fields over_blocks(int fields, const Shape &n) { return Fields({fields, n[0], n[1], n[2]}); }

Shape blocks_of(OverBlocks a) { return {int(a.n[1]), int(a.n[2]), int(a.n[3])}; }

void require_fields(OverBlocks a, Index fields, const Shape &n) {
    require_fit(a.n == std::array<Index, 4>{fields, n[0], n[1], n[2]});
}

// How many channels there are in means of extinction and emission.
int channels_of(OverBlocks means) {
    require_fit(means.n[0] > 1 && (means.n[0] - 1) % Blocks::FIELDS == 0);
    return int(means.n[0] - 1) / Blocks::FIELDS;
}

// Blocks that reach around all voxels of a support.
void require_around(const Blocks &blocks, const Support &support) {
    for (int axis = 0; axis < 3; ++axis)
        require_fit(blocks.size > 0 && 2 * blocks.offset[axis] + 1 >= blocks.size &&
                    2 * (blocks.offset[axis] + support.n[axis]) - 1 < (2 * blocks.n[axis] - 1) * blocks.size);
}

// Zeros that get memory where they are touched.
py::array_t<float> zeros(const std::vector<Index> &shape) {
    const auto size = std::accumulate(shape.begin(), shape.end(), std::size_t(1), std::multiplies<>());
    Values values(size);
    if (!LazyPages<float>::starts_as_zero(size))
        std::fill(values.begin(), values.end(), 0.0f);
    float *const data = values.data();
    return array_of(data, shape, std::move(values));
}

void register_voxels(py::module_ &module) {
    module.def("zeros", &zeros, "shape"_a,
               "Zeros that get memory where they are touched, in large pages where the system has them.");

    py::class_<Support>(module, "Support",
                        "Where there can be smoke; ``marked`` is (nx, ny, nz), not 0 in such voxels.")
        .def(py::init<const Bytes &>(), "marked"_a);

    module.def("pack",
               unlocked([](Workers &workers, Part<const float> density, const Support &support,
                           float extinction, VoxelArray medium) {
                   require_fit(density.n == support.n);
                   pack(density, support.marked.data(), extinction, support.spans, voxels_of(medium, support),
                        workers);
               }),
               "density"_a, "support"_a, "extinction"_a, "medium"_a,
               "Write the extinction of the marked voxels from their density; ``extinction`` is in 1/m at "
               "density 1.");

    module.def(
        "unpack",
        unlocked([](Workers &workers, VoxelArray gradient, const Support &support, float extinction,
                    Part<float> result) {
            require_fit(result.n == support.n);
            unpack(voxels_of(gradient, support), support.marked.data(), extinction, result, workers);
        }),
        "gradient"_a, "support"_a, "extinction"_a, "result"_a,
        "Write the derivative by density of the marked voxels into ``result``; others are left as they are.");
}

void register_lights(py::module_ &module) {
    py::class_<Phase>(module, "Phase", R"(Henyey-Greenstein phase function times albedo, towards the camera.

        ``to_eye`` is (3, 4): it maps a voxel's index (i, j, k, 1) to the direction to the eye, of any length.)")
        .def(py::init([](const std::array<std::array<float, 4>, 3> &to_eye, float albedo, float anisotropy) {
                 return Phase{to_eye, albedo, anisotropy};
             }),
             py::kw_only(), "to_eye"_a, "albedo"_a, "anisotropy"_a);

    module.def("shade",
               unlocked([](Workers &workers, VoxelArray medium, const Support &support, const Phase &phase,
                           const std::vector<Light> &lights) {
                   const Voxels voxels = voxels_of(medium, support);
                   for (const Light &light : lights) {
                       const bool add = &light != &lights.front();
                       std::visit(
                           [&](const auto &l) { shade(voxels, support.spans, phase, l, add, workers); },
                           light);
                   }
                   extend_into_border(voxels);
               }),
               "medium"_a, "support"_a, "phase"_a, "lights"_a,
               "Write the radiance that the lights scatter in every voxel towards the camera.");

    module.def(
        "shade_adjoint",
        unlocked([](Workers &workers, VoxelArray medium, VoxelArray gradient,
                    std::optional<VoxelArray> scratch, const Support &support, const Phase &phase,
                    const std::vector<Light> &lights) {
            const Voxels voxels = voxels_of(medium, support), gradients = voxels_of(gradient, support);
            const Voxels space = scratch ? voxels_of(*scratch, support) : Voxels{};
            require_fit(gradients.width == voxels.width && (scratch || lights.size() == 1) &&
                        space.width == 1);
            fold_border(gradients);
            for (const Light &light : lights) {
                if (const auto *point = std::get_if<PointLight>(&light))
                    shade_adjoint(voxels, gradients, support.spans, phase, *point, workers);
                else
                    shade_adjoint(voxels, gradients, space, support.spans, phase,
                                  std::get<ParallelLight>(light), workers);
            }
        }),
        "medium"_a, "gradient"_a, "scratch"_a, "support"_a, "phase"_a, "lights"_a,
        R"(Add to the derivative by extinction what the in-scattered radiance says of it (adjoint sweep of `shade`).

        ``scratch`` is one float per voxel, shape (nx+2, ny+2, nz+2, 1); a single light needs none. The derivative by the
        in-scattered radiance is used up.)");
}

void register_camera(py::module_ &module) {
    py::class_<OwnedRays>(module, "Rays", R"(One ray a pixel.

        Parameters
        ----------
        lines : (rows, columns, 4)
            b0, b1, c0, c1: the ray crosses plane k of its dominant axis at (b0 + b1 k, c0 + c1 k) along the two other axes,
            voxel centers at integers.
        length : (rows, columns)
            Between two planes in meters.
        planes : (rows, columns, 4)
            Dominant axis, travel along it, first and last plane with a sample; last < first where there is none.)")
        .def(py::init<const Floats &, const Floats &, Read<3, int>>(), "lines"_a, "length"_a, "planes"_a)
        .def("clip",
             unlocked([](Workers &workers, OwnedRays &self, const Support &support, VoxelArray medium) {
                 clip(voxels_of(medium, support), self.rays, workers);
             }),
             "support"_a, "medium"_a, "Shorten every ray to where the voxels around it hold anything.")
        .def_property_readonly("recorded", &OwnedRays::recorded,
                               "Samples that a record holds of each channel: neighboring rays have as many.");

    module.def(
        "march",
        unlocked([](Workers &workers, VoxelArray medium, const Support &support, const OwnedRays &rays,
                    std::optional<Write<>> record) {
            const Voxels voxels = voxels_of(medium, support);
            const Index rows = rays.rays.rows, columns = rays.rays.columns;
            Made<float, 3> scattered({rows, columns, voxels.width - 1});
            Made<float, 2> depth({rows, columns});
            march(voxels, rays.rays, scattered.data(), depth.data(), rays.record(record, voxels.width),
                  workers);
            return std::pair(std::move(scattered), std::move(depth));
        }),
        "medium"_a, "support"_a, "rays"_a, "record"_a,
        R"(Radiance towards the camera (rows, columns, channels) and optical depth (rows, columns) of every ray.

        ``record`` (1 + channels, `Rays.recorded`) is written for `march_adjoint`: what the samples held. It may be None.)");

    module.def(
        "march_adjoint",
        unlocked([](Workers &workers, const OwnedRays &rays, Read<> depth, Read<> scattered_gradient,
                    Read<> transmittance_gradient, std::optional<Write<>> record, VoxelArray gradient,
                    const Support &support) {
            const Voxels voxels = voxels_of(gradient, support);
            rays.require_pixels(scattered_gradient.size, voxels.width - 1);
            rays.require_pixels(transmittance_gradient.size, 1);
            rays.require_pixels(depth.size, 1);
            const Record samples = rays.record(record, voxels.width);
            require_fit(samples.data);
            clear(voxels, workers);
            march_adjoint(rays.rays, depth.data, scattered_gradient.data, transmittance_gradient.data,
                          samples, voxels, workers);
        }),
        "rays"_a, "depth"_a, "scattered_gradient"_a, "transmittance_gradient"_a, "record"_a, "gradient"_a,
        "support"_a,
        R"(Write the derivatives by the voxels of ``gradient`` from those by radiance and transmittance of every ray.

        ``record`` is that of `march`; it is overwritten.)");
}

void register_blocks(py::module_ &module) {
    py::class_<Blocks>(
        module, "Blocks",
        R"(Cubes of ``size`` voxels; every voxel of a support lies between the centers of eight.

        ``offset`` is the index of the support's first voxel among those of the first block, ``shape`` the number of blocks.)")
        .def(py::init([](const Shape &shape, int size, const Shape &offset) {
                 return Blocks{shape, size, offset};
             }),
             py::kw_only(), "shape"_a, "size"_a, "offset"_a);

    module.def(
        "average",
        unlocked([](Workers &workers, VoxelArray medium, const Support &support, const Blocks &blocks) {
            const Voxels voxels = voxels_of(medium, support);
            require_around(blocks, support);
            Fields means = over_blocks(1 + (voxels.width - 1) * Blocks::FIELDS, blocks.n);
            average(voxels, support.spans, blocks, means.data(), workers);
            return means;
        }),
        "medium"_a, "support"_a, "blocks"_a,
        "Over blocks (1 + 4 channels, bx, by, bz): the mean of the extinction kappa, then kappa J by "
        "channel, linear.");

    module.def("average_adjoint",
               unlocked([](Workers &workers, VoxelArray medium, const Support &support, const Blocks &blocks,
                           OverBlocks means_gradient, VoxelArray gradient) {
                   const Voxels voxels = voxels_of(medium, support), gradients = voxels_of(gradient, support);
                   require_around(blocks, support);
                   require_fit(gradients.width == voxels.width);
                   require_fields(means_gradient, 1 + (voxels.width - 1) * Blocks::FIELDS, blocks.n);
                   average_adjoint(voxels, support.spans, blocks, means_gradient.data, gradients, workers);
               }),
               "medium"_a, "support"_a, "blocks"_a, "means_gradient"_a, "gradient"_a,
               "Add to the derivatives by kappa and J what those by the result of `average` say of them.");

    module.def("add_interpolated",
               unlocked([](Workers &workers, OverBlocks values, float factor, const Blocks &blocks,
                           VoxelArray medium, const Support &support) {
                   const Voxels voxels = voxels_of(medium, support);
                   require_around(blocks, support);
                   require_fields(values, (voxels.width - 1) * Blocks::FIELDS, blocks.n);
                   add_interpolated(values.data, factor, blocks, voxels, support.spans, workers);
                   extend_into_border(voxels);
               }),
               "values"_a, "factor"_a, "blocks"_a, "medium"_a, "support"_a,
               "J += factor x values (4 channels, bx, by, bz): what eight blocks say, weighted as between "
               "their centers.");

    module.def("interpolate_adjoint",
               unlocked([](Workers &workers, VoxelArray gradient, const Support &support, float factor,
                           const Blocks &blocks) {
                   const Voxels gradients = voxels_of(gradient, support);
                   require_around(blocks, support);
                   Fields result = over_blocks((gradients.width - 1) * Blocks::FIELDS, blocks.n);
                   fold_border(gradients);
                   interpolate_adjoint(gradients, support.spans, factor, blocks, result.data(), workers);
                   return result;
               }),
               "gradient"_a, "support"_a, "factor"_a, "blocks"_a,
               "Derivative by the values of `add_interpolated` (4 channels, bx, by, bz) from that by J.");

    module.def("diffuse", unlocked([](Workers &workers, OverBlocks means, float albedo, float edge) {
                   const int channels = channels_of(means);
                   const Shape n = blocks_of(means);
                   const std::size_t stride = Blocks::FIELDS * volume(n);
                   Fields phi = over_blocks(channels * Blocks::FIELDS, n);
                   const DiffuseLight light(means.data, albedo, n, edge);
                   for (int channel = 0; channel < channels; ++channel)
                       light.solve(means.data + volume(n) + channel * stride, phi.data() + channel * stride,
                                   workers);
                   return phi;
               }),
               "means"_a, "albedo"_a, "edge"_a,
               R"(Mean radiance (4 channels, bx, by, bz) after any number of scatterings, in W/m^2/sr.

        Parameters
        ----------
        means : (1 + 4 channels, bx, by, bz)
            Extinction in 1/m, then what is emitted by channel, in W/m^3/sr, the same in all directions.
        edge
            Of a block in meters.)");

    module.def(
        "diffuse_adjoint",
        unlocked([](Workers &workers, OverBlocks means, OverBlocks radiance, OverBlocks radiance_gradient,
                    float albedo, float edge) {
            const int channels = channels_of(means);
            const Shape n = blocks_of(means);
            require_fields(radiance, channels * Blocks::FIELDS, n);
            require_fields(radiance_gradient, channels * Blocks::FIELDS, n);
            Fields result = over_blocks(1 + channels * Blocks::FIELDS, n);
            float *const extinction = result.data(), *const emission = extinction + volume(n);
            const DiffuseLight light(means.data, albedo, n, edge);
            std::fill_n(extinction, volume(n), 0.0f);
            for (int channel = 0; channel < channels; ++channel) {
                const std::size_t at = channel * Blocks::FIELDS * volume(n);
                light.solve_adjoint(means.data + volume(n) + at, radiance.data + at,
                                    radiance_gradient.data + at, emission + at, extinction, workers);
            }
            return result;
        }),
        "means"_a, "radiance"_a, "radiance_gradient"_a, "albedo"_a, "edge"_a,
        "Derivative by the means (1 + 4 channels, bx, by, bz) from that by the radiance of `diffuse`.");
}

} // namespace

void register_render(py::module_ &module) {
    register_voxels(module);
    register_lights(module);
    register_camera(module);
    register_blocks(module);
}

} // namespace smokelift
