#include "codes.h"
#include "depth_profile.h"
#include "extraction.h"
#include "halves.h"
#include "lattice.h"
#include "patches.h"
#include "picture_blur.h"
#include "pictures.h"
#include "python.h"
#include "ranks.h"
#include "turning.h"

namespace smokelift {
namespace {

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Codes = py::array_t<unsigned char, 0>;
using Integers = py::array_t<int, py::array::c_style | py::array::forcecast>;
using Marks = py::array_t<bool, py::array::c_style | py::array::forcecast>;

std::vector<double> values_of(const Doubles &a) {
    require_fit(a.ndim() == 1 && a.size() > 0);
    return {a.data(), a.data() + a.size()};
}

PictureMap map_of(const Doubles &to_pixel, const std::array<Doubles, 3> &centres,
                  const std::array<int, 2> &size) {
    require_fit(to_pixel.ndim() == 2 && to_pixel.shape(0) == 3 && to_pixel.shape(1) == 4);
    PictureMap map;
    for (int row = 0; row < 3; ++row) {
        std::copy_n(to_pixel.data() + 4 * row, 4, map.to_pixel[row].begin());
        map.centres[row] = values_of(centres[row]);
    }
    map.columns = size[0];
    map.rows = size[1];
    return map;
}

CodedLines lines_of(const Codes &picture) {
    require_fit(picture.ndim() == 3 && picture.strides(2) == 1 && picture.strides(1) == picture.shape(2));
    return {picture.data(), picture.strides(0), int(picture.shape(0)),
            int(picture.shape(1) * picture.shape(2))};
}

LineWeights weights_of(const Integers &first, const Integers &lines, const Array &weights, int count) {
    const int *const begin = first.data();
    require_fit(first.ndim() == 1 && first.size() > 0 && begin[0] == 0 &&
                std::is_sorted(begin, begin + first.size()) && begin[first.size() - 1] == lines.size() &&
                lines.size() == weights.size());
    for (py::ssize_t n = 0; n < lines.size(); ++n)
        require_fit(lines.data()[n] >= 0 && lines.data()[n] < count);
    return {begin, lines.data(), weights.data(), int(first.size()) - 1};
}

void require_parts(const Integers &first, py::ssize_t parts, py::ssize_t whole) {
    const int *const begin = first.data();
    require_fit(first.ndim() == 1 && first.size() == parts + 1 && begin[0] == 0 && begin[parts] == whole &&
                std::is_sorted(begin, begin + parts + 1));
}

const unsigned char *bytes_of(const Marks &a) { return reinterpret_cast<const unsigned char *>(a.data()); }

void require_spans(const Integers &spans, const Shape &n) {
    require_fit(spans.ndim() == 3 && spans.shape(0) == n[0] && spans.shape(1) == n[1] && spans.shape(2) == 2);
    for (py::ssize_t at = 0; at < spans.size(); ++at)
        require_fit(spans.data()[at] >= 0 && spans.data()[at] <= n[2]);
}

Mask mask_of(const Marks &voxels) {
    require_fit(voxels.ndim() == 3);
    return {bytes_of(voxels), {int(voxels.shape(0)), int(voxels.shape(1)), int(voxels.shape(2))}};
}

void register_places(py::module_ &module) {
    using namespace py::literals;

    module.def(
        "depth_profile",
        [](const Marks &voxels, const std::array<Doubles, 3> &places, const std::array<double, 3> &depth,
           const std::array<Array, 2> &at, const Doubles &middle, const Doubles &width, double flatness) {
            const Mask mask = mask_of(voxels);
            require_fit(middle.ndim() == 2 && middle.size() > 0 && width.ndim() == 2 &&
                        width.shape(0) == middle.shape(0) && width.shape(1) == middle.shape(1));
            const DepthProfile profile{{values_of(places[0]), values_of(places[1]), values_of(places[2])},
                                       depth,
                                       middle.data(),
                                       width.data(),
                                       int(middle.shape(0)),
                                       int(middle.shape(1)),
                                       flatness};
            for (int axis = 0; axis < 3; ++axis)
                require_fit(int(profile.places[axis].size()) == mask.n[axis]);
            const auto first = released([&](Workers &workers) { return count_marked(mask, workers); });
            const auto count = py::ssize_t(first.back());
            require_fit(at[0].size() == count && at[1].size() == count);
            Array shapes(count), widths(count);
            float *const found_shapes = shapes.mutable_data(), *const found_widths = widths.mutable_data();
            const SeenAt seen_at{at[0].data(), at[1].data(), nullptr};
            released([&](Workers &workers) {
                find_profile(profile, mask, first, seen_at, found_shapes, found_widths, workers);
            });
            return py::make_tuple(shapes, widths);
        },
        "voxels"_a, "places"_a, "depth"_a, "at"_a, "middle"_a, "width"_a, "flatness"_a);

    module.def(
        "marked",
        [](const Marks &voxels) {
            const Mask mask = mask_of(voxels);
            const auto first = released([&](Workers &workers) { return count_marked(mask, workers); });
            return made<std::int64_t>({3, py::ssize_t(first.back())}, [&](auto *indices, Workers &workers) {
                find_marked(mask, first, indices, workers);
            });
        },
        "voxels"_a);

    py::class_<PictureMap>(module, "PictureMap")
        .def(py::init(&map_of), "to_pixel"_a, "centres"_a, "size"_a)
        .def(
            "places",
            [](const PictureMap &map, const Marks &voxels) {
                const Mask mask = mask_of(voxels);
                require_fit(mask.n == map.shape());
                const auto first = released([&](Workers &workers) { return count_marked(mask, workers); });
                const auto count = py::ssize_t(first.back());
                Array rows(count), columns(count);
                py::array_t<bool> visible(count);
                const Places places{rows.mutable_data(), columns.mutable_data(), visible.mutable_data()};
                released([&](Workers &workers) { find_places(map, mask, first, places, workers); });
                return py::make_tuple(rows, columns, visible);
            },
            "voxels"_a)
        .def(
            "shown",
            [](const PictureMap &map, const Marks &picture) {
                require_fit(picture.ndim() == 2 && picture.shape(0) == map.rows &&
                            picture.shape(1) == map.columns);
                const Shape n = map.shape();
                return made<bool>({n[0], n[1], n[2]}, [&](bool *shown, Workers &workers) {
                    mark_shown(map, bytes_of(picture), shown, workers);
                });
            },
            "picture"_a)
        .def_property_readonly("nearest", [](const PictureMap &map) {
            return released([&](Workers &workers) { return nearest_depth(map, workers); });
        });

    module.def(
        "read_bilinearly",
        [](const Doubles &picture, const Array &rows, const Array &columns) {
            require_fit(picture.ndim() == 2 && picture.size() > 0 && rows.size() == columns.size());
            return made({rows.size()}, [&](float *values, Workers &workers) {
                read_bilinearly(picture.data(), int(picture.shape(0)), int(picture.shape(1)), rows.data(),
                                columns.data(), std::size_t(rows.size()), values, workers);
            });
        },
        "picture"_a, "rows"_a, "columns"_a);
}

// A box of an array, of which consecutive elements along z are neighbours in memory.
template <class T, class Data> Part<T> part_of(const py::array_t<std::remove_const_t<T>, 0> &a, Data data) {
    require_fit(a.ndim() == 3 && a.size() > 0 && a.strides(2) == py::ssize_t(sizeof(T)));
    Part<T> part{{data, {}}, {int(a.shape(0)), int(a.shape(1)), int(a.shape(2))}};
    for (int axis = 0; axis < 3; ++axis)
        part.at.stride[axis] = a.strides(axis) / Stride(sizeof(T));
    return part;
}

template <class T> Part<const T> part_of(const py::array_t<T, 0> &a) { return part_of<const T>(a, a.data()); }

Shape halved(const Shape &n) { return {(n[0] + 1) / 2, (n[1] + 1) / 2, (n[2] + 1) / 2}; }

void register_halves(py::module_ &module) {
    using namespace py::literals;
    using Box = py::array_t<float, 0>;
    using BoxMarks = py::array_t<bool, 0>;

    module.def(
        "means_of_two",
        [](const Box &values, const std::optional<BoxMarks> &voxels) {
            const auto fine = part_of(values);
            std::optional<Part<const bool>> marked;
            if (voxels) {
                marked = part_of(*voxels);
                require_fit(marked->n == fine.n);
            }
            return filled(halved(fine.n),
                          [&](Out means, Workers &workers) { means_of_two(fine, marked, means, workers); });
        },
        py::arg("values").noconvert(), py::arg("voxels").noconvert() = py::none());

    module.def(
        "prolong_values",
        [](const Box &values, const BoxMarks &voxels) {
            const auto coarse = part_of(values);
            const auto marked = part_of(voxels);
            require_fit(coarse.n == halved(marked.n));
            std::vector<std::size_t> first(marked.n[0] + 1, 0);
            for (int x = 0; x < marked.n[0]; ++x) {
                first[x + 1] = first[x];
                for (int y = 0; y < marked.n[1]; ++y)
                    first[x + 1] += std::count(marked.row(x, y), marked.row(x, y) + marked.n[2], true);
            }
            return made({py::ssize_t(first.back())}, [&](float *prolonged, Workers &workers) {
                prolong_values(coarse, marked, first, prolonged, workers);
            });
        },
        py::arg("values").noconvert(), py::arg("voxels").noconvert());

    module.def(
        "scale_alike",
        [](const Box &values, const BoxMarks &voxels, const Box &before, const Box &after, float least,
           Box &result) {
            const auto fine = part_of(values), was = part_of(before), is = part_of(after);
            const auto marked = part_of(voxels);
            const auto scaled = part_of<float>(result, result.mutable_data());
            require_fit(marked.n == fine.n && scaled.n == fine.n && was.n == halved(fine.n) && is.n == was.n);
            released([&](Workers &workers) { scale_alike(fine, marked, was, is, least, scaled, workers); });
        },
        py::arg("values").noconvert(), py::arg("voxels").noconvert(), py::arg("before").noconvert(),
        py::arg("after").noconvert(), "least"_a, py::arg("result").noconvert());
}

void register_codes(py::module_ &module) {
    using namespace py::literals;

    module.def(
        "sum_lines",
        [](const Codes &picture, const Array &table, const Integers &first, const Integers &lines,
           const Array &weights) {
            const CodedLines coded = lines_of(picture);
            require_fit(table.size() == 256);
            const LineWeights summed = weights_of(first, lines, weights, coded.lines);
            return made({summed.count, picture.shape(1), picture.shape(2)},
                        [&](float *sums) { sum_lines(coded, table.data(), summed, sums); });
        },
        "picture"_a, "table"_a, "first"_a, "lines"_a, "weights"_a);

    module.def(
        "sum_columns",
        [](const Array &values, const Integers &first, const Integers &columns, const Array &weights) {
            require_fit(values.ndim() == 3);
            const Extent extent{int(values.shape(0)), int(values.shape(1)), int(values.shape(2))};
            const LineWeights summed = weights_of(first, columns, weights, extent.columns);
            return made({values.shape(0), summed.count, values.shape(2)},
                        [&](float *sums) { sum_columns(values.data(), extent, summed, sums); });
        },
        "values"_a, "first"_a, "columns"_a, "weights"_a);

    module.def(
        "add_weighted",
        [](const Codes &picture, const Array &table, const Array &weights, const Integers &lines,
           const Integers &columns, py::array_t<float, py::array::c_style> &sums) {
            const CodedLines coded = lines_of(picture);
            require_fit(table.size() == 256 && weights.ndim() == 3 && picture.shape(2) == 3 &&
                        weights.shape(2) == 3 && sums.ndim() == 3 &&
                        std::equal(sums.shape(), sums.shape() + 3, picture.shape()));
            require_parts(lines, weights.shape(0), coded.lines);
            require_parts(columns, weights.shape(1), picture.shape(1));
            const PartWeights parts{weights.data(), lines.data(), columns.data(), int(weights.shape(0)),
                                    int(weights.shape(1))};
            float *const result = sums.mutable_data();
            const py::gil_scoped_release unlocked;
            add_weighted(coded, table.data(), parts, result);
        },
        "picture"_a, "table"_a, "weights"_a, "lines"_a, "columns"_a, py::arg("sums").noconvert());

    module.def(
        "interleave",
        [](const std::array<Codes, 3> &channels) {
            std::array<CodedLines, 3> planes;
            for (int c = 0; c < 3; ++c) {
                const Codes &plane = channels[c];
                require_fit(plane.ndim() == 2 && plane.strides(1) == 1 &&
                            std::equal(plane.shape(), plane.shape() + 2, channels[0].shape()));
                planes[c] = {plane.data(), plane.strides(0), int(plane.shape(0)), int(plane.shape(1))};
            }
            return made<unsigned char>({channels[0].shape(0), channels[0].shape(1), 3},
                                       [&](unsigned char *codes) { interleave(planes, codes); });
        },
        "channels"_a);
}

void register_filters(py::module_ &module) {
    using namespace py::literals;

    module.def(
        "blur_picture",
        [](const Array &picture, const Doubles &weights) {
            require_fit((picture.ndim() == 2 || picture.ndim() == 3) && picture.size() > 0);
            const int channels = picture.ndim() == 3 ? int(picture.shape(2)) : 1;
            const Extent extent{int(picture.shape(0)), int(picture.shape(1)), channels};
            const std::vector<double> outwards = values_of(weights);
            return made({picture.shape(), picture.shape() + picture.ndim()},
                        [&](float *blurred) { blur_picture(picture.data(), extent, outwards, blurred); });
        },
        "picture"_a, "weights"_a);

    module.def(
        "at_ranks",
        [](const Array &values, const std::vector<int> &ranks) {
            require_fit(values.ndim() > 0 && values.shape(0) > 0);
            const int lines = int(values.shape(0));
            for (const int rank : ranks)
                require_fit(rank >= 0 && rank < lines);
            std::vector<py::ssize_t> shape(values.shape(), values.shape() + values.ndim());
            shape[0] = py::ssize_t(ranks.size());
            return made(shape, [&](float *found) {
                at_ranks(values.data(), lines, std::size_t(values.size() / lines), ranks, found);
            });
        },
        "values"_a, "ranks"_a);
}

void register_turning(py::module_ &module) {
    using namespace py::literals;

    module.def(
        "read_lattice",
        [](const Array &lattice, const Array &places) {
            const In nodes = view(lattice);
            require_fit(places.ndim() == 2 && places.shape(0) == 3);
            return made({places.shape(1)}, [&](float *values, Workers &workers) {
                read_lattice(nodes, places.data(), std::size_t(places.shape(1)), values, workers);
            });
        },
        "lattice"_a, "places"_a);

    module.def(
        "filled_spans",
        [](const Array &volume) {
            const In voxels = view(volume);
            return made<int>({volume.shape(0), volume.shape(1), 2},
                             [&](int *spans, Workers &workers) { find_filled(voxels, spans, workers); });
        },
        "volume"_a);

    module.def(
        "project_turned",
        [](const Array &volume, const Integers &spans, double first, std::array<double, 2> steps,
           int columns) {
            const In voxels = view(volume);
            require_spans(spans, voxels.n);
            require_fit(columns > 0);
            const Turned turned{first, steps[0], steps[1], columns};
            return made({columns, volume.shape(2)}, [&](float *picture, Workers &workers) {
                project_turned(voxels, spans.data(), turned, picture, workers);
            });
        },
        "volume"_a, "spans"_a, "first"_a, "steps"_a, "columns"_a);

    module.def(
        "scale_turned",
        [](py::array_t<float, py::array::c_style> &volume, const Integers &spans, double first,
           std::array<double, 2> steps, const Array &logarithm) {
            const Shape n{int(volume.shape(0)), int(volume.shape(1)), int(volume.shape(2))};
            require_spans(spans, n);
            require_fit(logarithm.ndim() == 2 && logarithm.shape(0) > 0 && logarithm.shape(1) == n[2]);
            const Out voxels{volume.mutable_data(), n};
            const Turned turned{first, steps[0], steps[1], int(logarithm.shape(0))};
            released([&](Workers &workers) {
                scale_turned(voxels, spans.data(), turned, logarithm.data(), workers);
            });
        },
        py::arg("volume").noconvert(), "spans"_a, "first"_a, "steps"_a, "logarithm"_a);
}

// The patches about some places, which have to lie in a picture (rows, columns).
Patches patches_at(const Integers &at, int size, py::ssize_t rows, py::ssize_t columns) {
    require_fit(at.ndim() == 2 && at.shape(0) == 2 && size > 0 && size % 2 == 1);
    const Patches patches{at.data(), at.data() + at.shape(1), std::size_t(at.shape(1)), size};
    const int reach = size / 2;
    for (std::size_t n = 0; n < patches.count; ++n)
        require_fit(patches.rows[n] >= reach && patches.rows[n] + reach < rows &&
                    patches.columns[n] >= reach && patches.columns[n] + reach < columns);
    return patches;
}

void register_patches(py::module_ &module) {
    using namespace py::literals;

    module.def(
        "unfold",
        [](const Array &picture, const Integers &at, int size) {
            require_fit(picture.ndim() == 2);
            const Patches patches = patches_at(at, size, picture.shape(0), picture.shape(1));
            return made({py::ssize_t(size) * size, at.shape(1)}, [&](float *pixels, Workers &workers) {
                unfold(picture.data(), int(picture.shape(1)), patches, pixels, workers);
            });
        },
        "picture"_a, "at"_a, "size"_a);

    module.def(
        "fold",
        [](const Array &pixels, const Integers &at, int size, std::array<int, 2> shape) {
            const Patches patches = patches_at(at, size, shape[0], shape[1]);
            require_fit(pixels.ndim() == 2 && pixels.shape(0) == py::ssize_t(size) * size &&
                        pixels.shape(1) == at.shape(1));
            return made({shape[0], shape[1]},
                        [&](float *picture) { fold(pixels.data(), patches, shape[0], shape[1], picture); });
        },
        "pixels"_a, "at"_a, "size"_a, "shape"_a);

    module.def(
        "to_quantiles",
        [](py::array_t<float, py::array::c_style> &values, const Array &wanted) {
            require_fit(values.ndim() == 2 && wanted.ndim() == 2 && values.shape(0) == wanted.shape(0) &&
                        wanted.shape(1) > 0);
            float *const result = values.mutable_data();
            released([&](Workers &workers) {
                to_quantiles(result, int(values.shape(0)), std::size_t(values.shape(1)), wanted.data(),
                             std::size_t(wanted.shape(1)), workers);
            });
        },
        py::arg("values").noconvert(), "wanted"_a);
}

void register_extraction(py::module_ &module) {
    using namespace py::literals;

    module.def("pyramid_levels", &pyramid_levels, "rows"_a, "columns"_a);

    module.def(
        "extract",
        [](const Array &moments, const std::array<float, 3> &source, const std::array<float, 6> &errors,
           const ScaleDeviations &deviations, float outlier_freedom, float pixels, int rounds,
           int iterations) {
            const Shape n = shape_of(moments);
            require_fit(n[2] * sizeof(float) == sizeof(Moments) &&
                        int(deviations.size()) == pyramid_levels(n[0], n[1]));
            const auto *const cells = reinterpret_cast<const Moments *>(moments.data());
            const ExtractionProblem problem{cells,           n[0],  n[1], source, errors, deviations,
                                            outlier_freedom, pixels};
            Array fields = new_array({n[0], n[1], 4});
            Array deviation({py::ssize_t(n[0]), py::ssize_t(n[1])}),
                weight({py::ssize_t(n[0]), py::ssize_t(n[1])});
            float *const found = fields.mutable_data(), *const spread = deviation.mutable_data(),
                         *const certain = weight.mutable_data();
            {
                const py::gil_scoped_release unlocked;
                extract(problem, rounds, iterations, found, spread, certain);
            }
            return py::make_tuple(fields, deviation, weight);
        },
        "moments"_a, "source"_a, "errors"_a, "deviations"_a, "outlier_freedom"_a, "pixels"_a, "rounds"_a,
        "iterations"_a);
}

} // namespace

void register_pictures(py::module_ &module) {
    register_places(module);
    register_halves(module);
    register_codes(module);
    register_filters(module);
    register_turning(module);
    register_patches(module);
    register_extraction(module);
}

} // namespace smokelift
