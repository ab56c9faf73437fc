// NumPy arrays in and out, and work without Python's lock: for the register_*.cpp files only.
#pragma once

#include "grid.h"
#include "threads.h"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <type_traits>
#include <vector>

namespace smokelift {

namespace py = pybind11;

using Array = py::array_t<float, py::array::c_style | py::array::forcecast>;
using Array3 = std::array<Array, 3>;

inline void require_fit(bool fits) {
    if (!fits)
        throw std::invalid_argument("the arrays do not have shapes that belong together.");
}

inline Shape shape_of(const Array &a) {
    if (a.ndim() != 3 || a.size() == 0)
        throw std::invalid_argument("expected a three-dimensional array that is not empty.");
    return {int(a.shape(0)), int(a.shape(1)), int(a.shape(2))};
}

inline In view(const Array &a) { return {a.data(), shape_of(a)}; }

inline In view(const Array &a, const Shape &expected) {
    require_fit(shape_of(a) == expected);
    return view(a);
}

// Three components at cell centres.
inline In3 view(const Array3 &a, const Shape &cells) {
    return {view(a[0], cells), view(a[1], cells), view(a[2], cells)};
}

inline StaggeredIn view(const Array3 &faces, const Box &box) {
    const auto n = box.faces();
    return {{view(faces[0], n[0]), view(faces[1], n[1]), view(faces[2], n[2])}, box};
}

// The box that arrays of face values belong to.
inline StaggeredIn view(const Array3 &faces, const Box::Closed &closed = {}) {
    const Shape x = shape_of(faces[0]);
    return view(faces, Box{{x[0] - 1, x[1], x[2]}, closed});
}

// An array that owns `values`; its memory goes back to the system with it, however small the others around
// it.
inline Array array_of(Values &&values, const std::vector<py::ssize_t> &shape) {
    auto owned = std::make_unique<Values>(std::move(values));
    const py::capsule owner(owned.get(), [](void *p) { delete static_cast<Values *>(p); });
    const float *data = owned.release()->data();
    return Array(shape, data, owner);
}

// Not defined at first.
inline Array new_array(const Shape &n) { return array_of(Values(volume(n)), {n[0], n[1], n[2]}); }

inline Array3 new_arrays(const std::array<Shape, 3> &n) {
    return {new_array(n[0]), new_array(n[1]), new_array(n[2])};
}

inline Out out(Array &a) { return {a.mutable_data(), shape_of(a)}; }
inline Out3 out(Array3 &a) { return {out(a[0]), out(a[1]), out(a[2])}; }

// Arrays are made while the lock is held; only the work itself runs without it.
template <class Work> auto released(const Work &work) {
    py::gil_scoped_release release;
    const BorrowedWorkers workers;
    return work(*workers);
}

// A new array that work(values, workers) fills.
template <class Work> Array filled(const Shape &n, const Work &work) {
    Array result = new_array(n);
    const Out values = out(result);
    released([&](Workers &workers) { work(values, workers); });
    return result;
}

// A new array of any kind and shape that work(values, workers), or work(values) on one thread, fills.
template <class T = float, class Work>
py::array_t<T> made(const std::vector<py::ssize_t> &shape, const Work &work) {
    py::array_t<T> result(shape);
    T *const values = result.mutable_data();
    if constexpr (std::is_invocable_v<Work, T *, Workers &>) {
        released([&](Workers &workers) { work(values, workers); });
    } else {
        const py::gil_scoped_release unlocked;
        work(values);
    }
    return result;
}

// New arrays of face values, the same way.
template <class Work> Array3 filled(const Box &box, const Work &work) {
    Array3 result = new_arrays(box.faces());
    const StaggeredOut values{out(result), box};
    released([&](Workers &workers) { work(values, workers); });
    return result;
}

void register_transport(py::module_ &module);
void register_velocity(py::module_ &module);
void register_render(py::module_ &module);
void register_pictures(py::module_ &module);
void register_density(py::module_ &module);

} // namespace smokelift
