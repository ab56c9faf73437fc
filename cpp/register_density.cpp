#include "descent.h"
#include "marked_voxels.h"
#include "pictures.h"
#include "python.h"

#include <optional>

namespace smokelift {

void register_density(py::module_ &module) {
    using namespace py::literals;
    using Vector = py::array_t<float, py::array::c_style>;
    using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
    using Marks = py::array_t<bool, py::array::c_style | py::array::forcecast>;

    py::class_<MarkedVoxels>(module, "MarkedVoxels")
        .def(py::init([](const Marks &voxels) {
                 require_fit(voxels.ndim() == 3);
                 const Mask mask{reinterpret_cast<const unsigned char *>(voxels.data()),
                                 {int(voxels.shape(0)), int(voxels.shape(1)), int(voxels.shape(2))}};
                 return released([&](Workers &workers) { return MarkedVoxels(mask, workers); });
             }),
             "voxels"_a)
        .def_property_readonly("count", &MarkedVoxels::count)
        .def(
            "above_zero",
            [](const MarkedVoxels &self, const Array &a, const Array &b) {
                require_fit(std::size_t(a.size()) == volume(self.shape()) && b.size() == a.size());
                return released(
                    [&](Workers &workers) { return self.above_zero(a.data(), b.data(), workers); });
            },
            "a"_a, "b"_a)
        .def(
            "take",
            [](const MarkedVoxels &self, const Array &from, std::optional<Vector> out) {
                require_fit(std::size_t(from.size()) == volume(self.shape()));
                Vector values = out ? *out : Vector(py::ssize_t(self.count()));
                require_fit(std::size_t(values.size()) == self.count());
                float *const to = values.mutable_data();
                released([&](Workers &workers) { self.take(from.data(), to, workers); });
                return values;
            },
            "volume"_a, py::arg("out").noconvert() = py::none())
        .def(
            "put",
            [](const MarkedVoxels &self, const Array &values, Vector to, float factor) {
                require_fit(std::size_t(to.size()) == volume(self.shape()) &&
                            std::size_t(values.size()) == self.count());
                float *const result = to.mutable_data();
                released([&](Workers &workers) { self.put(values.data(), factor, result, workers); });
            },
            "values"_a, "volume"_a.noconvert(), "factor"_a = 1.0f)
        .def(
            "share_in_cubes",
            [](const MarkedVoxels &self, const Vector &values, int size, double weight, Vector out) {
                require_fit(std::size_t(values.size()) == self.count() && out.size() == values.size() &&
                            size > 0);
                float *const shared = out.mutable_data();
                released([&](Workers &workers) {
                    share_in_cubes(self, size, weight, values.data(), shared, workers);
                });
            },
            "values"_a.noconvert(), "size"_a, "weight"_a, "out"_a.noconvert())
        .def(
            "scale_along_rays",
            [](const MarkedVoxels &self, const PictureMap &map, const Vector &values,
               const std::optional<Vector> &plausible, const Doubles &logarithm, float faint, float most,
               float share, Vector out) {
                require_fit(self.shape() == map.shape() && std::size_t(values.size()) == self.count() &&
                            out.size() == values.size() &&
                            (!plausible || plausible->size() == values.size()) && logarithm.ndim() == 2 &&
                            logarithm.shape(0) == map.rows && logarithm.shape(1) == map.columns);
                const RayScale scale{logarithm.data(), plausible ? plausible->data() : nullptr, faint, most,
                                     share};
                float *const scaled = out.mutable_data();
                released([&](Workers &workers) {
                    scale_along_rays(scale, map, self, values.data(), scaled, workers);
                });
            },
            "picture"_a, "values"_a.noconvert(), "plausible"_a.noconvert(), "logarithm"_a, "faint"_a,
            "most"_a, "share"_a, "out"_a.noconvert());

    module.def(
        "hold",
        [](const Vector &values, const Vector &gradient, const Vector &density, float bound, Vector out) {
            const py::ssize_t count = values.size();
            require_fit(gradient.size() == count && density.size() == count && out.size() == count);
            float *const held = out.mutable_data();
            released([&](Workers &workers) {
                hold(values.data(), gradient.data(), density.data(), bound, std::size_t(count), held,
                     workers);
            });
        },
        "values"_a.noconvert(), "gradient"_a.noconvert(), "density"_a.noconvert(), "bound"_a,
        "out"_a.noconvert());

    module.def(
        "descend",
        [](const Vector &density, const Vector &direction, const Vector &scale, const Vector &floor,
           float length, float max_change, float bound, Vector arrived, Vector moved) {
            const py::ssize_t count = density.size();
            require_fit(direction.size() == count && scale.size() == count && floor.size() == count &&
                        arrived.size() == count && moved.size() == count);
            const DescentStep step{density.data(), direction.data(), scale.data(), floor.data(),
                                   length,         max_change,       bound};
            float *const to = arrived.mutable_data(), *const way = moved.mutable_data();
            released([&](Workers &workers) { descend(step, std::size_t(count), to, way, workers); });
        },
        "density"_a.noconvert(), "direction"_a.noconvert(), "scale"_a.noconvert(), "floor"_a.noconvert(),
        "length"_a, "max_change"_a, "bound"_a, "arrived"_a.noconvert(), "moved"_a.noconvert());
}

} // namespace smokelift
