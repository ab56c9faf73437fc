#include "blur.h"
#include "codes.h"
#include "extraction.h"
#include "halves.h"
#include "patches.h"
#include "pictures.h"
#include "python.h"
#include "turning.h"
#include "vectors.h"

#include <optional>

namespace smokelift {
namespace {

using Doubles = std::vector<double>;
using Integers = Read<1, int>;
using Codes = py::array_t<unsigned char, 0>;

PictureMap map_of(Read<2, double> to_pixel, const std::array<Doubles, 3> &centers,
                  const std::array<int, 2> &size) {
    require_fit(to_pixel.n == std::array<Index, 2>{3, 4});
    PictureMap map;
    for (int row = 0; row < 3; ++row)
        std::copy_n(to_pixel.data + 4 * row, 4, map.to_pixel[row].begin());
    map.centers = centers;
    map.columns = size[0];
    map.rows = size[1];
    for (const Doubles &along : centers)
        require_fit(!along.empty());
    return map;
}

CodedLines lines_of(const Codes &picture) {
    require_fit(picture.ndim() == 3 && picture.strides(2) == 1 && picture.strides(1) == picture.shape(2));
    return {picture.data(), picture.strides(0), int(picture.shape(0)),
            int(picture.shape(1) * picture.shape(2))};
}

LineWeights weights_of(Integers first, Integers lines, Read<> weights, int count) {
    const int *const begin = first.data;
    require_fit(first.size > 0 && begin[0] == 0 && std::is_sorted(begin, begin + first.size) &&
                std::size_t(begin[first.size - 1]) == lines.size && lines.size == weights.size);
    for (std::size_t n = 0; n < lines.size; ++n)
        require_fit(lines.data[n] >= 0 && lines.data[n] < count);
    return {begin, lines.data, weights.data, int(first.size) - 1};
}

void require_parts(Integers first, Index parts, Index whole) {
    const int *const begin = first.data;
    require_fit(first.n[0] == parts + 1 && begin[0] == 0 && begin[parts] == whole &&
                std::is_sorted(begin, begin + parts + 1));
}

// Ranges of the columns (i, j) of a volume.
const Span *spans_of(Read<3, int> spans, const Shape &n) {
    require_fit(spans.n == std::array<Index, 3>{n[0], n[1], 2});
    for (std::size_t at = 0; at < spans.size; ++at)
        require_fit(spans.data[at] >= 0 && spans.data[at] <= n[2]);
    return reinterpret_cast<const Span *>(spans.data);
}

void register_places(py::module_ &module) {
    module.def(
        "depth_profile",
        unlocked([](Workers &workers, Mask voxels, const std::array<Doubles, 3> &places,
                    const std::array<double, 3> &depth, const std::array<Read<>, 2> &at,
                    Read<2, double> middle, Read<2, double> width, double flatness) {
            const int halves = int(2 * flatness);
            require_fit(middle.size > 0 && width.n == middle.n && halves > 0 && halves == 2 * flatness);
            for (int axis = 0; axis < 3; ++axis)
                require_fit(int(places[axis].size()) == voxels.n[axis]);
            const DepthProfile profile{places,           depth, middle.data, width.data, int(middle.n[0]),
                                       int(middle.n[1]), halves};
            const MarkedVoxels marked(voxels, workers);
            require_fit(at[0].size == marked.count() && at[1].size == marked.count());
            Made<float, 1> shapes({Index(marked.count())}), widths(shapes.n);
            find_profile(profile, marked, at[0].data, at[1].data, shapes.data(), widths.data(), workers);
            return std::pair(std::move(shapes), std::move(widths));
        }),
        "voxels"_a, "places"_a, "depth"_a, "at"_a, "middle"_a, "width"_a, "flatness"_a,
        R"(exp(-(|depth - middle| / width)^flatness) and the width, both (n,) at the marked voxels.

        ``places`` are those of the voxels along x, y and z in meters from a center, ``depth`` a direction, ``flatness`` a
        multiple of a half; ``at`` rows and columns (n,) where the pictures ``middle`` and ``width`` are read.)");

    py::class_<PictureMap>(module, "PictureMap", R"(Where the voxels of a grid lie in a picture.

        ``to_pixel`` (3, 4) maps homogeneous points of the world to (x depth, y depth, depth) in pixels. ``centers`` are the
        voxel centers' world coordinates (m) along x, y and z, ``size`` the picture's columns and rows.)")
        .def(py::init(&map_of), "to_pixel"_a, "centers"_a, "size"_a)
        .def("places", unlocked([](Workers &workers, const PictureMap &map, Mask voxels) {
                 require_fit(voxels.n == map.shape());
                 const MarkedVoxels marked(voxels, workers);
                 Made<float, 1> rows({Index(marked.count())}), columns(rows.n);
                 Made<bool, 1> visible(rows.n);
                 find_places(map, marked, {rows.data(), columns.data(), visible.data()}, workers);
                 return std::tuple(std::move(rows), std::move(columns), std::move(visible));
             }),
             "voxels"_a,
             "Rows and columns (n,) of the marked voxels, pixel centers at integers; whether they are in the "
             "picture.")
        .def("shown", unlocked([](Workers &workers, const PictureMap &map, Read<2, bool> picture) {
                 require_fit(picture.n == std::array<Index, 2>{map.rows, map.columns});
                 const Shape n = map.shape();
                 Made<bool, 3> shown({n[0], n[1], n[2]});
                 mark_shown(map, reinterpret_cast<const unsigned char *>(picture.data), shown.data(),
                            workers);
                 return shown;
             }),
             "picture"_a, "Voxels in the picture whose nearest pixel is marked (rows, columns).");

    module.def("read_bilinearly",
               unlocked([](Workers &workers, Read<2, double> picture, Read<> rows, Read<> columns) {
                   require_fit(picture.size > 0 && rows.size == columns.size);
                   Made<float, 1> values({Index(rows.size)});
                   read_bilinearly(picture.data, int(picture.n[0]), int(picture.n[1]), rows.data,
                                   columns.data, rows.size, values.data(), workers);
                   return values;
               }),
               "picture"_a, "rows"_a, "columns"_a,
               "A picture (rows, columns) at places (n,) in pixels; the nearest pixel's value outside.");
}

Shape halved(const Shape &n) { return {(n[0] + 1) / 2, (n[1] + 1) / 2, (n[2] + 1) / 2}; }

// Neighbors along z have to be neighbors in memory.
template <class... T> void require_rows(Part<T>... boxes) { require_fit(((boxes.stride[2] == 1) && ...)); }

void register_halves(py::module_ &module) {
    module.def(
        "means_of_two",
        unlocked([](Workers &workers, Part<const float> values, std::optional<Part<const bool>> voxels) {
            require_rows(values);
            if (voxels) {
                require_rows(*voxels);
                require_fit(voxels->n == values.n);
            }
            Field means(halved(values.n));
            means_of_two(values, voxels, means, workers);
            return means;
        }),
        "values"_a, "voxels"_a = py::none(),
        "Means of two along every axis; beyond the grid there is nothing, nor in rows without marked "
        "voxels.");

    module.def(
        "prolong_values", unlocked([](Workers &workers, Part<const float> values, Mask voxels) {
            require_rows(values);
            require_fit(values.n == halved(voxels.n));
            const MarkedVoxels marked(voxels, workers);
            Made<float, 1> prolonged({Index(marked.count())});
            prolong_values(values, marked, prolonged.data(), workers);
            return prolonged;
        }),
        "values"_a, "voxels"_a,
        "Values of the coarse grid, linear between the voxels' middles, at the marked voxels (n,) of the "
        "fine one.");

    module.def(
        "scale_alike",
        unlocked([](Workers &workers, Part<const float> values, Part<const bool> voxels,
                    Part<const float> before, Part<const float> after, float least, Part<float> result) {
            require_rows(values, voxels, before, after, result);
            require_fit(voxels.n == values.n && result.n == values.n && before.n == halved(values.n) &&
                        after.n == before.n);
            scale_alike(values, voxels, before, after, least, result, workers);
        }),
        "values"_a, "voxels"_a, "before"_a, "after"_a, "least"_a, "result"_a,
        R"(Write values x (after / before) at the marked voxels into a result.

        ``before``, at least ``least``, and ``after`` are the coarse grid's, linear between its voxels' middles.)");
}

void register_codes(py::module_ &module) {
    module.def(
        "sum_lines",
        unlocked([](const Codes &picture, Read<> table, Integers first, Integers lines, Read<> weights) {
            const CodedLines coded = lines_of(picture);
            require_fit(table.size == 256);
            const LineWeights summed = weights_of(first, lines, weights, coded.lines);
            Made<float, 3> sums({summed.count, picture.shape(1), picture.shape(2)});
            sum_lines(coded, table.data, summed, sums.data());
            return sums;
        }),
        "picture"_a, "table"_a, "first"_a, "lines"_a, "weights"_a,
        R"(Weighted sums (n, columns, channels) of lines of a picture (rows, columns, channels) whose values a table tells.

        The ``n``-th is that of ``lines`` from ``first[n]`` to ``first[n + 1]``, as of a sparse matrix in rows, and the same
        to the last bit. ``table`` has 256 values. Pixels lie one after the other in each line.)");

    module.def("sum_columns", unlocked([](Read<3> values, Integers first, Integers columns, Read<> weights) {
                   const Extent extent{int(values.n[0]), int(values.n[1]), int(values.n[2])};
                   const LineWeights summed = weights_of(first, columns, weights, extent.columns);
                   Made<float, 3> sums({values.n[0], summed.count, values.n[2]});
                   sum_columns(values.data, extent, summed, sums.data());
                   return sums;
               }),
               "values"_a, "first"_a, "columns"_a, "weights"_a,
               "Weighted sums (rows, n, channels) of columns of values (rows, columns, channels), as of "
               "`sum_lines`.");

    module.def(
        "add_weighted",
        unlocked([](const Codes &picture, Read<> table, Read<3> weights, Integers lines, Integers columns,
                    Write<3> sums) {
            const CodedLines coded = lines_of(picture);
            require_fit(table.size == 256 && picture.shape(2) == 3 && weights.n[2] == 3 &&
                        std::equal(sums.n.begin(), sums.n.end(), picture.shape()));
            require_parts(lines, weights.n[0], coded.lines);
            require_parts(columns, weights.n[1], picture.shape(1));
            add_weighted(coded, table.data,
                         {weights.data, lines.data, columns.data, int(weights.n[0]), int(weights.n[1])},
                         sums.data);
        }),
        "picture"_a, "table"_a, "weights"_a, "lines"_a, "columns"_a, "sums"_a,
        R"(Add the values of a picture (rows, columns, 3), times weights (m, n, 3) of its parts, to sums of its shape.

        The ``n``-th part down has the lines from ``lines[n]`` to ``lines[n + 1]``; columns likewise. The rest is as of
        `sum_lines`.)");

    module.def("blur_picture", unlocked([](Read<3> picture, const Doubles &weights) {
                   require_fit(picture.size > 0 && !weights.empty());
                   const Extent extent{int(picture.n[0]), int(picture.n[1]), int(picture.n[2])};
                   Made<float, 3> blurred(picture.n);
                   blur_picture(picture.data, extent, weights, blurred.data());
                   return blurred;
               }),
               "picture"_a, "weights"_a,
               R"(A picture (rows, columns) or (rows, columns, channels), smoothed down and across.

        ``weights`` are those of a pixel itself and of its neighbors on either side, outwards. Beyond its edges the picture
        is its own mirror image.)");
}

void register_turning(py::module_ &module) {
    module.def("filled_spans", unlocked([](Workers &workers, In volume) {
                   Made<int, 3> spans({volume.n[0], volume.n[1], 2});
                   find_filled(volume, reinterpret_cast<Span *>(spans.data()), workers);
                   return spans;
               }),
               "volume"_a,
               "Of every column of voxels (i, j) the first that is not zero and the end of those that are "
               "not, (nx, ny, 2).");

    module.def("project_turned",
               unlocked([](Workers &workers, In volume, Read<3, int> spans, double first,
                           const std::array<double, 2> &steps, int columns) {
                   require_fit(columns > 0);
                   Made<float, 2> picture({columns, volume.n[2]});
                   project_turned(volume, spans_of(spans, volume.n), {first, steps[0], steps[1], columns},
                                  picture.data(), workers);
                   return picture;
               }),
               "volume"_a, "spans"_a, "first"_a, "steps"_a, "columns"_a,
               R"(The picture (columns, nz) of a volume that is turned about its last axis, a pixel a voxel.

        It is zero outside the spans; see `filled_spans`.

        The column of voxels (i, j) is centered on first + i steps[0] + j steps[1], in pixels. A pixel gets what it covers
        of the voxels' shadows, so that even smoke makes an even picture from every angle.)");

    module.def("scale_turned",
               unlocked([](Workers &workers, Out volume, Read<3, int> spans, double first,
                           const std::array<double, 2> &steps, Read<2> logarithm) {
                   require_fit(logarithm.n[0] > 0 && logarithm.n[1] == volume.n[2]);
                   scale_turned(volume, spans_of(spans, volume.n),
                                {first, steps[0], steps[1], int(logarithm.n[0])}, logarithm.data, workers);
               }),
               "volume"_a, "spans"_a, "first"_a, "steps"_a, "logarithm"_a,
               "Multiply a volume in its spans by exponentials of a picture (columns, nz), read as "
               "`project_turned` weighs it.");
}

// The patches about some places, which have to lie in a picture (rows, columns).
Patches patches_at(Read<2, int> at, int size, Index rows, Index columns) {
    require_fit(at.n[0] == 2 && size > 0 && size % 2 == 1);
    const Patches patches{at.data, at.data + at.n[1], std::size_t(at.n[1]), size};
    const int reach = size / 2;
    for (std::size_t n = 0; n < patches.count; ++n)
        require_fit(patches.rows[n] >= reach && patches.rows[n] + reach < rows &&
                    patches.columns[n] >= reach && patches.columns[n] + reach < columns);
    return patches;
}

void register_patches(py::module_ &module) {
    module.def("unfold", unlocked([](Workers &workers, Read<2> picture, Read<2, int> at, int size) {
                   const Patches patches = patches_at(at, size, picture.n[0], picture.n[1]);
                   Made<float, 2> pixels({Index(size) * size, at.n[1]});
                   unfold(picture.data, int(picture.n[1]), patches, pixels.data(), workers);
                   return pixels;
               }),
               "picture"_a, "at"_a, "size"_a,
               "Pixels (size * size, n) of the square patches about places (2, n), all of which lie in the "
               "picture.");

    module.def("fold",
               unlocked([](Read<2> pixels, Read<2, int> at, int size, const std::array<int, 2> &shape) {
                   const Patches patches = patches_at(at, size, shape[0], shape[1]);
                   require_fit(pixels.n == std::array<Index, 2>{Index(size) * size, at.n[1]});
                   Made<float, 2> picture({shape[0], shape[1]});
                   fold(pixels.data, patches, shape[0], shape[1], picture.data());
                   return picture;
               }),
               "pixels"_a, "at"_a, "size"_a, "shape"_a,
               "For each pixel of a picture the mean of what the patches that cover it hold there; 0 where "
               "none does.");

    module.def(
        "to_quantiles", unlocked([](Workers &workers, Write<2> values, Read<2> wanted) {
            require_fit(values.n[0] == wanted.n[0] && wanted.n[1] > 0);
            to_quantiles(values.data, int(values.n[0]), std::size_t(values.n[1]), wanted.data,
                         std::size_t(wanted.n[1]), workers);
        }),
        "values"_a, "wanted"_a,
        R"(Replace values (lines, n) by their distance to the quantiles of the same rank of a line of ``wanted`` (lines, m).

        These are sorted. The distances are the one-dimensional optimal transport from one distribution to the other.)");
}

void register_extraction(py::module_ &module) {
    module.def(
        "pyramid_levels", &pyramid_levels, "rows"_a, "columns"_a,
        "Levels of a pyramid over so many cells; the coarsest has two cells at most along its longer side.");

    module.def(
        "extract",
        unlocked([](Read<3> moments, const std::array<float, 3> &source, const std::array<float, 6> &errors,
                    const ScaleDeviations &deviations, float outlier_freedom, float pixels, int rounds,
                    int iterations) {
            const int rows = int(moments.n[0]), columns = int(moments.n[1]);
            require_fit(moments.size > 0 && moments.n[2] * sizeof(float) == sizeof(Moments) &&
                        int(deviations.size()) == pyramid_levels(rows, columns));
            const auto *const cells = reinterpret_cast<const Moments *>(moments.data);
            const ExtractionProblem problem{cells,  rows,       columns,         source,
                                            errors, deviations, outlier_freedom, pixels};
            Made<float, 3> fields({rows, columns, 4});
            Made<float, 2> deviation({rows, columns}), weight(deviation.n);
            extract(problem, rounds, iterations, fields.data(), deviation.data(), weight.data());
            return std::tuple(std::move(fields), std::move(deviation), std::move(weight));
        }),
        "moments"_a, "source"_a, "errors"_a, "deviations"_a, "outlier_freedom"_a, "pixels"_a, "rounds"_a,
        "iterations"_a,
        R"(Opacity and the fields of J (rows, columns, 4) of smoke before a plate, the deviation of T, the data's weight.

        ``moments`` (rows, columns, 25) are means over each cell's pixels: B, the upper triangle of B B', D and D B', with D
        = I - B; then the variance of a pixel's noise in each channel and the probability that the plate is wrong. Then it
        has a covariance of ``errors``, the upper triangle. ``source`` (3,) is J where its fields are 0, ``deviations`` the
        prior's standard deviations by level, the finest first. ``outlier_freedom`` are the degrees of freedom of the noise,
        0 for normal noise; ``pixels`` are in a cell.)");
}

} // namespace

void register_pictures(py::module_ &module) {
    register_places(module);
    register_halves(module);
    register_codes(module);
    register_turning(module);
    register_patches(module);
    register_extraction(module);
}

} // namespace smokelift
