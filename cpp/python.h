// NumPy arrays in and out, and work without Python's lock: for the register_*.cpp files only.
#pragma once

#include "grid.h"
#include "halves.h"
#include "threads.h"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

namespace smokelift {

namespace py = pybind11;
using namespace py::literals;

using Index = py::ssize_t;
using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;

inline void require_fit(bool fits) {
    if (!fits)
        throw std::invalid_argument("the arrays do not have shapes that belong together.");
}

// A caller's array of so many axes (0: of any), C-contiguous. What is only read is converted if it is not of
// this kind; what is written is refused.
template <class T, int Axes = 0> struct Array {
    T *data = nullptr;
    std::array<Index, Axes> n{};
    std::size_t size = 0;
};

template <int Axes = 0, class T = float> using Read = Array<const T, Axes>;
template <int Axes = 0, class T = float> using Write = Array<T, Axes>;

// A new array for the caller, not defined at first.
template <class T, int Axes> struct Made {
    using Stored = std::conditional_t<std::is_same_v<T, bool>, unsigned char, T>; // a vector packs bool

    std::array<Index, Axes> n;
    std::vector<Stored, LazyPages<Stored>> values;

    explicit Made(const std::array<Index, Axes> &shape)
        : n(shape), values(std::accumulate(n.begin(), n.end(), std::size_t(1), std::multiplies<>())) {}
    T *data() { return reinterpret_cast<T *>(values.data()); }
};

inline In view(const Floats &a) {
    if (a.ndim() != 3 || a.size() == 0)
        throw std::invalid_argument("expected a three-dimensional array that is not empty.");
    return {a.data(), {int(a.shape(0)), int(a.shape(1)), int(a.shape(2))}};
}

inline In view(const Floats &a, const Shape &expected) {
    const In values = view(a);
    require_fit(values.n == expected);
    return values;
}

// Face values of a box whose sides are open.
inline StaggeredIn on_faces(const In3 &components) {
    const auto [nx, ny, nz] = components[0].n;
    const Box box{{nx - 1, ny, nz}, {}};
    for (int c = 0; c < 3; ++c)
        require_fit(components[c].n == box.faces()[c]);
    return {components, box};
}

// The same values in a box that they have to fit.
inline StaggeredIn in_box(const StaggeredIn &faces, const Box &box) {
    require_fit(faces.box.cells == box.cells);
    return {faces.faces, box};
}

// An array that owns what its data lies in.
template <class T, class Owned> py::array array_of(T *data, const std::vector<Index> &shape, Owned &&values) {
    auto owned = std::make_unique<std::decay_t<Owned>>(std::move(values));
    const py::capsule owner(owned.get(), [](void *p) { delete static_cast<std::decay_t<Owned> *>(p); });
    owned.release();
    return py::array_t<T>(shape, data, owner);
}

// A function for Python that runs without its lock, and with workers if they are what it takes first. Views
// of arrays are made before, arrays from what it returns afterwards.
template <class F, class Result, class... Taken>
auto unlocked(F work, Result (F::*)(Workers &, Taken...) const) {
    return [work](Taken... taken) -> Result {
        const py::gil_scoped_release release;
        const BorrowedWorkers workers;
        return work(*workers, std::forward<Taken>(taken)...);
    };
}
template <class F, class Result, class... Taken> auto unlocked(F work, Result (F::*)(Taken...) const) {
    return [work](Taken... taken) -> Result {
        const py::gil_scoped_release release;
        return work(std::forward<Taken>(taken)...);
    };
}
template <class F> auto unlocked(F work) { return unlocked(std::move(work), &F::operator()); }

void register_transport(py::module_ &module);
void register_velocity(py::module_ &module);
void register_render(py::module_ &module);
void register_pictures(py::module_ &module);
void register_density(py::module_ &module);

} // namespace smokelift

