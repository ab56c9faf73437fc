#include "lattice.h"
#include "marked_voxels.h"
#include "pictures.h"
#include "python.h"

#include <optional>

namespace smokelift {
namespace {

using Floats1 = py::array_t<float, py::array::c_style>;

template <class... T> void require_size(std::size_t size, const T &...arrays) {
    require_fit(((arrays.size == size) && ...));
}

} // namespace

void register_density(py::module_ &module) {
    py::class_<MarkedVoxels>(
        module, "MarkedVoxels",
        "The marked voxels of a grid; values (count,) are at them in their order in memory.")
        .def(py::init(unlocked([](Workers &workers, Mask voxels) { return MarkedVoxels(voxels, workers); })),
             "voxels"_a)
        .def_property_readonly("count", &MarkedVoxels::count, "How many there are.")
        .def("above_zero", unlocked([](Workers &workers, const MarkedVoxels &self, Read<> a, Read<> b) {
                 require_size(volume(self.shape()), a, b);
                 return self.above_zero(a.data, b.data, workers);
             }),
             "a"_a, "b"_a, "Those of them at which either volume (nx, ny, nz) is above 0.")
        .def(
            "take",
            [](const MarkedVoxels &self, const Floats &volume, std::optional<Floats1> out) {
                Floats1 values = out ? *out : Floats1(Index(self.count()));
                require_fit(std::size_t(volume.size()) == smokelift::volume(self.shape()) &&
                            std::size_t(values.size()) == self.count());
                float *const to = values.mutable_data();
                unlocked([&](Workers &workers) { self.take(volume.data(), to, workers); })();
                return values;
            },
            "volume"_a, py::arg("out").noconvert() = py::none(),
            "Values of a volume, written to ``out`` if that is given.")
        .def(
            "put",
            unlocked([](Workers &workers, const MarkedVoxels &self, Read<> values, Write<> to, float factor) {
                require_size(self.count(), values);
                require_size(volume(self.shape()), to);
                self.put(values.data, factor, to.data, workers);
            }),
            "values"_a, "volume"_a, "factor"_a = 1.0f, "Write values, times a factor, into a volume.")
        .def(
            "smooth_in_cubes",
            unlocked([](Workers &workers, const MarkedVoxels &self, Read<> values, int size, double weight,
                        Write<> out) {
                require_size(self.count(), values, out);
                require_fit(size > 0);
                smooth_in_cubes(self, size, weight, values.data, out.data, workers);
            }),
            "values"_a, "size"_a, "weight"_a, "out"_a,
            R"(Write values / (1 + weight) and, ``weight`` times as much, their means over cubes of ``size`` voxels.

        Half of it is over each of two lattices, half a cube apart. The result may replace the values.)")
        .def("read_lattice",
             unlocked([](Workers &workers, const MarkedVoxels &self, In lattice, float scale,
                         const std::array<float, 3> &shift, Read<2> motion, float stretch) {
                 require_fit(motion.n == std::array<Index, 2>{3, Index(self.count())});
                 Made<float, 1> values({Index(self.count())});
                 read_lattice(lattice, {scale, shift, motion.data, stretch}, self, values.data(), workers);
                 return values;
             }),
             "lattice"_a, "scale"_a, "shift"_a, "motion"_a, "stretch"_a,
             R"(A lattice that repeats, read at the voxels (count,), smooth between nodes at whole numbers.

        A voxel lies at its index x scale + shift (3,) + its motion (3, count) x stretch, which is finite.)")
        .def("scale_along_rays",
             unlocked([](Workers &workers, const MarkedVoxels &self, const PictureMap &picture, Read<> values,
                         std::optional<Read<>> plausible, Read<2, double> logarithm, float floor,
                         float max_gain, float fraction, Write<> out) {
                 require_size(self.count(), values, plausible.value_or(values), out);
                 require_fit(self.shape() == picture.shape() &&
                             logarithm.n == std::array<Index, 2>{picture.rows, picture.columns});
                 const RayScale scale{logarithm.data, plausible ? plausible->data : nullptr, floor, max_gain,
                                      fraction};
                 scale_along_rays(scale, picture, self, values.data, out.data, workers);
             }),
             "picture"_a, "values"_a, "plausible"_a, "logarithm"_a, "floor"_a, "max_gain"_a, "fraction"_a,
             "out"_a,
             R"(Scale values by a fraction of the logarithmic steps (rows, columns) of their pixels' rays.

        Steps are read bilinearly; what is not in the picture stays as it is. With ``plausible`` (count,) a step that
        would scale a value to v is multiplied by plausible / v where it adds smoke and by v / plausible where it takes
        some, both plus ``floor``, by ``max_gain`` at most. The result may replace the values.)");
}

} // namespace smokelift
