// Arrays of floats over a box, [x, y, z] with z fastest, and vectors on the faces of its cells (MAC grid).
#pragma once

#include "compiler.h"
#include "memory.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>

namespace smokelift {

using Shape = std::array<int, 3>;

// A place among indices, rounded towards zero: what is too low or NaN ends at `low`, what is too high at
// `high`.
SMOKELIFT_INLINE int index_within(double place, int low, int high) {
    return static_cast<int>(std::min(std::max(double(low), place), double(high)));
}

inline std::size_t volume(const Shape &n) { return std::size_t(n[0]) * n[1] * n[2]; }

// A view: does not own its data.
template <class T> struct Grid {
    T *data = nullptr;
    Shape n{};

    T *row(int i, int j) const { return data + (std::size_t(i) * n[1] + j) * n[2]; }
    std::size_t slab_size() const { return std::size_t(n[1]) * n[2]; }
    operator Grid<const T>() const { return {data, n}; }
};

using In = Grid<const float>;
using Out = Grid<float>;
using Mask = Grid<const unsigned char>; // 0 or 1, as NumPy's booleans

// A range of a row: first and end. Empty where first is not before end.
using Span = std::array<int, 2>;

// The shortest range that holds both.
SMOKELIFT_INLINE Span joined(const Span &a, const Span &b) {
    if (a[0] >= a[1])
        return b;
    if (b[0] >= b[1])
        return a;
    return {std::min(a[0], b[0]), std::max(a[1], b[1])};
}

// Where in a row of voxels the first is marked; its end if none is.
inline int first_marked(const unsigned char *row, int n) {
    const void *found = std::memchr(row, 1, std::size_t(n));
    return found ? int(static_cast<const unsigned char *>(found) - row) : n;
}

// The element of a line of n whose mirror image is at i.
inline int mirrored(int i, int n) {
    i = (i % (2 * n) + 2 * n) % (2 * n);
    return i < n ? i : 2 * n - 1 - i;
}

// The elements with the first index i.
template <class T> Grid<T> slab(const Grid<T> &a, int i) { return {a.row(i, 0), {1, a.n[1], a.n[2]}}; }

// The three components of a vector field.
using In3 = std::array<In, 3>;
using Out3 = std::array<Out, 3>;

inline In3 read(const Out3 &a) { return {In(a[0]), In(a[1]), In(a[2])}; }

// Unit cells, and which sides of their box are walls, in the order x-, x+, y-, y+, z-, z+. The other sides
// are open.
struct Box {
    using Closed = std::array<bool, 6>;

    Shape cells{};
    Closed closed{};

    // Shapes of the components of a vector on x, y and z faces.
    std::array<Shape, 3> faces() const {
        const auto [x, y, z] = cells;
        return {Shape{x + 1, y, z}, Shape{x, y + 1, z}, Shape{x, y, z + 1}};
    }
    // Shapes of the components of a vector on edges along x, y and z (curl of one on faces).
    std::array<Shape, 3> edges() const {
        const auto [x, y, z] = cells;
        return {Shape{x, y + 1, z + 1}, Shape{x + 1, y, z + 1}, Shape{x + 1, y + 1, z}};
    }
    bool sealed() const {
        for (bool side : closed)
            if (!side)
                return false;
        return true;
    }
};

// A view of a vector field on the faces of a box: each component on the faces across it.
template <class T> struct Staggered {
    std::array<Grid<T>, 3> faces;
    Box box;

    const Grid<T> &operator[](int c) const { return faces[c]; }
    operator const std::array<Grid<T>, 3> &() const { return faces; }
};

using StaggeredIn = Staggered<const float>;
using StaggeredOut = Staggered<float>;

inline StaggeredIn read(const StaggeredOut &u) { return {read(u.faces), u.box}; }

// Owns one array; what it holds at first is not defined.
class Field {
public:
    Field() = default;
    explicit Field(const Shape &n) : data_(volume(n)), n_(n) {}
    operator Out() { return {data_.data(), n_}; }
    operator In() const { return {data_.data(), n_}; }
    Out out() { return *this; }
    In in() const { return *this; }
    Values &data() { return data_; }

private:
    Values data_;
    Shape n_{};
};

// Owns a vector field on faces, each component with memory of its own; not defined at first either.
struct StaggeredField {
    Box box;
    std::array<Field, 3> components;

    StaggeredField() = default;
    explicit StaggeredField(const Box &of)
        : box(of), components{Field(of.faces()[0]), Field(of.faces()[1]), Field(of.faces()[2])} {}
    StaggeredOut out() { return {{components[0].out(), components[1].out(), components[2].out()}, box}; }
    StaggeredIn in() const { return {{components[0].in(), components[1].in(), components[2].in()}, box}; }
};

} // namespace smokelift