// The names are those of _core.pyi.
namespace pybind11::detail {

// What is read may have other real numbers, as it is converted.
template <class T> constexpr auto array_name = const_name("Array");
template <> constexpr auto array_name<const float> = const_name("Reals");
template <> constexpr auto array_name<const double> = const_name("Reals");
template <> constexpr auto array_name<const int> = const_name("Integers");
template <> constexpr auto array_name<int> = const_name("Integers");
template <> constexpr auto array_name<const bool> = const_name("Mask");
template <> constexpr auto array_name<bool> = const_name("Mask");

template <class T, int Axes> struct type_caster<smokelift::Array<T, Axes>> {
    using Value = std::remove_const_t<T>;
    using Type = smokelift::Array<T, Axes>;
    PYBIND11_TYPE_CASTER(Type, array_name<T>);

    bool load(handle from, bool) {
        if constexpr (std::is_const_v<T>)
            return load(array_t<Value, array::c_style | array::forcecast>::ensure(from));
        else
            return array_t<Value, array::c_style>::check_(from) && load(reinterpret_borrow<array>(from));
    }

private:
    bool load(array given) {
        if (!given)
            return false;
        loader_life_support::add_patient(given); // what was converted is kept as long as the call takes
        smokelift::require_fit(Axes == 0 || given.ndim() == Axes);
        std::copy_n(given.shape(), Axes, value.n.begin());
        value.size = std::size_t(given.size());
        if constexpr (std::is_const_v<T>)
            value.data = static_cast<T *>(given.data());
        else
            value.data = static_cast<T *>(given.mutable_data());
        return true;
    }
};

// A box of an array of the caller's, of this kind: it is never converted.
template <class T> struct type_caster<smokelift::Part<T>> {
    using Value = std::remove_const_t<T>;
    PYBIND11_TYPE_CASTER(smokelift::Part<T>, array_name<Value>);

    bool load(handle from, bool) {
        if (!array_t<Value, 0>::check_(from))
            return false;
        auto given = reinterpret_borrow<array>(from);
        smokelift::require_fit(given.ndim() == 3 && given.size() > 0);
        for (int axis = 0; axis < 3; ++axis) {
            value.n[axis] = int(given.shape(axis));
            value.stride[axis] = given.strides(axis) / ssize_t(sizeof(T));
        }
        value.data =
            static_cast<T *>(std::is_const_v<T> ? const_cast<void *>(given.data()) : given.mutable_data());
        return true;
    }
};

// A volume, or marked voxels.
template <class T> struct type_caster<smokelift::Grid<T>> {
    using Stored = std::conditional_t<std::is_same_v<T, const unsigned char>, const bool, T>;
    PYBIND11_TYPE_CASTER(smokelift::Grid<T>, array_name<Stored>);

    bool load(handle from, bool convert) {
        make_caster<smokelift::Array<Stored, 3>> given;
        if (!given.load(from, convert))
            return false;
        const auto &[data, n, size] = cast_op<smokelift::Array<Stored, 3> &>(given);
        smokelift::require_fit(size > 0);
        value = {reinterpret_cast<T *>(data), {int(n[0]), int(n[1]), int(n[2])}};
        return true;
    }
};

template <> struct type_caster<smokelift::StaggeredIn> {
    PYBIND11_TYPE_CASTER(smokelift::StaggeredIn, const_name("Faces"));

    bool load(handle from, bool convert) {
        make_caster<smokelift::In3> components;
        if (!components.load(from, convert))
            return false;
        value = smokelift::on_faces(cast_op<smokelift::In3 &>(components));
        return true;
    }
};

template <class T, int Axes> struct type_caster<smokelift::Made<T, Axes>> {
    static constexpr auto name = array_name<T>;

    static handle cast(smokelift::Made<T, Axes> &&made, return_value_policy, handle) {
        T *const data = made.data();
        return smokelift::array_of(data, {made.n.begin(), made.n.end()}, std::move(made.values)).release();
    }
};

template <> struct type_caster<smokelift::Field> {
    static constexpr auto name = const_name("Array");

    static handle cast(smokelift::Field &&field, return_value_policy, handle) {
        const smokelift::Out all = field;
        return smokelift::array_of(all.data, {all.n[0], all.n[1], all.n[2]}, std::move(field.data()))
            .release();
    }
};

template <> struct type_caster<smokelift::StaggeredField> {
    static constexpr auto name = const_name("list[Array]");

    static handle cast(smokelift::StaggeredField &&faces, return_value_policy policy, handle parent) {
        return make_caster<std::array<smokelift::Field, 3>>::cast(std::move(faces.components), policy,
                                                                  parent);
    }
};

} // namespace pybind11::detail
